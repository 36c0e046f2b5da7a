"""Two numbers with sound bounds enter; equal, different or open leaves.

Definition
----------
x and y are compared with the tolerance τ = 1e-6 · max(|x|, |y|) (the factor is a setting). They are *equal* if their
bounds put |x - y| ≤ τ, *different* if the bounds put it above τ, else *open*: then no claim is made. Since τ depends on x
and y themselves, "equal" takes the smallest τ the bounds allow, and "different" the largest. ∞ equals ∞ and differs from
every number that is certainly finite.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from ratherthan.model.mdp import Bools, Floats

__all__ = ["TOLERANCE", "Comparison", "Interval", "compare", "exceeds"]

TOLERANCE = 1e-6


class Comparison(Enum):
    """What the bounds of two numbers decide."""

    EQUAL = "equal"
    GREATER = "greater"
    LESS = "less"
    OPEN = "open"


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A number between two bounds: lower ≤ value ≤ upper; ±∞ allowed, both bounds equal where it is exact."""

    value: float
    lower: float
    upper: float

    @property
    def infinite(self) -> bool:
        """Whether the number is certainly ∞ or -∞."""
        return self.lower == self.upper and bool(np.isinf(self.lower))

    @property
    def finite(self) -> bool:
        """Whether the number is certainly finite."""
        return bool(np.isfinite(self.lower) and np.isfinite(self.upper))


def compare(x: Interval, y: Interval, tolerance: float = TOLERANCE) -> Comparison:
    """Compare two numbers by their bounds.

    Parameters
    ----------
    x, y : Interval
    tolerance : float
        The factor of τ.

    Returns
    -------
    Comparison
        ``GREATER`` means x is different from and greater than y.

    Examples
    --------
    >>> seven, eight = Interval(value=7, lower=7, upper=7), Interval(value=8, lower=7.9, upper=8.1)
    >>> compare(seven, eight)
    <Comparison.LESS: 'less'>
    """
    if x.infinite and y.infinite and x.lower == y.lower:
        return Comparison.EQUAL
    widest = _span(x.upper, y.lower), _span(y.upper, x.lower)
    least = tolerance * max(_nearest_to_zero(x), _nearest_to_zero(y))
    if max(widest) <= least and x.finite and y.finite:
        return Comparison.EQUAL
    most = tolerance * max(abs(x.lower), abs(x.upper), abs(y.lower), abs(y.upper))
    most = 0.0 if np.isinf(most) else most
    if _span(x.lower, y.upper) > most and (x.infinite or y.infinite or (x.finite and y.finite)):
        return Comparison.GREATER
    if _span(y.lower, x.upper) > most and (x.infinite or y.infinite or (x.finite and y.finite)):
        return Comparison.LESS
    return Comparison.OPEN


def _span(high: float, low: float) -> float:
    return 0.0 if high == low else high - low


def _nearest_to_zero(x: Interval) -> float:
    return 0.0 if x.lower <= 0.0 <= x.upper else min(abs(x.lower), abs(x.upper))


def exceeds(
    high: tuple[Floats, Floats], low: tuple[Floats, Floats], threshold: float, tolerance: float = TOLERANCE
) -> tuple[Bools, Bools]:
    """Decide where high - low > threshold + τ, for arrays of bounds.

    Parameters
    ----------
    high, low : pair of arrays
        Lower and upper bounds of the larger and of the smaller number.
    threshold : float
        At least 0, in the objective's unit.

    Returns
    -------
    certain, possible : array of bool
        Where it certainly holds, and where it may; where they differ it is open.

    Notes
    -----
    ∞ - ∞ = 0: where both numbers are certainly the same infinity it does not hold.
    """
    (high_lower, high_upper), (low_lower, low_upper) = high, low
    same = np.isinf(high_lower) & (high_lower == low_upper) & (high_lower == high_upper) & (low_lower == low_upper)
    with np.errstate(invalid="ignore"):
        least = np.where(high_lower == low_upper, 0.0, high_lower - low_upper)
        most = np.where(high_upper == low_lower, 0.0, high_upper - low_lower)
    largest = np.maximum.reduce([np.abs(high_lower), np.abs(high_upper), np.abs(low_lower), np.abs(low_upper)])
    smallest = np.maximum(_array_nearest(high_lower, high_upper), _array_nearest(low_lower, low_upper))
    tau_most = tolerance * np.where(np.isinf(largest), 0.0, largest)
    tau_least = tolerance * np.where(np.isinf(smallest), 0.0, smallest)
    exact_infinity = (np.isinf(high_lower) & (high_lower == high_upper)) | (
        np.isinf(low_upper) & (low_lower == low_upper)
    )
    bounded = np.isfinite(high_lower) & np.isfinite(high_upper) & np.isfinite(low_lower) & np.isfinite(low_upper)
    certain = (least > threshold + tau_most) & (exact_infinity | bounded) & ~same
    possible = (most > threshold + tau_least) & ~same
    return certain, possible


def _array_nearest(lower: Floats, upper: Floats) -> Floats:
    return np.where((lower <= 0.0) & (upper >= 0.0), 0.0, np.minimum(np.abs(lower), np.abs(upper)))
