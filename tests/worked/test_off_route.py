"""The policy may be thrown off its route, to a decision that matters there.

    start --go 1-----> near (0.9), astray (0.1)      near --on 1----> goal
    start --detour 5-> near                          astray --back 1-> near, --through 4-> goal

ρ(near) = 1. q(astray): back = 1 + 1 = 2, through = 4; ρ(astray) = 2.
q(start): go = 1 + 0.9 · 1 + 0.1 · 2 = 2.1, detour = 5 + 1 = 6. Both start and astray are critical.
Route: start, near, goal, with probability 0.9; the policy is sure to arrive. Off the route there is one decision: astray.
ε(start, go): the tree is {near, astray, goal}: 2. ε(start, detour): {near, goal}: 0. So go is best and most flexible.
"""

from __future__ import annotations

import pytest

import ratherthan as rt

MODEL = {
    "start": {"go": ([(0.9, "near"), (0.1, "astray")], 1), "detour": ([(1, "near")], 5)},
    "near": {"on": ([(1, "goal")], 1)},
    "astray": {"back": ([(1, "near")], 1), "through": ([(1, "goal")], 4)},
    "goal": {},
}
TEXTS = {
    "naive-path": ("First, we take go at start. Finally, we take on at near."),
    "contrastive": (
        "We take go at critical start because it leads to the route with the least cost and the most flexible "
        "future route. All other decisions result in equivalent routes. Off this route there is 1 more "
        "decision that matters."
    ),
    "responsibility at start": ("We take go at start because it leads to the route with the least cost."),
    "constrictive at start": ("We take go at start because it leads to the most flexible future route."),
    "responsibility at astray": ("We take back at astray because it leads to the route with the least cost."),
    "constrictive at astray": ("We take back at astray, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL))
    assert found.rho == pytest.approx({"start": 2.1, "near": 1, "astray": 2, "goal": 0}, rel=1e-12)
    assert found.proves("start", 2.1)
    assert found.q["start", "detour"] == 6
    assert (found.q["astray", "back"], found.q["astray", "through"]) == (2, 4)
    assert found.critical == {"start", "astray"}
    assert (found.epsilon["start", "go"], found.epsilon["start", "detour"]) == (2, 0)


def test_the_route_and_what_lies_off_it(small):
    told = rt.explain(rt.solve(small(MODEL)), kind="contrastive")
    assert [step.state for step in told.steps] == [0, 1]
    assert told.route_probability == pytest.approx(0.9)
    assert told.closing.off_route == 1


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]
