"""Rows of a system in some order enter; values and the rows taken leave improved: sweeps in place, of windows or of everything.

All systems are to be made small: where the most is wanted, costs and values are negative ones. See `sweeping` for what these loops
are for, `ratherthan.model._kernels` for how they run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Floats
from ratherthan.solve._kernels import Ordered

__all__ = ["Turn", "first_values", "gaps_of", "improve_rows", "relax_all", "relax_windows"]

Ints64 = npt.NDArray[np.int64]


class Turn(NamedTuple):
    """Where a pass through windows stands: the layer, the sweeps to go that keep to what was taken, those made there, nodes visited."""

    layer: int
    keeping: int
    made: int
    spent: int


def first_values(rows: Ordered, values: Floats, taken: Ints64) -> None:
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
    rows: Ordered,
    layers: Ints64,
    values: Floats,
    taken: Ints64,
    tolerance: Floats,
    place: tuple[int, int, int],
    limits: tuple[int, int, int],
) -> Turn:
    """Sweep window after window of `width` layers, each until no value changes by more than its tolerance, or often enough.

    `place` is the layer to begin at, the sweeps that still keep to what was taken, and how many were made there; `limits` are the width,
    how often a window is swept at most, and how many nodes may be visited. A sweep that chooses is followed by up to three that keep to what was chosen.
    """
    layer, keeping, made = place
    width, most, budget = limits
    last = len(layers) - 1
    spent = 0
    while layer < last and spent < budget:
        begin, end = layers[layer], layers[min(layer + width, last)]
        quiet = False
        while not quiet and made < most and spent < budget:
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
            made += 1
            if keeping == 0:
                if change <= 1.0:
                    quiet = True
                else:
                    keeping = 3
            else:
                keeping = keeping - 1 if change > 0.5 else 0
        if quiet or made >= most:
            layer += max(width // 2, 1)
            keeping, made = 0, 0
    return Turn(layer, keeping, made, spent)


def relax_all(rows: Ordered, values: Floats, taken: Ints64) -> None:
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


def gaps_of(rows: Ordered, values: Floats, taken: Ints64, gaps: Floats) -> float:
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


def improve_rows(rows: Ordered, values: Floats, taken: Ints64, gain: tuple[float, float], sweeps: int) -> int:
    """Sweep all nodes in their order and in place, some times or until nothing moves: each takes the value of its best row.

    `gain` are a share and a unit: the row taken at a node changes where another is better by more than the share of the larger of the
    value and the unit. Returns how many values moved by more than that in the last sweep.
    """
    share, unit = gain
    moving = 0
    for _ in range(sweeps):
        moving = 0
        for s in range(len(rows.node_to_rows) - 1):
            best, present, best_row = np.inf, np.inf, taken[s]
            for a in range(rows.node_to_rows[s], rows.node_to_rows[s + 1]):
                x = rows.cost[a]
                for b in range(rows.row_to_branches[a], rows.row_to_branches[a + 1]):
                    x += rows.probability[b] * values[rows.target[b]]
                if a == taken[s]:
                    present = x
                if x < best:
                    best, best_row = x, a
            least = share * max(abs(best), unit)
            if present - best > least:
                taken[s] = best_row
            if not abs(best - values[s]) <= least:
                moving += 1
            values[s] = best
        if moving == 0:
            break
    return moving
