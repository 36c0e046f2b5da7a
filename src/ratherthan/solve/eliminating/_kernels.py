"""The rows of a sparse matrix enter; its elimination tree, its factors without subtraction, and solutions leave.

All matrices are I - Q with Q ≥ 0, and row i of Q and out[i] sum to 1: out is what leaves the system. Variables are eliminated
in the order of their numbers, block by block; a row of Q has entries in its own block (near) and in earlier ones (far). See
`factored` for what these kernels are for, `ratherthan.model._kernels` for how they run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats

__all__ = [
    "Factors",
    "Pool",
    "Rows",
    "Scratch",
    "eliminate_rows",
    "elimination_tree",
    "fill_of",
    "same_components",
    "substitute_nodes",
    "symmetric_rows",
]

Ints64 = npt.NDArray[np.int64]


class Rows(NamedTuple):
    """Compressed rows of a matrix."""

    begin: Ints64  # [n+1]
    column: Ints64
    entry: Floats


class Factors(NamedTuple):
    """Row i, within its block: what goes to earlier variables (`low`), to later ones (`high`, normalised), and the rest of it."""

    low_from: Ints64  # [n+1]
    low_to: Ints64
    low: Floats
    high_from: Ints64  # [n+1]
    high_to: Ints64
    high: Floats
    kept: Floats  # [n], what does not stay; 0 where it fails


class Scratch(NamedTuple):
    """What elimination remembers from row to row."""

    work: Floats  # [n], all 0
    mark: Ints64  # [n], all -1
    seen: Ints64  # [n], all -1
    stack: Ints64  # [n]
    path: Ints64  # [n]


def symmetric_rows(rows: Ints64, columns: Ints64, n: int) -> tuple[Ints64, Ints64]:
    """Return the rows of the symmetric pattern with entries at (rows, columns) and (columns, rows), some of them twice."""
    begin = np.zeros(n + 1, np.int64)
    for p in range(len(rows)):
        begin[rows[p] + 1] += 1
        begin[columns[p] + 1] += 1
    for i in range(n):
        begin[i + 1] += begin[i]
    free = begin[:-1].copy()
    where = np.empty(2 * len(rows), np.int64)
    for p in range(len(rows)):
        i, j = rows[p], columns[p]
        where[free[i]] = j
        free[i] += 1
        where[free[j]] = i
        free[j] += 1
    return begin, where


def elimination_tree(row_from: Ints64, columns: Ints64) -> Ints64:
    """Return the parent of each variable in the elimination tree of a symmetric pattern, -1 at roots (Liu)."""
    n = len(row_from) - 1
    parent = np.full(n, -1, np.int64)
    ancestor = np.full(n, -1, np.int64)
    for i in range(n):
        for p in range(row_from[i], row_from[i + 1]):
            j = columns[p]
            while j >= 0 and j < i:
                after = ancestor[j]
                ancestor[j] = i
                if after == -1:
                    parent[j] = i
                j = after
    return parent


def fill_of(row_from: Ints64, columns: Ints64, parent: Ints64, most: int) -> int:
    """Return how many entries the lower factor of a symmetric pattern has, or a number above `most` as soon as it is passed."""
    n = len(row_from) - 1
    mark = np.full(n, -1, np.int64)
    filled = 0
    for i in range(n):
        mark[i] = i
        for p in range(row_from[i], row_from[i + 1]):
            j = columns[p]
            while j < i and mark[j] != i:
                mark[j] = i
                filled += 1
                j = parent[j]
        if filled > most:
            break
    return filled


def eliminate_rows(
    pattern: tuple[Ints64, Ints64, Ints64],
    near: Rows,
    out: Floats,
    factors: Factors,
    scratch: Scratch,
    at: Ints64,
    budget: int,
) -> int:
    """Factor some more rows of I - Q without a subtraction (Grassmann, Taksar, Heyman); return how many steps that took.

    What is kept of a row is the sum of all but its diagonal. `pattern` is a symmetric one that covers that of `near`, with its
    elimination tree; `out` is what leaves the block, changed in place, as `factors` are. `at` is the row to go on with, and how
    many entries of both factors there are; it leaves as where it stopped, after `budget` steps or so.
    """
    row_from, columns, parent = pattern
    low_from, low_to, low, high_from, high_to, high, kept = factors
    work, mark, seen, stack, path = scratch
    n = len(row_from) - 1
    lows, highs, steps = at[1], at[2], 0
    i = at[0]
    while i < n and steps < budget:
        top = n
        mark[i] = i
        for p in range(row_from[i], row_from[i + 1]):
            j = columns[p]
            length = 0
            while j < i and mark[j] != i:
                mark[j] = i
                path[length] = j
                length += 1
                j = parent[j]
            while length > 0:  # the path goes before what is there: every variable comes before its ancestors
                length -= 1
                top -= 1
                stack[top] = path[length]
        begin = highs
        for p in range(near.begin[i], near.begin[i + 1]):
            j = near.column[p]
            work[j] += near.entry[p]
            if j > i and seen[j] != i:
                seen[j] = i
                high_to[highs] = j
                highs += 1
        leaving = out[i]
        for q in range(top, n):
            k = stack[q]
            weight = work[k]
            work[k] = 0.0
            if weight == 0.0:
                continue
            low_to[lows] = k
            low[lows] = weight
            lows += 1
            leaving += weight * out[k]
            steps += high_from[k + 1] - high_from[k]
            for p in range(high_from[k], high_from[k + 1]):
                j = high_to[p]
                work[j] += weight * high[p]
                if j > i and seen[j] != i:
                    seen[j] = i
                    high_to[highs] = j
                    highs += 1
        work[i] = 0.0
        total = leaving
        for p in range(begin, highs):
            total += work[high_to[p]]
        kept[i] = total
        if total > 0.0:
            out[i] = leaving / total
        for p in range(begin, highs):
            high[p] = work[high_to[p]] / total if total > 0.0 else 0.0
            work[high_to[p]] = 0.0
        steps += n - top + highs - begin + 1
        i += 1
        low_from[i] = lows
        high_from[i] = highs
    at[0], at[1], at[2] = i, lows, highs
    return steps


class Pool(NamedTuple):
    """Factors of rows inside their blocks, wherever in the arrays they lie: to nodes before (`low`), and after them (`high`)."""

    low_from: Ints64  # [n]
    low_end: Ints64  # [n]
    low_to: Ints64
    low: Floats
    high_from: Ints64  # [n]
    high_end: Ints64  # [n]
    high_to: Ints64
    high: Floats
    kept: Floats  # [n]


def substitute_nodes(
    sequence: Ints64,
    blocks: Ints64,
    component: Ints64,
    rows: tuple[Ints64, Ints64, Floats],
    pool: Pool,
    right: Floats,
) -> Floats:
    """Return x with (I - Q) x = right; block k holds the nodes ``sequence[blocks[k]:blocks[k+1]]``, and leads to blocks before.

    `rows` are the compressed rows of Q.
    """
    begin, target, share = rows
    n = len(right)
    x = np.zeros(n, np.float64)
    for k in range(len(blocks) - 1):
        for i in range(blocks[k], blocks[k + 1]):
            s = sequence[i]
            total = right[s]
            for b in range(begin[s], begin[s + 1]):
                t = target[b]
                if t < n and component[t] != component[s]:
                    total += share[b] * x[t]
            for p in range(pool.low_from[s], pool.low_end[s]):
                total += pool.low[p] * x[pool.low_to[p]]
            x[s] = total / pool.kept[s]
        for j in range(blocks[k + 1] - blocks[k]):
            s = sequence[blocks[k + 1] - 1 - j]
            total = x[s]
            for p in range(pool.high_from[s], pool.high_end[s]):
                total += pool.high[p] * x[pool.high_to[p]]
            x[s] = total
    return x


def same_components(before: Ints64, after: Ints64, changed: Bools) -> Bools:
    """Return, for each strong component of `after`, whether it is one of `before` in none of whose nodes anything changed."""
    count, known = 0, 0
    for s in range(len(after)):
        count = max(count, after[s] + 1)
        known = max(known, before[s] + 1)
    old = np.full(count, -1, np.int64)
    size = np.zeros(count, np.int64)
    old_size = np.zeros(known, np.int64)
    same = np.ones(count, np.bool_)
    for s in range(len(after)):
        k, o = after[s], before[s]
        if old[k] == -1:
            old[k] = o
        if changed[s] or old[k] != o:
            same[k] = False
        size[k] += 1
        old_size[o] += 1
    for k in range(count):
        if size[k] != old_size[old[k]]:
            same[k] = False
    return same
