"""The best action leaves fewer decisions open than another.

    start --tunnel 1--> below --on 1--> goal         start --stairs 1--> square
    square --left 2--> goal, --right 3--> goal

ρ(below) = 1, ρ(square) = 2. q(start): tunnel 2, stairs 3. Critical: start (difference 1) and square (1).
ε(start, tunnel): the tree is {below, goal}: 0. ε(start, stairs): {square, goal}: 2. So the tunnel is best, the stairs are
most flexible.
EVEN swaps the costs at start (tunnel 2): both q are 3, start is not critical, and ε is as before.
"""

from __future__ import annotations

import pytest

MODEL = {
    "start": {"tunnel": ([(1, "below")], 1), "stairs": ([(1, "square")], 1)},
    "below": {"on": ([(1, "goal")], 1)},
    "square": {"left": ([(1, "goal")], 2), "right": ([(1, "goal")], 3)},
    "goal": {},
}
EVEN = MODEL | {"start": {"tunnel": ([(1, "below")], 2), "stairs": ([(1, "square")], 1)}}
TEXTS = {
    "naive-path": ("First, we take tunnel at start. Finally, we take on at below."),
    "contrastive": (
        "We take tunnel at critical start because it leads to the route with the least cost. All other "
        "decisions result in equivalent routes."
    ),
    "responsibility at start": ("We take tunnel at start because it leads to the route with the least cost."),
    "constrictive at start": ("We take tunnel at start."),
    "responsibility at square": ("We take left at square because it leads to the route with the least cost."),
    "constrictive at square": ("We take left at square, which leaves the same choices open as every other action."),
}
TEXTS_EVEN = {
    "naive-path": ("First, we take tunnel at start. Finally, we take on at below."),
    "contrastive": ("No decision on this route changes the cost."),
    "responsibility at start": ("We take tunnel at start because it leads to one of the routes with the least cost."),
    "constrictive at start": ("We take tunnel at start."),
    "responsibility at square": ("We take left at square because it leads to the route with the least cost."),
    "constrictive at square": ("We take left at square, which leaves the same choices open as every other action."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL))
    assert found.rho == {"start": 2, "below": 1, "square": 2, "goal": 0}
    assert (found.q["start", "tunnel"], found.q["start", "stairs"]) == (2, 3)
    assert found.critical == {"start", "square"}
    assert (found.epsilon["start", "tunnel"], found.epsilon["start", "stairs"]) == (0, 2)
    assert found.policy["start"] == "tunnel"


def test_numbers_of_a_tie(small, facts):
    found = facts(small(EVEN))
    assert found.q["start", "tunnel"] == found.q["start", "stairs"] == 3
    assert found.critical == {"square"}
    assert (found.epsilon["start", "tunnel"], found.epsilon["start", "stairs"]) == (0, 2)
    assert found.policy["start"] == "tunnel"


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]


@pytest.mark.parametrize("key", TEXTS_EVEN)
def test_texts_of_a_tie(small, told, key):
    assert told(small(EVEN), key) == TEXTS_EVEN[key]
