"""Rows of a system and values in two parts enter; exact drifts and swept values leave: loops for models with traps.

See `exact` for the arithmetic in two parts, `traps` for the sweeps, and `ratherthan.model._kernels` for how kernels run.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats

__all__ = ["exact_rows", "sweep_rows"]

Ints64 = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.int32]
Offsets = npt.NDArray[np.int32] | npt.NDArray[np.int64]


def exact_rows(
    own: Ints64, row_to_branches: Ints64, target: Ints64, probability: Floats, high: Floats, low: Floats
) -> tuple[Floats, Floats, Bools]:
    """Return Σ p (x(t) - x(s)) of each row of a node `own`, computed in two parts, Σ p |x(t) - x(s)|, and whether anything moves.

    x = `high` + `low`, ``[n+2]``, those of the two sinks behind the nodes'; |low| at most half a unit in the last place of high.
    """
    rows = len(own)
    total, weight, moved = np.zeros(rows), np.zeros(rows), np.zeros(rows, np.bool_)
    for a in range(rows):
        s = own[a]
        own_high, own_low = -high[s], -low[s]
        sum_high, sum_low, size = 0.0, 0.0, 0.0
        moves = False
        for b in range(row_to_branches[a], row_to_branches[a + 1]):
            t = target[b]
            if t == s:
                continue
            # x(t) - x(s): two sums without error, and what they lost (AccurateDWPlusDW)
            one_high, one_low = high[t], low[t]
            first = one_high + own_high
            back = first - one_high
            first_lost = (one_high - (first - back)) + (own_high - back)
            second = one_low + own_low
            back = second - one_low
            second_lost = (one_low - (second - back)) + (own_low - back)
            carry = first_lost + second
            step = first + carry
            rest = second_lost + (carry - (step - first))
            step_high = step + rest
            step_low = rest - (step_high - step)
            if step_high == 0.0 and step_low == 0.0:
                continue
            moves = True
            # times p: a product without error (Dekker), and the small part (DWTimesFP)
            p = probability[b]
            chance_scaled = 134217729.0 * p
            chance_head = chance_scaled - (chance_scaled - p)
            chance_tail = p - chance_head
            step_scaled = 134217729.0 * step_high
            step_head = step_scaled - (step_scaled - step_high)
            step_tail = step_high - step_head
            product = p * step_high
            lost = chance_tail * step_tail - (
                ((product - chance_head * step_head) - chance_tail * step_head) - chance_head * step_tail
            )
            small = p * step_low
            partial = product + small
            partial_low = (small - (partial - product)) + lost
            part_high = partial + partial_low
            part_low = partial_low - (part_high - partial)
            size += abs(part_high)
            # added up in two parts (AccurateDWPlusDW again)
            first = sum_high + part_high
            back = first - sum_high
            first_lost = (sum_high - (first - back)) + (part_high - back)
            second = sum_low + part_low
            back = second - sum_low
            second_lost = (sum_low - (second - back)) + (part_low - back)
            carry = first_lost + second
            step = first + carry
            rest = second_lost + (carry - (step - first))
            sum_high = step + rest
            sum_low = rest - (sum_high - step)
        total[a] = sum_high
        weight[a] = size
        moved[a] = moves
    return total, weight, moved


def sweep_rows(
    node_to_rows: Offsets,
    row_to_branches: Offsets,
    target: Numbers,
    probability: Floats,
    values: Floats,
    taken: Numbers,
    sign: float,
    gain: float,
    sweeps: int,
) -> tuple[int, int, int]:
    """Sweep over all nodes in order and in place, `sweeps` times or until nothing moves: each takes the value of its best row.

    `sign` is 1 for the largest value and -1 for the least. The row `taken` at a node changes where another is better by more
    than `gain` times the value. Returns how many rows changed in the last sweep, how many values moved by more than `gain` times
    themselves in it, and how many sweeps were made. Rows have no branch to their own node, and sum to 1.
    """
    changed, moving, made = 0, 0, 0
    for _ in range(sweeps):
        changed, moving = 0, 0
        for s in range(len(node_to_rows) - 1):
            best, present, best_row = -np.inf, 0.0, taken[s]
            for a in range(node_to_rows[s], node_to_rows[s + 1]):
                x = 0.0
                for b in range(row_to_branches[a], row_to_branches[a + 1]):
                    x += probability[b] * values[target[b]]
                x *= sign
                if a == taken[s]:
                    present = x
                if x > best:
                    best, best_row = x, a
            if best - present > gain * abs(best):
                taken[s] = best_row
                changed += 1
            best *= sign
            if abs(best - values[s]) > gain * best:
                moving += 1
            values[s] = best
        made += 1
        if moving == 0:
            break
    return changed, moving, made
