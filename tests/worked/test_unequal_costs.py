"""The paper's impact and the action value disagree where actions cost differently.

    start --taxi 10--> near --on 1--> goal          start --walk 1--> far --on 4--> goal

ρ(near) = 1, ρ(far) = 4. Impact: ω(taxi) = 1, ω(walk) = 4, so the paper's ζ calls the taxi good. Action values:
q(taxi) = 10 + 1 = 11, q(walk) = 1 + 4 = 5 = ρ(start): walking is best, ζ(taxi) = 6, ζ(walk) = 0.
Start is critical by both measures (11 - 5 = 6 and 4 - 1 = 3).

EVEN has start --taxi 4--> near instead: q(taxi) = 5 = q(walk), a tie, though ω still differs by 3: start is critical by ω and
not by q.
"""

from __future__ import annotations

import pytest

MODEL = {
    "start": {"taxi": ([(1, "near")], 10), "walk": ([(1, "far")], 1)},
    "near": {"on": ([(1, "goal")], 1)},
    "far": {"on": ([(1, "goal")], 4)},
    "goal": {},
}
EVEN = MODEL | {"start": {"taxi": ([(1, "near")], 4), "walk": ([(1, "far")], 1)}}
TEXTS = {
    "naive-path": ("First, we take walk at start. Finally, we take on at far."),
    "contrastive": (
        "We take walk at critical start because it leads to the route with the least cost. All other "
        "decisions result in equivalent routes."
    ),
    "responsibility at start": ("We take walk at start because it leads to the route with the least cost."),
    "constrictive at start": ("We take walk at start, which leaves the same choices open as every other action."),
}
TEXTS_EVEN = {
    "naive-path": ("First, we take taxi at start. Finally, we take on at near."),
    "contrastive": ("No decision on this route changes the cost."),
    "responsibility at start": ("We take taxi at start because it leads to one of the routes with the least cost."),
    "constrictive at start": ("We take taxi at start, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL))
    assert found.rho == {"start": 5, "near": 1, "far": 4, "goal": 0}
    assert (found.omega["start", "taxi"], found.omega["start", "walk"]) == (1, 4)
    assert (found.q["start", "taxi"], found.q["start", "walk"]) == (11, 5)
    assert (found.zeta["start", "taxi"], found.zeta["start", "walk"]) == (6, 0)
    assert found.critical == found.critical_by_omega == {"start"}
    assert found.policy["start"] == "walk"


def test_numbers_where_only_the_impact_differs(small, facts):
    found = facts(small(EVEN))
    assert found.q["start", "taxi"] == found.q["start", "walk"] == 5
    assert found.critical == set()
    assert found.critical_by_omega == {"start"}
    assert found.policy["start"] == "taxi"


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]


@pytest.mark.parametrize("key", TEXTS_EVEN)
def test_texts_where_only_the_impact_differs(small, told, key):
    assert told(small(EVEN), key) == TEXTS_EVEN[key]
