"""How often a policy takes each choice enters, the graph it moves in leaves: what can be reached, most probable ways, circles.

Branches that stay in place are left out and the rest renormalised. The length of a branch is -log of its probability, so
that the most probable way is the shortest (Dijkstra 1959).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ratherthan.model.compiling import compiled
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.watch import look
from ratherthan.verify._kernels import nearest
from ratherthan.verify.frame import Array, Frame, parts, slices

__all__ = ["TIE", "Edge", "Moves", "moves_of"]

TIE = 1e-12
"""Two ways are equally probable up to this difference in log-probability."""


@dataclass(frozen=True)
class Edge:
    """One move: by which choice, where to, how probable, and how probable before staying in place was left out."""

    choice: int
    target: int
    chance: float
    part: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Moves:
    """The moves of a policy in rows by state, in the order of (choice, branch): E moves.

    Parameters
    ----------
    first : array of int, ``[S+1]``
        Where the moves of each state begin; ended states have none.
    origin, target, choice : array of int, ``[E]``
    chance, part : array of float, ``[E]``
        The probability of each move with and without renormalising.
    """

    first: Array  # [S+1]
    origin: Array  # [E]
    target: Array  # [E]
    choice: Array  # [E]
    chance: Floats  # [E]
    part: Floats  # [E]

    def of(self, state: int) -> list[Edge]:
        """Return the moves of one state."""
        return [
            Edge(int(self.choice[e]), int(self.target[e]), float(self.chance[e]), float(self.part[e]))
            for e in range(int(self.first[state]), int(self.first[state + 1]))
        ]

    def move(self, state: int, choice: int, target: int) -> float:
        """Return the largest probability of one move by `choice` to `target`, 0 where there is none."""
        return max((e.chance for e in self.of(state) if (e.choice, e.target) == (choice, target)), default=0.0)

    def reached(self, start: int, known: Bools | None = None) -> Bools:
        """Return which states can be reached, the start included, ``[S]``; with those `known` to be, and all that they lead to."""
        found = np.zeros(len(self.first) - 1, dtype=np.bool_) if known is None else known.copy()
        layer = np.array([start], dtype=np.int64)
        while len(layer):
            found[layer] = True
            target = self.target[slices(self.first[layer], self.first[layer + 1])]
            layer = np.unique(target[~found[target]])
        return found

    @cached_property
    def length(self) -> Floats:
        """-log of the probability of each move, ``[E]``."""
        return np.asarray(-np.log(np.minimum(self.chance, 1.0)))

    def distances(self, to: Bools) -> Floats:
        """Return the length of the shortest way from each state to one of `to`, ``[S]``; ∞ where there is none."""
        distance = np.where(to, 0.0, np.inf)
        used = np.flatnonzero(~to[self.origin])
        if len(used):
            look()
            used = used[np.argsort(self.target[used], kind="stable")]
            count = np.bincount(self.target[used], minlength=len(to))
            first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
            room = np.zeros((2, len(to)), dtype=np.int64)
            compiled(nearest, len(used))(first, self.origin[used], self.length[used], distance, room[0], room[1])
        return distance

    def closed(self, start: int) -> tuple[Array, Bools]:
        """Return the component of each state reached, and which lie in one that is never left, ``[S]`` each."""
        reached = self.reached(start)
        used = reached[self.origin]
        part = parts(len(reached), self.origin[used], self.target[used])
        leaving = np.zeros(len(reached), dtype=np.bool_)
        leaving[part[self.origin[used & (part[self.origin] != part[self.target])]]] = True
        return part, reached & ~leaving[part]


def moves_of(frame: Frame, weight: Floats) -> Moves:
    """Return the moves of a policy.

    Parameters
    ----------
    frame : Frame
    weight : array of float, ``[C]``
        How often it takes each choice of its state.
    """
    mdp = frame.mdp
    chosen = np.flatnonzero((weight > 0) & frame.running[frame.row_state])
    branch = slices(
        mdp.choice_to_branches[chosen].astype(np.int64), mdp.choice_to_branches[chosen + 1].astype(np.int64)
    )
    choice = frame.entry_row[branch]
    origin, target = frame.row_state[choice], mdp.branch_to_target[branch].astype(np.int64)
    away = origin != target
    choice, origin, target, branch = choice[away], origin[away], target[away], branch[away]
    part = weight[choice] * mdp.branch_to_probability[branch]
    total = np.bincount(origin, weights=part, minlength=mdp.states)
    count = np.bincount(origin, minlength=mdp.states)
    return Moves(
        first=np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
        origin=origin,
        target=target,
        choice=choice,
        chance=part / total[origin],
        part=part,
    )
