"""Rows of equations enter, values that sweeps lead to leave; lengths of moves enter, shortest ways leave: the loops of the re-checker.

All equations are those of a least value, y = min over the rows of fixed + P y; where the largest is wanted, fixed and y are negative
ones. Nothing here is trusted: what comes of it is checked by one sweep that bounds its own rounding (`ratherthan.verify.sweeps`), or
compared with what was told. See `ratherthan.verify.settling` for what the loops are for, `ratherthan.model.compiling` for how
they run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats

__all__ = [
    "Table",
    "Turn",
    "arranged",
    "drifts",
    "largest_gap",
    "nearest",
    "outwards",
    "reached_back",
    "settle",
    "spread_beyond",
]

Ints64 = npt.NDArray[np.int64]
Ints32 = npt.NDArray[np.int32]


class Table(NamedTuple):
    """Rows by node: n nodes, m rows, entries that lead to other nodes."""

    begin: Ints64  # [n+1] the rows of each node
    first: Ints64  # [m+1] the entries of each row
    target: Ints32
    share: Floats


class Turn(NamedTuple):
    """Where a pass stands: at which layer it goes on, up to which node values are there, and how many entries were gone through."""

    layer: int
    known: int
    spent: int


def outwards(table: Table, outer: Bools, allowed: Bools) -> tuple[Ints64, Ints64, Ints64]:
    """Search backwards from the rows that lead outside, along rows that are allowed.

    Returns the nodes in the order in which they are met, where each layer of them begins (and the last one ends), and for each
    node the row by which it is met, -1 where it is not.
    """
    n, m = len(table.begin) - 1, len(table.first) - 1
    owner = np.zeros(m, np.int32)
    into = np.zeros(n + 1, np.int64)
    for node in range(n):
        for row in range(table.begin[node], table.begin[node + 1]):
            owner[row] = node
            if allowed[row]:
                for e in range(table.first[row], table.first[row + 1]):
                    into[table.target[e] + 1] += 1
    for node in range(n):
        into[node + 1] += into[node]
    place = into[:n].copy()
    entering = np.zeros(max(into[n], 1), np.int32)
    for row in range(m):
        if allowed[row]:
            for e in range(table.first[row], table.first[row + 1]):
                entering[place[table.target[e]]] = row
                place[table.target[e]] += 1
    taken = np.full(n, -1, np.int64)
    order = np.zeros(n, np.int64)
    starts = np.zeros(n + 2, np.int64)
    found = 0
    for row in range(m):
        if allowed[row] and outer[row] and taken[owner[row]] < 0:
            taken[owner[row]] = row
            order[found] = owner[row]
            found += 1
    layers, head = 0, 0
    while head < found:
        starts[layers] = head
        layers += 1
        end = found
        while head < end:
            node = order[head]
            head += 1
            for i in range(into[node], into[node + 1]):
                row = entering[i]
                if taken[owner[row]] < 0:
                    taken[owner[row]] = row
                    order[found] = owner[row]
                    found += 1
    starts[layers] = found
    return order[:found].copy(), starts[: layers + 1].copy(), taken


def reached_back(
    into: tuple[Ints64, Ints64], row_state: Ints64, rows: Bools, via: Bools, seen: Bools, queue: Ints64
) -> None:
    """Mark the states of `via` from which what is `seen` already can be reached along some rows.

    `into` has the rows that enter each state, and where those of each state begin.
    """
    filled = 0
    for state in range(len(seen)):
        if seen[state]:
            queue[filled] = state
            filled += 1
    head = 0
    while head < filled:
        state = queue[head]
        head += 1
        for i in range(into[1][state], into[1][state + 1]):
            row = into[0][i]
            before = row_state[row]
            if rows[row] and via[before] and not seen[before]:
                seen[before] = True
                queue[filled] = before
                filled += 1


def arranged(table: Table, order: Ints64) -> tuple[Table, Ints64]:
    """Return the same rows with the nodes in another order, and which row each of them was."""
    n, m = len(table.begin) - 1, len(table.first) - 1
    rank = np.zeros(n, np.int32)
    for i in range(n):
        rank[order[i]] = i
    begin = np.zeros(n + 1, np.int64)
    first = np.zeros(m + 1, np.int64)
    number = np.zeros(m, np.int64)
    target = np.zeros(len(table.target), np.int32)
    share = np.zeros(len(table.target), np.float64)
    at, filled = 0, 0
    for i in range(n):
        for row in range(table.begin[order[i]], table.begin[order[i] + 1]):
            for e in range(table.first[row], table.first[row + 1]):
                target[filled] = rank[table.target[e]]
                share[filled] = table.share[e]
                filled += 1
            number[at] = row
            at += 1
            first[at] = filled
        begin[i + 1] = at
    return Table(begin, first, target, share), number


def settle(
    table: Table,
    fixed: Floats,
    starts: Ints64,
    y: Floats,
    taken: Ints64,
    near: Floats,
    place: tuple[int, int, int, int, int],
    loose: tuple[float, float],
) -> Turn:
    """Sweep windows of layers one after the other, each until its values rest.

    They do where none changes by more than near + floor · |value|, times the first number of `loose`; the second is the floor.

    `place` is the layer to begin at, the layers of a window, how many sweeps keep to the rows that were taken after each one
    that chooses, how many entries may be gone through before the turn is handed back, and how many nodes have values. The
    others get some when a window comes to them; till then rows count as if they did not lead there: too low a guess of what lies
    ahead would draw everything to it.
    """
    layer, width, keep, budget, known = place
    last = len(starts) - 1
    spent = 0
    while layer < last and spent < budget:
        begin, end = starts[layer], starts[min(layer + width, last)]
        for node in range(known, end):
            least = np.inf
            for row in range(table.begin[node], table.begin[node + 1]):
                x, chance = fixed[row], 1.0
                for e in range(table.first[row], table.first[row + 1]):
                    if table.target[e] < node:
                        x += table.share[e] * y[table.target[e]]
                    else:
                        chance -= table.share[e]
                if chance > 1e-9 and x / chance < least:
                    least = x / chance
            if least < np.inf:
                y[node] = least
        known = max(known, end)
        quiet, keeping = False, 0
        while not quiet and spent < budget:
            most = 0.0
            for node in range(begin, end):
                low, high = table.begin[node], table.begin[node + 1]
                if keeping > 0:
                    low = taken[node]
                    high = low + 1
                best = np.inf
                for row in range(low, high):
                    x, chance = fixed[row], 1.0
                    for e in range(table.first[row], table.first[row + 1]):
                        if table.target[e] < known:
                            x += table.share[e] * y[table.target[e]]
                        else:
                            chance -= table.share[e]
                    if chance < 1.0:
                        x = x / chance if chance > 1e-9 else np.inf
                    if x < best:
                        best = x
                        taken[node] = row
                if best == np.inf:  # all that it leads to lies further on
                    continue
                most = max(most, abs(best - y[node]) / (near[node] + loose[1] * abs(best)))
                y[node] = best
                spent += table.first[high] - table.first[low] + 1
            if keeping == 0:
                quiet = most <= loose[0]
                keeping = keep
            else:
                keeping = 0 if most <= loose[0] else keeping - 1
            if not most < np.inf:
                return Turn(-1, known, spent)
        if quiet:
            layer += max(1, width // 2) if layer + width < last else width
    return Turn(layer, known, spent)


def largest_gap(table: Table, fixed: Floats, y: Floats, near: Floats, floor: float, taken: Ints64) -> float:
    """Return by how much one sweep of everything would change a value, in units as in `settle`; note the best rows."""
    most = 0.0
    for node in range(len(y)):
        best = np.inf
        for row in range(table.begin[node], table.begin[node + 1]):
            x = fixed[row]
            for e in range(table.first[row], table.first[row + 1]):
                x += table.share[e] * y[table.target[e]]
            if x < best:
                best = x
                taken[node] = row
        most = max(most, abs(best - y[node]) / (near[node] + floor * abs(best)))
    return most


def drifts(
    rows: tuple[Ints64, Ints64, Ints64],
    share: Floats,
    price: Floats,
    fading: float,
    x: Floats,
    rest: Floats,
) -> tuple[Floats, Floats]:
    """Return r + Σ share · (x' - x) - fading · x of every row (source, first, target) for the values x + rest, and the sum of all sizes."""
    source, first, target = rows
    m = len(source)
    drift = np.zeros(m, np.float64)
    size = np.zeros(m, np.float64)
    for row in range(m):
        end = first[row + 1] if row + 1 < m else len(target)
        own, small = x[source[row]], rest[source[row]]
        total, most = 0.0, 0.0
        for e in range(first[row], end):
            apart, further = x[target[e]] - own, rest[target[e]] - small
            total += share[e] * (apart + further)
            most += share[e] * (abs(apart) + abs(further))
        drift[row] = price[row] + total
        size[row] = abs(price[row]) + most
        if fading > 0.0:
            drift[row] = drift[row] - fading * own - fading * small
            size[row] += abs(fading * own) + abs(fading * small)
    return drift, size


def nearest(first: Ints64, origin: Ints64, length: Floats, distance: Floats, heap: Ints64, place: Ints64) -> int:
    """Find shortest ways backwards from where `distance` is 0 (Dijkstra 1959): `distance` is lowered, ∞ stays where no way leads.

    The moves into state s are first[s] … first[s + 1] - 1, from `origin` and of `length`. `heap` and `place` are room for the
    states that wait, in order, and for where each stands there, -1 where it does not. Returns how many states were settled.
    """
    size, settled = 0, 0
    for state in range(len(distance)):
        place[state] = -1
        if distance[state] == 0.0:
            place[state] = size
            heap[size] = state
            size += 1
    while size > 0:
        state = heap[0]
        place[state] = -1
        settled += 1
        size -= 1
        if size > 0:  # the last one sinks from the top
            sinking = heap[size]
            at = 0
            while 2 * at + 1 < size:
                child = 2 * at + 1
                if child + 1 < size and distance[heap[child + 1]] < distance[heap[child]]:
                    child += 1
                if distance[heap[child]] >= distance[sinking]:
                    break
                heap[at] = heap[child]
                place[heap[at]] = at
                at = child
            heap[at] = sinking
            place[sinking] = at
        for i in range(first[state], first[state + 1]):
            before, far = origin[i], distance[state] + length[i]
            if far < distance[before]:
                at = place[before]
                if at < 0:
                    at = size
                    size += 1
                distance[before] = far
                while at > 0 and distance[heap[(at - 1) // 2]] > far:
                    heap[at] = heap[(at - 1) // 2]
                    place[heap[at]] = at
                    at = (at - 1) // 2
                heap[at] = before
                place[before] = at
    return settled


def spread_beyond(
    rows: tuple[Ints64, Ints64],
    back: tuple[Ints64, Ints64],
    tree: tuple[Ints64, Ints64, int, int],
    begin: Ints64,
    without: int,
    mark: Ints64,
    stamp: int,
    queue: Ints64,
) -> int:
    """Find what is reached from some states without passing one, besides what is known to be.

    Known are the states of a `tree` (its order, the place of each state in that, -1 for none) but for those in the places from the
    third number on up to the fourth: the subtree of `without`, from which nothing is known. Edges lead forwards along `rows` and
    backwards along `back`. What is found is marked with the stamp and stands in the queue. Returns how many that are.
    """
    order, place, low, high = tree
    filled = 0
    for i in range(low, high):
        state = order[i]
        if state != without:
            for e in range(back[0][state], back[0][state + 1]):
                other = back[1][e]
                at = place[other]
                if other != without and at >= 0 and (at < low or at >= high):
                    mark[state] = stamp
                    queue[filled] = state
                    filled += 1
                    break
    for state in begin:
        at = place[state]
        known = at >= 0 and (at < low or at >= high)
        if state != without and mark[state] != stamp and not known:
            mark[state] = stamp
            queue[filled] = state
            filled += 1
    head = 0
    while head < filled:
        state = queue[head]
        head += 1
        for e in range(rows[0][state], rows[0][state + 1]):
            other = rows[1][e]
            at = place[other]
            known = at >= 0 and (at < low or at >= high)
            if other != without and mark[other] != stamp and not known:
                mark[other] = stamp
                queue[filled] = other
                filled += 1
    return filled
