"""Rows of a system in some order enter; values and the rows taken leave improved: sweeps in place, of windows or of everything.

All systems are to be made small: where the most is wanted, costs and values are negative ones. See `sweeping` for what these loops
are for, `ratherthan.model._kernels` for how they run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Floats

__all__ = ["Rows", "Turn", "first_values", "gaps_of", "in_order", "relax_all", "relax_windows"]

Ints64 = npt.NDArray[np.int64]
Ints32 = npt.NDArray[np.int32]


class Rows(NamedTuple):
    """Rows with the nodes in another order, loops to the own node taken out, what is left scaled to sum to 1."""

    node_to_rows: Ints64  # [n+1]
    row_to_branches: Ints64  # [m+1]
    target: Ints32
    probability: Floats
    cost: Floats  # [m]


class Turn(NamedTuple):
    """Where a pass through windows stands: the next layer, the sweeps to go that keep to what was taken, and nodes visited."""

    layer: int
    keeping: int
    spent: int


def in_order(
    rows: tuple[Ints64, Ints64, Ints64], probability: Floats, cost: Floats, order: Ints64, rank: Ints64
) -> Rows:
    """Return rows (node_to_rows, row_to_branches, target) in the `order` of their nodes; `rank` is the place of each in it."""
    node_to_rows, row_to_branches, target = rows
    n, m = len(node_to_rows) - 1, len(row_to_branches) - 1
    rows_of_node = np.zeros(n + 1, np.int64)
    branches_of_row = np.zeros(m + 1, np.int64)
    after = np.zeros(len(target), np.int32)
    chance = np.zeros(len(target), np.float64)
    paid = np.zeros(m, np.float64)
    row, branch = 0, 0
    for i in range(n):
        node = order[i]
        for a in range(node_to_rows[node], node_to_rows[node + 1]):
            leave = 0.0
            for b in range(row_to_branches[a], row_to_branches[a + 1]):
                if target[b] != node:
                    leave += probability[b]
            for b in range(row_to_branches[a], row_to_branches[a + 1]):
                if target[b] != node:
                    after[branch] = rank[target[b]]
                    chance[branch] = probability[b] / leave
                    branch += 1
            paid[row] = cost[a] / leave
            row += 1
            branches_of_row[row] = branch
        rows_of_node[i + 1] = row
    return Rows(rows_of_node, branches_of_row, after[:branch].copy(), chance[:branch].copy(), paid)


def first_values(rows: Rows, values: Floats, taken: Ints64) -> None:
    """Guess values in the order of the nodes: of the rows that lead back, the best one, as if it led nowhere else."""
    n = len(rows.node_to_rows) - 1
    for s in range(n):
        best = np.inf
        for a in range(rows.node_to_rows[s], rows.node_to_rows[s + 1]):
            known, x = 0.0, rows.cost[a]
            for b in range(rows.row_to_branches[a], rows.row_to_branches[a + 1]):
                t = rows.target[b]
                if t < s or t >= n:
                    known += rows.probability[b]
                    x += rows.probability[b] * values[t]
            if known > 0.0 and x / known < best:
                best = x / known
                taken[s] = a
        if best < np.inf:
            values[s] = best
        else:
            taken[s] = rows.node_to_rows[s]


def relax_windows(
    rows: Rows, layers: Ints64, values: Floats, taken: Ints64, tolerance: Floats, place: tuple[int, int, int, int]
) -> Turn:
    """Sweep window after window of `width` layers, each until no value changes by more than its tolerance.

    `place` is the layer to begin at, the sweeps that still keep to what was taken, the width, and how many nodes may be visited.
    A sweep that chooses is followed by up to three that keep to what was chosen.
    """
    layer, keeping, width, budget = place
    last = len(layers) - 1
    spent = 0
    while layer < last and spent < budget:
        begin, end = layers[layer], layers[min(layer + width, last)]
        quiet = False
        while not quiet and spent < budget:
            change = 0.0
            for s in range(begin, end):
                low, high = rows.node_to_rows[s], rows.node_to_rows[s + 1]
                if keeping > 0:
                    low = taken[s]
                    high = low + 1
                best = np.inf
                for a in range(low, high):
                    x = rows.cost[a]
                    for b in range(rows.row_to_branches[a], rows.row_to_branches[a + 1]):
                        x += rows.probability[b] * values[rows.target[b]]
                    if x < best:
                        best = x
                        taken[s] = a
                moved = abs(best - values[s]) / tolerance[s]
                if not moved <= change:  # NaN counts as a change
                    change = moved
                values[s] = best
            spent += end - begin
            if keeping == 0:
                if change <= 1.0:
                    quiet = True
                else:
                    keeping = 3
            else:
                keeping = keeping - 1 if change > 0.5 else 0
        if quiet:
            layer += max(width // 2, 1)
            keeping = 0
    return Turn(layer, keeping, spent)


def relax_all(rows: Rows, values: Floats, taken: Ints64) -> None:
    """Sweep all nodes in their order, choosing, and nine times back and forth, keeping to what was chosen."""
    n = len(rows.node_to_rows) - 1
    for sweep in range(10):
        for i in range(n):
            s = n - 1 - i if sweep % 2 == 1 else i
            low, high = rows.node_to_rows[s], rows.node_to_rows[s + 1]
            if sweep > 0:
                low = taken[s]
                high = low + 1
            best = np.inf
            for a in range(low, high):
                x = rows.cost[a]
                for b in range(rows.row_to_branches[a], rows.row_to_branches[a + 1]):
                    x += rows.probability[b] * values[rows.target[b]]
                if x < best:
                    best = x
                    taken[s] = a
            values[s] = best


def gaps_of(rows: Rows, values: Floats, taken: Ints64, gaps: Floats) -> float:
    """Fill in Tv - v at every node, and which row has it; return the largest |Tv - v|."""
    largest = 0.0
    for s in range(len(rows.node_to_rows) - 1):
        best = np.inf
        for a in range(rows.node_to_rows[s], rows.node_to_rows[s + 1]):
            x = rows.cost[a]
            for b in range(rows.row_to_branches[a], rows.row_to_branches[a + 1]):
                x += rows.probability[b] * values[rows.target[b]]
            if x < best:
                best = x
                taken[s] = a
        gaps[s] = best - values[s]
        if not abs(gaps[s]) <= largest:
            largest = abs(gaps[s])
    return largest
