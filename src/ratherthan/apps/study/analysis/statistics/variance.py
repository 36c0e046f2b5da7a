r"""Groups of numbers enter, the one-way analysis of variance leaves, with its sizes and comparisons of all pairs.

The total sum of squares of N numbers in k groups splits into one between and one within groups, and

.. math:: F = \frac{SS_b / (k-1)}{SS_w / (N-k)}

follows F(k−1, N−k) where all numbers are independent, normal, of equal variance, and the means are equal. *Independent* is
what a study with several answers of each person does not have: `repeated` is for those.

The sums are taken of the differences from the first number, with `math.fsum`: subtracting numbers that share their leading
digits is exact (Sterbenz 1974), so nothing is lost to a large common offset.

Sizes: η² = SS_b / SS_t is the share of the variance in the sample; ω² = (SS_b − (k−1) MS_w) / (SS_t + MS_w) corrects it for
chance, and is cut at 0. Their interval is of what both estimate, the share in the population λ / (λ + N), where λ is the
noncentrality of F: the values of λ for which the F found lies at the upper or lower 2.5 % (Steiger 2004).

Tukey's comparisons (Kramer's form for unequal groups) refer |m_i − m_j| / sqrt(MS_w (1/n_i + 1/n_j) / 2) to the studentised range.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.statistics import NotComputableError

__all__ = ["OneWay", "Pair", "Welch", "noncentral_share", "one_way", "tukey", "welch"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class OneWay:
    """A one-way analysis of variance."""

    f: float
    between: int  # degrees of freedom
    within: int
    p: float
    squares_between: float
    squares_within: float
    eta2: float
    omega2: float
    share: tuple[float, float] | None  # 95 % interval of the share in the population
    means: tuple[float, ...]
    counts: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Tukey's comparison of two groups: the first less the second."""

    first: int
    second: int
    difference: float
    low: float
    high: float
    p: float


@dataclass(frozen=True, kw_only=True)
class Welch:
    """Welch's test, which does not take the variances for equal."""

    f: float
    between: float
    within: float
    p: float


def one_way(groups: Sequence[Floats]) -> OneWay:
    """Return the one-way analysis of variance.

    Parameters
    ----------
    groups : sequence of array, each ``[n_i]``
        Groups without a number are passed over in the sums, but must not be there: leave them out.

    Raises
    ------
    NotComputableError
        If there are fewer than two groups, no more numbers than groups, or no variance within any group.
    """
    from scipy.stats import f as f_law

    count = len(groups)
    numbers = sum(len(group) for group in groups)
    if count < 2 or any(len(group) == 0 for group in groups):
        raise NotComputableError(
            f"An analysis of variance compares two or more groups with answers; there are {count_of(groups)}."
        )
    if numbers <= count:
        raise NotComputableError(
            f"An analysis of variance needs more answers than groups; there are {numbers} answers in {count} groups."
        )
    origin = float(groups[0][0])
    shifted = [group - origin for group in groups]
    sums = [math.fsum(group) for group in shifted]
    mean = math.fsum(sums) / numbers
    means = [total / len(group) for total, group in zip(sums, shifted, strict=True)]
    between = math.fsum(len(group) * (m - mean) ** 2 for m, group in zip(means, shifted, strict=True))
    within = math.fsum(math.fsum((group - m) ** 2) for m, group in zip(means, shifted, strict=True))
    widest = max(float(np.abs(group).max()) for group in shifted)
    if within <= 1e-24 * numbers * widest**2:
        raise NotComputableError("All answers within each group are the same, so nothing tells chance from effect.")
    square = within / (numbers - count)
    f = between / (count - 1) / square
    return OneWay(
        f=f,
        between=count - 1,
        within=numbers - count,
        p=float(f_law.sf(f, count - 1, numbers - count)),
        squares_between=between,
        squares_within=within,
        eta2=between / (between + within),
        omega2=max(0.0, (between - (count - 1) * square) / (between + within + square)),
        share=noncentral_share(f, count - 1, numbers - count),
        means=tuple(origin + m for m in means),
        counts=tuple(len(group) for group in groups),
    )


