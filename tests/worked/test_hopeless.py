"""Two hopeless models: no action is sure to arrive, and nothing arrives at all.

LEDGE: start --jump 1--> goal (0.7), ditch (0.3); start --climb 2--> goal (0.6), ditch (0.4). The ditch only loops.
Least cost: both q are ∞, λmax - λmin = ∞ - ∞ = 0, ζ = 0, not critical; yet one can arrive from start.
Largest chance: jump 0.7, climb 0.6; ρ(start) = 0.7, ζ(jump) = 0.1.

ISLAND: start --east 1--> beach, start --west 1--> wood; beach --back 1--> start, wood --back 1--> start. The goal lies
beyond the sea: no way leads there. All q are ∞, nothing is critical, and nobody can arrive. The largest chance is 0 exactly.
"""

from __future__ import annotations

from math import inf

import pytest

from ratherthan import ReachAvoid

LEDGE = {
    "start": {"jump": ([(0.7, "goal"), (0.3, "ditch")], 1), "climb": ([(0.6, "goal"), (0.4, "ditch")], 2)},
    "ditch": {},
    "goal": {},
}
ISLAND = {
    "start": {"east": ([(1, "beach")], 1), "west": ([(1, "wood")], 1)},
    "beach": {"back": ([(1, "start")], 1)},
    "wood": {"back": ([(1, "start")], 1)},
    "goal": {},
}
TEXTS_LEDGE = {
    "naive-path": ("We take jump at start."),
    "contrastive": ("No decision on this route changes the cost. No choice at start is sure to arrive."),
    "responsibility at start": ("We take jump at start although no choice here is sure to arrive."),
    "constrictive at start": ("We take jump at start, which leaves the same choices open as every other action."),
}
TEXTS_LEDGE_LIKELY = {
    "naive-path": ("We take jump at start."),
    "contrastive": ("We take jump at critical start because it leads to the route most likely to arrive."),
    "responsibility at start": ("We take jump at start because it leads to the route most likely to arrive."),
    "constrictive at start": ("We take jump at start, which leaves the same choices open as every other action."),
}
TEXTS_ISLAND = {
    "naive-path": ("There is no way to arrive from start: from there we get no further than beach and wood."),
    "contrastive": ("There is no way to arrive from start: from there we get no further than beach and wood."),
    "responsibility at start": ("We move east at start although no choice here is sure to arrive."),
    "constrictive at start": ("We move east at start, which leaves the same choices open as every other action."),
}


def test_no_action_is_sure_to_arrive(small, facts):
    found = facts(small(LEDGE))
    assert found.rho == {"start": inf, "ditch": inf, "goal": 0}
    assert found.q["start", "jump"] == found.q["start", "climb"] == inf
    assert found.zeta["start", "jump"] == found.zeta["start", "climb"] == 0
    assert found.critical == set()
    assert found.solution.can_arrive.tolist() == [True, False, True]


def test_the_chance_tells_the_ways_apart(small, facts):
    found = facts(small(LEDGE, objective=ReachAvoid(goal='"goal"')))
    assert found.rho["start"] == found.q["start", "jump"] == pytest.approx(0.7, rel=1e-12)
    assert found.q["start", "climb"] == pytest.approx(0.6, rel=1e-12)
    assert found.zeta["start", "jump"] == pytest.approx(0.1, rel=1e-9)
    assert found.critical == {"start"}
    assert found.policy["start"] == "jump"


def test_nothing_arrives(small, facts):
    found = facts(small(ISLAND))
    assert found.rho == {"start": inf, "beach": inf, "wood": inf, "goal": 0}
    assert found.critical == set()
    assert found.solution.can_arrive.tolist() == [False, False, False, True]
    likely = facts(small(ISLAND, objective=ReachAvoid(goal='"goal"')))
    assert likely.rho == {"start": 0, "beach": 0, "wood": 0, "goal": 1}
    assert likely.solution.upper[0].tolist() == [0, 0, 0, 1]
    assert likely.critical == set()


@pytest.mark.parametrize("key", TEXTS_LEDGE)
def test_texts_of_the_ledge(small, told, key):
    assert told(small(LEDGE), key) == TEXTS_LEDGE[key]


@pytest.mark.parametrize("key", TEXTS_LEDGE_LIKELY)
def test_texts_of_the_chance(small, told, key):
    assert told(small(LEDGE, objective=ReachAvoid(goal='"goal"')), key) == TEXTS_LEDGE_LIKELY[key]


@pytest.mark.parametrize("key", TEXTS_ISLAND)
def test_texts_of_the_island(small, told, key):
    assert told(small(ISLAND), key) == TEXTS_ISLAND[key]
