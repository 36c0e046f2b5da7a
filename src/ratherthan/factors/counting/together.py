"""Many choices enter, the weights of their search trees leave: 512 searches are one, with a bit for each.

A state is looked at when new bits have come to it, and hands them on to its successors, but never the bit of a choice of s to s.
Strong components are gone through from large numbers to small, so that outside of components all bits have come before a state
is looked at; inside, states are looked at in turn until no bit is new. The weights are added up bit by bit at the end, as sums in
binary digits that lie across: one digit of 64 sums is one word.

It needs nothing of the graph, and is exact on all of them. How much is gained depends on what the searches share: choices of
neighbouring states share nearly all.

References
----------
M. Then et al., The More the Merrier: Efficient Multi-Source Graph Traversal, PVLDB 8(4), 2014.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.factors.counting._kernels import WORDS, search_together
from ratherthan.factors.counting.ground import Ground
from ratherthan.model._kernels import compiled
from ratherthan.model.watch import room_for

__all__ = ["TOGETHER", "Together", "together_visits"]

Counts = npt.NDArray[np.int64]

TOGETHER = 64 * WORDS
"""How many choices are searched at once."""
PER_LOOK = 2
"""How many visits of a search by itself take as long as looking at a state with all its bits."""


def together_visits(ground: Ground, choices: int) -> int:
    """Return about how much work it is for so many choices, in visits of a search: if each state is looked at twice a time."""
    return -(-choices // TOGETHER) * 2 * PER_LOOK * ground.states


class Together:
    """Weighs the search trees of up to 512 choices at a time.

    Parameters
    ----------
    ground : Ground
    weights : pair of arrays of int, ``[S]``
        Those of the states that count for sure, and of all that may count.
    """

    def __init__(self, ground: Ground, weights: tuple[Counts, Counts]) -> None:
        states = ground.states
        room_for((8 * WORDS + 15) * states, f"Searching {states} states from {TOGETHER} choices at once")
        self.ground = ground
        self.weights = *weights, weights[0] is weights[1]
        self.room = (
            np.zeros((states, WORDS), dtype=np.uint64),
            np.empty(states, dtype=np.int32),
            np.empty(states, dtype=np.int32),
            np.full(states, -1, dtype=np.int32),
            np.zeros(3 * states, dtype=np.bool_),
        )

    def weigh(self, choices: Counts, states: Counts) -> tuple[Counts, Counts, int]:
        """Weigh the search trees of `choices`, of the `states`; return both weights, and the work it was."""
        ground, parts = self.ground, self.ground.components
        rows = ground.rows[1], ground.rows[2], ground.leaving_from, ground.leaving
        found = np.zeros(len(choices), dtype=np.int64), np.zeros(len(choices), dtype=np.int64)
        kernel = compiled(search_together, ground.work)
        members = parts.component, parts.members_from, parts.members
        looked = kernel(choices, states, rows, members, self.weights, self.room, found)
        return *found, PER_LOOK * looked + len(choices)