def count_of(groups: Sequence[Floats]) -> int:
    """Return how many groups have a number in them."""
    return sum(len(group) > 0 for group in groups)


def noncentral_share(f: float, between: int, within: int, level: float = 0.95) -> tuple[float, float] | None:
    """Return the interval of the share of variance in the population, λ / (λ + N) with N = `between` + `within` + 1.

    None where it cannot be found in double precision.
    """
    from scipy.optimize import brentq
    from scipy.special import ncfdtr

    if not math.isfinite(f):
        return None

    def at(probability: float) -> float:
        def gap(noncentrality: float) -> float:
            return float(ncfdtr(between, within, noncentrality, f)) - probability

        if gap(0.0) <= 0.0:
            return 0.0
        high = max(1.0, 2.0 * f * between)
        while gap(high) > 0.0 and high < 1e9:
            high *= 2.0
        return float(brentq(gap, 0.0, high, xtol=1e-9, rtol=1e-12))

    numbers = between + within + 1
    try:
        low, high = at((1 + level) / 2), at((1 - level) / 2)
    except (ValueError, RuntimeError):
        return None
    if not (math.isfinite(low) and math.isfinite(high)):
        return None
    return low / (low + numbers), high / (high + numbers)


def tukey(groups: Sequence[Floats]) -> list[Pair]:
    """Return Tukey's honest comparisons of all pairs, with 95 % intervals that hold together.

    Raises
    ------
    NotComputableError
        Where `one_way` does.
    """
    from scipy.stats import studentized_range

    whole = one_way(groups)
    square = whole.squares_within / whole.within
    count = len(groups)
    reach = _reach(count, whole.within)
    pairs = []
    for i in range(count):
        for j in range(i + 1, count):
            difference = whole.means[i] - whole.means[j]
            error = math.sqrt(square / 2 * (1 / whole.counts[i] + 1 / whole.counts[j]))
            p = float(studentized_range.sf(abs(difference) / error, count, whole.within))
            pairs.append(
                Pair(
                    first=i,
                    second=j,
                    difference=difference,
                    low=difference - reach * error,
                    high=difference + reach * error,
                    p=min(max(p, 0.0), 1.0),
                )
            )
    return pairs


@functools.cache
def _reach(groups: int, within: int) -> float:
    """Return the 95 % point of the studentised range, which takes a second to find."""
    from scipy.stats import studentized_range

    return float(studentized_range.ppf(0.95, groups, within))


def welch(groups: Sequence[Floats]) -> Welch:
    """Return Welch's (1951) test of equal means.

    Raises
    ------
    NotComputableError
        If a group has fewer than two numbers or no variance.
    """
    from scipy.stats import f as f_law

    count = len(groups)
    if count < 2 or any(len(group) < 2 for group in groups):
        raise NotComputableError("Welch's test needs two or more groups with two or more answers each.")
    origin = float(groups[0][0])
    shifted = [group - origin for group in groups]
    spreads = [float(np.var(group, ddof=1)) for group in shifted]
    if min(spreads) <= 1e-24 * max(abs(origin), 1.0) ** 2:
        raise NotComputableError("Welch's test needs answers that differ in every group; in one they are all the same.")
    weights = np.array([len(group) / spread for group, spread in zip(shifted, spreads, strict=True)])
    means = np.array([float(np.mean(group)) for group in shifted])
    total = float(weights.sum())
    mean = float(weights @ means) / total
    lost = math.fsum((1 - w / total) ** 2 / (len(g) - 1) for w, g in zip(weights, shifted, strict=True))
    above = float(weights @ (means - mean) ** 2) / (count - 1)
    f = above / (1 + 2 * (count - 2) / (count**2 - 1) * lost)
    within = (count**2 - 1) / (3 * lost)
    return Welch(f=f, between=count - 1, within=within, p=float(f_law.sf(f, count - 1, within)))
