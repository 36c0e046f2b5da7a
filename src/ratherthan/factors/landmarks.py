"""Many choices enter, the weights of their search trees leave: what they share is counted once.

The search tree of a choice (s,a) is what can be reached from its successors in the graph without s. One search per choice
looks at the whole graph each time, though most of what it finds is always the same. Let r be any other state, a *landmark*.
Its dominator tree tells what r reaches without s: all that r reaches but the subtree of s. The same tree of the reverse graph
tells which states reach r without s. So if a successor of (s,a) reaches r without s, all that r reaches without s belongs to
the search tree, its weight is a difference of sums known beforehand, and only what lies outside of it is searched. It is
exact for any landmarks; their choice matters for speed alone. Good ones lie in the largest strong component, near the
questions. One is made first, others where the searches show that it was not enough.

The two trees of a landmark cost about as much as three searches.

References
----------
See `ratherthan.model.dominators`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.factors._kernels import Trees, rooted_weights
from ratherthan.factors.counting.ground import Ground
from ratherthan.model._kernels import compiled, is_compiled
from ratherthan.model.dominators import DominatorTree, dominator_tree, opposite
from ratherthan.model.watch import look

__all__ = ["LANDMARKS", "Landmark", "Weigher", "landmark_at", "next_root", "slice_visits"]

Numbers = npt.NDArray[np.int64]

LANDMARKS = 3
LEAST_SHARE = 0.01
"""A strong component with a smaller share of the states gets no landmark: searches in it are short."""
BUDGET = 4_000_000
"""How many visits of a state are made between two looks, compiled: less than half a second, mostly."""
USUAL = 4
"""With so many edges a state; with more, fewer states are visited."""
PLAIN = 40
"""How many times slower the plain loops are."""
CHUNK = 1 << 19
"""How many choices a kernel is given at most at once."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Landmark:
    """The dominator trees of one state, in the graph and in the reverse graph."""

    forward: DominatorTree
    backward: DominatorTree


def landmark_at(ground: Ground, root: int) -> Landmark:
    """Return the landmark at a state."""
    graph = ground.graph
    look()
    forward = dominator_tree(graph, root)
    look()
    return Landmark(forward=forward, backward=dominator_tree(opposite(graph), root))


def next_root(ground: Ground, landmarks: Sequence[Landmark], states: Numbers) -> int | None:
    """Return where one more landmark helps to answer questions at `states`, None where it would not.

    It lies in the largest strong component that has none yet, or once more in the largest: near the state in the middle of
    those that are asked about, if possible at one that few questions are asked about, for it cannot help with its own.
    """
    parts = ground.components
    size = parts.size.copy()
    enough = max(2.0, LEAST_SHARE * ground.states)
    largest = int(size.argmax()) if len(size) else 0
    for known in landmarks:
        size[parts.component[known.forward.root]] = 0
    chosen = int(size.argmax()) if len(size) and size.max() >= enough else largest
    if not len(size) or parts.size[chosen] < enough:
        return None
    asked = np.bincount(states, minlength=ground.states)
    inside = states[parts.component[states] == chosen]
    members = parts.members[parts.members_from[chosen] : parts.members_from[chosen + 1]]
    middle = int(inside[len(inside) // 2]) if len(inside) else int(members[len(members) // 2])
    around = ground.leaving[ground.leaving_from[middle] : ground.leaving_from[middle + 1]]
    near = np.array([middle, *around[parts.component[around] == chosen]], dtype=np.int64)
    taken = {known.forward.root for known in landmarks}
    free = [int(root) for root in near if int(root) not in taken]
    return min(free, key=lambda root: asked[root]) if free else None


def slice_visits(ground: Ground) -> int:
    """Return how many visits are made between two looks."""
    few = BUDGET if is_compiled(ground.work) else BUDGET // PLAIN
    return max(few * USUAL // max(USUAL, len(ground.leaving) // max(ground.states, 1)), 1)


class Weigher:
    """Weighs the search trees of choices, with landmarks or without, in slices.

    Parameters
    ----------
    ground : Ground
    landmarks : sequence of Landmark
        Of this ground.
    weights : pair of arrays of int, ``[S]``
        Those of the states that count for sure, and of all that may count.
    """

    def __init__(self, ground: Ground, landmarks: Sequence[Landmark], weights: tuple[Numbers, Numbers]) -> None:
        self.ground = ground
        self.weights = weights
        self.trees = ground.once(
            f"{len(landmarks)} landmarks", weights, lambda: _weighed(ground.states, landmarks, weights)
        )
        self.mark = np.zeros(ground.states, dtype=np.int64)
        self.queue = np.empty(ground.states, dtype=np.int32)
        self.stamp = 1

    def weigh(self, choices: Numbers, states: Numbers, visits: int | None = None) -> tuple[Numbers, Numbers, int]:
        """Weigh the search trees of the first of `choices`, of the `states`: of one at least, of all if the work is little.

        Returns
        -------
        lower, upper : array of int, ``[M]``
            The weights of the first M choices.
        spent : int
            The visits made: about `visits` at most.
        """
        ground = self.ground
        rows = ground.rows[1], ground.rows[2], ground.leaving_from, ground.leaving
        budget = slice_visits(ground) if visits is None else min(visits, slice_visits(ground))
        room = self.mark, self.queue, self.stamp
        self.stamp += min(len(choices), CHUNK)  # before the marks are set: they are never set twice
        kernel = compiled(rooted_weights, ground.work)
        lower, upper, done, spent = kernel(
            choices[:CHUNK], states[:CHUNK], rows, *self.weights, self.trees, room, budget
        )
        return lower[:done], upper[:done], spent


def _weighed(states: int, landmarks: Sequence[Landmark], weights: tuple[Numbers, Numbers]) -> Trees:
    """Return the trees for the kernel, with prefix sums of two weights, ``[S]`` each."""
    certain = np.zeros((len(landmarks), states + 1), dtype=np.int64)
    possible = certain if weights[0] is weights[1] else np.zeros_like(certain)
    places = np.empty((4, len(landmarks), states), dtype=np.int32)
    for k, known in enumerate(landmarks):
        trees = known.forward, known.backward
        for i, tree in enumerate(trees):
            places[2 * i, k], places[2 * i + 1, k] = tree.position, tree.size
        order = known.forward.order
        for sums, weight in zip((certain, possible), weights, strict=True):
            np.cumsum(weight[order], out=sums[k, 1 : len(order) + 1])
            sums[k, len(order) + 1 :] = sums[k, len(order)]
            if certain is possible:
                break
    roots = np.array([known.forward.root for known in landmarks], dtype=np.int64)
    return Trees(
        roots=roots,
        position=places[0],
        size=places[1],
        certain=certain,
        possible=possible,
        back_position=places[2],
        back_size=places[3],
    )
