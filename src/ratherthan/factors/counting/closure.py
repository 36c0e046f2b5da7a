"""Choices enter whose search trees lie among strong components that never lead back; what those weigh leaves.

Where a graph is like a river, its strong components small and one leading to the next, no landmark helps: each state reaches
something else. But components are numbered so that each leads to smaller numbers only. So one pass over the edges between
them, from small numbers to large, finds for 512 of them at a time (the *columns* of a block: 512 bits a component) which
components lead to them. After as many passes as there are blocks, what any component leads to has been weighed, exactly.

A choice (s,a) is *split* first: what its successors reach is followed by a search as long as it might lead to s, that is in
components with no smaller number than that of s. All others are *roots*: what they lead to never needs s, and the union of it
is read off the bits. Choices at which that first search takes long are left to others.

Columns of equal weight lie in one block, so that bits are counted and multiplied; only components that can lead to the columns
of a block, those with larger numbers, are passed.

References
----------
R. Tarjan, Depth-First Search and Linear Graph Algorithms, SIAM J. Comput. 1(2), 1972 (the numbers).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.factors.counting._kernels import WORDS, close_block, gather_block, outside_roots
from ratherthan.factors.counting.ground import Ground
from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import Bools
from ratherthan.model.watch import look, room_for

__all__ = ["Split", "closure_visits", "split", "weigh_roots"]

Counts = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.int32]

COLUMNS = 64 * WORDS
MOST = 96, 48
"""How many visits and roots the split of one choice may take."""
SLICE = 1 << 15
"""How many choices are split between two looks."""
MOST_CLASSES = 12
"""Up to how many weights in a block bits are counted for each weight; with more, for each binary digit."""
JOINS_PER_VISIT = 4
"""How many joins of two rows of bits take as long as one visit of a search."""


class Split(NamedTuple):
    """The roots of N choices, in rows, and the weight of what was searched before them."""

    done: Bools  # [N], whether the choice could be split; elsewhere it has no roots
    roots_from: Counts  # [N+1]
    roots: Numbers
    lower: Counts  # [N]
    upper: Counts  # [N]


def split(ground: Ground, choices: Counts, states: Counts, weights: tuple[Counts, Counts]) -> Split:
    """Split what each of `choices`, of the `states`, leads to.

    Parameters
    ----------
    ground : Ground
    choices, states : array of int, ``[N]``
    weights : pair of arrays of int, ``[S]``
        Those of the states that count for sure, and of all that may count.
    """
    kernel = compiled(outside_roots, ground.work)
    rows = ground.rows[1], ground.rows[2], ground.leaving_from, ground.leaving
    found = []
    for first in range(0, max(len(choices), 1), SLICE):
        look()
        part = slice(first, first + SLICE)
        roots = np.empty(MOST[1] * len(choices[part]), dtype=np.int32)
        done, ends, lower, upper = kernel(
            choices[part], states[part], rows, ground.components.component, *weights, MOST, roots
        )
        found.append(Split(done, np.diff(ends), roots[: ends[-1]].copy(), lower, upper))
    joined = [np.concatenate(column) for column in zip(*found, strict=True)]
    roots_from = np.zeros(len(choices) + 1, dtype=np.int64)
    np.cumsum(joined[1], out=roots_from[1:])
    return Split(joined[0], roots_from, *joined[2:])


def closure_visits(ground: Ground, roots: int, weight: Counts) -> int:
    """Return how much work the closure is for choices with so many roots together, in visits of a search."""
    heavy = np.unique(ground.components.component[weight > 0])
    onward_from, onward = ground.onward
    return -(-len(heavy) // COLUMNS) * (len(onward) + len(onward_from) + roots) // (2 * JOINS_PER_VISIT)


def weigh_roots(ground: Ground, found: Split, weights: tuple[Counts, Counts]) -> tuple[Counts, Counts]:
    """Return the weights of the search trees of choices that were split.

    Parameters
    ----------
    ground : Ground
    found : Split
    weights : pair of arrays of int, ``[S]``

    Returns
    -------
    lower, upper : array of int, ``[N]``
    """
    parts = ground.components
    onward_from, onward = ground.onward
    count = len(onward_from) - 1
    roots_from, roots, rows = _distinct(found.roots_from, found.roots)
    sums = np.zeros(len(roots_from) - 1, dtype=np.int64), np.zeros(len(roots_from) - 1, dtype=np.int64)
    certain, possible = (_per_component(parts.component, weight, count) for weight in weights)
    top = int(roots.max(initial=-1)) + 1
    heavy = np.flatnonzero(possible[:top])
    columns = heavy[np.lexsort((heavy, certain[heavy], possible[heavy]))]
    room_for(8 * WORDS * top, f"Which of {count} components lead to which, 512 at a time,")
    bits, reaches = np.empty((top, WORDS), dtype=np.uint64), np.zeros(top, dtype=np.bool_)
    place = np.full(top, -1, dtype=np.int32)
    close, gather = compiled(close_block, ground.work), compiled(gather_block, ground.work)
    for begin in range(0, len(columns), COLUMNS):
        look(f"Counting the decisions left open: {begin} of {len(columns)} components")
        block = columns[begin : begin + COLUMNS]
        place[block] = np.arange(len(block))
        first = int(block.min())
        close(onward_from, onward, place, first, bits, reaches)
        gather(roots_from, roots, first, bits, reaches, _classes(certain[block], possible[block]), sums)
        place[block] = -1
    return found.lower + sums[0][rows], found.upper + sums[1][rows]


def _per_component(component: Numbers, weight: Counts, count: int) -> Counts:
    """Return the sum of a weight over each component, exactly."""
    sums = np.zeros(count, dtype=np.int64)
    heavy = np.flatnonzero(weight)
    np.add.at(sums, component[heavy], weight[heavy])
    return sums


def _distinct(roots_from: Counts, roots: Numbers) -> tuple[Counts, Numbers, Counts]:
    """Return the rows with those of one root each once, and which row stands for which."""
    length = np.diff(roots_from)
    single = length == 1
    alone, which = np.unique(roots[roots_from[:-1][single]], return_inverse=True)
    rows = np.empty(len(length), dtype=np.int64)
    rows[single] = which
    rows[~single] = len(alone) + np.arange(len(length) - len(which))
    lengths = np.concatenate([np.ones(len(alone), dtype=np.int64), length[~single]])
    starts = np.zeros(len(lengths) + 1, dtype=np.int64)
    np.cumsum(lengths, out=starts[1:])
    return starts, np.concatenate([alone, roots[~np.repeat(single, length)]]).astype(np.int32), rows


def _classes(certain: Counts, possible: Counts) -> tuple[npt.NDArray[np.uint64], Counts, Counts]:
    """Return sets of columns and what each of their columns adds to the two weights: one set per weight, or per digit."""
    pairs, which = np.unique(np.stack([certain, possible]), axis=1, return_inverse=True)
    if pairs.shape[1] <= MOST_CLASSES:
        chosen = [which.reshape(-1) == k for k in range(pairs.shape[1])]
        low, high = pairs
    else:
        digits = [(certain >> k) & 1 for k in range(int(certain.max()).bit_length())]
        others = [(possible >> k) & 1 for k in range(int(possible.max()).bit_length())]
        chosen = [mask > 0 for mask in (*digits, *others)]
        low = np.array([1 << k for k in range(len(digits))] + [0] * len(others), dtype=np.int64)
        high = np.array([0] * len(digits) + [1 << k for k in range(len(others))], dtype=np.int64)
    masks = np.zeros((len(chosen), COLUMNS), dtype=np.uint8)
    for k, mask in enumerate(chosen):
        masks[k, : len(mask)] = mask
    words = np.packbits(masks, axis=1, bitorder="little").view("<u8").astype(np.uint64)
    return words, np.ascontiguousarray(low), np.ascontiguousarray(high)
