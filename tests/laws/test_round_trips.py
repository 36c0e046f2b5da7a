"""What is written in a format and read again is the same: models with odd names and all kinds of objectives, and policies."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from random_models import LEVELS, MISSIONS, OBJECTIVES, SIGNED, random_policy, random_rich_problem

import ratherthan as rt
from ratherthan.io.examples import example_names
from ratherthan.io.policies import read_policy
from ratherthan.io.policy_write import write_policy
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.objective import Discounted, Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.world import World

WISHES = {**OBJECTIVES, **SIGNED, **MISSIONS, **LEVELS}
ODD = [
    "",
    "init",
    "deadlock",
    "__NOLABEL__",
    "line\nend",
    "\u2028",
    "back\\slash",
    "plain",
    "two words",
    'say "yes"',
    "ünï→",
    "[1]",
    "//",
    "a,b",
    "{x}",
    "init2",
    "tab\there",
    " ",
    "é" * 50,
    "5",
    "true",
]
SEEDS = range(int(os.environ.get("RATHERTHAN_MODELS", "120")) // 4)


def odd_names(random: Random, names: list[str]) -> dict[str, str]:
    return dict(zip(names, random.sample(ODD, len(names)), strict=True))


def odd_problem(random: Random) -> Problem:
    """A random problem with odd names, choices without names, several initial states and all that a Problem can hold."""
    problem = random_rich_problem(random, objective=random.choice(list(WISHES.values())))
    mdp = problem.mdp
    rewards = odd_names(random, list(mdp.rewards))
    actions = dict(zip(mdp.actions, random.sample(ODD[1:], len(mdp.actions)), strict=True))  # an empty name is none
    labels = {name: mdp.labels[old] for name, old in zip(random.sample(ODD, 2), mdp.labels, strict=True)}
    unnamed = np.array([random.random() < 0.2 for _ in range(mdp.choices)])
    initial = random.sample(range(mdp.states), random.randint(1, min(3, mdp.states)))
    variables = {
        "x": np.array(random.choices(range(-5, 300), k=mdp.states)),
        "ok": np.array(random.choices([False, True], k=mdp.states)),
        "far": np.array(random.choices([0.5, -1.25, 1e-9], k=mdp.states)),
    }
    texts = [*(f"{random.choice(ODD)} {s}" for s in range(mdp.states))]
    named = random.choice([{"strings": texts}, {"variables": variables}, {}])
    mdp = replace(
        mdp,
        actions=tuple(actions.values()),
        choice_to_action=np.where(unnamed, -1, mdp.choice_to_action).astype(mdp.choice_to_action.dtype),
        labels=labels,
        rewards={rewards[name]: reward for name, reward in mdp.rewards.items()} | {"nothing": Reward()},
        initial=np.array(sorted(initial)),
        names=StateNames(count=mdp.states, **named),
    )
    return replace(
        problem,
        mdp=mdp,
        world=random.choice([None, world(random, mdp.states)]),
        properties={name: random.choice(list(WISHES.values())) for name in random.sample(ODD, 3)}
        | {"at least": Threshold(objective=Discounted(reward="5", discount=0.3), relation=">", bound=-2.5)},
        others={'the "average"': 'LRAmax=? ["goal"]'},
        definitions={"N": "3", "there": '"goal" & x > N'},
        lexicon=Lexicon(
            actions={"go": "gehe"},
            state="{name}",
            states={"0": "«Null»"},
            objectives={"5": {"best": "→ 5"}},
            language="en",
        ),
        notes=("One note.", "«Two»"),
    )


def world(random: Random, states: int) -> World:
    cells = 3 * states
    return World(
        width=3,
        height=states,
        kinds=("road", "Häuser"),
        kind_of_cell=np.array(random.choices([0, 1], k=cells), dtype=np.uint8),
        cell_of_state=np.array(random.sample(range(-1, cells), states), dtype=np.int32),
        zones={"old town": np.array(random.choices([False, True], k=cells))},
        note="a note",
        title='a "title"',
    )


def spread(value: Any) -> Any:
    """Return a value as something that == compares: arrays with what they hold, nouns with their fields."""
    if isinstance(value, StateNames):
        variables = {name: np.asarray(column).tolist() for name, column in value.variables.items()}
        return value.count, None if value.strings is None else list(value.strings), variables
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return [(name, spread(item)) for name, item in value.items()]
    if isinstance(value, MDP | World | Reward):
        found = {field.name: spread(getattr(value, field.name)) for field in fields(value)}
        return found | {"labels": sorted(found["labels"])} if "labels" in found else found
    return value


def differing(one: Problem, other: Problem, *, but: tuple[str, ...] = ()) -> list[str]:
    """Return the fields in which two problems differ."""
    names = [field.name for field in fields(Problem) if field.name not in ("source", *but)]
    return [name for name in names if spread(getattr(one, name)) != spread(getattr(other, name))]


@pytest.mark.parametrize("suffix", [".npz", ".umb"])
def test_an_archive_holds_a_whole_problem(tmp_path: Path, suffix: str) -> None:
    for seed in SEEDS:
        problem = odd_problem(Random(seed))
        path = tmp_path / f"model{suffix}"
        rt.write(problem, path)
        assert differing(rt.read(path), problem) == [], seed


def test_a_drn_file_holds_the_model_with_what_a_choice_may_expect_of_its_branches(tmp_path: Path) -> None:
    for seed in SEEDS:
        problem = odd_problem(Random(seed))
        path = tmp_path / "model.drn"
        rt.write(problem, path)
        mdp, again = problem.mdp, rt.read(path).mdp
        for name in (
            "state_to_choices", "choice_to_branches", "branch_to_target", "branch_to_probability", "initial",
        ):  # fmt: skip
            assert np.array_equal(getattr(again, name), getattr(mdp, name)), (seed, name)
        own = [[m.actions[a] if a >= 0 else "" for a in m.choice_to_action.tolist()] for m in (mdp, again)]
        assert own[0] == own[1], seed
        assert spread(again.labels) == spread(mdp.labels), seed
        assert list(again.rewards) == list(mdp.rewards), seed
        for name, reward in mdp.rewards.items():
            assert gained(again, again.rewards[name]) == pytest.approx(gained(mdp, reward), rel=1e-14, abs=1e-300), seed
        if mdp.names.strings is None:
            assert spread(again.names) == spread(mdp.names), seed


def gained(mdp: MDP, reward: Reward) -> list[float]:
    """Return what each choice may expect, states and branches counted."""
    total = np.zeros(mdp.choices)
    for part, values in reward.parts():
        if part == "state":
            total += np.repeat(values, np.diff(mdp.state_to_choices))
        elif part == "choice":
            total += values
        else:
            total += np.add.reduceat(values * mdp.branch_to_probability, mdp.choice_to_branches[:-1])
    found: list[float] = total.tolist()
    return found


@pytest.mark.parametrize("suffix", [".npz", ".umb", ".drn"])
@pytest.mark.parametrize("name", example_names())
def test_the_bundled_examples_come_back_from_every_format(tmp_path: Path, name: str, suffix: str) -> None:
    problem = rt.read(f"example:{name}")
    rt.write(problem, tmp_path / f"model{suffix}")
    again = rt.read(tmp_path / f"model{suffix}")
    if suffix != ".drn":
        assert differing(again, problem) == []
        return
    without = replace(problem.mdp, names=again.mdp.names)
    assert spread(replace(without, rewards={})) == spread(replace(again.mdp, rewards={}))
    assert list(again.mdp.rewards) == list(problem.mdp.rewards)


def test_a_road_map_is_written_back_as_it_means(tmp_path: Path) -> None:
    written = 0
    for name in example_names():
        problem = rt.read(f"example:{name}")
        if problem.world is None:
            continue
        rt.write(problem, tmp_path / "map.roadmap")
        assert differing(rt.read(tmp_path / "map.roadmap"), problem, but=("notes",)) == [], name
        written += 1
    assert written


@pytest.mark.parametrize("randomised", [False, True])
def test_a_policy_comes_back_from_its_file(tmp_path: Path, randomised: bool) -> None:
    for seed in SEEDS:
        random = Random(seed)
        mdp = odd_problem(random).mdp
        policy = random_policy(random, mdp, randomised=randomised)
        path = tmp_path / "policy.json"
        write_policy(policy, mdp, path)
        again = read_policy(path, mdp)
        assert np.array_equal(again.weights(mdp), policy.weights(mdp)), seed
