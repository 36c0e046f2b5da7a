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
choices that leave theirs, again and again, each time only in the components that lost something.

References
----------
L. de Alfaro, Formal Verification of Probabilistic Systems, PhD thesis, Stanford, 1997.
C. Baier, J.-P. Katoen, Principles of Model Checking, MIT Press, 2008, chapter 10.
R. Tarjan, Depth-First Search and Linear Graph Algorithms, SIAM J. Comput. 1(2), 1972.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled, spread_all, spread_any, strong_components
from ratherthan.model.index import Index
from ratherthan.model.mdp import Bools, Ints

__all__ = [
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
]

Levels = npt.NDArray[np.int64]


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
    level = np.where(inside, -1, -2)
    level[targets] = 0
    queue = np.zeros(index.states, dtype=np.int64)
    start = np.flatnonzero(targets)
    queue[: len(start)] = start
    usable = np.ones(index.choices, dtype=np.bool_) if allowed is None else allowed
    kernel = compiled(spread_any, index.work)
    kernel(index.entering_from, index.entering, index.choice_to_state, usable, level, queue, len(start))
    return np.maximum(level, -1)


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
    usable = np.ones(index.choices, dtype=np.bool_) if allowed is None else allowed.copy()
    usable &= (inside & ~goal)[index.choice_to_state]
    staying = goal | inside
    lost = ~staying
    while True:
        staying &= ~_lose(index, lost, usable, staying & ~goal)
        reached = can_reach(index, goal, staying, usable)
        lost = staying & ~reached
        if not lost.any():
            return staying


def _lose(index: Index, lost: Bools, usable: Bools, inside: Bools) -> Bools:
    """Strike the choices that may enter `lost` from `usable`, and then those into states left without a choice.

    Returns ``[S]``: the lost states and those of `inside` that are lost with them.
    """
    remaining = np.bincount(index.choice_to_state[usable], minlength=index.states)
    bare = inside & (remaining == 0)
    start = np.flatnonzero(lost | bare)
    queue = np.zeros(index.states, dtype=np.int64)
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
    level = np.where(start, 0, -1)
    queue = np.zeros(index.states, dtype=np.int64)
    first = np.flatnonzero(start)
    queue[: len(first)] = first
    kernel = compiled(spread_any, index.work)
    kernel(leaving_from, edges, target, np.ones(len(target), dtype=np.bool_), level, queue, len(first))
    return level >= 0


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
    alive = inside.copy()
    alive &= ~_lose(index, ~alive, usable, alive)
    component = np.full(index.states, -1, dtype=np.int64)
    number = 0
    roots = np.flatnonzero(alive)
    kernel = compiled(strong_components, index.work)
    while len(roots):
        number = kernel(
            index.state_to_choices, index.choice_to_branches, index.branch_to_target,
            usable, roots, alive, component, number,
        )  # fmt: skip
        touched = _drop_crossing(index, component, usable, alive)
        roots = np.flatnonzero(touched & alive)
        component[touched] = -1
    component[~alive] = -1
    return component, usable


def _drop_crossing(index: Index, component: Levels, usable: Bools, alive: Bools) -> Bools:
    """Strike usable choices that leave their component, and states left bare; return the states of components touched."""
    target = component[index.branch_to_target]
    leaves = target != component[index.choice_to_state[index.branch_to_choice]]
    crossing = usable & any_branch_in_rows(index, leaves & usable[index.branch_to_choice])
    if not crossing.any():
        return np.zeros(index.states, dtype=np.bool_)
    usable &= ~crossing
    before = usable.copy()
    gone = _lose(index, ~alive, usable, alive) & alive
    alive &= ~gone
    struck = index.choice_to_state[crossing | (before & ~usable)]
    hit = np.zeros(int(component.max()) + 1, dtype=np.bool_)
    hit[component[struck]] = True
    hit[component[gone]] = True
    return (component >= 0) & hit[component]
