"""Two goals; the nearer first step leads to the dearer one. What lies beyond a goal is not searched.

    start --east 1--> e --on 5--> harbour        start --west 2--> w --on 1--> market
    harbour --sail 7--> e, --rest 0--> harbour   market --stroll 7--> w

ρ(e) = 5, ρ(w) = 1, both goals 0. q(start): east 1 + 5 = 6, west 2 + 1 = 3 = ρ(start), ζ(east) = 3: critical.
The objective has ended at the harbour: its rows keep ω and q by formula, q(harbour, sail) = 7 + ρ(e) = 12 and
q(harbour, rest) = 0 + ρ(harbour) = 0, but ζ = 0 and it is not critical, so ε(start, east) = ε(start, west) = 0.
"""

from __future__ import annotations

import pytest

MODEL = {
    "start": {"east": ([(1, "e")], 1), "west": ([(1, "w")], 2)},
    "e": {"on": ([(1, "harbour")], 5)},
    "w": {"on": ([(1, "market")], 1)},
    "harbour": {"sail": ([(1, "e")], 7), "rest": ([(1, "harbour")], 0)},
    "market": {"stroll": ([(1, "w")], 7)},
}
GOALS = ("harbour", "market")
TEXTS = {
    "naive-path": ("First, we move west at start. Finally, we take on at w."),
    "contrastive": (
        "We move west at critical start because it leads to the route with the least cost. All other "
        "decisions result in equivalent routes."
    ),
    "responsibility at start": ("We move west at start because it leads to the route with the least cost."),
    "constrictive at start": ("We move west at start, which leaves the same choices open as every other action."),
    "responsibility at harbour": ("We are already there."),
    "constrictive at harbour": ("We are already there."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL, goal=GOALS))
    assert found.rho == {"start": 3, "e": 5, "w": 1, "harbour": 0, "market": 0}
    assert (found.q["start", "east"], found.q["start", "west"]) == (6, 3)
    assert (found.q["harbour", "sail"], found.q["harbour", "rest"]) == (12, 0)
    assert (found.omega["harbour", "sail"], found.zeta["harbour", "sail"]) == (5, 0)
    assert found.critical == {"start"}
    assert found.epsilon["start", "east"] == found.epsilon["start", "west"] == 0


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL, goal=GOALS), key) == TEXTS[key]
