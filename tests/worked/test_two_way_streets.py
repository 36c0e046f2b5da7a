"""Streets that run both ways: before the last turn every action leaves the same choices open.

    a -- b, a -- c, b -- c, both ways, cost 1 each; b --goal 1--> goal. The start is a.

ρ(b) = 1, ρ(a) = ρ(c) = 2. q(a): b 2, c 3. q(b): goal 1, a 3, c 3. q(c): a 3, b 2. All three are critical.
ε(a, to b): the tree without a is {b, goal, c}: 3 + 2 = 5. ε(a, to c): {c, b, goal}: 5, the same.
ε(c, to a) = ε(c, to b) = |A(a)| + |A(b)| = 2 + 3 = 5.
ε(b, to goal) = 0; ε(b, to a) = ε(b, to c) = |A(a)| + |A(c)| = 4: the best action at b is not the most flexible, and two
others share the most, so none is.
"""

from __future__ import annotations

import pytest

MODEL = {
    "a": {"to b": ([(1, "b")], 1), "to c": ([(1, "c")], 1)},
    "b": {"to goal": ([(1, "goal")], 1), "to a": ([(1, "a")], 1), "to c": ([(1, "c")], 1)},
    "c": {"to a": ([(1, "a")], 1), "to b": ([(1, "b")], 1)},
    "goal": {},
}
TEXTS = {
    "naive-path": ("First, we take to b at a. Finally, we take to goal at b."),
    "contrastive": (
        "First, we take to b at critical a because it leads to the route with the least cost. Finally, we "
        "take to goal at critical b because it leads to the route with the least cost."
    ),
    "responsibility at a": ("We take to b at a because it leads to the route with the least cost."),
    "constrictive at a": ("We take to b at a, which leaves the same choices open as every other action."),
    "responsibility at b": ("We take to goal at b because it leads to the route with the least cost."),
    "constrictive at b": ("We take to goal at b."),
    "responsibility at c": ("We take to b at c because it leads to the route with the least cost."),
    "constrictive at c": ("We take to b at c, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL))
    assert found.rho == {"a": 2, "b": 1, "c": 2, "goal": 0}
    assert found.critical == {"a", "b", "c"}
    assert found.epsilon["a", "to b"] == found.epsilon["a", "to c"] == 5
    assert found.epsilon["c", "to a"] == found.epsilon["c", "to b"] == 5
    assert [found.epsilon["b", action] for action in ("to goal", "to a", "to c")] == [0, 4, 4]
    assert [found.q["b", action] for action in ("to goal", "to a", "to c")] == [1, 3, 3]


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]
