"""Critical states enter; how many decisions a choice leaves open leaves, with bounds: the count ε(s, a).

The count is a plain search: from the successors of (s, a), along every choice of every state reached but s, one layer after the
other; critical states count with all their choices. Where only steps towards better values are followed, a branch may be sure
to be followed, or only possibly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ratherthan.model.mdp import Bools
from ratherthan.verify.frame import Array, Frame
from ratherthan.verify.groups import Critical
from ratherthan.verify.interval import Bounds, never_above, order_all
from ratherthan.verify.values import Band

__all__ = ["Counts", "Tree"]

LARGE = 20_000
"""From so many branches on, searches without settings are done by a library."""


@dataclass(frozen=True, kw_only=True)
class Tree:
    """How the search tree is limited: so many steps after the choice, and only towards better values."""

    horizon: int | None = None
    toward_goal: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Counts:
    """The counts of all choices under one question.

    Parameters
    ----------
    frame : Frame
        Of the first level.
    band : Band
        Of the values that count there.
    critical, admitted, excused : Critical
        What is critical, what whoever made the explanation should have known of it, and what he must have known.
    tolerance : float
    tree : Tree
    """

    frame: Frame
    band: Band
    critical: Critical
    admitted: Critical
    excused: Critical
    tolerance: float
    tree: Tree

    def count(self, choice: int) -> tuple[Bounds, Bounds, Bounds]:
        """Return ε of a choice, and within which bounds its bounds should lie in an explanation, and must lie."""
        if choice not in self._counts:
            least = self._search(choice, sure=True)
            most = self._search(choice, sure=False) if self.tree.toward_goal else least
            weight = np.diff(self.frame.mdp.state_to_choices)
            own, admitted, excused = (
                Bounds(float((weight * found.sure)[least].sum()), float((weight * found.maybe)[most].sum()))
                for found in (self.critical, self.admitted, self.excused)
            )
            self._counts[choice] = own, admitted, excused
        return self._counts[choice]

    @cached_property
    def _counts(self) -> dict[int, tuple[Bounds, Bounds, Bounds]]:
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
        better = (lower[first], upper[first]), (lower[second], upper[second])
        more, less = order_all(*better, self.tolerance)
        if sure:
            return more
        equal = never_above(*better, self.tolerance) & never_above(*better[::-1], self.tolerance)
        return ~less & ~equal
