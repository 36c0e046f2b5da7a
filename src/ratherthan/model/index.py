"""The rows of a graph enter; their Index leaves: which choice a branch is of, which state a choice is of, what enters a state.

It is built once for a model, in time and memory linear in the branches, and passed on. What is as long as the branches is made
when it is first asked for: not every question needs it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled, entering_choices, is_compiled
from ratherthan.model.mdp import MDP, Ints
from ratherthan.model.watch import look, room_for

__all__ = ["Index", "branches_of", "build_index", "index_of"]

MANY = 30_000
"""From how many branches on sorting by counting is worth compiling it."""

BYTES = 8
"""What an index takes per branch."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Index:
    """The rows of a graph with their reverse: S states, C choices, B branches.

    Parameters
    ----------
    state_to_choices, choice_to_branches, branch_to_target : array of int, ``[S+1]``, ``[C+1]``, ``[B]``
        As in `MDP`.
    """

    state_to_choices: Ints  # [S+1]
    choice_to_branches: Ints  # [C+1]
    branch_to_target: Ints  # [B]

    @cached_property
    def choice_to_state(self) -> Ints:
        """The state of each choice, ``[C]``."""
        width = self.branch_to_target.dtype.type
        return _locked(np.repeat(np.arange(self.states, dtype=width), np.diff(self.state_to_choices)), width)

    @cached_property
    def branch_to_choice(self) -> Ints:
        """The choice of each branch, ``[B]``."""
        width = self.branch_to_target.dtype.type
        return _locked(np.repeat(np.arange(self.choices, dtype=width), np.diff(self.choice_to_branches)), width)

    @property
    def entering_from(self) -> Ints:
        """Where the choices with a branch to state s are among `entering`, ``[S+1]``: from s's number there up to the next."""
        return self._reverse[0]

    @property
    def entering(self) -> Ints:
        """The choices by where they lead, ``[B]``, ascending for each state; one with two branches to a state is there twice."""
        return self._reverse[1]

    @cached_property
    def _reverse(self) -> tuple[Ints, Ints]:
        width = self.branch_to_target.dtype.type
        if self.work > MANY and is_compiled(self.work):
            kernel = compiled(entering_choices, self.work)
            begin, choices = kernel(self.choice_to_branches, self.branch_to_target, self.states)
            return _locked(begin, width), _locked(choices, width)
        counts = np.bincount(self.branch_to_target, minlength=self.states)
        starts, order = np.concatenate([[0], np.cumsum(counts)]), np.argsort(self.branch_to_target, kind="stable")
        return _locked(starts, width), _locked(self.branch_to_choice[order], width)

    def forget(self) -> None:
        """Give back the memory of what is made anew where it is asked for again."""
        for name in ("_reverse", "branch_to_choice", "choice_to_state"):
            self.__dict__.pop(name, None)

    def by_choice(self, states: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Return for each choice whether its state is one of `states` ``[S]``, as ``[C]``."""
        return np.repeat(states, np.diff(self.state_to_choices))

    @property
    def states(self) -> int:
        """The number of states, S."""
        return len(self.state_to_choices) - 1

    @property
    def choices(self) -> int:
        """The number of choices, C."""
        return len(self.choice_to_branches) - 1

    @property
    def work(self) -> int:
        """How much work one pass is: the number of branches."""
        return len(self.branch_to_target)


_KNOWN: WeakKeyDictionary[MDP, Index] = WeakKeyDictionary()


def index_of(mdp: MDP) -> Index:
    """Return the Index of a model, built the first time it is asked for."""
    known = _KNOWN.get(mdp)
    if known is None:
        known = build_index(mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target)
        _KNOWN[mdp] = known
    return known


def build_index(state_to_choices: Ints, choice_to_branches: Ints, branch_to_target: Ints) -> Index:
    """Return the Index of rows.

    Parameters
    ----------
    state_to_choices, choice_to_branches, branch_to_target : array of int, ``[S+1]``, ``[C+1]``, ``[B]``
        As in `MDP`; here a state may be without choices and a choice without branches.

    Returns
    -------
    Index
        Its arrays are read-only.
    """
    states = len(state_to_choices) - 1
    width = _width(states, len(choice_to_branches) - 1, len(branch_to_target))
    room_for(BYTES * len(branch_to_target), f"The index of a model of {len(branch_to_target)} branches")
    look()
    return Index(
        state_to_choices=_locked(state_to_choices, width),
        choice_to_branches=_locked(choice_to_branches, width),
        branch_to_target=_locked(branch_to_target, width),
    )


def _width(*counts: int) -> type[np.int32 | np.int64]:
    """Return the width of all arrays of an index: with one width, one compiled kernel serves all graphs."""
    return np.int32 if max(counts) < np.iinfo(np.int32).max else np.int64


def _locked(array: npt.NDArray[Any], width: type[np.int32 | np.int64]) -> Ints:
    """Return `array` in `width`, read-only."""
    made: Any = np.ascontiguousarray(array, dtype=width)
    made.flags.writeable = False
    locked: Ints = made
    return locked


def branches_of(choice_to_branches: Ints, choices: Ints) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the branches of some choices, one after another, and where each choice's begin among them.

    Parameters
    ----------
    choice_to_branches : array of int, ``[C+1]``
    choices : array of int, ``[N]``

    Returns
    -------
    branches : array of int64
        Their branches in the order of `choices`.
    offsets : array of int64, ``[N+1]``
        The branches of ``choices[i]`` are ``branches[offsets[i]:offsets[i+1]]``.
    """
    first = choice_to_branches[choices].astype(np.int64)
    offsets = np.zeros(len(choices) + 1, dtype=np.int64)
    np.cumsum(choice_to_branches[choices + 1] - first, out=offsets[1:])
    branches = np.arange(offsets[-1]) + np.repeat(first - offsets[:-1], np.diff(offsets))
    return branches, offsets
