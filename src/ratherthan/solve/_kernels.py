"""Rows of models and systems enter; swept values, drifts, means and orders of nodes leave: the loops that all solvers share.

See `windows` and `windowed` for the sweeps, `system` for drifts, `layered` for what has no cycles, `sparse` for rows of matrices, and
`ratherthan.model._kernels` for how they run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Floats, Ints

__all__ = [
    "Needs",
    "Ordered",
    "Rows",
    "Swept",
    "backward_pass",
    "drift_rows",
    "gather_rows",
    "mean_rows",
    "ordered_rows",
    "scaling_needs",
    "sinks_first",
    "sweep",
    "swept_rows",
    "window_sweeps",
]

Ints64 = npt.NDArray[np.int64]
Offsets = npt.NDArray[np.int32] | npt.NDArray[np.int64]


class Rows(NamedTuple):
    """Compressed rows of a matrix."""

    begin: Ints64  # [n+1]
    column: Ints64
    entry: Floats


def sweep(lower: Rows, right: Floats) -> Floats:
    """Return x with (I - L) x = right, L strictly lower triangular: one Gauss-Seidel sweep from 0."""
    x = np.zeros(len(right), np.float64)
    for i in range(len(right)):
        total = right[i]
        for p in range(lower.begin[i], lower.begin[i + 1]):
            total += lower.entry[p] * x[lower.column[p]]
        x[i] = total
    return x


class Ordered(NamedTuple):
    """A system's rows with the nodes in another order, loops to the own node taken out, what is left scaled to sum to 1."""

    node_to_rows: Offsets  # [n+1]
    row_to_branches: Offsets  # [m+1]
    target: npt.NDArray[np.int32]
    probability: Floats
    cost: Floats  # [m]


def ordered_rows(
    rows: tuple[Ints64, Ints64, Ints64],
    probability: Floats,
    cost: Floats,
    places: tuple[Ints64, Ints64],
    offsets: tuple[Offsets, Offsets],
) -> Ordered:
    """Return the rows of a system in another order of its nodes, loops to the own node taken out, the rest scaled to sum to 1.

    `rows` are node_to_rows, row_to_branches and target, `places` the node at each place and the place of each node (and sink);
    `offsets` are filled in and tell by their type how wide the numbers are: zeros, ``[n+1]`` and ``[m+1]``.
    """
    node_to_rows, row_to_branches, target = rows
    order, rank = places
    rows_of_node, branches_of_row = offsets
    n, m = len(node_to_rows) - 1, len(row_to_branches) - 1
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
    return Ordered(rows_of_node, branches_of_row, after[:branch], chance[:branch], paid)


class Swept(NamedTuple):
    """Rows of a model in the order in which they are swept, and what is known of them."""

    rows: Ordered
    source: npt.NDArray[np.int32]  # [m], the choice of each row
    longest: int  # branches of a row, loops included
    least: float  # what a row pays, by step that leaves
    largest: float
    loops: bool  # whether there were any


def swept_rows(
    rows: tuple[Ints, Ints, Ints], probability: Floats, cost: Floats, order: Ints, rank: npt.NDArray[np.int32]
) -> Swept:
    """Return the rows of the states in `order` that may be taken, loops taken out and what is left scaled to sum to 1.

    `rows` are state_to_choices, choice_to_branches and branch_to_target. `rank` is the place of each state in `order`, their number
    at the goal, and below 0 at states that no row taken may lead to.
    """
    state_to_choices, choice_to_branches, branch_to_target = rows
    n, m, k = len(order), 0, 0
    for i in range(n):
        first, last = state_to_choices[order[i]], state_to_choices[order[i] + 1]
        m += last - first
        k += choice_to_branches[last] - choice_to_branches[first]
    node_to_rows = np.zeros(n + 1, np.int32)
    row_to_branches = np.empty(m + 1, np.int32)
    target = np.empty(k, np.int32)
    chance = np.empty(k, np.float64)
    paid = np.empty(m, np.float64)
    source = np.empty(m, np.int32)
    row_to_branches[0] = 0
    row, branch, longest = 0, 0, 0
    least, largest, loops = np.inf, 0.0, False
    for i in range(n):
        for c in range(state_to_choices[order[i]], state_to_choices[order[i] + 1]):
            first, last, at = choice_to_branches[c], choice_to_branches[c + 1], branch
            leave, inside = 0.0, True
            for b in range(first, last):
                t = rank[branch_to_target[b]]
                if t < 0:
                    inside = False
                    break
                if t != i:
                    target[at] = t
                    chance[at] = probability[b]
                    leave += probability[b]
                    at += 1
            if not inside or at == branch:
                continue
            loops = loops or at - branch < last - first
            longest = max(longest, last - first)
            if at - branch < last - first or leave != 1.0:
                for b in range(branch, at):
                    chance[b] = chance[b] / leave
            paid[row] = cost[c] / leave
            least, largest = min(least, paid[row]), max(largest, paid[row])
            source[row] = c
            row, branch = row + 1, at
            row_to_branches[row] = branch
        node_to_rows[i + 1] = row
    made = Ordered(node_to_rows, row_to_branches[: row + 1], target[:branch], chance[:branch], paid[:row])
    return Swept(made, source[:row], longest, least, largest, loops)


