r"""How often each person chose what enters, shares with intervals, tests of them and a ranking leave.

A person who chooses several times is counted as one person: intervals come from resampling persons, and tests compare persons.
Tests of votes, which take every vote for a person of its own, stand beside them because others publish these.

*Two kinds.* Of votes: the exact binomial test among those for one of the two. Of persons: the exact sign test among persons who
chose one more often than the other.

*Several.* Of votes: χ² of equal shares. Of persons: Hotelling's T² of each person's shares about equal ones.

*The ranking* is Luce's (1959) choice model, in which kind i is chosen from a set A with probability
:math:`w_i / \sum_{j \in A} w_j`; for pairs it is that of Bradley and Terry (1952). "Neither" says nothing on which of two is better,
so such votes are left out. Worths are found by Newton's method on θ = log w, to a change below 1e-10, and are scaled to sum to 1. They
exist if and only if no set of kinds is always chosen over all others (Ford 1957); otherwise half a vote is added to every kind in
every grouping, and that is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.statistics import NotComputableError
from ratherthan.apps.study.analysis.statistics.corrections import LEAST, MOST, interval_of, resampled

__all__ = ["Luce", "Share", "VoteTest", "equal_shares", "exact_interval", "luce", "shares", "two_kinds"]

Floats = npt.NDArray[np.float64]
FARTHEST = 12.0
"""A logarithm of worth beyond this has no bound that data tell."""


@dataclass(frozen=True, kw_only=True)
class Share:
    """The share of one choice."""

    votes: int
    share: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class VoteTest:
    """A test of votes or of persons."""

    statistic: float
    p: float
    count: int
    freedom: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Luce:
    """Worths of kinds, which sum to 1, with intervals and the ranks that are possible (from, to)."""

    items: tuple[int, ...]
    worth: tuple[float, ...]
    low: tuple[float | None, ...]
    high: tuple[float | None, ...]
    rank_low: tuple[int | None, ...]
    rank_high: tuple[int | None, ...]
    added: bool


def exact_interval(votes: int, of: int) -> tuple[float, float]:
    """Return Clopper and Pearson's 95 % interval of a share."""
    from scipy.stats import beta

    low = float(beta.ppf(0.025, votes, of - votes + 1)) if votes > 0 else 0.0
    high = float(beta.ppf(0.975, votes + 1, of - votes)) if votes < of else 1.0
    return low, high


def shares(counts: Floats) -> list[Share]:
    """Return the share of each option.

    Parameters
    ----------
    counts : array, ``[persons, options]``
        How often each person chose each.

    Raises
    ------
    NotComputableError
        If nobody chose.
    """
    counts = counts[counts.sum(axis=1) > 0]
    total, persons = counts.sum(), len(counts)
    if total == 0:
        raise NotComputableError("Nobody chose, so there are no shares.")
    votes = counts.sum(axis=0)
    sampled = interval_of(lambda weights: _normed(weights @ counts), persons)
    result = []
    for option, own in enumerate(votes):
        low, high = (0.0, 0.0) if sampled is None else (float(sampled[0][option]), float(sampled[1][option]))
        if high - low < 1e-9:  # too few persons, or all alike: as if each had chosen once
            low, high = exact_interval(round(persons * float(own / total)), persons)
        result.append(Share(votes=int(own), share=float(own / total), low=low, high=high))
    return result


def _normed(table: Floats) -> Floats:
    shares: Floats = table / table.sum(axis=-1, keepdims=True)
    return shares


def two_kinds(counts: Floats) -> tuple[VoteTest, VoteTest]:
    """Return the exact tests of two options: of votes, and of persons.

    Parameters
    ----------
    counts : array, ``[persons, 2]``

    Raises
    ------
    NotComputableError
        If nobody chose one of the two.
    """
    from scipy.stats import binomtest

    first, second = (int(total) for total in counts.sum(axis=0))
    if first + second == 0:
        raise NotComputableError("Nobody chose one of the two.")
    votes = VoteTest(statistic=first, p=float(binomtest(first, first + second).pvalue), count=first + second)
    ahead = np.sign(counts[:, 0] - counts[:, 1])
    more, less = int((ahead > 0).sum()), int((ahead < 0).sum())
    p = float(binomtest(more, more + less).pvalue) if more + less else 1.0
    return votes, VoteTest(statistic=more, p=p, count=more + less)


def equal_shares(counts: Floats) -> tuple[VoteTest, VoteTest | None]:
    """Return the tests of equal shares of several options: χ² of votes, and Hotelling's T² of persons (as F).

    The second is None where there are no more persons than options, or persons differ too little for it.

    Raises
    ------
    NotComputableError
        If nobody chose.
    """
    from scipy.stats import chi2, f

    counts = counts[counts.sum(axis=1) > 0]
    persons, options = counts.shape
    votes = counts.sum(axis=0)
    total = float(votes.sum())
    if total == 0 or options < 2:
        raise NotComputableError("Nobody chose between two or more options.")
    statistic = float(((votes - total / options) ** 2).sum() / (total / options))
    of_votes = VoteTest(
        statistic=statistic, p=float(chi2.sf(statistic, options - 1)), count=int(total), freedom=(options - 1,)
    )
    if persons <= options:
        return of_votes, None
    apart = _normed(counts)[:, :-1] - 1 / options
    covariance = np.atleast_2d(np.cov(apart, rowvar=False))
    if np.linalg.matrix_rank(covariance, tol=1e-12) < options - 1:
        return of_votes, None
    mean = apart.mean(axis=0)
    square = persons * float(mean @ np.linalg.solve(covariance, mean))
    freedom = options - 1, persons - options + 1
    ratio = square * freedom[1] / ((persons - 1) * freedom[0])
    return of_votes, VoteTest(statistic=ratio, p=float(f.sf(ratio, *freedom)), count=persons, freedom=freedom)


