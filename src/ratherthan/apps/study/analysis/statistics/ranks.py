r"""Numbers enter of which only the order counts, tests of it and their sizes leave.

Friedman's test ranks the k kinds within each person (ties share the mean rank) and asks whether the sums of ranks differ:

.. math:: Q = \frac{(k-1) \sum_j (R_j - n(k+1)/2)^2}{\sum_{ij} r_{ij}^2 - n k (k+1)^2/4},

which follows χ²(k−1) where no kind is preferred; Kendall's W = Q / (n (k−1)) says from 0 to 1 how far persons agree. Kruskal and
Wallis rank all persons at once, where each answered for one kind; ε² = H / (N−1) is its size. A contrast is Wilcoxon's test of signed
ranks where the same persons answered (zero differences are left out) or Mann and Whitney's; its size r is the share of favourable
less that of unfavourable pairs or ranks, from −1 to 1.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.statistics import NotComputableError

__all__ = ["RankTest", "RankedPair", "friedman", "kruskal", "mann_whitney", "wilcoxon"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class RankTest:
    """A test of ranks over several kinds."""

    statistic: float
    freedom: int
    p: float
    size: float  # Kendall's W, or ε²
    persons: int
    ranks: tuple[float, ...]  # the mean rank of each kind


@dataclass(frozen=True, kw_only=True)
class RankedPair:
    """A test of ranks for two kinds."""

    statistic: float
    p: float
    size: float  # rank-biserial
    persons: int
    exact: bool


def friedman(table: Floats) -> RankTest:
    """Return Friedman's test and Kendall's W of a table of persons by kinds.

    Raises
    ------
    NotComputableError
        If there are fewer than two persons or kinds, or every person rates all kinds alike.
    """
    from scipy.stats import chi2, rankdata

    persons, kinds = table.shape
    if persons < 2 or kinds < 2:
        raise NotComputableError(
            f"Friedman's test needs two or more persons who answered for two or more kinds; there are {persons} and {kinds}."
        )
    ranks = rankdata(table, axis=1)
    sums = ranks.sum(axis=0)
    bottom = float((ranks**2).sum()) - persons * kinds * (kinds + 1) ** 2 / 4
    if bottom <= 0.0:
        raise NotComputableError("Every person rates all kinds alike, so there is no order to test.")
    statistic = (kinds - 1) * float(((sums - persons * (kinds + 1) / 2) ** 2).sum()) / bottom
    return RankTest(
        statistic=statistic,
        freedom=kinds - 1,
        p=float(chi2.sf(statistic, kinds - 1)),
        size=statistic / (persons * (kinds - 1)),
        persons=persons,
        ranks=tuple(float(total) / persons for total in sums),
    )


def kruskal(groups: Sequence[Floats]) -> RankTest:
    """Return Kruskal and Wallis's test of groups of persons.

    Raises
    ------
    NotComputableError
        If there are fewer than two groups with answers, or all answers are the same.
    """
    from scipy.stats import chi2, rankdata

    if len(groups) < 2 or any(len(group) == 0 for group in groups):
        raise NotComputableError("A test of ranks compares two or more groups with answers.")
    pooled = np.concatenate(groups)
    count = len(pooled)
    ranks = rankdata(pooled)
    ends = np.cumsum([len(group) for group in groups])
    parts = np.split(ranks, ends[:-1])
    spread = float(((ranks - (count + 1) / 2) ** 2).sum())
    if spread <= 0.0:
        raise NotComputableError("All answers are the same, so there is no order to test.")
    between = sum(len(part) * (float(part.mean()) - (count + 1) / 2) ** 2 for part in parts)
    statistic = (count - 1) * between / spread
    return RankTest(
        statistic=statistic,
        freedom=len(groups) - 1,
        p=float(chi2.sf(statistic, len(groups) - 1)),
        size=statistic / (count - 1),
        persons=count,
        ranks=tuple(float(part.mean()) for part in parts),
    )


def wilcoxon(first: Floats, second: Floats) -> RankedPair:
    """Return Wilcoxon's test of signed ranks of two kinds that the same persons answered for.

    Raises
    ------
    NotComputableError
        If no person rates the two differently.
    """
    from scipy.stats import rankdata
    from scipy.stats import wilcoxon as library

    differences = first - second
    left = differences[np.abs(differences) > 1e-12]
    if len(left) == 0:
        raise NotComputableError("No person rates the two kinds differently, so there is no order to test.")
    ranks = rankdata(np.abs(left))
    above = float(ranks[left > 0].sum())
    whole = float(ranks.sum())
    exact = len(left) <= 50 and len(np.unique(np.abs(left))) == len(left)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # the law for few persons is asked for only where it is exact
        p = float(library(left, method="exact" if exact else "approx").pvalue)
    return RankedPair(statistic=above, p=p, size=(2 * above - whole) / whole, persons=len(left), exact=exact)


def mann_whitney(first: Floats, second: Floats) -> RankedPair:
    """Return Mann and Whitney's test of two groups of persons.

    Raises
    ------
    NotComputableError
        If a group is empty or all answers are the same.
    """
    from scipy.stats import mannwhitneyu

    if len(first) == 0 or len(second) == 0:
        raise NotComputableError("A test of ranks of two groups needs answers in both.")
    pooled = np.concatenate([first, second])
    if float(np.ptp(pooled)) == 0.0:
        raise NotComputableError("All answers are the same, so there is no order to test.")
    exact = max(len(first), len(second)) <= 8 and len(np.unique(pooled)) == len(pooled)
    found = mannwhitneyu(first, second, method="exact" if exact else "asymptotic")
    u = float(found.statistic)
    pairs = len(first) * len(second)
    return RankedPair(
        statistic=u, p=min(1.0, float(found.pvalue)), size=2 * u / pairs - 1, persons=len(pooled), exact=exact
    )
