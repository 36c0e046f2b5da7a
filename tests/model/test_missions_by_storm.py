"""Missions against Storm, which reads the same text with its own parser and follows it with its own automata."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest
from lasso import random_path
from missions import LABELS, chances, random_model

from ratherthan.errors import PropertyError
from ratherthan.io.umb_write import write_umb
from ratherthan.model.mdp import MDP
from ratherthan.model.objective import Mission
from ratherthan.model.problem import Problem
from ratherthan.model.product import unfolded
from ratherthan.model.property import parse_property
from ratherthan.model.syntax import text_of

stormpy = pytest.importorskip("stormpy")
TRIES = int(os.environ.get("RATHERTHAN_MODELS", "100"))
TEXTS = [
    'F ("goal" & (F "spot"))',
    'F "goal" & F "spot"',
    '(F "goal") & F "spot"',
    '(!"hazard" U "goal") & (F "spot")',
    '!"hazard" U "goal" & F "spot"',
    'F "goal" | X "spot"',
    'X X "goal"',
    'F<=4 "goal"',
    'F<4 "goal"',
    'F=3 "goal"',
    'F[1,4] "goal"',
    '!"hazard" U<=4 "goal"',
    '!"hazard" U[2,4] "goal"',
    'F "goal" U "spot"',
    'F X "goal"',
    '"hazard" & X "goal" | "spot"',
    '!X "goal"',
    '!"goal" & !X "goal" | "spot"',
]


def by_storm(problem: Problem, text: str, folder: Path) -> list[float]:
    fields = {name: getattr(problem.mdp, name) for name in problem.mdp.__dataclass_fields__}
    bare = MDP(**(fields | {"rewards": {}}))  # it takes no two rewards between the same two states
    write_umb(replace(problem, mdp=bare), folder / "model.umb")
    model = stormpy.build_model_from_umb(str(folder / "model.umb"))
    wanted = stormpy.parse_property(text)
    found = stormpy.model_checking(model, wanted, environment=stormpy.environments.sound())
    return [float(found.get_value(state)) for state in range(problem.mdp.states)]


def by_product(problem: Problem, text: str) -> np.ndarray:
    objective = parse_property(text, problem)
    mission = objective if isinstance(objective, Mission) else Mission(formula=objective.text[7:-1])
    values = chances(unfolded(problem, mission), maximise=objective.maximise, sweeps=3000)
    return values[: problem.mdp.states]


@pytest.mark.parametrize("way", ["max", "min"])
@pytest.mark.parametrize("text", TEXTS)
def test_a_text_means_what_it_means_to_storm(text: str, way: str, tmp_path: Path) -> None:
    for seed in range(5):
        problem = random_model(Random(seed))
        asked = f"P{way}=? [{text}]"
        assert by_product(problem, asked) == pytest.approx(by_storm(problem, asked, tmp_path), abs=1e-6)


@pytest.mark.parametrize("seed", range(TRIES))
def test_the_canonical_text_of_a_mission_means_the_same_to_storm(seed: int, tmp_path: Path) -> None:
    random = Random(seed)
    problem = random_model(random)
    for _ in range(500):
        term = random_path(random, LABELS, depth=2)
        text = text_of(term)
        way = random.choice(["max", "min"])
        if {"W", "R"} & set(text) or "=>" in text or "?" in text or "G<" in text or "G[" in text or ">" in text:
            continue  # Storm has no such operators, and no bounds without an end
        try:
            objective = parse_property(f"P{way}=? [{text}]", problem)
        except PropertyError:
            continue
        if isinstance(objective, Mission):
            break
    else:
        pytest.fail("no mission was drawn")
    assert by_product(problem, objective.text) == pytest.approx(by_storm(problem, objective.text, tmp_path), abs=1e-6)
