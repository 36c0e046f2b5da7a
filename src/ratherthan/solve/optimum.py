"""A Task enters; its optimum on all states leaves, with proved bounds and the policy that attains it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Floats
from ratherthan.model.policy import Policy
from ratherthan.solve.certify import Parts, Tight, chain_margin, never_falls, never_rises, optimum_bound
from ratherthan.solve.chain import Evaluated, Guess, chain_of, evaluated, nodes_of
from ratherthan.solve.policy_iteration import Found, PolicyIteration, iterate_policies
from ratherthan.solve.sweeps import Sweeps, arriving_rows, sweep_from_below, upper_vector
from ratherthan.solve.system import System, build_system, drift, rows_of
from ratherthan.solve.task import Task
from ratherthan.solve.tied import first_tied, tied_choices

__all__ = ["Method", "Optimum", "optimum"]

Progress = Callable[[str], None]
Method = PolicyIteration | Sweeps
Nodes = npt.NDArray[np.int64]

TIES = np.array([1e-10, 1e-13, -np.inf])
"""Relative tolerances within which choices are tied, the next where the policy loses; at last the solver's rows alone."""
LOSS = 1e-10
"""Up to which relative loss a policy counts as attaining the optimum."""


class Optimum(NamedTuple):
    """The optimum of a task on all states, the policy that attains it, and how it was found."""

    values: Floats  # [S]
    lower: Floats  # [S]
    upper: Floats  # [S]
    choice: Nodes  # [S]
    attained: Evaluated
    engine: str
    solves: int
    residual: float


def optimum(task: Task, method: Method, progress: Progress | None = None) -> Optimum:
    """Return the optimum of a task.

    Parameters
    ----------
    task : Task
    method : PolicyIteration or Sweeps
    progress : callable, optional
    """
    with np.errstate(all="ignore"):  # numbers beyond doubles become ±∞ or NaN, which no check lets pass
        return _optimum(task, method, progress)


def _optimum(task: Task, method: Method, progress: Progress | None) -> Optimum:
    """Return the optimum of a task."""
    goal = task.goal
    if not task.open.any():
        choice = first_tied(task, task.internal | task.attaining)
        attained = evaluated(goal, chain_of(goal, Policy(choice=choice)))
        return Optimum(task.fixed, task.fixed, task.fixed, choice, attained, "graph search", 0, 0.0)
    node, core, whole = _systems(task)
    found = None
    if isinstance(method, PolicyIteration):
        found = iterate_policies(core, goal.maximise, method, progress)
    if found is None:
        sweeps = method if isinstance(method, Sweeps) else Sweeps()
        return _swept(task, (core, whole), node, sweeps, progress)
    choice, attained, solves = _attaining(task, core, node, found)
    if progress is not None:
        progress("proving the bounds")
    tight = Tight(Parts(found.solved.high, found.solved.low), found.rows, found.solved.inverse)
    proved = optimum_bound(core, whole, node[task.open], tight, goal.maximise)
    values, lower, upper = _joined(task, found.values[node[task.open]], proved, attained)
    residual = _residual(core, goal.maximise, found.solved.high, found.solved.low)
    return Optimum(values, lower, upper, choice, attained, found.engine, found.rounds + solves, residual)


def _residual(core: System, maximise: bool, *parts: Floats) -> float:
    """Return the largest |Tv - v|."""
    total, _ = drift(core, *parts)
    least = np.minimum.reduceat(-total if maximise else total, core.node_to_rows[:-1])
    return float(np.abs(least).max())


def _swept(
    task: Task, systems: tuple[System, System], node: Nodes, method: Sweeps, progress: Progress | None
) -> Optimum:
    """Return the optimum by value iteration."""
    goal, (core, whole), own = task.goal, systems, node[task.open]
    if progress is not None:
        progress(f"value iteration on {core.nodes} states")
    swept = sweep_from_below(core, goal.maximise, method)
    rows = arriving_rows(core, goal.maximise, swept.values)
    choice = first_tied(task, tied_choices(task, core, np.zeros(core.rows), np.full(core.rows, -1.0), rows))
    attained = evaluated(goal, chain_of(goal, Policy(choice=choice)))
    if goal.maximise:
        above = upper_vector(core, swept.values, maximise=True, settings=None if goal.counts_cost else method)
        proved = above[own] if above is not None and never_rises(whole, above[own]) else None
    else:
        proved = swept.values[own] if never_falls(whole, swept.values[own]) else None
    values, lower, upper = _joined(task, swept.values[own], proved, attained)
    residual = _residual(core, goal.maximise, swept.values)
    return Optimum(values, lower, upper, choice, attained, "value iteration", swept.sweeps, residual)


