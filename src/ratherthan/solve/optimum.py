"""A Task enters; its optimum on all states leaves, with proved bounds and the policy that attains it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.policy import Policy
from ratherthan.solve.certify import Parts, Tight, chain_margin, never_falls, never_rises, optimum_bound
from ratherthan.solve.chain import Evaluated, Guess, chain_of, evaluated
from ratherthan.solve.equations import systems_of
from ratherthan.solve.gathering import loops_in_doubt, most_reward
from ratherthan.solve.goal import Goal, Kind, Task
from ratherthan.solve.layered import Layered, layered_bounds, swept_bounds
from ratherthan.solve.levelling import levelled, raised, without_cancelling
from ratherthan.solve.linear import Method as LinearMethod
from ratherthan.solve.linear import Solved
from ratherthan.solve.policy_iteration import Found, PolicyIteration, iterate_policies, least_rows
from ratherthan.solve.precise import width_aimed_at
from ratherthan.solve.stopped import Equations, begun, written
from ratherthan.solve.sweeps import Sweeps, Swept, arriving_rows, sweep_from_below, swept_between, upper_vector
from ratherthan.solve.system import System, drift, rows_of
from ratherthan.solve.tied import first_tied, fixed_best, tied_choices
from ratherthan.solve.trapped import ENGINE, suits_traps
from ratherthan.solve.trapped.horizon import Horizon, within_steps

__all__ = ["Method", "Optimum", "optimum"]

Progress = Callable[[str], None]
Method = PolicyIteration | Sweeps
Nodes = npt.NDArray[np.int64]

TIES = np.array([1e-10, 1e-13, -np.inf])
"""Relative tolerances within which choices are tied, the next where the policy loses; at last the solver's rows alone."""
NO_METHOD = LinearMethod(lambda _: None)
AFTER_TRAPS = PolicyIteration()
"""Where elimination past traps had its turn before."""
COARSE = 1e-10
"""Below which relative width of bounds windows are left to sweeps that go on."""
LOSS = 1e-10
"""Up to which relative loss a policy counts as attaining the optimum."""
SEVERAL = 50_000
"""Up to how many nodes probabilities that one method could not prove are left to the other."""
OPEN = 1e-3
"""How wide the bounds of a probability must be for what holds within a number of steps to be of interest."""


class Optimum(NamedTuple):
    """The optimum of a task on all states, the policy that attains it, and how it was found."""

    values: Floats  # [S]
    lower: Floats  # [S]
    upper: Floats  # [S]
    choice: Nodes  # [S]
    tied: Bools  # [C], the choices that cannot be told from the best
    attained: Evaluated
    engine: str
    solves: int
    residual: float
    task: Task
    horizon: Horizon | None = None  # [S], where nothing else was proved from above


def optimum(task: Task, method: Method | None, progress: Progress | None = None, *, finest: int = 0) -> Optimum:
    """Return the optimum of a task.

    Parameters
    ----------
    task : Task
    method : PolicyIteration or Sweeps, optional
        Without it the program chooses, in this order, each giving up where it does not suit: windowed sweeps, one backward
        pass, elimination past traps, sweeps of any sum, policy iteration, value iteration.
    progress : callable, optional
    finest : int
        Which of the tolerances for ties to begin with; the later, the finer.
    """
    begun(task)
    with np.errstate(all="ignore"):  # numbers beyond doubles become ±∞ or NaN, which no check lets pass
        best = _optimum(task, method, progress, finest)
        return best._replace(horizon=_horizon(best))


def _horizon(best: Optimum) -> Horizon | None:
    """Return what holds within a number of steps, where no bound against all policies was proved of a largest probability."""
    task = best.task
    own, goal = task.open, task.goal
    if goal.counts_cost or not goal.maximise or not (best.upper[own] - best.lower[own] > OPEN).any():
        return None
    found = within_steps(systems_of(task)[2], best.values[own])
    if found is None:
        return None
    upper = task.fixed.copy()
    upper[own] = np.minimum(found.upper, best.upper[own])
    return Horizon(found.steps, upper)


