"""Choices and the critical states enter; how many decisions each choice leaves open leaves.

Definition
----------
ε(s,a) = Σ |A(u)| over u ∈ T(s,a) ∩ S_c (Chen, Boggess, Feng 2020, section III-B): the larger, the more decisions are left,
the less constrictive and the *more flexible* the choice. The search tree T(s,a) starts at the successors of (s,a) and
follows every choice of every state reached; states where the objective has ended are leaves. The search never returns to s
(a path of a search tree repeats no state): staying in place and driving back are no new options. So T(s,a) is the set of
states reachable from the successors of (s,a) in the graph without s, each counted once.

Where criticality is open the count has two bounds: open states counted, and not counted.

Method: one breadth-first search per choice; a choice costs one pass over the branches it reaches. Where many choices are asked
about on a large model, what their searches share is counted once (`counting`); the counts are the same. To count all of them
is in the worst case as hard as to say which states reach which, for which nothing much better than one search each is known:
whoever does not want to wait for it grants an `Effort`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from ratherthan.factors._kernels import tree_weight
from ratherthan.factors.compare import TOLERANCE
from ratherthan.factors.counting.effort import Counts, Effort
from ratherthan.factors.counting.ground import Ground, ground_of, known_ground, restricted
from ratherthan.factors.counting.plan import count_all, count_near
from ratherthan.factors.selectiveness import Criticality
from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.watch import look

__all__ = [
    "Constrictiveness",
    "Counts",
    "Effort",
    "Nearer",
    "Search",
    "constrictiveness",
    "count_decisions",
    "nearer_goal",
    "search_tree",
]

States = npt.NDArray[np.int64]

FEW, LITTLE = 4, 1_000_000
"""Up to how many choices, and up to how many of them times branches, each choice is searched by itself: in all questions together."""
_SEARCHED: WeakKeyDictionary[MDP, int] = WeakKeyDictionary()

ALL = Effort()
"""Count everything, however long it takes."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """Settings of the search.

    Parameters
    ----------
    horizon : int, optional
        At most so many steps after the choice itself; None is without end.
    toward_goal : bool
        Beyond the choice itself, follow only branches to strictly better values.
    """

    horizon: int | None = None
    toward_goal: bool = False


class Nearer(NamedTuple):
    """Which branches a search toward the goal follows: those with target[t] < origin[s], ``[S]`` each."""

    target: Floats
    origin: Floats


def nearer_goal(lower: Floats, upper: Floats, *, maximise: bool, tolerance: float = TOLERANCE) -> tuple[Nearer, Nearer]:
    """Return which branches lead to strictly better values for sure, and which may, from bounds of the values.

    Parameters
    ----------
    lower, upper : array of float, ``[S]``
    maximise : bool
    tolerance : float
        Values are different, not equal, beyond the factor of τ.
    """
    sure, maybe = _beyond(lower, upper, tolerance), _beyond(upper, np.maximum(lower, 0.0), tolerance)
    if maximise:  # better is larger
        return Nearer(-sure, -upper), Nearer(-maybe, -lower)
    return Nearer(upper, sure), Nearer(lower, maybe)


def _beyond(larger: Floats, size: Floats, tolerance: float) -> Floats:
    """Return what a number must be below, ``[S]``, to be different from and smaller than `larger`.

    Where both are below 0 the smaller one has the larger absolute value, and τ is a share of that: y < x - τ if and only if
    y < x / (1 - tolerance). Where x ≥ 0 it is a share of `size`, and any y < 0 differs.
    """
    with np.errstate(invalid="ignore"):
        above = larger - tolerance * np.where(np.isfinite(size), np.abs(size), 0.0)
    return np.where(larger < 0.0, larger / (1.0 - tolerance), above)


@dataclass(frozen=True, kw_only=True)
class Constrictiveness:
    """How many decisions a choice leaves open: between `lower` and `upper`, equal unless criticality is open somewhere."""

    lower: int
    upper: int

    @property
    def count(self) -> int | None:
        """The count ε where it is decided, else None."""
        return self.lower if self.lower == self.upper else None


def constrictiveness(
    mdp: MDP,
    critical: Criticality,
    ended: Bools,
    choices: Iterable[int],
    *,
    search: Search = Search(),
    nearer: tuple[Nearer, Nearer] | None = None,
) -> dict[int, Constrictiveness]:
    """Count the decisions that each of `choices` leaves open.

    Parameters
    ----------
    mdp : MDP
    critical : Criticality
        S_c of the same values, impact and α.
    ended : array of bool, ``[S]``
    choices : iterable of int
    search : Search
    nearer : pair of Nearer, optional
        Needed for ``Search(toward_goal=True)``: which branches lead to better values for sure, and which may.

    Returns
    -------
    dict of int to Constrictiveness
    """
    found = count_decisions(mdp, critical, ended, np.fromiter(choices, dtype=np.int64), search=search, nearer=nearer)
    rows = zip(found.choices.tolist(), found.lower.tolist(), found.upper.tolist(), strict=True)
    return {choice: Constrictiveness(lower=lower, upper=upper) for choice, lower, upper in rows}


def count_decisions(
    mdp: MDP,
    critical: Criticality,
    ended: Bools,
    choices: States,
    *,
    search: Search = Search(),
    nearer: tuple[Nearer, Nearer] | None = None,
    effort: Effort = ALL,
) -> Counts:
    """Count the decisions that each of many choices leaves open, with no more work than is granted.

    Parameters
    ----------
    mdp : MDP
    critical : Criticality
    ended : array of bool, ``[S]``
    choices : array of int, ``[N]``
    search : Search
    nearer : pair of Nearer, optional
        As in `constrictiveness`.
    effort : Effort
        Everything is counted by default, however long it takes.

    Returns
    -------
    Counts

    Raises
    ------
    LimitError
        If a limit of time or memory is reached.
    """
    weight = np.diff(mdp.state_to_choices).astype(np.int64)
    certain = weight * critical.certain
    possible = certain if np.array_equal(critical.certain, critical.possible) else weight * critical.possible
    weights = certain, possible
    steered = nearer if search.toward_goal and nearer is not None else None
    asked = len(choices) + (_SEARCHED.get(mdp, 0) if steered is None else 0)
    many = asked > FEW and asked * mdp.branches > LITTLE
    known = steered is None and known_ground(mdp, ended) is not None
    if not (many or known or effort != ALL):
        if steered is None:
            _SEARCHED[mdp] = asked
        return _searched(mdp, ended, choices, weights, horizon=search.horizon, steered=steered)
    if steered is None:
        return _counted(ground_of(mdp, ended), choices, weights, search, effort)
    sure, maybe = (restricted(mdp, ended, *follow) for follow in steered)
    if certain is possible and sure.same_edges(maybe):
        return _counted(sure, choices, weights, search, effort)
    half = effort if effort.visits is None else replace(effort, visits=effort.visits // 2)
    least = _counted(sure, choices, (certain, certain), search, half)
    rest = effort if effort.visits is None else replace(effort, visits=max(effort.visits - least.visits, 0))
    most = _counted(maybe, choices, (possible, possible), search, rest)
    counted = least.counted & most.counted
    return Counts(
        choices=choices,
        lower=least.lower,
        upper=most.upper,
        counted=counted,
        visits=least.visits + most.visits,
        estimate=np.where(least.counted, least.lower, least.estimate),
        error=least.error,
        estimated=(least.estimated | least.counted) & ~counted & effort.estimate,
    )


def _counted(ground: Ground, choices: States, weights: tuple[States, States], search: Search, effort: Effort) -> Counts:
    if search.horizon is None:
        return count_all(ground, choices, weights, effort)
    return count_near(ground, choices, weights, effort, search.horizon)


def _searched(
    mdp: MDP,
    ended: Bools,
    choices: States,
    weights: tuple[States, States],
    *,
    horizon: int | None,
    steered: tuple[Nearer, Nearer] | None,
) -> Counts:
    """Count by one search per choice."""
    rows = mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target
    mark, queue = np.zeros(mdp.states, dtype=np.int64), np.zeros(mdp.states, dtype=np.int64)
    everywhere = Nearer(np.zeros(0), np.zeros(0))
    sure, maybe = steered or (everywhere, everywhere)
    kernel = compiled(tree_weight, mdp.branches)
    lower, upper = np.zeros(len(choices), dtype=np.int64), np.zeros(len(choices), dtype=np.int64)
    steps = -1 if horizon is None else horizon
    stamp = 0
    for i, choice in enumerate(map(int, choices)):
        look()
        branches, found = mdp.branches_of(choice), []
        own = branches.start, branches.stop
        for follow in (sure,) if sure is maybe else (sure, maybe):
            stamp += 1
            room = mark, queue, stamp
            found.append(kernel(mdp.state_of(choice), own, rows, ended, *weights, room, steps, *follow))
        lower[i], upper[i] = found[0].certain, found[-1].possible
    nothing = np.zeros(len(choices))
    return Counts(
        choices=choices,
        lower=lower,
        upper=upper,
        counted=np.ones(len(choices), dtype=np.bool_),
        visits=0,
        estimate=nothing,
        error=nothing,
        estimated=np.zeros(len(choices), dtype=np.bool_),
    )


def search_tree(
    mdp: MDP,
    ended: Bools,
    choice: int,
    *,
    search: Search = Search(),
    nearer: Nearer | None = None,
) -> States:
    """Return the states of T(s,a) in breadth-first order, each once.

    Parameters and notes as in `constrictiveness`.
    """
    root = mdp.state_of(choice)
    seen = np.zeros(mdp.states, dtype=bool)
    seen[root] = True
    frontier = _fresh(mdp.branch_to_target[mdp.branches_of(choice)].astype(np.int64), seen)
    layers = [frontier]
    steps = 0
    while len(frontier) and (search.horizon is None or steps < search.horizon):
        origin, target = _branches_from(mdp, frontier[~ended[frontier]])
        if search.toward_goal and nearer is not None:
            target = target[nearer.target[target] < nearer.origin[origin]]
        frontier = _fresh(target, seen)
        layers.append(frontier)
        steps += 1
    return np.concatenate(layers)


def _fresh(targets: States, seen: Bools) -> States:
    """Return the targets not seen yet, in the order of their first appearance, and mark them seen."""
    targets = targets[~seen[targets]]
    _, first = np.unique(targets, return_index=True)
    fresh = targets[np.sort(first)]
    seen[fresh] = True
    return fresh


def _branches_from(mdp: MDP, states: States) -> tuple[States, States]:
    """Return origin and target of every branch of every choice of `states`."""
    first = mdp.choice_to_branches[mdp.state_to_choices[states]].astype(np.int64)
    last = mdp.choice_to_branches[mdp.state_to_choices[states + 1]].astype(np.int64)
    counts = last - first
    total = int(counts.sum())
    offsets = (
        np.repeat(first - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts) if total else np.zeros(0, np.int64)
    )
    branches = offsets + np.arange(total)
    return np.repeat(states, counts), mdp.branch_to_target[branches].astype(np.int64)