def window_sweeps(
    rows: Ordered,
    layers: Ints64,
    values: Floats,
    taken: npt.NDArray[np.int32],
    at: Ints64,
    spans: tuple[int, int],
    wanted: tuple[float, float],
    budget: int,
) -> tuple[int, float]:
    """Solve window after window, each until no sweep changes a value by more than a tolerance; or until a budget is spent.

    `spans` are how many layers a window has, and how many it moves on; `wanted` are the tolerance and a step. A sweep that chooses is
    followed by up to three that keep to what was chosen. `values` (those of the sinks behind them) and the row `taken` at each node
    leave improved. A positive step says that there are no values yet: a node then begins with the least value of the nodes before it
    that its first row leads to, and a step more. `at` is the layer of the window to begin with, and how many nodes have values; it
    leaves as where to go on, the number of layers at the end. Returns how many nodes were visited, and the last change.
    """
    (width, stride), (tolerance, step) = spans, wanted
    nodes, last = len(rows.node_to_rows) - 1, len(layers) - 1
    spent, change = 0, np.inf
    while at[0] < last and spent <= budget:
        layer = at[0]
        begin, end = layers[layer], layers[min(layer + width, last)]
        if step > 0.0:
            ahead = layers[min(layer + width + stride, last)]  # what the window looks at must have values, too
            for s in range(at[1], ahead):
                nearest = np.inf
                first = rows.node_to_rows[s]
                for b in range(rows.row_to_branches[first], rows.row_to_branches[first + 1]):
                    t = rows.target[b]
                    if (t < s or t >= nodes) and values[t] < nearest:
                        nearest = values[t]
                values[s] = step + (nearest if nearest < np.inf else values[max(s - 1, 0)])
            at[1] = max(at[1], ahead)
        keeping = 0  # how many sweeps more keep to what was chosen
        while spent <= budget:
            change = 0.0
            if keeping > 0:
                for s in range(begin, end):
                    a = taken[s]
                    x = rows.cost[a]
                    for b in range(rows.row_to_branches[a], rows.row_to_branches[a + 1]):
                        x += rows.probability[b] * values[rows.target[b]]
                    change = max(change, abs(x - values[s]))
                    values[s] = x
                keeping = keeping - 1 if change > 0.5 * tolerance else 0
                spent += end - begin
                continue
            for s in range(begin, end):
                best = np.inf
                for a in range(rows.node_to_rows[s], rows.node_to_rows[s + 1]):
                    x = rows.cost[a]
                    for b in range(rows.row_to_branches[a], rows.row_to_branches[a + 1]):
                        x += rows.probability[b] * values[rows.target[b]]
                    if x < best:
                        best = x
                        taken[s] = a
                change = max(change, abs(best - values[s]))
                values[s] = best
            spent += end - begin
            if not change > tolerance:
                at[0] = last if layer + width >= last else layer + stride
                break
            keeping = 3
    return spent, change


class Needs(NamedTuple):
    """By what share values must be made smaller, and larger, to be proved bounds; and the largest |Tv - v|."""

    below: float
    above: float
    residual: float


