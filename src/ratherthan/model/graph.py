"""The Index of a graph and sets of states enter; sets of states, levels and components leave. No probability is looked at.

Which states reach a goal for sure, possibly or never depends on the graph alone: a branch is there or not. With G the
goal, I the states through which a run may pass (neither goal nor hazard), and a choice *leading to* a set when one of its
branches does:

* ``can_reach``: Pmax > 0. Least set with G ⊆ R, and s ∈ R for s ∈ I with a choice leading to R.
* ``surely_reach``: Pmax = 1 (prob1E). Greatest X such that every state of X reaches G by choices with all branches in
  X ∪ G: νX. μR. G ∪ {s ∈ I : some choice stays in X ∪ G and leads to R} (de Alfaro 1997, algorithm for one player).
* ``can_avoid``: Pmin = 0 (prob0E). Complement of the least set A ⊇ G with s ∈ A for s ∈ I where *all* choices lead to A.
* ``cannot_miss``: Pmin = 1 (prob1A). Complement of the states from which ``can_avoid`` can be reached before G: where the
  goal can be missed with positive probability, it is missed by going to a set where it can be avoided for ever.

An *end component* is a set of states with choices that never leave it and connect it strongly: what a policy can stay in
for ever (de Alfaro 1997). The maximal ones are disjoint. They are found by taking strong components and dropping
choices that leave theirs, again and again, each time only in the components that lost something; that takes time in proportion to the
branches of what is split, so that only components which lose a little many times over cost more than one search.

References
----------
L. de Alfaro, Formal Verification of Probabilistic Systems, PhD thesis, Stanford, 1997.
C. Baier, J.-P. Katoen, Principles of Model Checking, MIT Press, 2008, chapter 10.
R. Tarjan, Depth-First Search and Linear Graph Algorithms, SIAM J. Comput. 1(2), 1972.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled, end_components_of, spread_all, spread_any
from ratherthan.model.index import Index, branches_of
from ratherthan.model.mdp import Bools, Ints

__all__ = [
    "Sure",
    "all_branches_in",
    "any_branch_in",
    "any_branch_in_rows",
    "can_avoid",
    "can_reach",
    "cannot_miss",
    "end_components",
    "first_downhill",
    "first_listed",
    "levels_to",
    "reached_from",
    "surely_reach",
    "surely_reaching",
    "way_back",
]

Levels = npt.NDArray[np.int64]

FEW = 8
"""Of so many states, one is few: what enters few states is gathered, what enters many is marked."""


class Sure(NamedTuple):
    """From where a goal can be reached with probability 1, and what is found on the way to that."""

    states: Bools  # [S], Pmax = 1
    possible: Bools  # [S], Pmax > 0
    usable: Bools  # [C], the permitted choices of `states` that are no goals, with which a run stays among `states`
    level: Ints  # [S], how many steps the goal is away along such choices; below 0 outside `states`
    order: Ints  # `states`, the nearest first


def any_branch_in(index: Index, states: Bools) -> Bools:
    """Return ``[C]``: whether a choice has a branch to one of `states`."""
    return any_branch_in_rows(index, states[index.branch_to_target])


def all_branches_in(index: Index, states: Bools) -> Bools:
    """Return ``[C]``: whether all branches of a choice go to `states`."""
    return ~any_branch_in_rows(index, ~states[index.branch_to_target])


def any_branch_in_rows(index: Index, marked: Bools) -> Bools:
    """Return ``[C]``: whether a choice has a branch that is marked, ``[B]``."""
    found = np.zeros(index.choices, dtype=np.bool_)
    found[index.branch_to_choice[marked]] = True
    return found


def first_listed(index: Index, choices: Bools) -> npt.NDArray[np.int64]:
    """Return ``[S]``: the first of `choices` that each state has, -1 where it has none."""
    first = np.full(index.states, -1, dtype=np.int64)
    listed = np.flatnonzero(choices)[::-1]
    first[index.choice_to_state[listed]] = listed  # the last assignment, that of the first listed choice, stands
    return first


def first_downhill(index: Index, level: Levels, allowed: Bools) -> Levels:
    """Return ``[S]``: the first listed of the `allowed` choices with a branch to a lower level, -1 where none has."""
    origin = level[index.choice_to_state[index.branch_to_choice]]
    target = level[index.branch_to_target]
    return first_listed(index, allowed & any_branch_in_rows(index, (target >= 0) & (target < origin)))


def levels_to(index: Index, targets: Bools, inside: Bools, allowed: Bools | None = None) -> Levels:
    """Return how many steps each state is from `targets` along branches of positive probability.

    Parameters
    ----------
    index : Index
    targets, inside : array of bool, ``[S]``
        Where to, and through which other states.
    allowed : array of bool, ``[C]``, optional
        The choices that may be used; all by default.

    Returns
    -------
    array of int64, ``[S]``
        0 at targets, -1 where none can be reached.
    """
    usable = np.ones(index.choices, dtype=np.bool_) if allowed is None else allowed
    level = _spread(index, (targets, np.flatnonzero(targets)), inside, usable)[0]
    return np.maximum(level, -1).astype(np.int64)


def _spread(
    index: Index, targets: tuple[Bools, npt.NDArray[np.int64]], inside: Bools, usable: Bools
) -> tuple[Ints, Ints]:
    """Return the level of every state, below 0 where it is not reached, and the states met, the nearest first.

    `targets` has level 0, all of it; and those of it, by number, from which the search begins.
    """
    width, (marked, start) = index.entering.dtype, targets
    level: Any = np.full(index.states, -2, dtype=width)
    level[inside] = -1
    level[marked] = 0
    queue: Any = np.empty(index.states, dtype=width)
    queue[: len(start)] = start
    kernel = compiled(spread_any, index.work)
    filled = kernel(index.entering_from, index.entering, index.choice_to_state, usable, level, queue, len(start))
    return level, queue[:filled]


def way_back(index: Index, states: Bools, inside: Bools) -> Levels:
    """Return ``[S]``: the first listed choice of each state of `inside` that leads nearer to `states`; -1 elsewhere.

    Levels and choices are those of `levels_to` and `first_downhill`. Only the states outside `states` are looked at: it takes no
    time to speak of where these are few.
    """
    down = np.full(index.states, -1, dtype=np.int64)
    outside = np.flatnonzero(inside & ~states)
    if not len(outside):
        return down
    choices, _ = branches_of(index.state_to_choices, outside)
    branches, offsets = branches_of(index.choice_to_branches, choices)
    after = index.branch_to_target[branches]
    border = np.unique(after[states[after]]).astype(np.int64)
    every = np.ones(index.choices, dtype=np.bool_)
    level, _ = _spread(index, (states, border), inside & ~states, every)
    own = np.repeat(choices, np.diff(offsets))
    nearer = (level[after] >= 0) & (level[after] < level[index.choice_to_state[own]])
    heading = own[nearer][::-1]
    down[index.choice_to_state[heading]] = heading  # the last assignment, that of the first listed choice, stands
    return down


def can_reach(index: Index, goal: Bools, inside: Bools, allowed: Bools | None = None) -> Bools:
    """Return ``[S]``: where some policy reaches `goal` through states `inside` with positive probability (Pmax > 0)."""
    return levels_to(index, goal, inside, allowed) >= 0


def surely_reach(index: Index, goal: Bools, inside: Bools, allowed: Bools | None = None) -> Bools:
    """Return ``[S]``: where some policy reaches `goal` through states `inside` with probability 1 (Pmax = 1).

    Parameters
    ----------
    index : Index
    goal, inside : array of bool, ``[S]``
    allowed : array of bool, ``[C]``, optional
        The choices that may be used; all by default.
    """
    return surely_reaching(index, goal, inside, allowed).states


def surely_reaching(index: Index, goal: Bools, inside: Bools, allowed: Bools | None = None) -> Sure:
    """Return the same as `surely_reach` with what was found on the way.

    States that cannot reach the goal are struck, with all choices that may enter them and the states that have no other, and the
    goal is searched for again. Where no choice of a state that is left enters what was struck, as on maps, one search was enough.
    """
    usable = (inside & ~goal)[index.choice_to_state]
    if allowed is not None:
        usable &= allowed
    start = np.flatnonzero(goal)
    level, order = _spread(index, (goal, start), inside, usable)
    staying = possible = level >= 0
    lost = ~possible
    while lost.any() and _entered(index, lost, usable, staying):
        staying = staying & ~_lose(index, lost, usable, staying & ~goal)
        level, order = _spread(index, (goal, start), staying & ~goal, usable)
        lost = staying & (level < 0)
        staying = staying & ~lost
    usable &= staying[index.choice_to_state]
    return Sure(staying, possible, usable, level, order)


def _entered(index: Index, lost: Bools, usable: Bools, staying: Bools) -> bool:
    """Return whether a usable choice of a state that stays may enter a lost one."""
    states = np.flatnonzero(lost)
    if FEW * len(states) > index.states:
        return bool((any_branch_in(index, lost) & usable & staying[index.choice_to_state]).any())
    places, _ = branches_of(index.entering_from, states)
    choices = index.entering[places]
    return bool((usable[choices] & staying[index.choice_to_state[choices]]).any())


def _counts(index: Index, choices: Bools) -> Ints:
    """Return ``[S]``: how many of `choices` each state has."""
    before: Any = np.zeros(index.choices + 1, dtype=index.entering.dtype)
    np.cumsum(choices, out=before[1:])
    counts: Ints = before[index.state_to_choices[1:]] - before[index.state_to_choices[:-1]]
    return counts


def _lose(index: Index, lost: Bools, usable: Bools, inside: Bools) -> Bools:
    """Strike the choices that may enter `lost` from `usable`, and then those into states left without a choice.

    Returns ``[S]``: the lost states and those of `inside` that are lost with them.
    """
    remaining = _counts(index, usable)
    bare = inside & (remaining == 0)
    start = np.flatnonzero(lost | bare)
    queue: Any = np.empty(index.states, dtype=index.entering.dtype)
    queue[: len(start)] = start
    remaining[start] = -1
    kernel = compiled(spread_all, index.work)
    filled = kernel(index.entering_from, index.entering, index.choice_to_state, usable, remaining, queue, len(start))
    gone = np.zeros(index.states, dtype=np.bool_)
    gone[queue[:filled]] = True
    return gone


def can_avoid(index: Index, goal: Bools, inside: Bools) -> Bools:
    """Return ``[S]``: where some policy never reaches `goal` through states `inside` (Pmin = 0)."""
    usable = (inside & ~goal)[index.choice_to_state]
    return ~_lose(index, goal, usable, np.zeros(index.states, dtype=np.bool_))


def cannot_miss(index: Index, goal: Bools, inside: Bools) -> Bools:
    """Return ``[S]``: where every policy reaches `goal` through states `inside` with probability 1 (Pmin = 1)."""
    missing = can_avoid(index, goal, inside)
    return ~can_reach(index, missing, inside & ~goal)


def reached_from(index: Index, start: Bools, ended: Bools, allowed: Bools | None = None) -> Bools:
    """Return ``[S]``: the states that can be reached from `start`, which are among them; nothing is followed from `ended`."""
    usable = np.ones(index.choices, dtype=np.bool_) if allowed is None else allowed
    followed = (usable & ~ended[index.choice_to_state])[index.branch_to_choice]
    origin = index.choice_to_state[index.branch_to_choice[followed]]  # ascending: branches lie state by state
    target: Ints = index.branch_to_target[followed]
    # The reverse graph has one choice per followed branch, from its target to its origin.
    leaving_from: Ints = np.zeros(index.states + 1, dtype=index.entering_from.dtype)
    np.cumsum(np.bincount(origin, minlength=index.states), out=leaving_from[1:])
    edges: Any = np.arange(len(target)).astype(index.entering.dtype)
    for array in (leaving_from, edges, target):
        array.flags.writeable = False  # like the arrays of an Index: one compiled kernel serves both
    level: Any = np.where(start, 0, -1).astype(index.entering.dtype)
    queue: Any = np.empty(index.states, dtype=index.entering.dtype)
    first = np.flatnonzero(start)
    queue[: len(first)] = first
    kernel = compiled(spread_any, index.work)
    kernel(leaving_from, edges, target, np.ones(len(target), dtype=np.bool_), level, queue, len(first))
    reached: Bools = level >= 0
    return reached


def end_components(index: Index, inside: Bools, allowed: Bools) -> tuple[Levels, Bools]:
    """Return the maximal end components of the `allowed` choices among the states `inside`.

    Returns
    -------
    component : array of int64, ``[S]``
        A number per maximal end component, -1 outside all of them.
    internal : array of bool, ``[C]``
        The allowed choices with which a run stays in the component of its state.
    """
    usable = allowed & inside[index.choice_to_state]
    component: Any = np.full(index.states, -1, dtype=np.int64)
    if not usable.any():
        return component, usable
    alive = inside & ~_lose(index, ~inside, usable, inside)
    members: Any = np.flatnonzero(alive).astype(index.entering.dtype)
    kernel = compiled(end_components_of, index.work)
    kernel(
        (index.state_to_choices, index.choice_to_branches, index.branch_to_target),
        (index.choice_to_state, index.entering_from, index.entering),
        usable, _counts(index, usable), members, component,
    )  # fmt: skip
    return component, usable
