"""Given policies: one that circles for ever, one that is worse than the best, one that tosses a coin.

    a --round 1--> b, --out 6--> goal               b --round 1--> a, --out 3--> goal

ρ(b): out = 3; round = 1 + ρ(a). ρ(a): round = 1 + 3 = 4, out = 6. So ρ(a) = 4, ρ(b) = 3; q(b, round) = 5. Both are critical.
CIRCLES (round, round): never arrives, ρ^π = ∞ at a and b, though every single step at a is best by q.
WORSE (out, out): ρ^π(a) = 6, ρ^π(b) = 3. Out at a is 2 more than the best.
COIN: at a round with 0.6, out with 0.4; at b out: ρ^π(b) = 3, ρ^π(a) = 0.6 · (1 + 3) + 0.4 · 6 = 4.8.
LEAVES (at a round, at b round with 0.5 and out with 0.5): x = 1 + y, y = 0.5 (1 + x) + 0.5 · 3, so y = 0.5 (2 + y) + 1.5 = 5 and
x = 6.
"""

from __future__ import annotations

from math import inf

import pytest

import ratherthan as rt

MODEL = {
    "a": {"round": ([(1, "b")], 1), "out": ([(1, "goal")], 6)},
    "b": {"round": ([(1, "a")], 1), "out": ([(1, "goal")], 3)},
    "goal": {},
}
CIRCLES = {"a": "round", "b": "round", "goal": "stay"}
WORSE = {"a": "out", "b": "out", "goal": "stay"}
COIN = {"a": {"round": 0.6, "out": 0.4}, "b": "out", "goal": "stay"}
LEAVES = {"a": "round", "b": {"round": 0.5, "out": 0.5}, "goal": "stay"}
TEXTS_CIRCLES = {
    "naive-path": (
        "First, we take round at a. Finally, we take round at b. We never arrive: we go round at a and b for ever."
    ),
    "contrastive": (
        "First, we take round at critical a because it leads to the most flexible future route and is the "
        "right way to begin, but we do not stay on the route with the least cost. Finally, we take round at "
        "critical b because it leads to the most flexible future route, although taking out would lead to a "
        "route with less cost (3 instead of 5). We never arrive: we go round at a and b for ever."
    ),
    "responsibility at a": (
        "We take round at a because it is the right way to begin, but we do not stay on the route with the least cost."
    ),
    "constrictive at a": ("We take round at a because it leads to the most flexible future route."),
    "responsibility at b": (
        "We take round at b although taking out would lead to a route with less cost (3 instead of 5)."
    ),
    "constrictive at b": ("We take round at b because it leads to the most flexible future route."),
}
TEXTS_WORSE = {
    "naive-path": ("We take out at a."),
    "contrastive": (
        "We take out at critical a although taking round would lead to a route with less cost (4 instead of 6)."
    ),
    "responsibility at a": (
        "We take out at a although taking round would lead to a route with less cost (4 instead of 6)."
    ),
    "constrictive at a": ("We take out at a."),
    "responsibility at b": ("We take out at b because it leads to the route with the least cost."),
    "constrictive at b": ("We take out at b."),
}
TEXTS_COIN = {
    "naive-path": ("First, we take round 60 % of the time at a. Finally, we take out at b."),
    "contrastive": (
        "First, we take round 60 % of the time at critical a because it leads to the route with the least "
        "cost and the most flexible future route. Finally, we take out at critical b because it leads to the "
        "route with the least cost."
    ),
    "responsibility at a": ("We take round 60 % of the time at a because it leads to the route with the least cost."),
    "constrictive at a": ("We take round 60 % of the time at a because it leads to the most flexible future route."),
    "responsibility at b": ("We take out at b because it leads to the route with the least cost."),
    "constrictive at b": ("We take out at b."),
}


@pytest.mark.parametrize(
    ("taken", "following"),
    [
        (CIRCLES, {"a": inf, "b": inf, "goal": 0}),
        (WORSE, {"a": 6, "b": 3, "goal": 0}),
        (COIN, {"a": 4.8, "b": 3, "goal": 0}),
        (LEAVES, {"a": 6, "b": 5, "goal": 0}),
    ],
)
def test_numbers(small, facts, policy, taken, following):
    problem = small(MODEL)
    found = facts(problem, policy(problem, taken))
    assert found.following == pytest.approx(following, rel=1e-12)
    assert found.rho == {"a": 4, "b": 3, "goal": 0}
    assert (found.q["a", "round"], found.q["a", "out"]) == (4, 6)
    assert (found.q["b", "round"], found.q["b", "out"]) == (5, 3)
    assert found.critical == {"a", "b"}


def test_a_policy_that_circles_says_where(small, policy):
    problem = small(MODEL)
    told = rt.explain(rt.evaluate(problem, policy(problem, CIRCLES)), kind="naive-path")
    assert told.route_outcome == "circles"
    assert sorted(told.circle) == [0, 1]
    assert (told.arrival.lower, told.arrival.upper) == (0, 0)


@pytest.mark.parametrize(
    ("taken", "texts", "key"),
    [
        (taken, texts, key)
        for taken, texts in ((CIRCLES, TEXTS_CIRCLES), (WORSE, TEXTS_WORSE), (COIN, TEXTS_COIN))
        for key in texts
    ],
)
def test_texts(small, told, policy, taken, texts, key):
    problem = small(MODEL)
    assert told(problem, key, policy(problem, taken)) == texts[key]