def _optimum(task: Task, method: Method | None, progress: Progress | None, finest: int) -> Optimum:
    """Return the optimum of a task."""
    goal = task.goal
    if not task.open.any():
        tied = fixed_best(task)
        choice = first_tied(task, task.internal | task.attaining)
        attained = evaluated(goal, chain_of(goal, Policy(choice=choice)))
        return Optimum(task.fixed, task.fixed, task.fixed, choice, tied, attained, "graph search", 0, 0.0, task)
    quick = _windowed(task, progress) if method is None and finest == 0 and width_aimed_at() >= COARSE else None
    if quick is not None:
        return quick
    node, core, whole = systems_of(task)
    written(task, Equations(node, core, whole))
    plain = None if core is not whole or loops_in_doubt(task) else _layered_bounds(task, core)
    if method is None and plain is not None and plain.narrow:
        return _layered(task, core, node, plain, finest)
    if method is None and suits_traps(task, core) and (past := _likely(task, (core, whole), node, finest, progress)):
        return past
    swept = _contracted(task, (core, whole), node, (plain, finest)) if method is None else None
    if swept is not None and swept.good and swept.optimum is not None:
        return swept.optimum
    grown = _growing(task, core, node) if swept is not None else None
    if grown is not None:
        return _optimum(grown, method, progress, finest)
    best = None
    if not isinstance(method, Sweeps):
        start = None if swept is None else swept.rows
        found = iterate_policies(core, goal.maximise, method or PolicyIteration(), progress, start=start)
        if found is not None and found.endless is not None:
            return _optimum(_without(task, node, found.endless), method, progress, finest)
        if found is not None:
            best = _by_equations(_Asked(task, core, whole, node, plain, finest, method, progress), found)
    if best is None and swept is not None and swept.optimum is not None:
        return swept.optimum
    if best is None:
        best = _swept(task, (core, whole), node, method if isinstance(method, Sweeps) else Sweeps(), progress)
        after = "" if isinstance(method, Sweeps) else ", after policy iteration gave no numbers"
        return best._replace(engine=best.engine + after)
    return best if swept is None or swept.optimum is None else _better(best, swept.optimum)


class _Asked(NamedTuple):
    """A task with its systems, the bounds of a backward pass if there are any, and how it is to be solved."""

    task: Task
    core: System
    whole: System
    node: Nodes
    plain: Layered | None
    finest: int
    method: Method | None
    progress: Progress | None


def _better(best: Optimum, other: Optimum) -> Optimum:
    """Return an optimum with the better of the bounds that two methods proved."""
    lower, upper = np.maximum(best.lower, other.lower), np.minimum(best.upper, other.upper)
    return best._replace(values=np.clip(best.values, lower, upper), lower=lower, upper=upper)


def _by_equations(asked: _Asked, found: Found) -> Optimum:
    """Return the optimum that policy iteration found, with what can be proved of it."""
    task, core, whole, node, plain, finest, method, progress = asked
    goal = task.goal
    choice, tied, attained, solves = _attaining(task, core, node, found, finest)
    if progress is not None:
        progress("proving the bounds")
    tight = Tight(Parts(found.solved.high, found.solved.low), found.rows, found.solved.inverse, found.solved.scale)
    proved = None if loops_in_doubt(task) else optimum_bound(core, whole, node[task.open], tight, goal.maximise)
    if proved is None and goal.kind is Kind.REWARD:
        level = levelled(task, tied)
        if level is not None:
            return _on_level(task, level, method, progress, finest)
    if proved is None and (grown := _growing(task, core, node)) is not None:
        return _optimum(grown, method, progress, finest)
    values, lower, upper = _joined(task, found.values[node[task.open]], proved, attained)
    values, lower, upper = _tightened(task, whole, plain, (values, lower, upper))
    if proved is None and goal.kind is Kind.REWARD:
        apart = without_cancelling(task, tied)
        if apart is not None:  # what cannot come there may be proved all the same
            upper = np.where(apart.open, _optimum(apart, method, progress, finest).upper, upper)
            values = np.clip(values, lower, upper)
    residual = _residual(core, goal.maximise, found.solved.high, found.solved.low)
    tied = fixed_best(task) | tied & task.open[goal.index.choice_to_state]
    best = Optimum(values, lower, upper, choice, tied, attained, found.engine, found.rounds + solves, residual, task)
    if goal.counts_cost or not (upper - lower > OPEN).any() or core.nodes > SEVERAL or method is AFTER_TRAPS:
        return best
    past = _past_traps(task, (core, whole), node, finest, progress)
    return best if past is None or _width(past) >= _width(best) else past


def _width(best: Optimum) -> float:
    """Return how wide the bounds are, on average."""
    return float((best.upper - best.lower).mean())


def _layered_bounds(task: Task, core: System) -> Layered | None:
    """Return the bounds of one backward pass, None where there is a cycle."""
    return layered_bounds(core, task.goal.maximise, most=np.inf if task.goal.counts_cost else 1.0)


def _tightened(
    task: Task, whole: System, plain: Layered | None, found: tuple[Floats, Floats, Floats]
) -> tuple[Floats, Floats, Floats]:
    """Return values and bounds on all states, the better of two bounds where a pass has others."""
    values, lower, upper = found
    own = task.open
    if plain is not None:
        lower[own], upper[own] = np.maximum(lower[own], plain.lower), np.minimum(upper[own], plain.upper)
    elif task.goal.signed:
        lower[own], upper[own] = swept_bounds(whole, lower[own], upper[own], task.goal.maximise)
    return np.clip(values, lower, upper), lower, upper


