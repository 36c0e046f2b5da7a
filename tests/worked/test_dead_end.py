"""One action leads into a pit that nobody leaves.

    start --bridge 1--> far side   (0.8; else it stays)
    start --down 1----> pit        the pit only loops, at cost 1
    far side --on 2---> goal

ρ(far side) = 2. Bridge: q = 1 + 0.8 · 2 + 0.2 · ρ(start), ρ(start) = (1 + 1.6) / 0.8 = 3.25.
ρ(pit) = ∞, so q(start, down) = ∞ and ζ(start, down) = ∞: critical. After down the chance to arrive is 0: a dead end.
At the pit the two actions are both infinite: their difference is 0, so the pit is not critical; nor is far side (one choice).
ε(start, bridge): the tree is {far side, goal}: 0. ε(start, down): the tree is {pit}: 0.
"""

from __future__ import annotations

from math import inf

import pytest

MODEL = {
    "start": {"bridge": ([(0.8, "far side"), (0.2, "start")], 1), "down": ([(1, "pit")], 1)},
    "far side": {"on": ([(1, "goal")], 2)},
    "pit": {"shout": ([(1, "pit")], 1), "sit": ([(1, "pit")], 0)},
    "goal": {},
}
TEXTS = {
    "naive-path": ("First, we take bridge at start. Finally, we take on at far side."),
    "contrastive": (
        "We take bridge at critical start because it leads to the route with the least cost. All other "
        "decisions result in equivalent routes."
    ),
    "responsibility at start": ("We take bridge at start because it leads to the route with the least cost."),
    "constrictive at start": ("We take bridge at start, which leaves the same choices open as every other action."),
    "responsibility at pit": ("We take shout at pit although no choice here is sure to arrive."),
    "constrictive at pit": ("We take shout at pit, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL))
    assert found.rho["start"] == pytest.approx(3.25, rel=1e-12)
    assert found.proves("start", 3.25)
    assert found.rho["pit"] == found.q["start", "down"] == found.zeta["start", "down"] == inf
    assert found.q["pit", "shout"] == found.q["pit", "sit"] == inf
    assert found.zeta["pit", "shout"] == found.zeta["pit", "sit"] == 0
    assert found.critical == {"start"}
    assert found.epsilon["start", "bridge"] == found.epsilon["start", "down"] == 0
    assert found.policy["start"] == "bridge"
    assert found.solution.can_arrive.tolist() == [True, True, False, True]


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]
