"""The rows of a model enter; their Ground leaves: the edges that searches follow, and what is found out about them, once.

Edges lead from state to state, each once, whatever choices and branches make it: none from a state where the objective has
ended, none from a state to itself. On them stand the methods of this package: `pieces`, landmarks, `closure`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from ratherthan.factors.counting._kernels import condensed_rows, followed_edges, strong_numbers
from ratherthan.factors.counting.pieces import Pieces, pieces_of
from ratherthan.model._kernels import compiled, reversed_rows
from ratherthan.model.dominators import Graph
from ratherthan.model.mdp import MDP, Bools, Floats, Ints
from ratherthan.model.watch import look, room_for

if TYPE_CHECKING:
    from ratherthan.factors.landmarks import Landmark

__all__ = ["Components", "Ground", "ground_of", "known_ground", "restricted"]

Counts = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.int32]
Made = TypeVar("Made")


class Components(NamedTuple):
    """The strong components of a graph, numbered so that each leads to smaller ones only; N counts them."""

    component: Numbers  # [S]
    members_from: Counts  # [N+1]
    members: Numbers  # [S]

    @property
    def size(self) -> Counts:
        """How many states each component has, ``[N]``."""
        return np.diff(self.members_from)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ground:
    """The rows of a model with the edges that searches follow.

    Parameters
    ----------
    rows : tuple of arrays
        state_to_choices, choice_to_branches and branch_to_target of the model.
    leaving_from, leaving : array of int, ``[S+1]``, ``[E]``
        The edges, in rows.
    landmarks : list of Landmark
        Those made so far; more are added where they help.
    made : dict
        What was made last for some weights: the next question mostly has the same.
    searched : list of int
        How many visits searches have made so far: one number.
    """

    rows: tuple[Ints, Ints, Ints]
    leaving_from: Counts  # [S+1]
    leaving: Numbers  # [E]
    landmarks: list[Landmark] = field(default_factory=list)
    made: dict[str, tuple[Counts, Counts, Any]] = field(default_factory=dict)
    searched: list[int] = field(default_factory=lambda: [0])

    @property
    def states(self) -> int:
        """The number of states, S."""
        return len(self.leaving_from) - 1

    @property
    def work(self) -> int:
        """How much work a pass over the rows is: the number of branches."""
        return len(self.rows[2])

    def states_of(self, choices: Counts) -> Counts:
        """Return the state of each of `choices`."""
        offsets = self.rows[0]
        found: Counts = np.searchsorted(offsets, choices.astype(offsets.dtype), side="right").astype(np.int64) - 1
        return found

    def same_edges(self, other: Ground) -> bool:
        """Return whether the edges are those of another ground."""
        return np.array_equal(self.leaving_from, other.leaving_from) and np.array_equal(self.leaving, other.leaving)

    def once(self, what: str, weights: tuple[Counts, Counts], make: Callable[[], Made]) -> Made:
        """Return what was made for the same weights last time, else make it."""
        before = self.made.get(what)
        if before is not None and all(map(np.array_equal, before[:2], weights)):
            kept: Made = before[2]
            return kept
        fresh = make()
        self.made.clear()  # what was made for other weights, or with fewer landmarks, is not kept
        self.made[what] = *weights, fresh
        return fresh

    @cached_property
    def graph(self) -> Graph:
        """The edges with those of the reverse graph."""
        look()
        entering_from, entering = compiled(reversed_rows, self.work)(self.leaving_from, self.leaving)
        return Graph(self.leaving_from, self.leaving, entering_from, entering)

    @cached_property
    def pieces(self) -> Pieces | None:
        """What falls apart without a state, where all streets run both ways; else None."""
        look()
        return pieces_of(self.leaving_from, self.leaving, self.work)

    @cached_property
    def components(self) -> Components:
        """The strong components."""
        look()
        component, count = compiled(strong_numbers, self.work)(self.leaving_from, self.leaving)
        members_from = np.zeros(count + 1, dtype=np.int64)
        np.cumsum(np.bincount(component, minlength=count), out=members_from[1:])
        members = np.argsort(component, kind="stable").astype(np.int32)
        return Components(component, members_from, members)

    @cached_property
    def onward(self) -> tuple[Counts, Numbers]:
        """The components that each component leads to by one edge, in rows."""
        look()
        parts, kernel = self.components, compiled(condensed_rows, self.work)
        rows: tuple[Counts, Numbers] = kernel(self.leaving_from, self.leaving, *parts)
        return rows


_KNOWN: WeakKeyDictionary[MDP, tuple[Bools, Ground]] = WeakKeyDictionary()


def known_ground(mdp: MDP, leaves: Bools) -> Ground | None:
    """Return the Ground of a model with these leaves if it has been found before."""
    before = _KNOWN.get(mdp)
    return before[1] if before is not None and np.array_equal(before[0], leaves) else None


def ground_of(mdp: MDP, leaves: Bools) -> Ground:
    """Return the Ground of a model, found the first time it is asked for with these leaves.

    Parameters
    ----------
    mdp : MDP
    leaves : array of bool, ``[S]``
        Where nothing is followed: the objective has ended.
    """
    known = known_ground(mdp, leaves)
    if known is None:
        known = restricted(mdp, leaves, np.zeros(0), np.zeros(0))
        _KNOWN[mdp] = leaves.copy(), known
    return known


def restricted(mdp: MDP, leaves: Bools, target: Floats, origin: Floats) -> Ground:
    """Return the Ground of the branches from s to t with target[t] < origin[s], ``[S]`` each; of all where they are empty."""
    room_for(4 * mdp.branches + 24 * mdp.states, f"The edges of a model of {mdp.branches} branches")
    look()
    rows = mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target
    leaving_from, leaving = compiled(followed_edges, mdp.branches)(rows, leaves, target, origin)
    return Ground(rows=rows, leaving_from=leaving_from, leaving=leaving)
