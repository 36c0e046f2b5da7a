"""Numbers between bounds enter, what their bounds decide leaves: equal, greater, less, or open.

Definition
----------
x and y are compared with τ = t · max(|x|, |y|), t the tolerance of the explanation. Over all x and y that the bounds allow,
x - y lies in [x⁻ - y⁺, x⁺ - y⁻], and max(|x|, |y|) in [m, M]. So they are *equal* if the largest |x - y| is at most t·m,
*different* if the smallest is above t·M, else *open*. ∞ equals ∞ and differs from what is certainly finite.

Nothing here is shared with the code that made the explanation.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Protocol

import numpy as np

from ratherthan.model.mdp import Bools, Floats

__all__ = [
    "Bounds",
    "Ends",
    "Interval",
    "Order",
    "above",
    "all_above",
    "largest",
    "never_above",
    "order",
    "order_all",
    "smallest",
]


Ends = tuple[Floats, Floats]
"""Arrays of lower and of upper bounds."""


class Interval(Protocol):
    """Whatever has a lower and an upper bound."""

    @property
    def lower(self) -> float:
        """The lower bound."""

    @property
    def upper(self) -> float:
        """The upper bound."""


class Order(Enum):
    """How two numbers stand to each other, as far as their bounds tell."""

    EQUAL = "equal"
    GREATER = "greater"
    LESS = "less"
    OPEN = "open"


@dataclass(frozen=True)
class Bounds:
    """A number that lies between `lower` and `upper`, ±∞ allowed."""

    lower: float
    upper: float

    @staticmethod
    def around(exact: Fraction) -> Bounds:
        """Return the tightest bounds of an exact number."""
        try:
            near = float(exact)
        except OverflowError:
            largest_double = math.nextafter(math.inf, 0.0)
            return Bounds(largest_double, math.inf) if exact > 0 else Bounds(-math.inf, -largest_double)
        lower = near if Fraction(near) <= exact else math.nextafter(near, -math.inf)
        upper = near if Fraction(near) >= exact else math.nextafter(near, math.inf)
        return Bounds(lower, upper)

    @property
    def finite(self) -> bool:
        """Whether the number is certainly finite."""
        return math.isfinite(self.lower) and math.isfinite(self.upper)

    @property
    def infinite(self) -> bool:
        """Whether the number is certainly ∞ or -∞."""
        return self.lower == self.upper and math.isinf(self.lower)

    def widened(self, share: float, size: float = 0.0) -> Bounds:
        """Return bounds that are wider by a share of the number, or of `size` where that is larger; ∞ stays what it is."""
        lower = self.lower - share * max(abs(self.lower), size) if math.isfinite(self.lower) else self.lower
        upper = self.upper + share * max(abs(self.upper), size) if math.isfinite(self.upper) else self.upper
        return Bounds(lower, upper)

    def covers(self, other: Interval, share: float, size: float = 0.0) -> bool:
        """Whether other bounds are no wider than these widened by a share of the number; by ∞, all bounds are covered."""
        if math.isinf(share):
            return True
        return self.widened(share, size).contains(other)

    def vague(self, other: Interval, share: float, size: float = 0.0) -> bool:
        """Whether these bounds are too wide to confirm the other ones: they reach beyond them by more than a share."""
        return not Bounds(other.lower, other.upper).widened(share, size).contains(self)

    def contains(self, other: Interval) -> bool:
        """Whether other bounds lie between these."""
        return self.lower <= other.lower and other.upper <= self.upper

    def meets(self, other: Interval) -> bool:
        """Whether one number can lie between both pairs of bounds."""
        return self.lower <= other.upper and other.lower <= self.upper


def _bounds(x: Interval) -> Bounds:
    return Bounds(x.lower, x.upper)


def _least_size(x: Bounds) -> float:
    return 0.0 if x.lower <= 0.0 <= x.upper else min(abs(x.lower), abs(x.upper))


def _most_size(x: Bounds) -> float:
    return max(abs(x.lower), abs(x.upper))


def order(first: Interval, second: Interval, tolerance: float) -> Order:
    """Return how two numbers stand to each other.

    Parameters
    ----------
    first, second : Interval
    tolerance : float
        The factor of τ.
    """
    x, y = _bounds(first), _bounds(second)
    if x.infinite or y.infinite:
        return _order_at_infinity(x, y)
    if not (x.finite and y.finite):
        return Order.OPEN
    if max(x.upper - y.lower, y.upper - x.lower) <= tolerance * max(_least_size(x), _least_size(y)):
        return Order.EQUAL
    most = tolerance * max(_most_size(x), _most_size(y))
    if x.lower - y.upper > most:
        return Order.GREATER
    if y.lower - x.upper > most:
        return Order.LESS
    return Order.OPEN


def _order_at_infinity(x: Bounds, y: Bounds) -> Order:
    if x.infinite and y.infinite and x.lower == y.lower:
        return Order.EQUAL
    if x.lower > y.upper:
        return Order.GREATER
    return Order.LESS if y.lower > x.upper else Order.OPEN


def above(high: Interval, low: Interval, threshold: float, tolerance: float) -> bool | None:
    """Return whether high - low > threshold + τ, None where the bounds leave it open; ∞ - ∞ is 0.

    Parameters
    ----------
    high, low : Interval
        The larger and the smaller number.
    threshold : float
        At least 0.
    tolerance : float
        The factor of τ.
    """
    ends = [np.array([end]) for end in (high.lower, high.upper, low.lower, low.upper)]
    surely, maybe = all_above((ends[0], ends[1]), (ends[2], ends[3]), threshold, tolerance)
    return True if surely[0] else None if maybe[0] else False


def all_above(high: Ends, low: Ends, threshold: float, tolerance: float) -> tuple[Bools, Bools]:
    """Return where high - low > threshold + τ for sure, and where it may be, for arrays of lower and upper bounds."""
    ends = np.array([*high, *low])
    high_infinite, low_infinite = (np.isinf(pair[0]) & (pair[0] == pair[1]) for pair in (high, low))
    finite = np.isfinite(ends).all(axis=0)
    crosses = np.array([(pair[0] <= 0.0) & (pair[1] >= 0.0) for pair in (high, low)])
    near = np.where(crosses, 0.0, np.array([np.abs(pair).min(axis=0) for pair in (high, low)]))
    with np.errstate(invalid="ignore"):
        most, least = tolerance * np.abs(ends).max(axis=0), tolerance * near.max(axis=0)
        surely = finite & (high[0] - low[1] > threshold + most)
        never = finite & (high[1] - low[0] <= threshold + least)
    surely |= (high_infinite | low_infinite) & (high[0] > low[1])
    never |= (high_infinite | low_infinite) & (high[1] <= low[0])
    return surely, ~never


def order_all(first: tuple[Floats, Floats], second: tuple[Floats, Floats], tolerance: float) -> tuple[Bools, Bools]:
    """Return where the first number is greater than the second for sure, and where it is less, for arrays of bounds."""
    return all_above(first, second, 0.0, tolerance)[0], all_above(second, first, 0.0, tolerance)[0]


def never_above(first: Ends, second: Ends, tolerance: float) -> Bools:
    """Return where the first number is not greater than the second by more than τ, for sure, for arrays of bounds."""
    return ~all_above(first, second, 0.0, tolerance)[1]


def largest(numbers: Iterable[Interval]) -> Bounds:
    """Return bounds of the largest of some numbers."""
    pairs = [(x.lower, x.upper) for x in numbers]
    return Bounds(max(lower for lower, _ in pairs), max(upper for _, upper in pairs))


def smallest(numbers: Iterable[Interval]) -> Bounds:
    """Return bounds of the smallest of some numbers."""
    pairs = [(x.lower, x.upper) for x in numbers]
    return Bounds(min(lower for lower, _ in pairs), min(upper for _, upper in pairs))
