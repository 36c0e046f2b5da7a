"""Open states enter, the states where it is proved that more and more can be gathered leave.

Definition
----------
Let R be a set of states that a policy stays in for ever, each reached from each, in which it pays g > 0 per step on the average.
From R the target can be reached for sure. So a run that goes round in R for k steps and then goes on gathers about k·g: where R
can be reached the largest expected reward is ∞ (with g < 0 the least is -∞).

What is proved
--------------
For any x, the mean of D(c) = r(c) + Σ δ(c, s') (x(s') - x(s)) over the stationary distribution of R is the mean of r. So if D is
above its rounding error everywhere in R, for whatever x, then g > 0. Such an x solves D = g (Poisson's equation); it is a
candidate, and the sign of D decides. A choice that stays in a free end component, and pays, is such a set by itself.

Where to look
-------------
Each such set lies in a maximal end component. There x ← x + ½ max D is repeated: D tends to the largest mean reward g of the
component, from above (max D ≥ g) as from below. If max D becomes 0 or less, nothing is gathered there; if D is above its error
in a set that the best choices never leave, that is proved. Also a policy that looks better than all, but never leaves the open
states, shows where to look.

References
----------
M. L. Puterman, Markov Decision Processes, Wiley 1994, chapter 8.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ratherthan.model.mdp import Bools, Floats
from ratherthan.verify.equations import Core, Open, Rows, rows_of
from ratherthan.verify.frame import Array, parts

__all__ = ["circling", "gathering", "paying_inside"]

DENSE = 400
NOTHING = 1e-13
"""A mean of so small a share of the largest reward cannot be told from 0."""
FEWEST, MOST_WORK = 200, 300_000_000
"""How many sweeps are made at least, and how many choices are gone through in all."""
EVERY = 25
"""After so many sweeps it is looked whether something is proved."""


def paying_inside(core: Core) -> Bools:
    """Return the states of free end components in which a choice stays and is paid for it, ``[S]``."""
    problem, every = core.problem, core.every
    sign = 1.0 if problem.frame.maximise else -1.0
    stays = np.ones(len(every.source), dtype=np.bool_)
    stays[core.number] = False
    paid = np.unique(core.node[every.source[stays & (sign * every.price > every.blur)]])
    found: Bools = problem.open & np.isin(core.node, paid)
    return found


def circling(problem: Open, sweeps: int) -> Bools:
    """Return the states of end components in which sweeps prove that going round is paid for, ``[S]``.

    Parameters
    ----------
    problem : Open
    sweeps : int
        How many at most.
    """
    frame, found = problem.frame, np.zeros_like(problem.open)
    sign = 1.0 if frame.maximise else -1.0
    part, usable = frame.blocks(problem.open, problem.rows)
    paid = np.unique(part[frame.row_state[usable & (sign * frame.price > 0.0)]])
    chosen = np.flatnonzero(usable & np.isin(part[frame.row_state], paid))
    x = np.zeros(len(problem.open))
    unit = float(np.abs(frame.price[chosen]).max(initial=0.0))
    for sweep in range(1, min(sweeps, max(FEWEST, MOST_WORK // max(len(chosen), 1))) + 1):
        if not len(chosen):
            break
        if sweep % EVERY == 1:
            rows = rows_of(problem, chosen)
            rows = replace(rows, price=sign * (rows.price / unit), blur=rows.blur / unit)
            begin = np.flatnonzero(np.append([True], rows.source[1:] != rows.source[:-1]))
            states = rows.source[begin]
        drift, error = rows.drift(x)
        best = np.maximum.reduceat(drift, begin)
        if sweep % EVERY == 0:
            taken = np.searchsorted(begin, np.arange(len(drift)), side="right") - 1
            hits = np.flatnonzero(drift >= best[taken])
            own = hits[np.searchsorted(taken[hits], np.arange(len(begin)))]
            found |= _never_left(rows.some(own), drift[own] > error[own], len(x))
            most = np.full(len(x), -np.inf)
            np.maximum.at(most, part[states], best)
            over = found[states] | (most[part[states]] <= NOTHING)
            done = np.unique(part[states[over]])
            chosen = chosen[~np.isin(part[frame.row_state[chosen]], done)]
        x[states] += 0.5 * best
    return found


def _never_left(rows: Rows, paid: Bools, count: int) -> Bools:
    """Return the states of sets that a policy never leaves, each reached from each, and that are paid throughout, ``[S]``."""
    origin = rows.source[rows.entry_row]
    component = parts(count, origin, rows.target)
    leaving = np.zeros(count, dtype=np.bool_)
    leaving[component[origin[component[origin] != component[rows.target]]]] = True
    leaving[component[rows.source[~paid]]] = True
    found = np.zeros(count, dtype=np.bool_)
    found[rows.source] = ~leaving[component[rows.source]]
    return found


def gathering(core: Core, rows: Array) -> Bools:
    """Return the states of the sets that a policy stays in for ever and is proved to be paid for, ``[S]``.

    Parameters
    ----------
    core : Core
    rows : array of int, ``[n]``
        The row that each node takes.
    """
    taken = core.rows.some(rows)
    origin, target = taken.entry_row, core.node[taken.target]
    leaving = np.zeros(core.count, dtype=np.bool_)
    leaving[origin[target < 0]] = True
    inside = target >= 0
    part = parts(core.count, origin[inside], target[inside])
    crossing = part[origin[inside]] != part[target[inside]]
    leaving[part[origin[inside][crossing]]] = True
    leaving[part[leaving]] = True
    proved = np.zeros(core.count, dtype=np.bool_)
    for first in np.unique(part[~leaving[part]]):
        nodes = np.flatnonzero(part == first)
        if _is_paid(core, taken, nodes):
            proved[nodes] = True
    found: Bools = core.problem.open & proved[core.node]
    return found


def _is_paid(core: Core, taken: Rows, nodes: Array) -> bool:
    """Return whether the mean reward of a set that is never left has the sign that is wanted."""
    sign = 1.0 if core.problem.frame.maximise else -1.0
    own = taken.some(nodes)
    y = np.zeros(core.count)
    y[nodes] = _relative_values(core, own, nodes)
    drift, error = own.drift(*core.spread_pair((y, np.zeros(core.count)), 0.0))
    return bool(np.isfinite(y).all() and (sign * drift > error).all())


def _relative_values(core: Core, own: Rows, nodes: Array) -> Floats:
    """Return a solution of r + Σ δ (y' - y) = g with y = 0 in the first node, zeros where there is none."""
    place = np.full(core.count, -1, dtype=np.int64)
    place[nodes] = np.arange(len(nodes))
    row, column = own.entry_row, place[core.node[own.target]]
    count = len(nodes)
    away = row != column
    data = np.concatenate([own.share[away], -np.bincount(row[away], own.share[away], count), -np.ones(count)])
    where = np.concatenate([row[away], np.arange(count), np.arange(count)])
    which = np.concatenate([column[away], np.arange(count), np.zeros(count, dtype=np.int64)])
    kept = which > 0  # the first node has the value 0, and its column is that of g
    kept[-count:] = True
    if count <= DENSE:
        matrix = np.zeros((count, count))
        np.add.at(matrix, (where[kept], which[kept]), data[kept])
        try:
            solved = np.linalg.solve(matrix, -own.price)
        except np.linalg.LinAlgError:
            return np.zeros(count)
    else:
        from scipy.sparse import csc_array
        from scipy.sparse.linalg import splu

        try:
            sparse = csc_array((data[kept], (where[kept], which[kept])), shape=(count, count))
            solved = splu(sparse).solve(-own.price)
        except (RuntimeError, MemoryError):
            return np.zeros(count)
    solved[0] = 0.0
    return np.asarray(solved, dtype=np.float64)
