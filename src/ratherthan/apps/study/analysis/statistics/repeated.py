r"""A table of persons by kinds enters, the analysis of variance for repeated measures and contrasts of kinds leave.

Each person rates every kind, so what differs between persons is taken out before kinds are compared. With row means m_i, column
means m_j and the grand mean m of an n × k table Y,

.. math:: SS_k = n \sum_j (m_j - m)^2, \quad SS_e = \sum_{ij} (y_{ij} - m_i - m_j + m)^2, \quad
          F = \frac{SS_k/(k-1)}{SS_e/((n-1)(k-1))}.

F has its usual law only where all differences between two kinds vary alike (sphericity). Greenhouse and Geisser (1959) multiply
both degrees of freedom by ε̂ = tr(M)² / ((k−1) tr(M²)), M the covariance of the k columns in an orthonormal basis of contrasts; ε̂
lies between 1/(k−1) and 1. Which of these is valid is not asked of another test first: the corrected p is the one to read.

Generalised η² = SS_k / (SS_k + SS_persons + SS_e) (Olejnik and Algina 2003) can be compared across designs.

A contrast of two kinds is the t test of the differences, one for each person. Its sizes: d_z = mean / s of the differences, with an
interval through the noncentral t; d_av = mean / sqrt((s_1² + s_2²)/2), in units of how much persons vary (Cumming 2012).
Where other persons saw the other kind it is Welch's t test, and d_av, with an interval by Hedges and Olkin's (1985) approximation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.statistics import NotComputableError
from ratherthan.apps.study.analysis.statistics.corrections import interval_of

__all__ = ["Contrast", "Repeated", "paired", "repeated", "unpaired"]

Floats = npt.NDArray[np.float64]
TINY = 1e-12
"""A spread below this times the numbers themselves is rounding."""


@dataclass(frozen=True, kw_only=True)
class Repeated:
    """An analysis of variance for repeated measures."""

    f: float
    kinds: float  # degrees of freedom before the correction
    errors: float
    epsilon: float
    p: float  # with Greenhouse and Geisser's correction
    p_uncorrected: float
    eta2: float  # generalised
    eta2_interval: tuple[float, float] | None
    persons: int


@dataclass(frozen=True, kw_only=True)
class Contrast:
    """The comparison of two kinds: the first less the second."""

    difference: float
    low: float
    high: float
    t: float
    freedom: float
    p: float
    size: float  # d_av
    size_low: float | None
    size_high: float | None
    paired_size: float | None  # d_z
    persons: int
    paired: bool


def repeated(table: Floats) -> Repeated:
    """Return the analysis of variance for repeated measures.

    Parameters
    ----------
    table : array, ``[persons, kinds]``
        Without gaps.

    Raises
    ------
    NotComputableError
        If there are fewer than two persons or kinds, or what is left after taking out persons and kinds does not vary.
    """
    from scipy.stats import f as f_law

    persons, kinds = table.shape
    if kinds < 2 or persons < 2:
        raise NotComputableError(
            "An analysis of variance for repeated measures needs two or more persons who answered for every one of two or more "
            f"kinds; there are {persons} such persons and {kinds} kinds."
        )
    squares = _squares(table, np.ones((1, persons)))[0]
    between, error, _ = (float(part) for part in squares)
    scale = max(1.0, float(np.abs(table).max())) ** 2 * persons * kinds
    if error <= TINY**2 * scale:
        raise NotComputableError(
            "Every person differs between the kinds in just the same way, so nothing tells chance from effect."
        )
    freedom = float(kinds - 1), float((kinds - 1) * (persons - 1))
    f = between / freedom[0] / (error / freedom[1])
    epsilon = _epsilon(table)
    interval = interval_of(lambda weights: _generalised(_squares(table, weights)), persons)
    return Repeated(
        f=f,
        kinds=freedom[0],
        errors=freedom[1],
        epsilon=epsilon,
        p=float(f_law.sf(f, epsilon * freedom[0], epsilon * freedom[1])),
        p_uncorrected=float(f_law.sf(f, *freedom)),
        eta2=float(_generalised(squares[None])[0]),
        eta2_interval=None if interval is None else (float(interval[0]), float(interval[1])),
        persons=persons,
    )


def _squares(table: Floats, weights: Floats) -> Floats:
    """Return the sums of squares of kinds, errors and persons, ``[samples, 3]``, for each row of weights of persons."""
    persons = weights.sum(axis=1)
    centred = table - table.mean()
    rows = centred.mean(axis=1)
    columns = weights @ centred / persons[:, None]  # [samples, kinds]
    mean = columns.mean(axis=1)
    between = persons * ((columns - mean[:, None]) ** 2).sum(axis=1)
    of_persons = centred.shape[1] * np.maximum(weights @ rows**2 - persons * mean**2, 0.0)
    total = weights @ (centred**2).sum(axis=1) - persons * centred.shape[1] * mean**2
    if len(weights) == 1:  # without cancellation where it counts
        left = centred - rows[:, None] - columns[0] + mean[0]
        error = weights @ (left**2).sum(axis=1)
        of_persons = centred.shape[1] * (weights @ (rows - mean[0]) ** 2)
    else:
        error = np.maximum(total - between - of_persons, 0.0)
    return np.stack([between, error, of_persons], axis=1)


def _generalised(squares: Floats) -> Floats:
    """Return generalised η² from sums of squares of kinds, errors and persons."""
    shares: Floats = squares[:, 0] / squares.sum(axis=1)
    return shares


def _epsilon(table: Floats) -> float:
    """Return Greenhouse and Geisser's ε̂."""
    kinds = table.shape[1]
    covariance = np.cov(table - table.mean(), rowvar=False)
    centring = np.eye(kinds) - 1.0 / kinds
    double = centring @ covariance @ centring
    bottom = (kinds - 1) * float((double * double).sum())
    if bottom <= 0.0:
        return 1.0
    found = float(np.trace(double)) ** 2 / bottom
    return float(min(1.0, max(1.0 / (kinds - 1), found)))