def scaling_needs(
    rows: Ordered,
    source: npt.NDArray[np.int32],
    values: Floats,
    limits: tuple[float, float],
    tied: npt.NDArray[np.bool_],
) -> Needs:
    """Return what it takes to prove `values` ``[n + 2]`` by scaling; the choices that cannot be told from the best leave in `tied`.

    With D the drift of the values along a row and e what it may be wrong by, (1 - h) v is a bound from below if h · cost ≥ e - D along
    every row; (1 + h) v is one from above of the policy that takes the first tied row of each node if h · cost ≥ (1 + h) (D + e) along
    its rows. `limits` are how far a tied row may be behind the best, and the relative error of a drift. Needs are infinite, or no
    numbers, where nothing can be proved.
    """
    slack, unit = limits
    n, most = len(rows.node_to_rows) - 1, 0
    for s in range(n):
        most = max(most, rows.node_to_rows[s + 1] - rows.node_to_rows[s])
    drifts, errors = np.zeros(most), np.zeros(most)
    below, above, residual = 0.0, 0.0, 0.0
    for s in range(n):
        first, own, best = rows.node_to_rows[s], values[s], np.inf
        for a in range(first, rows.node_to_rows[s + 1]):
            moved, size, wide = 0.0, rows.cost[a], 0.0
            for b in range(rows.row_to_branches[a], rows.row_to_branches[a + 1]):
                step = values[rows.target[b]] - own
                share = rows.probability[b] * step
                moved += share
                size += abs(share)
                wide += 1.0 + abs(step)
            drift, error = rows.cost[a] + moved, unit * size + 1e-322 * wide
            drifts[a - first], errors[a - first] = drift, error
            best = min(best, drift)
            need = (error - drift) / rows.cost[a]
            if not need <= below:
                below = need
        residual = max(residual, abs(best))
        choosing = True
        for a in range(first, rows.node_to_rows[s + 1]):
            near = drifts[a - first] - best <= slack + 4.0 * errors[a - first]
            tied[source[a]] = near
            if near and choosing:
                choosing = False
                need = (drifts[a - first] + errors[a - first]) / rows.cost[a]
                if not need <= above:
                    above = need
        if choosing:
            above = np.inf
    return Needs(below, above, residual)


def gather_rows(
    rows: Ints64, own: Ints64, index: tuple[Ints, Ints], probability: Floats, node: Ints64
) -> tuple[Ints64, Ints64, Ints64, Floats]:
    """Return the rows of a model that leave their node: which of `rows` they are, offsets, targets, probabilities.

    `own` is the node of each row, `node` that of each state; `index` holds choice_to_branches and branch_to_target.
    """
    choice_to_branches, branch_to_target = index
    total = 0
    for i in range(len(rows)):
        total += choice_to_branches[rows[i] + 1] - choice_to_branches[rows[i]]
    kept = np.zeros(len(rows), np.int64)
    offsets = np.zeros(len(rows) + 1, np.int64)
    target = np.zeros(total, np.int64)
    chance = np.zeros(total, np.float64)
    count, filled = 0, 0
    for i in range(len(rows)):
        leaves = False
        at = filled
        for b in range(choice_to_branches[rows[i]], choice_to_branches[rows[i] + 1]):
            t = node[branch_to_target[b]]
            target[at] = t
            chance[at] = probability[b]
            leaves = leaves or t != own[i]
            at += 1
        if leaves:
            filled = at
            kept[count] = i
            count += 1
            offsets[count] = filled
    return kept[:count], offsets[: count + 1], target[:filled], chance[:filled]


def drift_rows(
    own: Ints64,
    row_to_branches: Ints64,
    target: Ints64,
    probability: Floats,
    paid: tuple[Floats, Floats],
    parts: Floats,
) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
    """Return, for each row of a node `own`, its drift, the weight of its rounding error, and whether anything moves.

    `paid` is what each row pays and the size of that; `parts` are the values, ``[p, n+2]``, which sum to x, those of the two sinks behind the nodes'.
    """
    cost, sizes = paid
    rows = len(cost)
    total, weight, moved = np.zeros(rows), np.zeros(rows), np.zeros(rows, np.bool_)
    for a in range(rows):
        s = own[a]
        drift, size = 0.0, 0.0
        moves = sizes[a] > 0.0
        for b in range(row_to_branches[a], row_to_branches[a + 1]):
            t = target[b]
            step, wide = 0.0, 0.0
            for p in range(len(parts)):
                further = parts[p, t] - parts[p, s]
                step += further
                wide += abs(further)
            drift += probability[b] * step
            size += probability[b] * wide
            moves = moves or wide > 0.0
        total[a] = cost[a] + drift
        weight[a] = sizes[a] + size
        moved[a] = moves
    return total, weight, moved


