"""A problem and an objective enter, a Frame leaves: which states end, what each choice costs, and plain searches on the graph.

A run of an objective passes through *running* states and ends in a *target* or, where a formula forbids to go on, in a state
that is *out*. The searches here are fixpoints of sets of states, computed a layer at a time over arrays:

* ``reach(to, via, rows)``: where some policy that uses `rows` reaches `to` with positive probability: the least set;
* ``keep(inside, rows)``: the largest part of a set that can be kept for sure: every state has a row with all branches in it;
* ``sure(to, via, rows)``: where some policy reaches `to` with probability 1: the largest set X such that `to` is reached with
  rows whose branches all stay in X (de Alfaro 1997);
* ``blocks``: maximal end components, where a run can go round for ever.

Where later rewards count less (a discount γ < 1) no run ends by itself: it is as if each step ended it with the chance 1 - γ.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from ratherthan.model.compiling import compiled, is_compiled
from ratherthan.model.mdp import MDP, Bools, Floats, Ints
from ratherthan.model.watch import look
from ratherthan.verify._kernels import reached_back
from ratherthan.verify.prices import Prices

__all__ = ["Array", "Frame", "parts", "slices"]

Array = npt.NDArray[np.int64]

DENSE = 300
"""Up to so many states components are found by squaring a matrix, without a library."""


def slices(first: Array, last: Array) -> Array:
    """Return all numbers of the ranges first[i] … last[i] - 1, one after the other."""
    counts = last - first
    total = int(counts.sum())
    if total == 0:
        return np.zeros(0, dtype=np.int64)
    skipped = np.repeat(first - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
    result: Array = skipped + np.arange(total)
    return result


@dataclass(frozen=True, eq=False)
class _Shape:
    """What all frames on a model have in common; it is made once."""

    states: int
    state_to_choices: Ints
    choice_to_branches: Ints
    branch_to_target: Ints
    branch_to_probability: Floats

    @cached_property
    def row_state(self) -> Array:
        """The state of each choice, ``[C]``."""
        return np.repeat(np.arange(self.states), np.diff(self.state_to_choices)).astype(np.int64, copy=False)

    @cached_property
    def entry_row(self) -> Array:
        """The choice of each branch, ``[B]``."""
        degree = np.diff(self.choice_to_branches)
        return np.repeat(np.arange(len(degree)), degree).astype(np.int64, copy=False)

    @cached_property
    def share(self) -> Floats:
        """The probabilities of the branches, rows summing to 1, ``[B]``."""
        sums = np.add.reduceat(self.branch_to_probability, self.choice_to_branches[:-1])
        return np.asarray(self.branch_to_probability / sums[self.entry_row], dtype=np.float64)

    @cached_property
    def rows_by_target(self) -> tuple[Array, Array]:
        """The choices with a branch into each state, and where those of each state begin."""
        order = np.argsort(self.branch_to_target, kind="stable")
        count = np.bincount(self.branch_to_target, minlength=self.states)
        return self.entry_row[order], np.concatenate([[0], np.cumsum(count)]).astype(np.int64)


_shapes: WeakKeyDictionary[MDP, _Shape] = WeakKeyDictionary()


def _shape_of(mdp: MDP) -> _Shape:
    found = _shapes.get(mdp)
    if found is None:
        arrays = mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target, mdp.branch_to_probability
        found = _shapes[mdp] = _Shape(mdp.states, *arrays)
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """An objective on a model.

    Parameters
    ----------
    mdp : MDP
    maximise : bool
    target, out : array of bool, ``[S]``
        Where a run ends: where it was to go, and where it may not go on.
    prices : Prices, optional
        What the choices pay where a sum of rewards is wanted; None where a probability is.
    demanding : bool
        Whether only policies count that reach the target with probability 1; rewards may then have any sign. Else, and
        without a discount, no reward is negative.
    discount : float
        γ; 1 where all rewards count alike.
    ending : bool
        Whether only policies count under which a run surely ends, wherever that is.
    permitted : array of bool, ``[C]``, optional
        The choices that may be taken; None for all.
    """

    mdp: MDP
    maximise: bool
    target: Bools  # [S]
    out: Bools  # [S]
    prices: Prices | None = None
    demanding: bool = False
    discount: float = 1.0
    ending: bool = False
    permitted: Bools | None = None  # [C]

    @property
    def row_state(self) -> Array:
        """The state of each choice, ``[C]``."""
        return _shape_of(self.mdp).row_state

    @property
    def entry_row(self) -> Array:
        """The choice of each branch, ``[B]``."""
        return _shape_of(self.mdp).entry_row

    @cached_property
    def usable(self) -> Bools:
        """The choices that may be taken where a run has not ended, ``[C]``."""
        usable: Bools = self.running[self.row_state]
        return usable if self.permitted is None else usable & self.permitted

    @property
    def costs(self) -> bool:
        """Whether a sum of rewards is wanted, else a probability."""
        return self.prices is not None

    @property
    def endless(self) -> bool:
        """Whether later rewards count less, so that there is no end and no goal."""
        return self.discount < 1.0

    @property
    def signed(self) -> bool:
        """Whether values may have either sign."""
        return self.demanding or self.endless

    @property
    def running(self) -> Bools:
        """Where a run has not ended, ``[S]``."""
        return ~(self.target | self.out)

    @property
    def risk(self) -> bool:
        """Whether a probability is to be kept small: then there is no goal to arrive at."""
        return not self.costs and not self.maximise

    @property
    def aimless(self) -> bool:
        """Whether there is no goal to arrive at."""
        return self.risk or self.endless

    @property
    def goal(self) -> Bools:
        """Where a run has ended well, ``[S]``."""
        return self.out if self.risk else self.target

    @property
    def hazard(self) -> Bools:
        """Where a run has ended badly, ``[S]``."""
        return self.target if self.risk else self.out

    @cached_property
    def can_arrive(self) -> Bools:
        """Where some policy reaches the goal with positive probability, ``[S]``; everywhere where there is no goal."""
        if self.aimless:
            return np.ones(self.mdp.states, dtype=np.bool_)
        return self.reach(self.target, self.running)

    @property
    def share(self) -> Floats:
        """The probabilities of the branches, rows summing to 1, ``[B]``."""
        return _shape_of(self.mdp).share

    @cached_property
    def price(self) -> Floats:
        """The expected immediate reward of each choice, ``[C]``; 0 where a probability is wanted."""
        return np.zeros(self.mdp.choices) if self.prices is None else self.prices.price

    @cached_property
    def blur(self) -> Floats:
        """A bound of the rounding error of `price`, ``[C]``."""
        return np.zeros(self.mdp.choices) if self.prices is None else self.prices.blur

    @cached_property
    def pays(self) -> Bools:
        """Which choices pay something, ``[C]``."""
        return np.zeros(self.mdp.choices, dtype=np.bool_) if self.prices is None else self.prices.pays

    def rows_into(self, states: Array) -> Array:
        """Return the choices with a branch into `states` (some more than once)."""
        row, first = _shape_of(self.mdp).rows_by_target
        return row[slices(first[states], first[states + 1])]

    def branches_from(self, states: Array) -> tuple[Array, Array]:
        """Return origin and target of every branch of every choice of some states."""
        mdp = self.mdp
        begin = mdp.choice_to_branches[mdp.state_to_choices[states]].astype(np.int64)
        end = mdp.choice_to_branches[mdp.state_to_choices[states + 1]].astype(np.int64)
        return np.repeat(states, end - begin), mdp.branch_to_target[slices(begin, end)].astype(np.int64)

    def explored(self, start: int) -> Bools:
        """Return what any choices can reach from a state, itself included; where a run has ended nothing goes on, ``[S]``."""
        found = np.zeros(self.mdp.states, dtype=np.bool_)
        layer = np.array([start], dtype=np.int64)
        while len(layer):
            found[layer] = True
            _, near = self.branches_from(layer[self.running[layer]])
            layer = np.unique(near[~found[near]])
        return found

    def rows_within(self, inside: Bools) -> Bools:
        """Return which choices have all branches inside a set, ``[C]``."""
        good: Bools = np.logical_and.reduceat(inside[self.mdp.branch_to_target], self.mdp.choice_to_branches[:-1])
        return good

    def reach(self, to: Bools, via: Bools, rows: Bools | None = None) -> Bools:
        """Return the states of `to`, and those of `via` from which it can be reached through `via`, ``[S]``."""
        look()
        seen, mdp = to.copy(), self.mdp
        if is_compiled(mdp.branches):
            allowed = np.ones(mdp.choices, dtype=np.bool_) if rows is None else rows
            queue = np.zeros(mdp.states, dtype=np.int64)
            run = compiled(reached_back, mdp.branches)
            run(_shape_of(mdp).rows_by_target, self.row_state, allowed, via, seen, queue)
            return seen
        frontier = np.flatnonzero(to)
        while len(frontier):
            into = self.rows_into(frontier)
            if rows is not None:
                into = into[rows[into]]
            states = self.row_state[into]
            frontier = np.unique(states[via[states] & ~seen[states]])
            seen[frontier] = True
        return seen

    def keep(self, inside: Bools, free: Bools, rows: Bools | None = None) -> Bools:
        """Return the largest part of a set whose states each have a row that stays in it; `free` states need none."""
        inside = inside.copy()
        usable = np.ones(self.mdp.choices, dtype=np.bool_) if rows is None else rows.copy()
        usable &= self.rows_within(inside)
        left = np.bincount(self.row_state[usable], minlength=self.mdp.states)
        frontier = np.flatnonzero(inside & ~free & (left == 0))
        while len(frontier):
            inside[frontier] = False
            lost = np.unique(self.rows_into(frontier))
            lost = lost[usable[lost]]
            usable[lost] = False
            np.subtract.at(left, self.row_state[lost], 1)
            touched = np.unique(self.row_state[lost])
            frontier = touched[inside[touched] & ~free[touched] & (left[touched] == 0)]
        return inside

    def sure(self, to: Bools, via: Bools, rows: Bools | None = None) -> Bools:
        """Return the states from which some policy reaches `to` through `via` with probability 1, ``[S]``."""
        inside = self.reach(to, via, rows)
        while True:
            kept = self.keep(inside, to, rows)
            usable = self.rows_within(kept) if rows is None else self.rows_within(kept) & rows
            reached = self.reach(to, via & kept, usable)
            if (reached == inside).all():
                return inside
            inside = reached

    def blocks(self, inside: Bools, rows: Bools) -> tuple[Array, Bools]:
        """Return the maximal end component of each state within a set (-1 for none) and the rows that stay in them.

        Parameters
        ----------
        inside : array of bool, ``[S]``
        rows : array of bool, ``[C]``
            Which choices a component may use.
        """
        alive = inside.copy()
        usable = rows & alive[self.row_state] & self.rows_within(alive)
        while True:
            alive &= np.bincount(self.row_state[usable], minlength=self.mdp.states) > 0
            usable &= alive[self.row_state] & self.rows_within(alive)
            entry = np.flatnonzero(usable[self.entry_row])
            origin, target = self.row_state[self.entry_row[entry]], self.mdp.branch_to_target[entry]
            part = parts(self.mdp.states, origin, target.astype(np.int64))
            crossing = np.zeros(self.mdp.choices, dtype=np.bool_)
            crossing[self.entry_row[entry[part[origin] != part[target]]]] = True
            empty = alive & (np.bincount(self.row_state[usable & ~crossing], minlength=self.mdp.states) == 0)
            if not crossing.any() and not empty.any():
                return np.where(alive, part, -1), usable
            usable &= ~crossing


def parts(count: int, origin: Array, target: Array) -> Array:
    """Return the strongly connected component of each state of a graph, ``[count]``."""
    if len(origin) == 0:
        return np.arange(count, dtype=np.int64)
    present = np.unique(np.concatenate([origin, target]))
    local = np.zeros(count, dtype=np.int64)
    local[present] = np.arange(len(present))
    if len(present) <= DENSE:
        found = _parts_by_squaring(len(present), local[origin], local[target])
    else:
        found = _parts_by_library(len(present), local[origin], local[target])
    result = np.arange(count, dtype=np.int64)
    result[present] = present[found]
    return result


def _parts_by_squaring(count: int, origin: Array, target: Array) -> Array:
    """Return the first member of each state's component: reachability there and back."""
    reach = np.eye(count, dtype=np.bool_)
    reach[origin, target] = True
    while True:
        further = (reach.astype(np.float32) @ reach.astype(np.float32)) > 0
        if (further == reach).all():
            return np.asarray(np.argmax(reach & reach.T, axis=1), dtype=np.int64)
        reach = further


def _parts_by_library(count: int, origin: Array, target: Array) -> Array:
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    matrix = csr_array((np.ones(len(origin), dtype=np.int8), (origin, target)), shape=(count, count))
    _, component = connected_components(matrix, directed=True, connection="strong")
    first = np.full(int(component.max()) + 1, count, dtype=np.int64)
    np.minimum.at(first, component, np.arange(count))
    return np.asarray(first[component], dtype=np.int64)
