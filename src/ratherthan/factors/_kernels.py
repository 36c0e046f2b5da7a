"""Rows of a model enter, what one search tree holds leaves: the loop that numpy cannot do in one stroke."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats, Ints

__all__ = ["Trees", "Weight", "rooted_weights", "tree_weight"]

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


class Trees(NamedTuple):
    """Dominator trees of K roots, forward and backward, with prefix sums of the weights in forward order."""

    roots: Ints  # [K]
    position: Ints  # [K, S]
    size: Ints  # [K, S]
    certain: Counts  # [K, S+1]
    possible: Counts  # [K, S+1]
    back_position: Ints  # [K, S]
    back_size: Ints  # [K, S]


def rooted_weights(
    choices: Counts,
    states: Counts,
    rows: tuple[Ints, Ints, Ints, Ints],
    certain: Counts,
    possible: Counts,
    trees: Trees,
    room: tuple[Counts, Ints, int],
    budget: int,
) -> tuple[Counts, Counts, int, int]:
    """Weigh the search tree of every one of `choices`, of the `states`, with what the trees know already.

    `rows` are choice_to_branches, branch_to_target, and the graph's leaving_from and leaving. A root that can be reached from
    the choice without its state stands for all that it reaches without it; only the rest is searched. `room` is a mark per
    state, a queue for all states and the stamp of the first choice. Returns the weights, how many choices were weighed before
    `budget` visits were spent, and how many were.
    """
    choice_to_branches, branch_to_target, leaving_from, leaving = rows
    mark, queue, stamp = room
    lower, upper = np.zeros(len(choices), np.int64), np.zeros(len(choices), np.int64)
    spent = 0
    for i in range(len(choices)):
        if spent > budget:
            return lower, upper, i, spent
        s = states[i]
        now = stamp + i
        begin, end = choice_to_branches[choices[i]], choice_to_branches[choices[i] + 1]
        known, most = -1, -1
        for k in range(len(trees.roots)):
            r = trees.roots[k]
            if r == s:
                continue
            total = trees.possible[k, -1]
            p = trees.position[k, s]
            if p >= 0:
                total -= trees.possible[k, p + trees.size[k, s]] - trees.possible[k, p]
            if total <= most:
                continue
            p = trees.back_position[k, s]
            for b in range(begin, end):
                u = branch_to_target[b]
                q = trees.back_position[k, u]
                if u != s and q >= 0 and (p < 0 or q < p or q >= p + trees.back_size[k, s]):
                    known, most = k, total
                    break
        first, last = -1, -1
        if known >= 0:
            p = trees.position[known, s]
            lower[i], upper[i] = trees.certain[known, -1], most
            if p >= 0:
                first, last = p, p + trees.size[known, s]
                lower[i] -= trees.certain[known, last] - trees.certain[known, first]
        filled, head = 0, 0
        mark[s] = now
        for b in range(begin, end):
            t = branch_to_target[b]
            q = trees.position[known, t] if known >= 0 else -1
            if mark[t] != now and (q < 0 or first <= q < last):
                mark[t] = now
                queue[filled] = t
                filled += 1
        while head < filled:
            u = queue[head]
            head += 1
            lower[i] += certain[u]
            upper[i] += possible[u]
            for e in range(leaving_from[u], leaving_from[u + 1]):
                t = leaving[e]
                if mark[t] != now:
                    q = trees.position[known, t] if known >= 0 else -1
                    if q < 0 or first <= q < last:
                        mark[t] = now
                        queue[filled] = t
                        filled += 1
        spent += filled + 1
    return lower, upper, len(choices), spent