def luce(groupings: Sequence[tuple[Sequence[int], Floats]]) -> Luce:
    """Return the worths of kinds by Luce's choice model.

    Parameters
    ----------
    groupings : sequence of (items, counts)
        Which items were to choose from, and how often each person chose each, ``[persons, options]``; the persons are the same in
        all groupings.

    Raises
    ------
    NotComputableError
        If nobody chose, or some kinds were never compared with the others, not even through a third.
    """
    asked = [(list(options), counts) for options, counts in groupings if float(counts.sum()) > 0]
    if not asked:
        raise NotComputableError("Nobody chose one of the kinds, so they cannot be ranked.")
    kept = sorted({item for options, _ in asked for item in options})
    if len(kept) < 2 or not _connected(asked, kept, both=False):
        raise NotComputableError(
            "A ranking needs kinds that were compared with each other, at least through a third; here some never were."
        )
    place = {item: i for i, item in enumerate(kept)}
    sets = [[place[item] for item in options] for options, _ in asked]
    added = not _connected(asked, kept, both=True)
    more = 0.5 if added else 0.0
    theta = _newton(sets, [counts.sum(axis=0)[None] + more for _, counts in asked], len(kept))[0]
    persons = len(asked[0][1])
    low: list[float | None] = [None] * len(kept)
    high: list[float | None] = [None] * len(kept)
    first: list[int | None] = [None] * len(kept)
    last: list[int | None] = [None] * len(kept)
    if LEAST <= persons <= MOST:
        weights = resampled(persons, 1000)
        drawn = _newton(sets, [weights @ counts + more for _, counts in asked], len(kept))
        ends = np.quantile(drawn, [0.025, 0.975], axis=0)
        worths = np.quantile(_worth(drawn), [0.025, 0.975], axis=0)
        ranks = np.quantile((-drawn).argsort(axis=1).argsort(axis=1) + 1, [0.025, 0.975], axis=0)
        bounded = np.abs(ends).max(axis=0) < FARTHEST
        low = [float(x) if ok else None for x, ok in zip(worths[0], bounded, strict=True)]
        high = [float(x) if ok else None for x, ok in zip(worths[1], bounded, strict=True)]
        first, last = [int(x) for x in np.floor(ranks[0])], [int(x) for x in np.ceil(ranks[1])]
    return Luce(
        items=tuple(kept),
        worth=tuple(float(x) for x in _worth(theta[None])[0]),
        low=tuple(low),
        high=tuple(high),
        rank_low=tuple(first),
        rank_high=tuple(last),
        added=added,
    )


def _worth(theta: Floats) -> Floats:
    """Return worths that sum to 1 from their logarithms, ``[samples, kinds]``."""
    risen = np.exp(theta - theta.max(axis=1, keepdims=True))
    worths: Floats = risen / risen.sum(axis=1, keepdims=True)
    return worths


def _connected(asked: Sequence[tuple[list[int], Floats]], kept: list[int], *, both: bool) -> bool:
    """Whether every kind can be reached from every other by comparisons; with `both`, by comparisons that were won."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    place = {item: i for i, item in enumerate(kept)}
    links = np.zeros((len(kept), len(kept)))
    for options, counts in asked:
        won = counts.sum(axis=0) > 0
        for a, is_won in zip(options, won, strict=True):
            for b in options:
                if a != b and (is_won or not both):
                    links[place[a], place[b]] = 1.0
    parts, _ = connected_components(csr_matrix(links), directed=True, connection="strong" if both else "weak")
    return bool(parts == 1)


def _newton(sets: list[list[int]], counts: list[Floats], items: int) -> Floats:
    """Return log worths with mean 0, ``[samples, items]``, for counts ``[samples, options]`` of each set."""
    samples = len(counts[0])
    theta = np.zeros((samples, items))
    for _ in range(200):
        slope = np.zeros((samples, items))
        bend = np.full((samples, items, items), 1.0)  # fixes the mean; the rest is added
        for options, votes in zip(sets, counts, strict=True):
            chance = _worth(theta[:, options])
            total = votes.sum(axis=1)
            slope[:, options] += votes - total[:, None] * chance
            for i, a in enumerate(options):
                bend[:, a, a] += total * chance[:, i]
                for j, b in enumerate(options):
                    bend[:, a, b] -= total * chance[:, i] * chance[:, j]
        bend[:, np.arange(items), np.arange(items)] += 1e-9
        step = np.linalg.solve(bend, slope[:, :, None])[:, :, 0]
        step *= np.minimum(1.0, 1.0 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        theta = np.clip(theta + step, -2 * FARTHEST, 2 * FARTHEST)
        if float(np.abs(step).max()) < 1e-10:
            break
    result: Floats = theta - theta.mean(axis=1, keepdims=True)
    return result
