"""The votes of a study enter, shares with intervals, their tests and a ranking of kinds leave."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.data import Choices, Data
from ratherthan.apps.study.analysis.statistics import NotComputableError
from ratherthan.apps.study.analysis.statistics.choosing import (
    Luce,
    Share,
    VoteTest,
    equal_shares,
    luce,
    shares,
    two_kinds,
)

__all__ = ["NEITHER", "GroupResult", "Lacking", "Preferences", "attempted", "preferences"]

Floats = npt.NDArray[np.float64]
NEITHER = "neither"
T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Lacking:
    """In place of a statistic that cannot be computed: why not."""

    why: str


@dataclass(frozen=True, kw_only=True, eq=False)
class GroupResult:
    """What is known of one grouping.

    `of_votes` and `of_persons` test the two kinds of a pair, or equal shares of several kinds; "neither" counts in the shares only.
    """

    name: str
    options: tuple[str, ...]
    persons: int
    shares: list[Share] | Lacking
    of_votes: VoteTest | Lacking
    of_persons: VoteTest | Lacking

    @property
    def kinds(self) -> tuple[str, ...]:
        """What there was to choose from, without "neither"."""
        return tuple(option for option in self.options if option != NEITHER)


@dataclass(frozen=True, kw_only=True, eq=False)
class Preferences:
    """What is known of all groupings, and the ranking (`Luce.items` are indices into the kinds of the data)."""

    groups: tuple[GroupResult, ...]
    kinds: tuple[str, ...]
    ranking: Luce | Lacking


def attempted(compute: Callable[[], T]) -> T | Lacking:
    """Return what `compute` returns, or why it cannot."""
    try:
        return compute()
    except NotComputableError as error:
        return Lacking(why=error.message)


def counts_of(votes: Choices, persons: int) -> Floats:
    """Return how often each person chose each option, ``[persons, options]``."""
    counts = np.zeros((persons, len(votes.options)))
    np.add.at(counts, (votes.person, votes.choice), 1.0)
    return counts


def preferences(data: Data) -> Preferences | None:
    """Return what is known of the choices; None where there were none to make."""
    if not data.choices:
        return None
    named = [kind for votes in data.choices for kind in votes.options if kind != NEITHER]
    kinds = (*(k for k in data.kinds if k in named), *dict.fromkeys(k for k in named if k not in data.kinds))
    groups, ranked = [], []
    for votes in data.choices:
        counts = counts_of(votes, len(data.persons))
        places = [i for i, option in enumerate(votes.options) if option != NEITHER]
        own = counts[:, places]
        groups.append(_group(votes, counts, own))
        ranked.append((tuple(kinds.index(votes.options[i]) for i in places), own))
    voters = np.sum([own.sum(axis=1) for _, own in ranked], axis=0) > 0
    ranking = attempted(lambda: luce([(options, own[voters]) for options, own in ranked]))
    return Preferences(groups=tuple(groups), kinds=kinds, ranking=ranking)


def _group(votes: Choices, counts: Floats, own: Floats) -> GroupResult:
    """Return what is known of one grouping, from counts of all options and of the kinds alone."""
    of_votes: VoteTest | Lacking
    of_persons: VoteTest | Lacking
    tests = attempted(lambda: two_kinds(own) if own.shape[1] == 2 else equal_shares(own))
    if isinstance(tests, Lacking):
        of_votes = of_persons = tests
    else:
        of_votes = tests[0]
        of_persons = tests[1] or Lacking(
            why="There are too few persons, or they differ too little, to test equal shares over persons."
        )
    return GroupResult(
        name=votes.name,
        options=votes.options,
        persons=int((counts.sum(axis=1) > 0).sum()),
        shares=attempted(lambda: shares(counts)),
        of_votes=of_votes,
        of_persons=of_persons,
    )
