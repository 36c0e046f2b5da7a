"""A corridor: one action everywhere, so nothing is critical and nothing can be compared.

    start --on 2--> hall --on 3--> stairs --on 1--> goal (0.5; else it stays)

ρ(stairs) = 1 / 0.5 = 2, ρ(hall) = 3 + 2 = 5, ρ(start) = 2 + 5 = 7.
"""

from __future__ import annotations

import pytest

MODEL = {
    "start": {"on": ([(1, "hall")], 2)},
    "hall": {"on": ([(1, "stairs")], 3)},
    "stairs": {"on": ([(0.5, "goal"), (0.5, "stairs")], 1)},
    "goal": {},
}
TEXTS = {
    "naive-path": ("First, we take on at start. Next, we take on at hall. Finally, we take on at stairs."),
    "contrastive": ("No decision on this route changes the cost."),
}


def test_numbers(small, facts):
    found = facts(small(MODEL))
    assert found.rho == pytest.approx({"start": 7, "hall": 5, "stairs": 2, "goal": 0}, rel=1e-12)
    assert found.proves("start", 7)
    assert found.critical == set()
    assert set(found.zeta.values()) == {0}
    assert set(found.epsilon.values()) == {0}


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL), key) == TEXTS[key]
