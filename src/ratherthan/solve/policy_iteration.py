"""A system with a choice at every node enters, its optimum leaves: values in two parts, and a best row for every node.

Howard's policy iteration: solve the equations of the present rows; at every node take the row whose drift is best, if it
improves on the present one by more than rounding can explain; repeat until no node changes. With exact solves the values
improve strictly, so that no policy comes twice and it ends at the optimum (Howard 1960; for stochastic shortest paths
Bertsekas and Tsitsiklis 1991: started from rows that arrive, it keeps to such rows).

It starts from rows that lead towards a sink. On large systems some sweeps of value iteration go between two solves, from
values that can only be improved upon, so that every greedy policy on the way arrives, too; they save solves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.watch import keep, look
from ratherthan.solve.endless import rising_nodes, stuck_nodes
from ratherthan.solve.linear import GRAIN, MOST_DENSE, Solved, methods_for, solve_chain
from ratherthan.solve.system import System, drift, exchanged, padded, rows_of

__all__ = ["Found", "PolicyIteration", "best_rows", "iterate_policies", "least_rows", "rows_towards_sinks"]

CAUTION = 4.0
"""How many rounding errors of drift a gain must be."""
FLOORS = (0.0, 1e-24, 1e-20, 1e-16, 1e-13)
"""Which share of the value a gain must be besides, the next one each time that gains turn out to be none."""
MOST_VAIN = 10
"""How many rounds may gain nothing that is seen."""
LOSS = 1e-9
GAIN = 1e-13
"""Relative changes of values by which a round is told to have lost, and not to have gained."""
FEW = 0.005
"""The share of nodes below which no sweeps are made any more: the rest is left to exact solves."""

Nodes = npt.NDArray[np.int64]
Progress = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class PolicyIteration:
    """Settings of policy iteration.

    Parameters
    ----------
    most_rounds : int
        After how many linear solves to stop, converged or not.
    sweeps : int
        Sweeps of value iteration between two solves of a large system.
    """

    most_rounds: int = 200
    sweeps: int = 40


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """What a solver found on a system: approximate values in two parts, and the rows that attain them.

    Nothing is promised; `certify` decides what is proved. Except `endless`: the nodes of end components where more and more
    can be gathered, which is proved; then the values are none.
    """

    solved: Solved
    rows: Nodes  # [n]
    rounds: int
    converged: bool
    engine: str
    endless: Bools | None = None  # [n]

    @property
    def values(self) -> Floats:
        """The values rounded to doubles, ``[n]``."""
        return self.solved.high + self.solved.low


def iterate_policies(
    system: System,
    maximise: bool,
    settings: PolicyIteration,
    progress: Progress | None = None,
    *,
    start: Nodes | None = None,
) -> Found | None:
    """Return the optimum of a system by policy iteration, None where an equation could not be solved.

    Parameters
    ----------
    system : System
        Of which every policy arrives at a sink, or (minimising) pays without end; where costs are signed, any.
    maximise : bool
    settings : PolicyIteration
    progress : callable, optional
        Told now and then how far it is.
    start : array of int, ``[n]``, optional
        Rows to begin with, which arrive; those that lead towards sinks by default.
    """
    rows = rows_towards_sinks(system) if start is None else start
    sign = -1.0 if maximise else 1.0
    methods = methods_for(rows_of(system, rows))
    found: Found | None = None
    failed: dict[str, None] = {}
    floors = iter(FLOORS)
    floor, vain, sweeps = next(floors), 0, settings.sweeps
    for number in range(1, settings.most_rounds + 1):
        stuck = stuck_nodes(system, rows) if system.signed else None
        if stuck is not None and found is not None:
            rising = rising_nodes(system, rows, stuck) if maximise else None
            if rising is not None:
                return replace(found, endless=rising)
            sweeps = 0
        solved = solve_chain(rows_of(system, rows), methods) if stuck is None else None
        if solved is not None:
            failed.update(dict.fromkeys(solved.failed))
        if found is None:
            if solved is None:
                return None
            methods = methods[methods.index(solved.method) :]
        else:
            lost = solved is None or _worse(sign, solved, found)
            vain += solved is None or not _improved(solved, found)
            if lost or vain > MOST_VAIN:  # what seemed a gain was none: only larger ones from here on
                vain, last, floor = 0, floor, next(floors, floor)
                if floor == last:
                    return found
            if solved is None or lost:
                solved, rows = found.solved, found.rows
        better, changed = _improved_rows(system, sign, solved, rows, floor)
        found = Found(solved=solved, rows=rows, rounds=number, converged=changed == 0, engine=_engine(failed))
        keep(system=system, guess=found.values, rows=rows, solved=solved, engine=found.engine)
        told = f"policy iteration, round {number}: {changed} of {system.nodes} choices improved"
        look(told)
        if progress is not None:
            progress(told)
        if changed == 0:
            return found
        sweeping = sweeps > 0 and system.nodes > MOST_DENSE and changed > FEW * system.nodes
        rows = _swept(system, sign, solved.high, better, sweeps) if sweeping else better
    return found


def _engine(failed: Iterable[str]) -> str:
    """Return what the values are owed to, and which solvers gave no numbers."""
    names = " and ".join(failed)
    return f"policy iteration, after {names} gave no numbers" if names else "policy iteration"


def _worse(sign: float, solved: Solved, found: Found) -> bool:
    """Return whether a round lost something that rounding does not explain."""
    before = found.solved.high
    return bool((sign * (solved.high - before) > LOSS * np.abs(found.solved.size)).any())


def _improved(solved: Solved, found: Found) -> bool:
    """Return whether a round changed a value by more than rounding."""
    before = found.solved.high
    return bool((np.abs(solved.high - before) > GAIN * np.abs(found.solved.size)).any())


def _improved_rows(system: System, sign: float, solved: Solved, rows: Nodes, floor: float) -> tuple[Nodes, int]:
    """Return the rows that are better for the values of `rows`, and at how many nodes.

    What may be wrong with a drift is its rounding error, and the errors that the values have. These are alike on a slow part of
    the chain, and differ between parts, as their estimate does.
    """
    total, error = drift(system, solved.high, solved.low)
    error += GRAIN * exchanged(system, np.abs(solved.high))
    doubt = np.abs(solved.inverse((np.abs(total) + error)[rows]))
    if np.isfinite(doubt).all():
        error += drift(system, doubt, cost=np.zeros(system.rows), one=0.0)[1] / system.rounding
    error = CAUTION * error + floor * np.abs(solved.size)[system.row_node]
    better = best_rows(system, sign * total, error, rows)
    return better, int(np.count_nonzero(better != rows))


def rows_towards_sinks(system: System) -> Nodes:
    """Return for every node the row that leads down fastest on average, of those with a branch down, ``[n]``.

    Down is towards the sinks, by breadth-first levels. A branch down at every node is enough to arrive; the largest fall on
    average keeps values of the first round from growing without measure.
    """
    index = system.index
    sinks = np.arange(index.states) >= system.nodes
    level = graph.levels_to(index, sinks, ~sinks)
    falls = level[index.branch_to_target] - level[index.choice_to_state[index.branch_to_choice]]
    begin = system.row_to_branches[:-1]
    mean = np.add.reduceat(system.probability * falls, begin)
    down = np.logical_or.reduceat(falls < 0, begin)
    return least_rows(system, np.where(down, mean, np.inf))


def best_rows(system: System, gap: Floats, error: Floats, rows: Nodes) -> Nodes:
    """Return the rows with the least gap, the present ones where nothing is gained beyond rounding, ``[n]``.

    Parameters
    ----------
    system : System
    gap, error : array of float, ``[m]``
        The drift of each row, the less the better, and how much of it may be error.
    rows : array of int, ``[n]``
        The present row of each node.
    """
    best = least_rows(system, gap)
    gain = gap[rows] - gap[best]
    worthwhile: Bools = gain > error[best] + error[rows]
    return np.where(worthwhile, best, rows)


def least_rows(system: System, gap: Floats) -> Nodes:
    """Return the first row of each node with the least gap, ``[n]``."""
    least = np.minimum.reduceat(gap, system.node_to_rows[:-1])
    candidates = np.flatnonzero(gap == least[system.row_node])
    first = np.searchsorted(candidates, system.node_to_rows[:-1])
    return candidates[first]


def _swept(system: System, sign: float, values: Floats, rows: Nodes, sweeps: int) -> Nodes:
    """Return greedy rows after some sweeps of value iteration, the loops of a row to its own node taken out."""
    from scipy.sparse import csr_array

    n, leave, branch_row = (
        system.nodes,
        system.leave,
        np.repeat(np.arange(system.rows), np.diff(system.row_to_branches)),
    )
    away = np.where(system.target != system.branch_node, system.probability, 0.0) / leave[branch_row]
    step = csr_array((away, system.target, system.row_to_branches), shape=(system.rows, n + 2))
    paid = sign * system.cost / leave
    extended = sign * padded(values, 1.0)
    for _ in range(sweeps):
        look()
        extended[:n] = np.minimum.reduceat(paid + step @ extended, system.node_to_rows[:-1])
    swept = sign * extended[:n]
    total, error = drift(system, swept)
    error += 2.0**-48 * exchanged(system, np.abs(swept))  # of values in one double
    return best_rows(system, sign * total / leave, CAUTION * error / leave, rows)