def _layered(task: Task, core: System, node: Nodes, plain: Layered, finest: int) -> Optimum:
    """Return the optimum of a task without cycles, of which one backward pass has proved the bounds."""
    goal, own = task.goal, node[task.open]
    total, _ = drift(core, plain.values)
    rows = least_rows(core, -total if goal.maximise else total)
    solved = Solved(plain.values, np.zeros(core.nodes), lambda right: np.full_like(right, np.nan), NO_METHOD, 0.0)
    found = Found(solved=solved, rows=rows, rounds=1, converged=True, engine="one backward pass")
    choice, tied, attained, solves = _attaining(task, core, node, found, finest)
    values, lower, upper = (task.fixed.copy() for _ in range(3))
    for whole, part in zip((values, lower, upper), plain, strict=True):
        whole[task.open] = part[own]
    side, better = (lower, np.maximum) if goal.maximise else (upper, np.minimum)
    side[task.open] = better(side, attained.lower if goal.maximise else attained.upper)[task.open]
    values = np.clip(values, lower, upper)
    residual = _residual(core, goal.maximise, plain.values)
    tied = fixed_best(task) | tied & task.open[goal.index.choice_to_state]
    return Optimum(values, lower, upper, choice, tied, attained, found.engine, 1 + solves, residual, task)


def _windowed(task: Task, progress: Progress | None) -> Optimum | None:
    """Return the optimum by windowed sweeps, None where these do not suit."""
    from ratherthan.solve.windowed import suits_windows, windowed_optimum

    return windowed_optimum(task, progress=progress) if suits_windows(task) else None


def _likely(
    task: Task, systems: tuple[System, System], node: Nodes, finest: int, progress: Progress | None
) -> Optimum | None:
    """Return the optimum of many probabilities; where one method could not prove them, with what the other can."""
    past = _past_traps(task, systems, node, finest, progress)
    if past is None or systems[0].nodes > SEVERAL or not (past.upper - past.lower > OPEN).any():
        return past
    return _better(_optimum(task, AFTER_TRAPS, progress, finest), past)


def _past_traps(
    task: Task, systems: tuple[System, System], node: Nodes, finest: int, progress: Progress | None
) -> Optimum | None:
    """Return the optimum of probabilities in two parts, None where its equations would fill, or nothing could be proved of it."""
    from ratherthan.solve.trapped.attained import past_traps

    found = past_traps(task, systems, node, finest, progress)
    if found is None:
        return None
    values, lower, upper = _joined(task, found.values, found.bound, found.attained)
    tied = fixed_best(task) | found.tied & task.open[task.goal.index.choice_to_state]
    return Optimum(values, lower, upper, found.choice, tied, found.attained, ENGINE, found.rounds, found.residual, task)


class _Contracted(NamedTuple):
    """An optimum found by sweeps, whether its bounds are narrow enough, and rows for others to begin with."""

    optimum: Optimum | None
    rows: Nodes | None  # [n]
    good: bool


def _contracted(
    task: Task,
    systems: tuple[System, System],
    node: Nodes,
    layered: tuple[Layered | None, int],
) -> _Contracted | None:
    """Return the optimum by sweeps of any kind of sum, None where these do not suit or come to no end."""
    from ratherthan.solve.contracting import contracted, suits_contraction

    (core, whole), (plain, finest) = systems, layered
    if not suits_contraction(task, core) or loops_in_doubt(task):
        return None
    found, rows = contracted(task, systems, node, finest=finest)
    if found is None:
        return _Contracted(None, rows, good=False)
    values, lower, upper = _joined(task, found.values[node[task.open]], found.bound, found.attained)
    values, lower, upper = _tightened(task, whole, plain, (values, lower, upper))
    tied = fixed_best(task) | found.tied & task.open[task.goal.index.choice_to_state]
    best = Optimum(
        values, lower, upper, found.choice, tied, found.attained, found.engine, found.rounds, found.residual, task
    )
    return _Contracted(best, rows, good=found.good)


def _growing(task: Task, core: System, node: Nodes) -> Task | None:
    """Return the task when sweeps have found where more and more can be gathered, None where they find nothing."""
    if task.goal.kind is not Kind.REWARD or not task.goal.signed:
        return None
    from ratherthan.solve.contracting.growth import growing_nodes

    endless = growing_nodes(core)
    return None if endless is None else _without(task, node, endless)


def _without(task: Task, node: Nodes, endless: Bools) -> Task:
    """Return the task when it is known at which nodes more and more can be gathered."""
    states = task.goal.index.states
    rising = np.zeros(states, dtype=np.bool_)
    rising[task.open] = endless[node[task.open]]
    return most_reward(task.goal, rising | (task.fixed == np.inf))


