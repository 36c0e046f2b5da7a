"""Reaching a goal while avoiding a fire, as a largest and as a smallest chance.

    start --short--> goal (0.8), fire (0.2)          hall --door--> goal (0.95), fire (0.05)
    start --long---> hall                            hall --window--> goal (0.5), start (0.3), fire (0.2)

Largest chance of [!fire U goal], x at start and y at hall: y = max(0.95, 0.5 + 0.3x), x = max(0.8, y). As x ≤ 1, the window
gives 0.8 at most: y = 0.95, x = 0.95. q(start): short 0.8, long 0.95; q(hall): door 0.95, window 0.5 + 0.3 · 0.95 = 0.785.
ζ(start, long) = 0.15, ζ(hall, door) = 0.165. Both are critical. ε(start, long): the tree is {hall, goal, fire} (not start):
2; ε(start, short) = 0. ε(hall, door) = 0; ε(hall, window): the tree is {goal, start, fire} without hall: 2.
Least chance of [F fire], u at start and v at hall: v = min(0.05, 0.2 + 0.3u) = 0.05, u = min(0.2, v) = 0.05.
q(start): short 0.2, long 0.05; q(hall): door 0.05, window 0.2 + 0.3 · 0.05 = 0.215. The fire is the hazard, no goal is left.
"""

from __future__ import annotations

import pytest

from ratherthan import ReachAvoid

MODEL = {
    "start": {"short": ([(0.8, "goal"), (0.2, "fire")], 1), "long": ([(1, "hall")], 1)},
    "hall": {
        "door": ([(0.95, "goal"), (0.05, "fire")], 1),
        "window": ([(0.5, "goal"), (0.3, "start"), (0.2, "fire")], 1),
    },
    "goal": {},
    "fire": {},
}
SAFELY = ReachAvoid(goal='"goal"', through='!"hazard"')
NEVER = ReachAvoid(goal='"hazard"', maximise=False)
TEXTS = {
    "naive-path": ("First, we take long at start. Finally, we take door at hall."),
    "contrastive": (
        "First, we take long at critical start because it leads to the safest and most flexible future route. "
        "Finally, we take door at critical hall because it leads to the safest route."
    ),
    "responsibility at start": ("We take long at start because it leads to the safest route."),
    "constrictive at start": ("We take long at start because it leads to the most flexible future route."),
    "responsibility at hall": ("We take door at hall because it leads to the safest route."),
    "constrictive at hall": ("We take door at hall."),
}
TEXTS_NEVER = {
    "naive-path": ("First, we take long at start. Finally, we take door at hall."),
    "contrastive": (
        "First, we take long at critical start because it leads to the safest and most flexible future route. "
        "Finally, we take door at critical hall because it leads to the safest route."
    ),
    "responsibility at start": ("We take long at start because it leads to the safest route."),
    "constrictive at start": ("We take long at start because it leads to the most flexible future route."),
    "responsibility at hall": ("We take door at hall because it leads to the safest route."),
    "constrictive at hall": ("We take door at hall."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL, hazard="fire", objective=SAFELY))
    assert found.rho == pytest.approx({"start": 0.95, "hall": 0.95, "goal": 1, "fire": 0}, rel=1e-12)
    assert found.proves("start", 0.95)
    expected = {("start", "short"): 0.8, ("start", "long"): 0.95, ("hall", "door"): 0.95, ("hall", "window"): 0.785}
    assert {key: found.q[key] for key in expected} == pytest.approx(expected, rel=1e-12)
    assert found.zeta["start", "long"] == pytest.approx(0.15, rel=1e-9)
    assert found.zeta["hall", "door"] == pytest.approx(0.165, rel=1e-9)
    assert found.critical == {"start", "hall"}
    assert [found.epsilon[key] for key in expected] == [0, 2, 0, 2]
    assert (found.policy["start"], found.policy["hall"]) == ("long", "door")
    assert found.solution.hazard.tolist() == [False, False, False, True]


def test_numbers_of_the_least_chance(small, facts):
    found = facts(small(MODEL, hazard="fire", objective=NEVER))
    assert found.rho == pytest.approx({"start": 0.05, "hall": 0.05, "goal": 0, "fire": 1}, rel=1e-12)
    expected = {("start", "short"): 0.2, ("start", "long"): 0.05, ("hall", "door"): 0.05, ("hall", "window"): 0.215}
    assert {key: found.q[key] for key in expected} == pytest.approx(expected, rel=1e-12)
    assert found.critical == {"start", "hall"}
    assert (found.policy["start"], found.policy["hall"]) == ("long", "door")
    assert found.solution.hazard.tolist() == [False, False, False, True]
    assert not found.solution.goal.any()


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL, hazard="fire", objective=SAFELY), key) == TEXTS[key]


@pytest.mark.parametrize("key", TEXTS_NEVER)
def test_texts_of_the_least_chance(small, told, key):
    assert told(small(MODEL, hazard="fire", objective=NEVER), key) == TEXTS_NEVER[key]
