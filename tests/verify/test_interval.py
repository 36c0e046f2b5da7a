"""What bounds decide is what every pair of numbers between them says."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.verify.interval import Bounds, Order, above, order

TOLERANCE = 0.125
NUMBERS = st.integers(-8, 8).map(float)
ENDS = st.tuples(NUMBERS, NUMBERS).map(lambda pair: Bounds(*sorted(pair)))


def between(bounds: Bounds) -> list[Fraction]:
    low, high = Fraction(bounds.lower), Fraction(bounds.upper)
    return [low + (high - low) * k / 8 for k in range(9)]


def truth(x: Fraction, y: Fraction) -> Order:
    if abs(x - y) <= Fraction(TOLERANCE) * max(abs(x), abs(y)):
        return Order.EQUAL
    return Order.GREATER if x > y else Order.LESS


@given(ENDS, ENDS)
def test_what_is_decided_holds_for_every_pair(x: Bounds, y: Bounds) -> None:
    found = order(x, y, TOLERANCE)
    if found is not Order.OPEN:
        assert {truth(p, q) for p in between(x) for q in between(y)} == {found}


@given(NUMBERS, NUMBERS)
def test_exact_numbers_are_always_decided(x: float, y: float) -> None:
    assert order(Bounds(x, x), Bounds(y, y), TOLERANCE) is truth(Fraction(x), Fraction(y))


@given(ENDS, ENDS, st.sampled_from([0.0, 1.0, 2.5]))
def test_what_lies_above_lies_above_for_every_pair(x: Bounds, y: Bounds, threshold: float) -> None:
    found = above(x, y, threshold, TOLERANCE)
    if found is not None:
        pairs = [(p, q) for p in between(x) for q in between(y)]
        limits = [Fraction(threshold) + Fraction(TOLERANCE) * max(abs(p), abs(q)) for p, q in pairs]
        assert {p - q > limit for (p, q), limit in zip(pairs, limits, strict=True)} == {found}


INF = Bounds(math.inf, math.inf)
SEVEN, UNKNOWN = Bounds(7.0, 7.0), Bounds(-math.inf, math.inf)


def test_infinity_is_a_number_like_any_other() -> None:
    assert order(INF, INF, TOLERANCE) is Order.EQUAL
    assert order(INF, SEVEN, TOLERANCE) is Order.GREATER
    assert order(SEVEN, INF, TOLERANCE) is Order.LESS
    assert order(INF, Bounds(3.0, math.inf), TOLERANCE) is Order.OPEN
    assert order(UNKNOWN, SEVEN, TOLERANCE) is Order.OPEN
    assert above(INF, SEVEN, 1e9, TOLERANCE) is True
    assert above(INF, INF, 0.0, TOLERANCE) is False
    assert above(UNKNOWN, SEVEN, 0.0, TOLERANCE) is None


@given(st.fractions())
def test_exact_numbers_are_enclosed_by_neighbours(exact: Fraction) -> None:
    bounds = Bounds.around(exact)
    assert Fraction(bounds.lower) <= exact <= Fraction(bounds.upper)
    assert bounds.upper <= np.nextafter(bounds.lower, math.inf)


@pytest.mark.parametrize("sign", [1, -1])
def test_numbers_beyond_the_largest_double_are_enclosed(sign: int) -> None:
    bounds = Bounds.around(Fraction(sign * 10**400))
    assert bounds.finite is False
    assert bounds.infinite is False