def mean_rows(
    choice_to_branches: Ints, branch_to_target: Ints, probability: Floats, values: Floats, below_wins: bool
) -> tuple[Floats, Floats]:
    """Return Σ p · value of each choice, and Σ p · |value - that of the first branch|; infinite where a branch is."""
    count = len(choice_to_branches) - 1
    mean, spread = np.zeros(count), np.zeros(count)
    for c in range(count):
        begin = choice_to_branches[c]
        first = values[branch_to_target[begin]]
        below, above = first == -np.inf, first == np.inf
        moved, size = 0.0, 0.0
        for b in range(begin + 1, choice_to_branches[c + 1]):
            after = values[branch_to_target[b]]
            if np.isinf(after):
                below, above = below or after < 0.0, above or after > 0.0
            elif not (below or above):
                step = probability[b] * (after - first)
                moved += step
                size += abs(step)
        if below or above:
            mean[c] = -np.inf if below and (below_wins or not above) else np.inf
        else:
            mean[c], spread[c] = first + moved, size
    return mean, spread


def sinks_first(begin: Ints64, target: Ints64) -> Ints64:
    """Return the nodes in an order in which each comes after all that it leads to; nothing where there is none.

    The branches of node s are ``begin[s]`` up to ``begin[s+1]``; targets from the number of nodes on are sinks.
    """
    n = len(begin) - 1
    order = np.zeros(n, np.int64)
    seen = np.zeros(n, np.int8)  # 1: it is being searched from; 2: all that it leads to is in order
    following = begin[:n].copy()
    stack = np.zeros(n, np.int64)
    filled = 0
    for root in range(n):
        if seen[root] != 0:
            continue
        stack[0] = root
        seen[root] = 1
        height = 1
        while height > 0:
            s = stack[height - 1]
            if following[s] == begin[s + 1]:
                seen[s] = 2
                order[filled] = s
                filled += 1
                height -= 1
                continue
            t = target[following[s]]
            following[s] += 1
            if t >= n or seen[t] == 2:
                continue
            if seen[t] == 1:
                return order[:0]
            seen[t] = 1
            stack[height] = t
            height += 1
    return order


def backward_pass(
    rows: tuple[Ints64, Ints64, Ints64],
    probability: Floats,
    paid: tuple[Floats, Floats, npt.NDArray[np.bool_]],
    order: Ints64,
    known: Floats,
    unit: float,
    direction: float,
    maximise: bool,
) -> Floats:
    """Return a bound of the best value of every node, below (direction -1) or above it (1), those of the sinks behind them.

    `known` is one that is known, ``[n]``; it leaves no worse.

    `rows` are node_to_rows, row_to_branches and target, `paid` is what rows pay, the size of that and whether it is exact,
    `order` is that of `sinks_first`, and `unit` times the number of branches and 8 more the relative error of a drift.
    """
    node_to_rows, row_to_branches, target = rows
    cost, size, exact = paid
    n = len(node_to_rows) - 1
    x = np.zeros(n + 2, np.float64)
    x[:n] = known
    x[n + 1] = 1.0
    for i in range(n):
        s = order[i]
        best = -np.inf if maximise else np.inf
        for a in range(node_to_rows[s], node_to_rows[s + 1]):
            first, last = row_to_branches[a], row_to_branches[a + 1]
            count = last - first
            likeliest, least = first, first
            for b in range(first, last):
                likeliest = b if probability[b] > probability[likeliest] else likeliest
                least = b if x[target[b]] < x[target[least]] else least
            base, moved, weight = 0.0, 0.0, np.inf
            for origin in (
                likeliest,
                least,
            ):  # what the differences are taken from: the one that leaves less to rounding
                start, drift, size_of = x[target[origin]], 0.0, size[a]
                for b in range(first, last):
                    step = x[target[b]] - start
                    drift += probability[b] * step
                    size_of += probability[b] * abs(step) + (1e-322 if step != 0.0 else 0.0)
                if size_of < weight:
                    base, moved, weight = start, drift, size_of
                if least == likeliest:
                    break
            further = cost[a] + moved
            doubt = 0.0
            if weight > 0.0 and not (exact[a] and count == 1 and probability[first] == 1.0):
                doubt = (count + 8) * unit * weight + count * 1e-322
            total = base + further
            back = total - base
            lost = (base - (total - back)) + (further - back)
            if doubt > 0.0 or lost != 0.0:
                doubt += abs(lost)
                total += direction * (doubt + 2.0**-51 * (abs(total) + doubt))
            best = max(best, total) if maximise else min(best, total)
        x[s] = max(x[s], best) if direction < 0.0 else min(x[s], best)
    return x
