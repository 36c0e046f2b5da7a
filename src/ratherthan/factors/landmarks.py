"""Many choices enter, the weights of their search trees leave: what they share is counted once.

The search tree of a choice (s,a) is what can be reached from its successors in the graph without s. One search per choice
looks at the whole graph each time, though most of what it finds is always the same. Let r be any other state, a *landmark*.
Its dominator tree tells what r reaches without s: all that r reaches but the subtree of s. The same tree of the reverse graph
tells which states reach r without s. So if a successor of (s,a) reaches r without s, all that r reaches without s belongs to
the search tree, its weight is a difference of sums known beforehand, and only what lies outside of it is searched. It is
exact for any landmarks; their choice matters for speed alone. Good ones lie on the route and in the largest strong component.

The two trees of a landmark cost about as much as five searches: below some dozens of choices the plain search is faster.

References
----------
See `ratherthan.model.dominators`.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from ratherthan.factors._kernels import Trees, rooted_weights
from ratherthan.model._kernels import compiled, strong_components
from ratherthan.model.dominators import DominatorTree, Graph, dominator_tree, graph_of, opposite
from ratherthan.model.index import Index, index_of
from ratherthan.model.mdp import MDP, Bools

__all__ = ["Landmarks", "landmarks", "landmarks_of", "tree_weights"]

Numbers = npt.NDArray[np.int64]

LANDMARKS = 3
BUDGET = 4_000_000
"""How many visits of a state are made between two chances to be interrupted: less than a second."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Landmarks:
    """A graph with the dominator trees of some of its states, forward and backward."""

    graph: Graph
    forward: tuple[DominatorTree, ...]
    backward: tuple[DominatorTree, ...]

    def weighed(self, certain: Numbers, possible: Numbers) -> Trees:
        """Return the trees for the kernel, with prefix sums of two weights, ``[S]`` each."""
        sums = [[_padded(tree.prefix(weight), len(weight)) for tree in self.forward] for weight in (certain, possible)]
        return Trees(
            roots=np.array([tree.root for tree in self.forward]),
            position=np.array([tree.position for tree in self.forward]),
            size=np.array([tree.size for tree in self.forward]),
            certain=np.array(sums[0]),
            possible=np.array(sums[1]),
            back_position=np.array([tree.position for tree in self.backward]),
            back_size=np.array([tree.size for tree in self.backward]),
        )


def _padded(sums: Numbers, states: int) -> Numbers:
    return np.concatenate([sums, np.full(states + 1 - len(sums), sums[-1])])


def landmarks(index: Index, leaves: Bools, near: Numbers) -> Landmarks:
    """Return a few landmarks of a graph.

    Parameters
    ----------
    index : Index
    leaves : array of bool, ``[S]``
        States from which nothing is followed.
    near : array of int
        States around which questions will be asked, in the order of a route where there is one.
    """
    graph = graph_of(index, leaves)
    largest = _largest_component(index, leaves)
    candidates = [int(near[len(near) // 2]), int(near[0]), int(near[-1])] if len(near) else []
    inside = [state for state in candidates if largest[state]]
    members = np.flatnonzero(largest)
    spread = [int(members[len(members) * k // LANDMARKS]) for k in range(LANDMARKS)]
    roots = list(dict.fromkeys(inside + spread + candidates))[:LANDMARKS]
    reverse = opposite(graph)
    return Landmarks(
        graph=graph,
        forward=tuple(dominator_tree(graph, root) for root in roots),
        backward=tuple(dominator_tree(reverse, root) for root in roots),
    )


_KNOWN: WeakKeyDictionary[MDP, tuple[Bools, Landmarks]] = WeakKeyDictionary()


def landmarks_of(mdp: MDP, leaves: Bools, choices: Numbers) -> Landmarks:
    """Return the landmarks of a model, found the first time they are asked for with these leaves, near these choices."""
    before = _KNOWN.get(mdp)
    if before is not None and np.array_equal(before[0], leaves):
        return before[1]
    index = index_of(mdp)
    found = landmarks(index, leaves, index.choice_to_state[choices].astype(np.int64))
    _KNOWN[mdp] = leaves.copy(), found
    return found


def _largest_component(index: Index, leaves: Bools) -> Bools:
    """Return the states of the largest strong component, ``[S]``."""
    component = np.full(index.states, -1, dtype=np.int64)
    kernel = compiled(strong_components, index.work)
    everywhere = np.ones(index.states, dtype=np.bool_)
    allowed = ~leaves[index.choice_to_state]
    kernel(
        index.state_to_choices, index.choice_to_branches, index.branch_to_target,
        allowed, np.arange(index.states), everywhere, component, 0,
    )  # fmt: skip
    largest: Bools = component == np.bincount(component).argmax()
    return largest


def tree_weights(
    index: Index, known: Landmarks, choices: Numbers, weights: tuple[Numbers, Numbers], budget: int = BUDGET
) -> tuple[Numbers, Numbers]:
    """Return the weights of the search trees of some choices.

    Parameters
    ----------
    index : Index
    known : Landmarks
        Of this index.
    choices : array of int, ``[N]``
    weights : pair of arrays of int, ``[S]`` each
        Those of the states that count for sure, and of all that may count.
    budget : int
        How many states are visited, about, before the loop comes up for air: an interruption is heard then.

    Returns
    -------
    lower, upper : array of int, ``[N]``
    """
    certain, possible = weights
    kernel = compiled(rooted_weights, index.work)
    rows = index.choice_to_branches, index.branch_to_target, known.graph.leaving_from, known.graph.leaving
    states, trees = index.choice_to_state[choices].astype(np.int64), known.weighed(certain, possible)
    found: list[tuple[Numbers, Numbers]] = []
    done = 0
    while done < len(choices):
        lower, upper, more = kernel(choices[done:], states[done:], rows, certain, possible, trees, budget)
        found.append((lower[:more], upper[:more]))
        done += more
    empty = np.zeros(0, dtype=np.int64)
    return np.concatenate([empty, *(low for low, _ in found)]), np.concatenate([empty, *(high for _, high in found)])
