"""Rows of a model enter, what one search tree holds leaves: the loop that numpy cannot do in one stroke."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats, Ints

__all__ = ["Weight", "tree_weight"]

Counts = npt.NDArray[np.int64]


class Weight(NamedTuple):
    """The decisions in a search tree: those of states that are critical for sure, and of those that may be."""

    certain: int
    possible: int


def tree_weight(
    root: int,
    own: tuple[int, int],
    rows: tuple[Ints, Ints, Ints],
    leaf: Bools,
    certain: Counts,
    possible: Counts,
    room: tuple[Counts, Counts, int],
    horizon: int,
    nearer_target: Floats,
    nearer_origin: Floats,
) -> Weight:
    """Search breadth first from the branches `own` of a choice of `root`, never entering `root`.

    `rows` are state_to_choices, choice_to_branches and branch_to_target; `room` is a mark per state, a queue for all states
    and the stamp of this search. A negative `horizon` is without end; where `nearer_target` is not
    empty, only branches from s to t with nearer_target[t] < nearer_origin[s] are followed.
    """
    state_to_choices, choice_to_branches, branch_to_target = rows
    mark, queue, stamp = room
    toward = len(nearer_target) > 0
    lower, upper = 0, 0
    filled, head = 0, 0
    mark[root] = stamp
    for b in range(own[0], own[1]):
        t = branch_to_target[b]
        if mark[t] != stamp:
            mark[t] = stamp
            queue[filled] = t
            filled += 1
            lower += certain[t]
            upper += possible[t]
    layer, steps = filled, 0
    while head < filled:
        if head == layer:
            layer = filled
            steps += 1
        if horizon >= 0 and steps >= horizon:
            break
        s = queue[head]
        head += 1
        if leaf[s]:
            continue
        for b in range(choice_to_branches[state_to_choices[s]], choice_to_branches[state_to_choices[s + 1]]):
            t = branch_to_target[b]
            if mark[t] != stamp and not (toward and nearer_target[t] >= nearer_origin[s]):
                mark[t] = stamp
                queue[filled] = t
                filled += 1
                lower += certain[t]
                upper += possible[t]
    return Weight(lower, upper)