def paired(first: Floats, second: Floats) -> Contrast:
    """Return the contrast of two kinds that the same persons answered for, person by person in the same order.

    Raises
    ------
    NotComputableError
        If there are fewer than two persons, or all differences are the same.
    """
    from scipy.stats import t as t_law

    persons = len(first)
    if persons < 2:
        raise NotComputableError(
            f"A contrast needs two or more persons who answered for both kinds; there are {persons}."
        )
    differences = first - second
    mean, spread = float(np.mean(differences)), float(np.std(differences, ddof=1))
    if spread <= TINY * max(1.0, float(np.abs(first).max()), float(np.abs(second).max())):
        raise NotComputableError(
            f"All {persons} persons have the same difference between the two kinds, so nothing tells chance from effect."
        )
    error = spread / math.sqrt(persons)
    t = mean / error
    reach = float(t_law.ppf(0.975, persons - 1)) * error
    typical = math.sqrt((float(np.var(first, ddof=1)) + float(np.var(second, ddof=1))) / 2)
    z = mean / spread
    ends = _noncentral_t(t, persons - 1)
    scale = spread / typical / math.sqrt(persons)
    return Contrast(
        difference=mean,
        low=mean - reach,
        high=mean + reach,
        t=t,
        freedom=persons - 1,
        p=float(2 * t_law.sf(abs(t), persons - 1)),
        size=mean / typical,
        size_low=None if ends is None else ends[0] * scale,
        size_high=None if ends is None else ends[1] * scale,
        paired_size=z,
        persons=persons,
        paired=True,
    )


def unpaired(first: Floats, second: Floats) -> Contrast:
    """Return the contrast of two kinds that different persons answered for, without taking the variances for equal.

    Raises
    ------
    NotComputableError
        If a kind has fewer than two persons, or neither varies.
    """
    from scipy.stats import t as t_law

    n, m = len(first), len(second)
    if min(n, m) < 2:
        raise NotComputableError(f"A contrast of two groups needs two or more persons in each; there are {n} and {m}.")
    a, b = float(np.var(first, ddof=1)) / n, float(np.var(second, ddof=1)) / m
    scale = max(1.0, float(np.abs(first).max()), float(np.abs(second).max()))
    if a + b <= (TINY * scale) ** 2:
        raise NotComputableError(
            "All answers within each of the two groups are the same, so nothing tells chance from effect."
        )
    difference = float(np.mean(first)) - float(np.mean(second))
    error = math.sqrt(a + b)
    freedom = (a + b) ** 2 / (a**2 / (n - 1) + b**2 / (m - 1))
    reach = float(t_law.ppf(0.975, freedom)) * error
    size = difference / math.sqrt((a * n + b * m) / 2)
    wide = 1.959963984540054 * math.sqrt((n + m) / (n * m) + size**2 / (2 * (n + m)))
    return Contrast(
        difference=difference,
        low=difference - reach,
        high=difference + reach,
        t=difference / error,
        freedom=freedom,
        p=float(2 * t_law.sf(abs(difference) / error, freedom)),
        size=size,
        size_low=size - wide,
        size_high=size + wide,
        paired_size=None,
        persons=n + m,
        paired=False,
    )


def _noncentral_t(t: float, freedom: int) -> tuple[float, float] | None:
    """Return the noncentralities for which t lies at the upper and lower 2.5 %; None where they cannot be found."""
    from scipy.optimize import brentq
    from scipy.special import nctdtr

    def at(probability: float) -> float:
        def gap(noncentrality: float) -> float:
            below = float(nctdtr(freedom, noncentrality, t))
            if not math.isfinite(below):  # far out the library gives no number, but the limits are known
                below = 1.0 if noncentrality < t else 0.0
            return below - probability

        reach = 1.0
        while gap(t - reach) < 0.0 or gap(t + reach) > 0.0:
            reach *= 2.0
        return float(brentq(gap, t - reach, t + reach, xtol=1e-9))

    try:
        return at(0.975), at(0.025)
    except (ValueError, RuntimeError):
        return None
