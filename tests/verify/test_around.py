"""Searches that share what they have in common find what a plain search finds."""

from __future__ import annotations

import numpy as np
import pytest

from ratherthan.verify.around import around


def plainly(count, edges, without, begin):
    found = {int(state) for state in begin if state != without}
    waiting = list(found)
    while waiting:
        state = waiting.pop()
        for origin, target in edges:
            if origin == state and target != without and target not in found:
                found.add(target)
                waiting.append(target)
    return np.isin(np.arange(count), list(found))


@pytest.mark.parametrize("seed", range(60))
def test_a_search_without_a_state_finds_what_a_plain_one_finds(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 14))
    origin = np.sort(rng.integers(0, count, int(rng.integers(0, 3 * count))))
    target = rng.integers(0, count, len(origin))
    edges = list(zip(origin.tolist(), target.tolist(), strict=True))
    prepared, weights = around(count, origin, target), rng.integers(0, 5, (count, 2))
    for without in range(count):
        begin = np.unique(rng.integers(0, count, int(rng.integers(1, 4))))
        expected = plainly(count, edges, without, begin)
        assert (prepared.found(without, begin) == expected).all()
        assert (prepared.sums(without, begin, weights) == weights[expected].sum(axis=0)).all()


def test_a_long_line_without_its_middle_falls_apart():
    count = 2000
    along = np.arange(count - 1)
    origin = np.concatenate([along, along + 1])
    target = np.concatenate([along + 1, along])
    order = np.argsort(origin, kind="stable")
    prepared = around(count, origin[order], target[order])
    found = prepared.found(700, np.array([701]))
    assert (np.flatnonzero(found) == np.arange(701, count)).all()
