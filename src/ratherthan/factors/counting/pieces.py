"""A graph whose edges all run both ways enters; what falls apart without a state leaves, for every state at once.

On a map whose streets all run both ways, what can be reached from a neighbour of s without s is the connected piece of the
graph without s that the neighbour lies in. A depth-first search tells the pieces of all states in one pass: it has tree edges
and edges back to ancestors only, so without s the subtree of a child c of s hangs together, and it is cut off if and only if
no edge leads from it past s (low[c] ≥ number of s). All that is not cut off is one piece: the rest. States numbered in
preorder make each subtree a range, and its weight a difference of two prefix sums. So after a pass over the edges every choice
is answered in the time that looking at its own branches takes, whatever the map looks like.

Edges to states without edges (goals, hazards, dead ends) run one way and are left out; such states (`ends`) must weigh nothing.

References
----------
J. Hopcroft, R. Tarjan, Algorithm 447: Efficient Algorithms for Graph Manipulation, CACM 16(6), 1973.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.factors.counting._kernels import depth_first_pieces, piece_weights
from ratherthan.model._kernels import compiled, reversed_rows
from ratherthan.model.mdp import Bools, Ints
from ratherthan.model.watch import look

__all__ = ["Pieces", "pieces_of", "sums_of", "weigh_pieces"]

Counts = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.int32]
SLICE = 1 << 19
"""How many choices are weighed between two looks."""


class Pieces(NamedTuple):
    """A depth-first search of a graph."""

    number: Numbers  # [S]
    order: Numbers  # [S], the states by number; all that follows is by number, too
    size: Numbers  # [S], of the subtree
    apart: Bools  # [S], whether nothing leads from the subtree past the parent
    top: Numbers  # [S], the root of the tree
    children_from: Counts  # [S+1]
    children: Numbers
    ends: Counts  # the states without edges to which an edge leads


def pieces_of(leaving_from: Counts, leaving: Numbers, work: int) -> Pieces | None:
    """Return the pieces of a graph, None where an edge between states with edges runs one way only."""
    ways = np.diff(leaving_from)
    kept = ways[leaving] > 0
    within = leaving[kept]
    sums = np.zeros(len(kept) + 1, dtype=np.int64)
    np.cumsum(kept, out=sums[1:])
    within_from = sums[leaving_from]
    if not np.array_equal(np.bincount(within, minlength=len(ways)), np.diff(within_from)):
        return None
    look()
    turn = compiled(reversed_rows, work)
    back_from, back = turn(within_from, within)
    look()
    _, there = turn(back_from, back)  # turned twice: the edges themselves, those of a state in order
    if not np.array_equal(back, there):
        return None
    look()
    ends = np.flatnonzero(np.bincount(leaving[~kept], minlength=len(ways)))
    return Pieces(*compiled(depth_first_pieces, work)(back_from, back), ends)


def sums_of(pieces: Pieces, weights: tuple[Counts, Counts]) -> tuple[Counts, Counts]:
    """Return the prefix sums of two weights, ``[S]`` each, in the order of the pieces."""
    certain = _sums(weights[0][pieces.order])
    return certain, certain if weights[0] is weights[1] else _sums(weights[1][pieces.order])


def weigh_pieces(
    pieces: Pieces, rows: tuple[Ints, Ints], asked: tuple[Counts, Counts], sums: tuple[Counts, Counts], work: int
) -> tuple[Counts, Counts]:
    """Return the weights of the search trees of some choices.

    Parameters
    ----------
    pieces : Pieces
    rows : pair of arrays
        choice_to_branches and branch_to_target.
    asked : pair of arrays of int, ``[N]``
        The choices and their states.
    sums : pair of arrays of int, ``[S+1]``
        Those of the weights of states that count for sure, and of all that may count; they are 0 at `pieces.ends`.
    work : int

    Returns
    -------
    lower, upper : array of int, ``[N]``
    """
    tree = pieces.number, pieces.size, pieces.apart, pieces.top, pieces.children_from, pieces.children
    kernel = compiled(piece_weights, work)
    choices, states = asked
    found = []
    for first in range(0, max(len(choices), 1), SLICE):
        look()
        part = slice(first, first + SLICE)
        found.append(kernel(choices[part], states[part], rows, tree, *sums))
    return np.concatenate([lower for lower, _ in found]), np.concatenate([upper for _, upper in found])


def _sums(weight: Counts) -> Counts:
    """Return the sums of the first 0, 1, … N numbers."""
    sums = np.zeros(len(weight) + 1, dtype=np.int64)
    np.cumsum(weight, out=sums[1:])
    return sums
