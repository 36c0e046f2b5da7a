"""Bounds of values enter; action values, critical states and counts of decisions leave, with bounds, for every choice.

The number of a choice is q = r + Σ δ(s, a, s') ρ(s'), or ω = Σ δ(s, a, s') ρ(s') where that was asked for. A mean lies between the
smallest and the largest of what it is taken of, so equal values have that value exactly. The count ε(s, a) is a plain
search: from the successors of (s, a), along every choice of every state reached but s, one layer after the other; critical
states count with all their choices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ratherthan.model.mdp import Bools, Floats
from ratherthan.verify.frame import Array, Frame
from ratherthan.verify.interval import Bounds, all_above, largest, order_all, smallest
from ratherthan.verify.values import Band

__all__ = ["Measures", "Tree"]

ROUNDING = 1.12e-16
LARGE = 20_000
"""From so many branches on, searches without settings are done by a library."""


@dataclass(frozen=True, kw_only=True)
class Tree:
    """How the search tree is limited: so many steps after the choice, and only towards better values."""

    horizon: int | None = None
    toward_goal: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Measures:
    """The numbers of all choices under one question.

    Parameters
    ----------
    frame : Frame
    band : Band
        Of the values that count: the optimum, or those of the policy.
    omega : bool
        Take ω instead of q.
    alpha, tolerance : float
    tree : Tree
    slack : float
        By which share of itself a number may be less well known to whoever made the explanation; ∞ for any share.
    """

    frame: Frame
    band: Band
    omega: bool
    alpha: float
    tolerance: float
    tree: Tree
    slack: float

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        """The lower and upper bounds of all action values q, ``[C]`` each."""
        return self._ends(self.band.lower, -1.0, omega=False), self._ends(self.band.upper, 1.0, omega=False)

    @cached_property
    def lambda_ends(self) -> tuple[Floats, Floats]:
        """The same of what decides λ and criticality: q, or on request ω."""
        if not self.omega:
            return self.ends
        return self._ends(self.band.lower, -1.0, omega=True), self._ends(self.band.upper, 1.0, omega=True)

    def _ends(self, values: Floats, away: float, *, omega: bool) -> Floats:
        mdp = self.frame.mdp
        begin = mdp.choice_to_branches[:-1]
        near = values[mdp.branch_to_target]
        finite = np.where(np.isfinite(near), near, 0.0)
        total = np.add.reduceat(self.frame.share * finite, begin)
        size = np.add.reduceat(np.abs(self.frame.share * finite), begin)
        degree = np.diff(mdp.choice_to_branches)
        mean = total + away * (2 * degree + 12) * ROUNDING * size
        clip = np.maximum.reduceat(near, begin) if away > 0 else np.minimum.reduceat(near, begin)
        mean = np.minimum(mean, clip) if away > 0 else np.maximum(mean, clip)
        mean = np.where(np.isfinite(mean), mean, 0.0)  # what is infinite is set below
        if not omega:
            price = self.frame.price
            mean = mean + price + away * (2 * degree + 12) * ROUNDING * (price + np.where(price > 0, np.abs(mean), 0.0))
        for infinity in (-np.inf, np.inf):  # no value is -∞, that is only a bound: a mean with ∞ in it is ∞
            hit = np.logical_or.reduceat(near == infinity, begin)
            mean[hit] = infinity
        return mean

    def number(self, choice: int) -> Bounds:
        """Return the number of one choice."""
        return Bounds(float(self.ends[0][choice]), float(self.ends[1][choice]))

    def numbers(self, state: int) -> dict[int, Bounds]:
        """Return the numbers of a state's choices."""
        return {choice: self.number(choice) for choice in self.frame.mdp.choices_of(state)}

    def spread(self, state: int) -> tuple[Bounds, Bounds]:
        """Return λmax and λmin of a state."""
        lower, upper = self.lambda_ends
        numbers = [Bounds(float(lower[c]), float(upper[c])) for c in self.frame.mdp.choices_of(state)]
        return largest(numbers), smallest(numbers)

    def difference(self, state: int) -> tuple[Bounds, Bounds]:
        """Return the largest and the smallest action value of a state."""
        numbers = self.numbers(state).values()
        return largest(numbers), smallest(numbers)

    def fate(self, choice: int) -> str | None:
        """Return what an infinite number of a cost to be kept small means, None where it is not that."""
        if not self.frame.costs or self.frame.maximise or self.number(choice) != Bounds(np.inf, np.inf):
            return None
        targets = self.frame.mdp.branch_to_target[self.frame.mdp.branches_of(choice)]
        return "may fail" if bool(self.frame.can_arrive[targets].any()) else "dead end"

    @cached_property
    def critical(self) -> tuple[Bools, Bools]:
        """Which states are critical for sure, and which may be, ``[S]`` each."""
        return self._critical(*self.lambda_ends)

    @cached_property
    def admitted(self) -> tuple[Bools, Bools]:
        """Which states whoever made the explanation must know to be critical, and which he may have left open."""
        several = (np.diff(self.frame.mdp.state_to_choices) > 1) & self.frame.running
        if np.isinf(self.slack):
            return np.zeros_like(several), several
        lower, upper = self.lambda_ends
        finite_lower, finite_upper = (np.where(np.isfinite(end), np.abs(end), 0.0) for end in self.lambda_ends)
        return self._critical(lower - self.slack * finite_lower, upper + self.slack * finite_upper)

    def _critical(self, lower: Floats, upper: Floats) -> tuple[Bools, Bools]:
        begin = self.frame.mdp.state_to_choices[:-1]
        high = np.maximum.reduceat(lower, begin), np.maximum.reduceat(upper, begin)
        low = np.minimum.reduceat(lower, begin), np.minimum.reduceat(upper, begin)
        surely, maybe = all_above(high, low, self.alpha, self.tolerance)
        several = (np.diff(self.frame.mdp.state_to_choices) > 1) & self.frame.running
        return surely & several, maybe & several

    def is_critical(self, state: int) -> bool | None:
        """Return whether a state is critical, None where the bounds leave it open."""
        return True if self.critical[0][state] else None if self.critical[1][state] else False

    def count(self, choice: int) -> tuple[Bounds, Bounds]:
        """Return ε of a choice, and within which bounds its bounds must lie in an explanation."""
        if choice not in self._counts:
            least = self._search(choice, sure=True)
            most = self._search(choice, sure=False) if self.tree.toward_goal else least
            weight = np.diff(self.frame.mdp.state_to_choices)
            own, admitted = (
                Bounds(float((weight * sure)[least].sum()), float((weight * maybe)[most].sum()))
                for sure, maybe in (self.critical, self.admitted)
            )
            self._counts[choice] = own, admitted
        return self._counts[choice]

    @cached_property
    def _counts(self) -> dict[int, tuple[Bounds, Bounds]]:
        return {}

    def _search(self, choice: int, *, sure: bool) -> Bools:
        """Return the states of the search tree; only branches that are sure to be followed, or all that may be."""
        mdp, frame = self.frame.mdp, self.frame
        root = int(frame.row_state[choice])
        first = np.unique(mdp.branch_to_target[mdp.branches_of(choice)]).astype(np.int64)
        if self.tree == Tree() and mdp.branches > LARGE:
            return self._search_large(root, first)
        found = np.zeros(mdp.states, dtype=np.bool_)
        layer = first[first != root]
        depth = 0
        while len(layer):
            found[layer] = True
            if depth == self.tree.horizon:
                break
            depth += 1
            origin, target = frame.branches_from(layer[frame.running[layer]])
            if self.tree.toward_goal:
                target = target[self._better(origin, target, sure=sure)]
            layer = np.unique(target[~found[target] & (target != root)])
        return found

    @cached_property
    def _graph(self) -> Any:
        """The branches of all running states as a sparse matrix."""
        from scipy.sparse import csr_array

        mdp = self.frame.mdp
        origin, target = self.frame.branches_from(np.flatnonzero(self.frame.running))
        first = np.concatenate([[0], np.cumsum(np.bincount(origin, minlength=mdp.states))])
        return csr_array((np.ones(len(target)), target, first), shape=(mdp.states, mdp.states))

    def _search_large(self, root: int, first: Array) -> Bools:
        """Do the same by a library: what is reached from s if it has this choice alone, without s itself."""
        from scipy.sparse.csgraph import breadth_first_order

        graph = self._graph
        own = slice(int(graph.indptr[root]), int(graph.indptr[root + 1]))
        before = graph.indices[own].copy()
        graph.indices[own] = np.resize(first, len(before))
        found = np.zeros(self.frame.mdp.states, dtype=np.bool_)
        found[breadth_first_order(graph, root, return_predecessors=False)] = True
        graph.indices[own] = before
        found[root] = False
        return found

    def _better(self, origin: Array, target: Array, *, sure: bool) -> Bools:
        """Return which branches lead to a strictly better value."""
        lower, upper = self.band.lower, self.band.upper
        first, second = (target, origin) if self.frame.maximise else (origin, target)
        more, less = order_all((lower[first], upper[first]), (lower[second], upper[second]), self.tolerance)
        return more if sure else ~less & ~self._equal(origin, target)

    def _equal(self, one: Array, other: Array) -> Bools:
        """Return which pairs of states have values that are certainly equal."""
        lower, upper = self.band.lower, self.band.upper
        with np.errstate(invalid="ignore"):
            apart = np.maximum(upper[one] - lower[other], upper[other] - lower[one])
        least = self.tolerance * np.maximum(lower[one], lower[other])
        return np.where(np.isfinite(apart), apart <= np.maximum(least, 0.0), lower[one] == lower[other])