def _on_level(
    task: Task, level: tuple[Goal, Floats], method: Method | None, progress: Progress | None, finest: int
) -> Optimum:
    """Return the optimum of a task by that of the task in which gains and losses that cancel are taken out."""
    goal, height = level
    best = _optimum(most_reward(goal, task.fixed == np.inf), method, progress, finest)
    attained = evaluated(task.goal, chain_of(task.goal, Policy(choice=best.choice)))
    lower, upper = raised(best.lower, height, -np.inf), raised(best.upper, height, np.inf)
    lower = np.where(task.open, np.maximum(lower, attained.lower), lower)
    values = np.clip(raised(best.values, height, 0.0), lower, upper)
    return best._replace(values=values, lower=lower, upper=upper, attained=attained)


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
    if goal.signed:
        between, _, proved = swept_between(core, method, maximise=True)
        proved = proved[own] if proved is not None and never_rises(whole, proved[own]) else None
        swept = Swept(values=between, sweeps=method.most)
    else:
        swept = sweep_from_below(core, goal.maximise, method)
    rows = arriving_rows(core, goal.maximise, swept.values)
    tied = tied_choices(task, core, np.zeros(core.rows), np.full(core.rows, -1.0), rows)
    choice = first_tied(task, tied)
    attained = evaluated(goal, chain_of(goal, Policy(choice=choice)))
    if goal.signed:
        proved = None if loops_in_doubt(task) else proved
    elif goal.maximise:
        above = upper_vector(core, swept.values, maximise=True, settings=None if goal.counts_cost else method)
        proved = above[own] if above is not None and never_rises(whole, above[own]) else None
    else:
        proved = swept.values[own] if never_falls(whole, swept.values[own]) else None
    values, lower, upper = _joined(task, swept.values[own], proved, attained)
    residual = _residual(core, goal.maximise, swept.values)
    tied = fixed_best(task) | tied & task.open[goal.index.choice_to_state]
    return Optimum(values, lower, upper, choice, tied, attained, "value iteration", swept.sweeps, residual, task)


def _attaining(task: Task, core: System, node: Nodes, found: Found, finest: int) -> tuple[Nodes, Bools, Evaluated, int]:
    """Return the first listed policy that loses nothing, the choices it was taken of, its values, and how many were tried.

    Where a policy loses, or cannot be proved not to, the next finer tolerance is taken, and only there. If even the solver's
    rows cannot be proved, because the run takes too long to get through a collapsed component, the solver's values are checked.
    """
    goal, open_ = task.goal, task.open
    total, error = drift(core, found.solved.high, found.solved.low)
    gap = -total if goal.maximise else total
    wanted, own = found.values[node[open_]], node[open_]
    rung = np.full(core.nodes, finest, dtype=np.int64)
    guess = None
    for solves in range(finest + 1, len(TIES) + 2):
        least = TIES[rung][core.row_node] * np.abs(found.values)[core.row_node] + 4.0 * error
        tied = tied_choices(task, core, gap, least, found.rows)
        choice = first_tied(task, tied)
        attained = evaluated(goal, chain_of(goal, Policy(choice=choice)), guess)
        loses = _losing(goal, attained, open_, wanted)
        if not loses.any() or guess is not None:
            break
        if solves < len(TIES):
            rung[own[loses]] = solves
        else:
            rung[:] = len(TIES) - 1
            guess = _guess(task, core, node, found)
    return choice, tied, attained, solves - finest


def _losing(goal: Goal, attained: Evaluated, open_: Bools, wanted: Floats) -> Bools:
    """Return where a policy does not provably attain what is wanted of the open states, up to a small loss.

    Signed values may be small though what they are made of is not: the width of the policy's bounds is allowed them besides.
    """
    lower, upper = attained.lower[open_], attained.upper[open_]
    most = LOSS * np.abs(wanted) + (np.where(np.isfinite(upper - lower), upper - lower, 0.0) if goal.signed else 0.0)
    return ~(np.abs((lower if goal.maximise else upper) - wanted) <= most)


def _guess(task: Task, core: System, node: Nodes, found: Found) -> Guess | None:
    """Return the solver's values on all states, with the margin that is right for its rows."""
    parts = Parts(found.solved.high, found.solved.low)
    tight = Tight(parts, np.arange(core.nodes), found.solved.inverse, found.solved.scale)
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
        lower[open_] = attained.lower[open_] if task.goal.signed else np.maximum(attained.lower[open_], 0.0)
        upper[open_] = most if proved is None else np.minimum(proved, most)
    else:
        lower[open_] = 0.0 if proved is None else proved
        upper[open_] = attained.upper[open_]
    values[open_] = np.clip(open_values, lower[open_], upper[open_])
    return values, lower, upper
