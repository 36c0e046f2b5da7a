"""Maximised costs keep PRISM's meaning: infinite where the goal can be dodged, else the largest total.

    start --linger 1--> start (0.5), goal (0.5); --leave 1--> goal
Nobody can linger for ever: x = max(1 + 0.5x, 1) = 2. q(start): linger 2, leave 1, ζ(linger) = 1: here large is good.

DODGE has start --hide 1--> shed, and the shed loops at cost 1: the goal can be dodged, so ρ(start) = ∞. q: hide = 1 + ∞ = ∞,
linger = 1 + 0.5 · ∞ = ∞, leave = 1 + 0 = 1: critical.
"""

from __future__ import annotations

from math import inf

import pytest

from ratherthan import ExpectedCost

MODEL = {
    "start": {"linger": ([(0.5, "start"), (0.5, "goal")], 1), "leave": ([(1, "goal")], 1)},
    "goal": {},
}
DODGE = {
    "start": MODEL["start"] | {"hide": ([(1, "shed")], 1)},
    "shed": {"wait": ([(1, "shed")], 1)},
    "goal": {},
}
MOST = ExpectedCost(goal='"goal"', reward="cost", maximise=True)
TEXTS = {
    "naive-path": ("We take linger at start."),
    "contrastive": ("We take linger at critical start because it leads to the route with the most cost."),
    "responsibility at start": ("We take linger at start because it leads to the route with the most cost."),
    "constrictive at start": ("We take linger at start, which leaves the same choices open as every other action."),
}
TEXTS_DODGE = {
    "naive-path": ("We take hide at start. We never arrive: we stay at shed for ever."),
    "contrastive": (
        "We take hide at critical start because it leads to one of the routes with the most cost. We never "
        "arrive: we stay at shed for ever."
    ),
    "responsibility at start": ("We take hide at start because it leads to one of the routes with the most cost."),
    "constrictive at start": ("We take hide at start, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL, objective=MOST))
    assert found.rho == pytest.approx({"start": 2, "goal": 0}, rel=1e-12)
    assert found.proves("start", 2)
    assert found.q["start", "linger"] == pytest.approx(2, rel=1e-12)
    assert (found.q["start", "leave"], found.zeta["start", "leave"]) == (1, 0)
    assert found.zeta["start", "linger"] == pytest.approx(1, rel=1e-9)
    assert found.critical == {"start"}
    assert found.policy["start"] == "linger"


def test_numbers_where_the_goal_can_be_dodged(small, facts):
    found = facts(small(DODGE, objective=MOST))
    assert found.rho == {"start": inf, "shed": inf, "goal": 0}
    assert found.q["start", "hide"] == found.q["start", "linger"] == inf
    assert found.q["start", "leave"] == 1
    assert found.critical == {"start"}
    assert found.following["start"] == inf


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL, objective=MOST), key) == TEXTS[key]


@pytest.mark.parametrize("key", TEXTS_DODGE)
def test_texts_where_the_goal_can_be_dodged(small, told, key):
    assert told(small(DODGE, objective=MOST), key) == TEXTS_DODGE[key]
