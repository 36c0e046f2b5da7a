"""A cheap way that arrives with probability 0.9 only, beside a dear one that is sure.

    start --jump 1---> goal (0.9), ditch (0.1)      the ditch only loops
    start --bridge 5-> goal

Least cost: jump is not sure to arrive, so q(start, jump) = ∞ although its chance is 0.9: it may fail to arrive, and is no
dead end (can_arrive holds at start). q(start, bridge) = 5 = ρ(start).
Largest chance to arrive: q(start, jump) = 0.9, q(start, bridge) = 1; ζ: jump 0, bridge 0.1. Large is good.
"""

from __future__ import annotations

from math import inf

import pytest

from ratherthan import ReachAvoid

MODEL = {
    "start": {"jump": ([(0.9, "goal"), (0.1, "ditch")], 1), "bridge": ([(1, "goal")], 5)},
    "ditch": {},
    "goal": {},
}
TEXTS = {
    "naive-path": ("We take bridge at start."),
    "contrastive": ("We take bridge at critical start because it leads to the route with the least cost."),
    "responsibility at start": ("We take bridge at start because it leads to the route with the least cost."),
    "constrictive at start": ("We take bridge at start, which leaves the same choices open as every other action."),
}
TEXTS_LIKELY = {
    "naive-path": ("We take bridge at start."),
    "contrastive": ("We take bridge at critical start because it leads to the route most likely to arrive."),
    "responsibility at start": ("We take bridge at start because it leads to the route most likely to arrive."),
    "constrictive at start": ("We take bridge at start, which leaves the same choices open as every other action."),
}


def test_numbers_of_the_cost(small, facts):
    found = facts(small(MODEL))
    assert found.rho == {"start": 5, "ditch": inf, "goal": 0}
    assert found.q["start", "jump"] == found.omega["start", "jump"] == inf
    assert found.critical == {"start"}
    assert found.policy["start"] == "bridge"
    assert found.solution.can_arrive.tolist() == [True, False, True]


def test_numbers_of_the_chance(small, facts):
    found = facts(small(MODEL, objective=ReachAvoid(goal='"goal"')))
    assert found.rho == {"start": 1, "ditch": 0, "goal": 1}
    assert found.q["start", "jump"] == pytest.approx(0.9, rel=1e-12)
    assert found.zeta["start", "bridge"] == pytest.approx(0.1, rel=1e-9)
    assert found.zeta["start", "jump"] == 0
    assert found.critical == {"start"}
    assert found.policy["start"] == "bridge"


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]


@pytest.mark.parametrize("key", TEXTS_LIKELY)
def test_texts_of_the_chance(small, told, key):
    assert told(small(MODEL, objective=ReachAvoid(goal='"goal"')), key) == TEXTS_LIKELY[key]