def _systems(task: Task) -> tuple[Nodes, System, System]:
    """Return the node of each state, the system with end components collapsed, and that of the open states as they are."""
    goal = task.goal
    probability = goal.mdp.branch_to_probability
    single = nodes_of(task.open, task.fixed)
    rows = np.flatnonzero(task.allowed)
    collapsed = task.open & (task.component >= 0)
    if not collapsed.any():
        core = build_system(goal.index, probability, goal.cost, rows, single)
        return single, core, core
    whole = build_system(goal.index, probability, goal.cost, rows, single)
    representative = np.arange(len(single))
    members = np.flatnonzero(collapsed)
    first = np.full(int(task.component.max()) + 1, len(single))
    np.minimum.at(first, task.component[members], members)
    representative[members] = first[task.component[members]]
    kept = task.open & (representative == np.arange(len(single)))
    count = int(np.count_nonzero(kept))
    node = np.where(task.fixed == 1.0, count + 1, count)
    node[kept] = np.arange(count)
    node[members] = node[representative[members]]
    external = np.flatnonzero(task.allowed & ~task.internal)
    return node, build_system(goal.index, probability, goal.cost, external, node), whole


def _attaining(task: Task, core: System, node: Nodes, found: Found) -> tuple[Nodes, Evaluated, int]:
    """Return the first listed policy that loses nothing, its values, and how many were tried.

    Where a policy loses, or cannot be proved not to, the next finer tolerance is taken, and only there. If even the solver's
    rows cannot be proved, because the run takes too long to get through a collapsed component, the solver's values are checked.
    """
    goal, open_ = task.goal, task.open
    total, error = drift(core, found.solved.high, found.solved.low)
    gap = -total if goal.maximise else total
    wanted, own = found.values[node[open_]], node[open_]
    rung = np.zeros(core.nodes, dtype=np.int64)
    guess = None
    for solves in range(1, len(TIES) + 2):
        least = TIES[rung][core.row_node] * found.values[core.row_node] + 4.0 * error
        choice = first_tied(task, tied_choices(task, core, gap, least, found.rows))
        attained = evaluated(goal, chain_of(goal, Policy(choice=choice)), guess)
        bound = attained.lower if goal.maximise else attained.upper
        loses = np.abs(bound[open_] - wanted) > LOSS * wanted
        if not loses.any() or guess is not None:
            break
        if solves < len(TIES):
            rung[own[loses]] = solves
        else:
            rung[:] = len(TIES) - 1
            guess = _guess(task, core, node, found)
    return choice, attained, solves


def _guess(task: Task, core: System, node: Nodes, found: Found) -> Guess | None:
    """Return the solver's values on all states, with the margin that is right for its rows."""
    tight = Tight(Parts(found.solved.high, found.solved.low), np.arange(core.nodes), found.solved.inverse)
    margin = chain_margin(rows_of(core, found.rows), tight)
    if margin is None:
        return None
    whole = Guess(*(np.zeros(len(node)) for _ in range(3)))
    for part, values in zip(whole, (*tight.values, margin), strict=True):
        part[task.open] = values[node[task.open]]
    return whole


def _joined(
    task: Task, open_values: Floats, proved: Floats | None, attained: Evaluated
) -> tuple[Floats, Floats, Floats]:
    """Return the values on all states, with the bound that no policy beats and that which one attains."""
    open_ = task.open
    values, lower, upper = task.fixed.copy(), task.fixed.copy(), task.fixed.copy()
    if task.goal.maximise:
        most = np.inf if task.goal.counts_cost else 1.0
        lower[open_] = np.maximum(attained.lower[open_], 0.0)
        upper[open_] = most if proved is None else np.minimum(proved, most)
    else:
        lower[open_] = 0.0 if proved is None else proved
        upper[open_] = attained.upper[open_]
    values[open_] = np.clip(open_values, lower[open_], upper[open_])
    return values, lower, upper
