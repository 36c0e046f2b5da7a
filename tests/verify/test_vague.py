"""A number that is known less well in an explanation than it could be is left undecided; one that is wrong is contradicted."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mutations import Mutant, retold
from random_models import Table, problem_of

from ratherthan.explain import explain, question
from ratherthan.explain.record import to_document
from ratherthan.model.mdp import Reward
from ratherthan.model.objective import ExpectedCost, Objective, ReachAvoid
from ratherthan.model.problem import Problem
from ratherthan.narrate import narrate
from ratherthan.solve import solve
from ratherthan.verify import Verdicts, verify

Document = dict[str, Any]
KEYS = ("value", "lower", "upper")

FORK: Table = {
    0: {"short": ([(0.5, 1), (0.5, 3)], 1.0), "long": ([(1.0, 2)], 3.0)},
    1: {"on": ([(0.5, 3), (0.5, 1)], 1.0), "wait": ([(1.0, 1)], 1.0)},
    2: {"on": ([(1.0, 3)], 1.0), "back": ([(1.0, 0)], 1.0)},
    3: {"stay": ([(1.0, 3)], 0.0)},
}
TOLL = np.array([1.0, 0.0, 2.0, 1.0, 0.0, 4.0, 0.0])


def fork() -> Problem:
    objective = ExpectedCost(goal='"goal"', reward="cost")
    return problem_of(FORK, objective, goals=[3], hazards=[2], rewards={"toll": Reward(choice=TOLL)})


def told(problem: Problem, also: tuple[str, ...] = (), **asked: Any) -> Document:
    explanation = explain(solve(problem), also=also, asked=question(**asked))
    return json.loads(json.dumps(to_document(explanation, narrate(explanation))))


def numbers(part: Any) -> list[dict[str, float]]:
    """Return every finite number with its bounds that a document holds, but those of what follows: a claim needs them equal."""
    if isinstance(part, list):
        return [number for inner in part for number in numbers(inner)]
    if not isinstance(part, dict):
        return []
    own = [part] if {"value", "lower", "upper"} <= set(part) and isinstance(part["value"], float) else []
    return own + [number for key, inner in part.items() if key != "follows" for number in numbers(inner)]


def checked(document: Document, problem: Problem, change: Callable[[dict[str, float]], object]) -> Verdicts:
    """Return what becomes of a document in which every number was changed, told anew under a new seal."""
    made = copy.deepcopy(document)
    for number in numbers(made):
        change(number)
    forged = retold(Mutant((), "", made))
    assert forged is not None
    return verify(forged.document, problem)


def wider(share: float) -> Callable[[dict[str, float]], object]:
    return lambda number: number.update(
        lower=number["lower"] - share * abs(number["lower"]), upper=number["upper"] + share * abs(number["upper"])
    )


def moved(share: float) -> Callable[[dict[str, float]], object]:
    return lambda number: number.update({key: value * (1 + share) for key, value in number.items() if key in KEYS})


ASKED: dict[str, dict[str, Any]] = {
    "every step": {"kind": "contrastive"},
    "as the policy goes on": {"kind": "contrastive", "policy_values": True},
    "one step": {"state": 0, "rather_than": "long"},
    "with a toll": {"state": 0, "rather_than": "long", "also": ("toll",)},
    "totals": {"kind": "contrastive", "also": ("toll",)},
    "at a threshold": {"kind": "contrastive", "alpha": 100.0},
}


@pytest.mark.parametrize("how", ASKED)
def test_a_vague_number_is_undecided_and_a_wrong_one_is_contradicted(how: str) -> None:
    problem, document = fork(), told(fork(), **ASKED[how])
    assert verify(document, problem).holds
    assert checked(document, problem, wider(1e-6)).holds
    assert checked(document, problem, wider(5e-5)).undecided
    assert checked(document, problem, wider(1e-2)).fails
    assert checked(document, problem, moved(1e-4)).fails


def rare(objective: Objective, chance: float) -> Problem:
    """One action all but never comes to the hazard, another often; who is lucky pays much."""
    table: Table = {
        0: {"risk": ([(0.5, 2), (0.5, 1)], 0.0), "luck": ([(chance, 2), (1.0 - chance, 1)], 0.0)},
        1: {"stay": ([(1.0, 1)], 0.0)},
        2: {"stay": ([(1.0, 2)], 0.0)},
    }
    gain = Reward(branch=np.array([1e9, 0.0, 1e9, 0.0, 0.0, 0.0]))
    return problem_of(table, objective, goals=[1], hazards=[2], rewards={"gain": gain})


LEAST = ReachAvoid(goal='"hazard"', maximise=False)
GAIN = 'R{"gain"}max=? [Cdiscount=0.5]'


@pytest.mark.parametrize("chance", [1e-3, 1e-9, 1e-12, 1e-15])
@pytest.mark.parametrize("also", [(), (GAIN,)], ids=["alone", "with a gain"])
@pytest.mark.parametrize("asked", [{"kind": "contrastive"}, {"state": 0, "rather_than": "risk"}], ids=["path", "foil"])
def test_rounding_of_a_rare_chance_is_no_contradiction(
    chance: float, also: tuple[str, ...], asked: dict[str, Any]
) -> None:
    problem = rare(LEAST, chance)
    document = told(problem, also, **asked)
    assert not verify(document, problem).fails

    def blurred(number: dict[str, float]) -> None:
        """The error of adding up chances near 1."""
        number.update(lower=max(number["lower"] - 1e-14, 0.0), upper=number["upper"] + 1e-14)

    assert not checked(document, problem, blurred).fails
    assert checked(document, problem, lambda number: number.update(dict.fromkeys(KEYS, number["value"] + 0.1))).fails


@pytest.mark.parametrize(
    ("difference", "verdict"), [(2.0, "holds"), (2.0002, "undecided"), (2.1, "fails"), (1.9, "fails")]
)
def test_the_largest_difference_of_what_is_not_told_is_at_least_the_true_one(difference: float, verdict: str) -> None:
    problem, document = fork(), told(fork(), kind="contrastive", alpha=100.0)
    assert document["closing"]["largest_difference"] == pytest.approx(2.0)
    document["closing"]["largest_difference"] = difference
    assert getattr(checked(document, problem, lambda _: None), verdict)
