"""The rows of a sparse matrix enter; its elimination tree, its factors without subtraction, and solutions leave.

All matrices are I - Q with Q ≥ 0, and row i of Q and out[i] sum to 1: out is what leaves the system. Variables are eliminated
in the order of their numbers, block by block; a row of Q has entries in its own block (near) and in earlier ones (far). See
`sparse` for what these kernels are for, `ratherthan.model._kernels` for how they run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Floats

__all__ = ["Factors", "Rows", "eliminate", "elimination_tree", "fill_of", "substitute", "sweep"]

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


def eliminate(row_from: Ints64, columns: Ints64, parent: Ints64, near: Rows, out: Floats, fill: int) -> Factors:
    """Factor I - Q without a subtraction (Grassmann, Taksar, Heyman): what is kept of a row is the sum of all but its diagonal.

    `row_from`, `columns` and `parent` are a symmetric pattern that covers that of `near` with its elimination tree, `out` is
    what leaves the block (changed in place), `fill` what `fill_of` counted.
    """
    n = len(row_from) - 1
    low_from = np.zeros(n + 1, np.int64)
    low_to = np.zeros(fill, np.int64)
    low = np.zeros(fill, np.float64)
    high_from = np.zeros(n + 1, np.int64)
    high_to = np.zeros(fill, np.int64)
    high = np.zeros(fill, np.float64)
    kept = np.zeros(n, np.float64)
    work = np.zeros(n, np.float64)
    mark = np.full(n, -1, np.int64)
    seen = np.full(n, -1, np.int64)
    stack = np.zeros(n, np.int64)
    path = np.zeros(n, np.int64)
    lows = 0
    highs = 0
    for i in range(n):
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
        low_from[i + 1] = lows
        high_from[i + 1] = highs
    return Factors(low_from, low_to, low, high_from, high_to, high, kept)


def substitute(blocks: Ints64, factors: Factors, far: Rows, right: Floats) -> Floats:
    """Return x with (I - Q) x = right; block k is ``blocks[k]`` up to ``blocks[k+1]``, and its far entries are in earlier ones."""
    x = np.zeros(len(right), np.float64)
    for k in range(len(blocks) - 1):
        for i in range(blocks[k], blocks[k + 1]):
            total = right[i]
            for p in range(far.begin[i], far.begin[i + 1]):
                total += far.entry[p] * x[far.column[p]]
            for p in range(factors.low_from[i], factors.low_from[i + 1]):
                total += factors.low[p] * x[factors.low_to[p]]
            x[i] = total / factors.kept[i]
        for i in range(blocks[k + 1] - 1, blocks[k] - 1, -1):
            total = x[i]
            for p in range(factors.high_from[i], factors.high_from[i + 1]):
                total += factors.high[p] * x[factors.high_to[p]]
            x[i] = total
    return x


def sweep(lower: Rows, right: Floats) -> Floats:
    """Return x with (I - L) x = right, L strictly lower triangular: one Gauss-Seidel sweep from 0."""
    x = np.zeros(len(right), np.float64)
    for i in range(len(right)):
        total = right[i]
        for p in range(lower.begin[i], lower.begin[i + 1]):
            total += lower.entry[p] * x[lower.column[p]]
        x[i] = total
    return x
