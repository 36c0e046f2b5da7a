"""The start is a goal: there is nothing to do, whatever could be done.

    home --roam 2--> field, --rest 0--> home         field --back 3--> home, --wait 1--> field

ρ(home) = 0 (ended). ρ(field): back = 3; wait = 1 + ρ(field), so 3. q(home, roam) = 2 + 3 = 5, q(home, rest) = 0, by formula;
ζ = 0 there. q(field): back 3, wait 4, critical. ε(home, roam): the tree is {field}, 2 decisions; ε(home, rest) = 0.
"""

from __future__ import annotations

import pytest

import ratherthan as rt

MODEL = {
    "home": {"roam": ([(1, "field")], 2), "rest": ([(1, "home")], 0)},
    "field": {"back": ([(1, "home")], 3), "wait": ([(1, "field")], 1)},
}
TEXTS = {
    "naive-path": ("We are already there."),
    "contrastive": ("We are already there."),
    "responsibility at home": ("We are already there."),
    "constrictive at home": ("We are already there."),
    "responsibility at field": ("We take back at field because it leads to the route with the least cost."),
    "constrictive at field": ("We take back at field, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL, goal="home"))
    assert found.rho == {"home": 0, "field": 3}
    assert (found.q["home", "roam"], found.q["home", "rest"]) == (5, 0)
    assert found.zeta["home", "roam"] == found.zeta["home", "rest"] == 0
    assert (found.q["field", "back"], found.q["field", "wait"]) == (3, 4)
    assert found.critical == {"field"}


def test_there_is_no_step_to_take(small):
    told = rt.explain(rt.solve(small(MODEL, goal="home")), kind="contrastive")
    assert list(told.steps) == []


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL, goal="home"), key) == TEXTS[key]
