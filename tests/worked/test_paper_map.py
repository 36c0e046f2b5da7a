"""Every number and sentence of the paper's 5×5 map, to the letter.

Reference: Chen, Boggess, Feng (2020), arXiv:2003.07425, Examples 1-4 and Table I; the map is a reconstruction.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from ratherthan.explain import Factors, explain, question
from ratherthan.io import read
from ratherthan.narrate import narrate
from ratherthan.solve import Solution, solve

TEXTS = {
    "none": "",
    "naive-state": "We move east at grid 10.",
    "responsibility": "We move east at grid 10 because it leads to the shortest route.",
    "constrictive": "We move east at grid 10 because it leads to the most flexible future route.",
    "naive-path": (
        "First, we move south at grid 5. Next, we move east at grid 10. Then, we move east at grid 11. "
        "Next, we move north at grid 12. Then, we move east at grid 7. Next, we move north at grid 8. "
        "Finally, we move east at grid 3."
    ),
    "selective": (
        "First, we move south at critical grid 5. Then, we move east at critical grid 10. "
        "Next, we move north at critical grid 12. Finally, we move east at critical grid 7. "
        "All other decisions result in equivalent routes."
    ),
    "contrastive": (
        "First, we move south at critical grid 5 because it leads to the shortest and most flexible future route. "
        "Then, we move east at critical grid 10 because it leads to the shortest and most flexible future route. "
        "Next, we move north at critical grid 12 because it leads to the shortest route. "
        "Finally, we move east at critical grid 7 because it leads to the shortest route. "
        "All other decisions result in equivalent routes."
    ),
}
AT_10 = ("naive-state", "responsibility", "constrictive")


@pytest.fixture(scope="module")
def solution() -> Solution:
    return solve(read("example:paper-5x5"))


@pytest.fixture(scope="module")
def factors(solution: Solution) -> Factors:
    return Factors(solution=solution, asked=question())


def choice(solution: Solution, state: int, action: str) -> int:
    mdp = solution.problem.mdp
    return next(c for c in mdp.choices_of(state) if mdp.action_name(c) == action)


def test_the_map_has_its_size(solution: Solution) -> None:
    mdp = solution.problem.mdp
    assert (mdp.states, mdp.choices, mdp.branches) == (25, 31, 56)
    assert mdp.initial.tolist() == [5]
    assert np.flatnonzero(mdp.labels["destination"]).tolist() == [4]


def test_values(solution: Solution) -> None:
    assert solution.values[0][[10, 11, 15]] == pytest.approx([6 + 2 / 3, 5 + 5 / 9, 10.0], rel=1e-12)
    assert (solution.upper[0, [10, 11, 15]] - solution.lower[0, [10, 11, 15]]).max() < 1e-9


@pytest.mark.parametrize(
    ("state", "action", "impact", "action_value"),
    [(10, "east", 5 + 2 / 3, 6 + 2 / 3), (10, "south", 9 + 2 / 3, 10 + 2 / 3)],
)
def test_impacts_and_action_values(
    factors: Factors, state: int, action: str, impact: float, action_value: float
) -> None:
    c = choice(factors.solution, state, action)
    assert factors.measures.impact[c] == pytest.approx(impact, rel=1e-12)
    assert factors.measures.action_value[c] == pytest.approx(action_value, rel=1e-12)


def test_critical_states(factors: Factors) -> None:
    assert np.flatnonzero(factors.critical.certain).tolist() == [5, 7, 10, 12, 14]
    assert (factors.critical.certain == factors.critical.possible).all()


@pytest.mark.parametrize(
    ("state", "action", "count"),
    [(10, "south", 2), (10, "east", 4), (5, "south", 8), (12, "north", 2), (12, "south", 2), (7, "east", 0)],
)
def test_decisions_left_open(factors: Factors, state: int, action: str, count: int) -> None:
    c = choice(factors.solution, state, action)
    assert factors.counts([c])[c].count == count


def test_responsibility(factors: Factors) -> None:
    south, east = (choice(factors.solution, 10, action) for action in ("south", "east"))
    assert factors.measures.responsibility[south] == pytest.approx(4.0, rel=1e-12)
    assert factors.measures.responsibility[east] == 0.0


@pytest.mark.parametrize(("state", "action"), [(5, "north"), (7, "north"), (14, "west")])
def test_ways_into_dead_ends_are_infinite(factors: Factors, state: int, action: str) -> None:
    assert factors.measures.action_value[choice(factors.solution, state, action)] == math.inf


def test_there_are_three_routes_of_7_7_and_11_moves(solution: Solution) -> None:
    mdp = solution.problem.mdp
    lengths = []

    def walk(state: int, path: tuple[int, ...]) -> None:
        if state == 4:
            lengths.append(len(path) - 1)
            return
        targets = {int(t) for c in mdp.choices_of(state) for t in mdp.branch_to_target[mdp.branches_of(c)]}
        for target in sorted(targets - set(path)):
            walk(target, (*path, target))

    walk(5, (5,))
    assert sorted(lengths) == [7, 7, 11]


@pytest.mark.parametrize("kind", TEXTS)
def test_sentences(solution: Solution, kind: str) -> None:
    assert narrate(explain(solution, kind, state=10 if kind in AT_10 else None)) == TEXTS[kind]


def test_rather_than(solution: Solution) -> None:
    assert narrate(explain(solution, state=10, rather_than="south")) == (
        "We move east rather than south at grid 10 because it leads to a shorter route (6.7 instead of 10.7) "
        "and leaves more decisions open (4 instead of 2)."
    )


def test_a_threshold_keeps_its_promise(solution: Solution) -> None:
    explanation = explain(solution, "selective", alpha=4.5)
    assert narrate(explanation) == (
        "First, we move south at critical grid 5. Finally, we move east at critical grid 7. "
        "All other decisions on this route change the distance by at most 4."
    )
    assert explanation.closing.largest_difference == pytest.approx(4.0, rel=1e-9)


def test_the_reconstruction_is_said_so() -> None:
    world = read("example:paper-5x5").world
    assert world is not None
    assert "reconstruction" in world.note
