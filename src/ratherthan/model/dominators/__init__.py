"""A graph and a root enter, its dominator tree leaves, in a form that answers "what is cut off without s?" at once.

State s *dominates* t, seen from a root r, if every path from r to t passes through s. The dominators of a state form a chain;
so there is a tree in which the subtree of s holds exactly what r can no longer reach when s is taken out. The states are
numbered in preorder of that tree: a subtree is a range of numbers, and the weight of a subtree is the difference of two
prefix sums.

Method: semidominators with path compression, then the nearest common ancestor of the parent and the semidominator, which is
the immediate dominator (Semi-NCA): near-linear in the number of edges.

References
----------
T. Lengauer, R. E. Tarjan, A Fast Algorithm for Finding Dominators in a Flowgraph, ACM TOPLAS 1(1), 1979.
L. Georgiadis, Linear-Time Algorithms for Dominators and Related Problems, PhD thesis, Princeton, 2005 (Semi-NCA).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled, is_compiled, reversed_rows
from ratherthan.model.dominators._kernels import depth_first, semidominators, tree_places
from ratherthan.model.index import Index
from ratherthan.model.mdp import Bools
from ratherthan.model.watch import look

__all__ = ["DominatorTree", "Graph", "dominator_tree", "graph_of", "opposite"]

Numbers = npt.NDArray[np.int32]
Offsets = npt.NDArray[np.int64]

SLICE = 1 << 21
"""How many edges are looked at between two looks at the limits, compiled: less than half a second, mostly."""
PLAIN = 40
"""How many times slower the plain loops are."""


class Graph(NamedTuple):
    """Edges from state to state in compressed rows, with those of the reverse graph; E counts edges."""

    leaving_from: Offsets  # [S+1]
    leaving: Numbers  # [E]
    entering_from: Offsets  # [S+1]
    entering: Numbers  # [E]


class DominatorTree(NamedTuple):
    """The dominator tree of one root: the subtree of s are the states numbered from position[s] up to position[s] + size[s].

    `position` is -1 where the root does not lead; `order` lists the states by position.
    """

    root: int
    position: Numbers  # [S]
    size: Numbers  # [S]
    order: Numbers  # [N]

    def prefix(self, weight: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Return the sums of `weight`, ``[S]``, over the first 0, 1, … N states of the order, ``[N+1]``."""
        sums = np.zeros(len(self.order) + 1, dtype=np.int64)
        np.cumsum(weight[self.order], out=sums[1:])
        return sums


def graph_of(index: Index, leaves: Bools) -> Graph:
    """Return the edges of all choices, without those of `leaves`, ``[S]``, and without loops from a state to itself."""
    origin = index.choice_to_state[index.branch_to_choice]
    kept = (origin != index.branch_to_target) & ~leaves[origin]
    leaving_from = np.zeros(index.states + 1, dtype=np.int64)
    np.cumsum(np.bincount(origin[kept], minlength=index.states), out=leaving_from[1:])
    leaving = index.branch_to_target[kept].astype(np.int32)
    kernel = compiled(reversed_rows, index.work)
    entering_from, entering = kernel(leaving_from, leaving)
    return Graph(leaving_from, leaving, entering_from, entering)


def opposite(graph: Graph) -> Graph:
    """Return the graph with all edges turned round."""
    return Graph(graph.entering_from, graph.entering, graph.leaving_from, graph.leaving)


def dominator_tree(graph: Graph, root: int) -> DominatorTree:
    """Return the dominator tree of a graph from `root`.

    Parameters
    ----------
    graph : Graph
    root : int
    """
    work, states = len(graph.leaving), len(graph.leaving_from) - 1
    budget = SLICE if is_compiled(work) else SLICE // PLAIN
    number, vertex, parent, path = np.full(states, -1, dtype=np.int32), *np.zeros((3, states), dtype=np.int32)
    number[root], vertex[0], path[0] = 0, root, root
    room = number, vertex, parent, path, graph.leaving_from[:-1].copy()
    at = np.array([1, 0])
    search, dominate = compiled(depth_first, work), compiled(semidominators, work)
    while not search(graph.leaving_from, graph.leaving, room, at, budget):
        look()
    found = int(at[0])
    semi = np.arange(found, dtype=np.int32)
    links = semi, np.stack([parent[:found], semi], axis=1), path
    last = found - 1
    while last > 0:
        last = dominate(graph.entering_from, graph.entering, (number, vertex, parent), links, last, budget)
        look()
    return DominatorTree(root, *compiled(tree_places, work)(states, vertex, parent, semi))
