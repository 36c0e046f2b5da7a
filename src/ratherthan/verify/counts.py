"""Critical states enter; how many decisions a choice leaves open leaves, with bounds: the count ε(s, a).

The count is a plain search: from the successors of (s, a), along every choice of every state reached but s, one layer after the
other; critical states count with all their choices. Where only steps towards better values are followed, a branch may be sure
to be followed, or only possibly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ratherthan.model.mdp import Bools
from ratherthan.verify.around import Around, around
from ratherthan.verify.frame import Array, Frame
from ratherthan.verify.groups import Critical
from ratherthan.verify.interval import Bounds, never_above, order_all
from ratherthan.verify.values import Band

__all__ = ["Counts", "Tree"]

LARGE = 20_000
"""From so many branches on, searches without settings share what they have in common (`ratherthan.verify.around`)."""


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
            low, high = self._sums(choice)
            own, admitted, excused = (
                Bounds(float(low[k]), float(high[k + 1])) for k in range(0, self._weights.shape[1], 2)
            )
            self._counts[choice] = own, admitted, excused
        return self._counts[choice]

    @cached_property
    def _weights(self) -> Array:
        """|A(u)| of what is surely and of what may be critical: for oneself, as admitted and as excused, ``[S, 6]``."""
        weight = np.diff(self.frame.mdp.state_to_choices)
        groups = (self.critical, self.admitted, self.excused)
        masks = [mask for found in groups for mask in (found.sure, found.maybe)]
        return np.stack([weight * mask for mask in masks], axis=1).astype(np.int64)

    def _sums(self, choice: int) -> tuple[Array, Array]:
        """Return the sums of the weights over the search tree: where branches are sure to be followed, and where they may be."""
        mdp = self.frame.mdp
        if self.tree == Tree() and mdp.branches > LARGE:
            first = np.unique(mdp.branch_to_target[mdp.branches_of(choice)]).astype(np.int64)
            found = self._around.sums(int(self.frame.row_state[choice]), first, self._weights)
            return found, found
        least = self._search(choice, sure=True)
        most = self._search(choice, sure=False) if self.tree.toward_goal else least
        return self._weights[least].sum(axis=0), self._weights[most].sum(axis=0)

    @cached_property
    def _counts(self) -> dict[int, tuple[Bounds, Bounds, Bounds]]:
        return {}

    def _search(self, choice: int, *, sure: bool) -> Bools:
        """Return the states of the search tree; only branches that are sure to be followed, or all that may be."""
        mdp, frame = self.frame.mdp, self.frame
        root = int(frame.row_state[choice])
        first = np.unique(mdp.branch_to_target[mdp.branches_of(choice)]).astype(np.int64)
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
    def _around(self) -> Around:
        """The graph of all branches of running states, prepared for many searches."""
        mdp = self.frame.mdp
        origin, target = self.frame.branches_from(np.flatnonzero(self.frame.running))
        return around(mdp.states, origin, target)

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
