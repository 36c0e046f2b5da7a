"""Going round costs nothing, so iterating from 0 would find 0; the least cost of arriving is the largest fixed point.

    start --round 0--> back, --pay 3--> goal        back --round 0--> start, --pay 5--> goal

Over policies that arrive: from start 3 (pay). From back: round to start and pay 3, or pay 5: ρ(back) = 3.
q(start): round = 0 + ρ(back) = 3, pay = 3: a tie, not critical. q(back): round = 3, pay = 5: critical, ζ(pay) = 2.
Though round is listed first at start and its q is as good, taking it at both states never arrives: the policy pays at start.
ε(start, round): the tree is {back, goal}, back is critical with two choices: 2. ε(start, pay) = 0.
ε(back, round): the tree is {start, goal}: 0, as ε(back, pay).
"""

from __future__ import annotations

import pytest

MODEL = {
    "start": {"round": ([(1, "back")], 0), "pay": ([(1, "goal")], 3)},
    "back": {"round": ([(1, "start")], 0), "pay": ([(1, "goal")], 5)},
    "goal": {},
}
TEXTS = {
    "naive-path": ("We take pay at start."),
    "contrastive": ("No decision on this route changes the cost."),
    "responsibility at start": ("We take pay at start because it leads to one of the routes with the least cost."),
    "constrictive at start": ("We take pay at start."),
    "responsibility at back": ("We take round at back because it leads to the route with the least cost."),
    "constrictive at back": ("We take round at back, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL))
    assert found.rho == {"start": 3, "back": 3, "goal": 0}
    assert found.proves("start", 3)
    assert found.q == {
        ("start", "round"): 3,
        ("start", "pay"): 3,
        ("back", "round"): 3,
        ("back", "pay"): 5,
        ("goal", "stay"): 0,
    }
    assert found.critical == {"back"}
    assert found.zeta["back", "pay"] == 2
    assert found.policy == {"start": "pay", "back": "round", "goal": "stay"}
    assert found.epsilon["start", "round"] == 2
    assert found.epsilon["start", "pay"] == found.epsilon["back", "round"] == found.epsilon["back", "pay"] == 0


def test_the_policy_attains_the_optimum(small, facts):
    found = facts(small(MODEL))
    assert found.following == found.rho


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]
