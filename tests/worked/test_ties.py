"""Two best actions at the start, and a tie that does not matter further on.

    start --left 1--> west --gate 2--> goal       west also has door 2 --> goal
    start --right 1-> east --gate 2--> goal
    start --round 1-> park --gate 5--> goal

ρ(west) = ρ(east) = 2, ρ(park) = 5.
q(start): left = 1 + 2 = 3, right = 1 + 2 = 3, round = 1 + 5 = 6. λmin = 3, λmax = 6: start is critical, and left is only
among the best. ζ: left 0, right 0, round 3.
q(west): gate = door = 2: a choice, but not critical. So no state but start is critical, and ε = 0 everywhere.
Of the tied choices the first listed is taken: left, then gate.
"""

from __future__ import annotations

import pytest

MODEL = {
    "start": {"left": ([(1, "west")], 1), "right": ([(1, "east")], 1), "round": ([(1, "park")], 1)},
    "west": {"gate": ([(1, "goal")], 2), "door": ([(1, "goal")], 2)},
    "east": {"gate": ([(1, "goal")], 2)},
    "park": {"gate": ([(1, "goal")], 5)},
    "goal": {},
}
TEXTS = {
    "naive-path": ("First, we take left at start. Finally, we take gate at west."),
    "contrastive": (
        "We take left at critical start because it leads to one of the routes with the least cost. All other "
        "decisions result in equivalent routes."
    ),
    "responsibility at start": ("We take left at start because it leads to one of the routes with the least cost."),
    "constrictive at start": ("We take left at start, which leaves the same choices open as every other action."),
    "responsibility at west": ("We take gate at west because it leads to one of the routes with the least cost."),
    "constrictive at west": ("We take gate at west, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL))
    assert found.rho == {"start": 3, "west": 2, "east": 2, "park": 5, "goal": 0}
    assert [found.q["start", a] for a in ("left", "right", "round")] == [3, 3, 6]
    assert [found.zeta["start", a] for a in ("left", "right", "round")] == [0, 0, 3]
    assert found.q["west", "gate"] == found.q["west", "door"] == 2
    assert found.critical == {"start"}
    assert set(found.epsilon.values()) == {0}
    assert (found.policy["start"], found.policy["west"]) == ("left", "gate")
    assert found.proves("start", 3)


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]
