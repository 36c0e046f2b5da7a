"""What was known when a limit stopped a solver enters; a Solution leaves whose bounds are proved all the same, wide as they may be.

Solvers lay down what they have on the way (`ratherthan.model.watch.keep`): the task, that is all that the graph decides; its
equations; values that were swept so far, rows of a policy and its solution. None of it is believed. What is told are

* the values that the graph decides, and 0 and 1, 0 and ∞ (of a discounted sum with |r̄| ≤ R: ± R / (1 - γ)) elsewhere;
* (1 - h) v and (1 + h) v for the values v so far, if costs are positive and some h < 1 passes the checks of `certify`:
  v of the sweeps may be as rough as it likes, h tells how rough;
* c · l below a least cost, with c the least that a choice pays and l the least number of steps to where nothing more is paid;
* the bounds of the policy so far, on the side where a policy is one: above a least cost, below a largest value;
* vectors that a method has proved on the way by how it came to them (``lower``, ``upper``), checked again where that is possible.

As bounds of the same value, they are taken together: the largest of the lower, the least of the upper ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.errors import LimitError, StoppedError
from ratherthan.model import graph
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.objective import Level
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.model.watch import current, keep, look, phase, unlimited
from ratherthan.solve.certify import Parts, Tight, chain_bounds, never_falls, never_rises
from ratherthan.solve.goal import Goal, Kind, Task
from ratherthan.solve.linear import Solved
from ratherthan.solve.policy_iteration import least_rows
from ratherthan.solve.solution import Outcome, Solution
from ratherthan.solve.system import System, drift, rows_of

__all__ = ["Equations", "begun", "finishing", "keeping", "stopped", "unsolved", "written"]

Nodes = npt.NDArray[np.int64]

LESS = 1.0 - 1e-9
"""What is taken of the bound by levels, for rounding."""
MOST = 0.9
"""Up to which h a scaled bound is worth a check."""
ROOM = 1.0 + 1e-6


class Equations(NamedTuple):
    """A task's equations: the node of each state, the system with end components collapsed, and that of the open states."""

    node: Nodes  # [S]
    core: System
    whole: System


@contextmanager
def keeping(problem: Problem, levels: tuple[Level, ...]) -> Iterator[None]:
    """Solve a problem in the block: what it lays down is its own, and a limit that stops it leaves with what is known.

    Raises
    ------
    StoppedError
        Where a limit is reached in the block; `solution` holds what is proved by then.
    """
    board = current().board
    before = board.kept
    keep(problem=problem, levels=levels, found=(), goal=None, task=None, equations=None, engine=None)
    try:
        with phase("solving"):
            yield
    except StoppedError:  # of a further problem on the way; it has told what it knows
        raise
    except LimitError as limit:
        raise unsolved(limit, board.kept) from limit
    finally:
        board.kept = before


def begun(task: Task) -> None:
    """Lay down what the graph decides of a task."""
    keep(
        task=task,
        equations=None,
        system=None,
        lower=None,
        upper=None,
        bounds=None,
        guess=None,
        rows=None,
        solved=None,
        engine=None,
    )
    look()


def written(task: Task, equations: Equations) -> None:
    """Lay down the equations of a task, if it is the one that is solved and no other on the way to it."""
    if current().board.kept.get("task") is task:
        keep(equations=equations)
    look()


def unsolved(limit: LimitError, kept: Mapping[str, Any]) -> StoppedError:
    """Return the error of a solver that a limit stopped, with all that was proved by then in its `solution`.

    Parameters
    ----------
    limit : LimitError
    kept : mapping
        What was laid down on the way.
    """
    limit.__traceback__ = limit.__cause__ = limit.__context__ = None  # and with them the arrays of what was stopped
    with unlimited():
        try:
            solution = stopped(kept)
        except MemoryError:  # not even for this is there room
            solution = stopped({name: kept[name] for name in ("problem", "levels")})
    mdp = solution.problem.mdp
    said = ""
    if len(mdp.initial) == 1:
        lower, upper = (float(bound[0, mdp.initial[0]]) for bound in (solution.lower, solution.upper))
        sides = [f"{word} {end:.10g}" for word, end in (("at least", lower), ("at most", upper)) if np.isfinite(end)]
        if lower == upper:
            said = f" {solution.objectives[0].text} at the start is {lower:.10g}."
        elif sides:
            said = f" Proved so far: {solution.objectives[0].text} at the start is {' and '.join(sides)}."
        else:
            said = f" Nothing is proved yet of {solution.objectives[0].text} at the start."
    return StoppedError(limit.message + said, solution=solution, reached=limit.message, **limit.place)


def stopped(kept: Mapping[str, Any]) -> Solution:
    """Return what is proved of a problem's values by now.

    Parameters
    ----------
    kept : mapping
        What was laid down on the way: at least ``problem`` and ``levels``, as `keeping` does.
    """
    problem, levels = kept["problem"], kept["levels"]
    mdp, found = problem.mdp, kept.get("found") or ()
    goal: Goal | None = found[0][0] if found else kept.get("goal")
    rows = []
    for number, level in enumerate(levels):
        if number < len(found):
            own, best = found[number]
            rows.append(_facing(own, (best.values, best.lower, best.upper)))
        elif number == len(found) and kept.get("task") is not None:
            with np.errstate(all="ignore"):
                rows.append(_facing(kept["task"].goal, _bounded(kept["task"], kept)))
        else:
            rows.append(_unknown(mdp.states, goal if number == 0 else None, level))
    values, lower, upper = map(np.stack, zip(*rows, strict=True))
    task = found[0][1].task if found else kept.get("task")
    nowhere = np.zeros(mdp.states, dtype=np.bool_)
    good, bad = (nowhere, nowhere) if goal is None else goal.ends  # to find them out would take time again
    nothing = np.full_like(values, np.inf)
    choice = found[-1][1].choice if found else mdp.state_to_choices[:-1].astype(np.int64)
    return Solution(
        problem=problem,
        objectives=levels,
        values=values,
        lower=lower,
        upper=upper,
        policy=Policy(choice=choice),
        given=False,
        policy_values=values,
        policy_lower=-nothing,
        policy_upper=nothing,
        goal=good,
        hazard=bad,
        can_arrive=np.ones(mdp.states, dtype=np.bool_) if task is None else task.can_arrive,
        outcome=Outcome.STOPPED,
        engine=kept.get("engine") or "graph search",
        sweeps=0,
        residual=float("inf"),
    )


@contextmanager
def finishing(best: Solution | None, policy: Policy) -> Iterator[None]:
    """Judge a given policy in the block: a limit that stops it leaves with what is known of the optimum, and nothing of the policy.

    Parameters
    ----------
    best : Solution, optional
        The optimum, where it is known by now.
    policy : Policy
    """
    try:
        with phase("evaluating the policy") if best is not None else nullcontext():
            yield
    except LimitError as limit:
        place = dict(limit.place)
        known = place.pop("solution", best)
        if known is None:  # before there was anything to solve
            raise
        nothing = np.full_like(known.values, np.inf)
        told = replace(
            known, policy=policy, given=True, policy_lower=-nothing, policy_upper=nothing, outcome=Outcome.STOPPED
        )
        raise StoppedError(limit.message, solution=told, **place) from limit


def _facing(goal: Goal, bounds: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    """Return values and bounds as the objective means them, which a mirrored goal turns round."""
    values, lower, upper = bounds
    return (0.0 - values, 0.0 - upper, 0.0 - lower) if goal.mirrored else bounds


def _unknown(states: int, goal: Goal | None, level: Level) -> tuple[Floats, Floats, Floats]:
    """Return the bounds that hold of any model; where the goal is known, what they are there."""
    from ratherthan.model.objective import ExpectedCost, Mission, ReachAvoid

    least = 0.0 if isinstance(level, ExpectedCost | ReachAvoid | Mission) else -np.inf
    most = 1.0 if isinstance(level, ReachAvoid | Mission) else np.inf
    lower, upper = np.full(states, least), np.full(states, most)
    if goal is not None and goal.kind is Kind.PROBABILITY:
        lower[goal.target] = 1.0
        upper[~goal.running & ~goal.target] = 0.0
    elif goal is not None and goal.kind is not Kind.DISCOUNTED:
        lower[goal.target] = upper[goal.target] = 0.0
    return _value(None, lower, upper), lower, upper


def _value(guess: Floats | None, lower: Floats, upper: Floats) -> Floats:
    """Return a finite number between bounds wherever there is one: the guess, if there is one and it is a number."""
    middle = np.zeros_like(lower)
    np.add(0.5 * lower, 0.5 * upper, out=middle, where=np.isfinite(lower) & np.isfinite(upper))
    wanted = middle if guess is None else np.where(np.isfinite(guess), guess, middle)
    return np.clip(wanted, lower, upper)


def _bounded(task: Task, kept: Mapping[str, Any]) -> tuple[Floats, Floats, Floats]:
    """Return a value and proved bounds of all states for a task that was not finished."""
    goal, open_ = task.goal, task.open
    lower, upper = task.fixed.copy(), task.fixed.copy()
    lower[open_], upper[open_] = _widest(task)
    guess = None
    if goal.kind is Kind.COST and not goal.maximise and not goal.signed and open_.any():
        steps = graph.levels_to(goal.index, ~open_, open_, task.allowed)[open_]
        lower[open_] = LESS * float(goal.cost[task.allowed].min(initial=np.inf)) * np.maximum(steps, 0)
    equations: Equations | None = kept.get("equations")
    if kept.get("bounds") is not None:  # of the open states, proved by whoever laid them down
        below, above = kept["bounds"]
        lower[open_], upper[open_] = np.maximum(lower[open_], below), np.minimum(upper[open_], above)
        guess = np.array(task.fixed)
        guess[open_] = kept["guess"]
    elif equations is not None and open_.any():
        parts = kept if kept.get("system") is equations.core else {}
        below, above = _proved(task, equations, parts)
        lower[open_] = np.maximum(lower[open_], below)
        upper[open_] = np.minimum(upper[open_], above)
        if parts.get("guess") is not None:
            guess = np.array(task.fixed)
            guess[open_] = parts["guess"][equations.node[open_]]
    if goal.discount < 1.0:
        paid = np.abs(goal.cost) + 1e-12 * goal.size
        most = float(paid.max(initial=0.0)) / (1.0 - goal.discount) * ROOM
        lower, upper = np.maximum(lower, -most), np.minimum(upper, most)
    return _value(guess, lower, upper), lower, upper


def _widest(task: Task) -> tuple[float, float]:
    """Return between which numbers all values of open states lie."""
    least = -np.inf if task.goal.signed else 0.0
    return least, np.inf if task.goal.counts_cost else 1.0


def _proved(task: Task, equations: Equations, parts: Mapping[str, Any]) -> tuple[Floats, Floats]:
    """Return bounds of the open states, -∞ and ∞ where nothing better is known."""
    goal, core, own = task.goal, equations.core, equations.node[task.open]
    lower, upper = np.full(len(own), -np.inf), np.full(len(own), np.inf)
    for candidate in _below(task, equations, parts):
        np.maximum(lower, candidate, out=lower)
    for candidate in _above(task, equations, parts):
        np.minimum(upper, candidate, out=upper)
    below, above = _of_policy(core, parts)
    if goal.maximise and below is not None:
        lower = np.maximum(lower, below[own])
    if not goal.maximise and above is not None:
        upper = np.minimum(upper, above[own])
    return lower, upper


def _below(task: Task, equations: Equations, parts: Mapping[str, Any]) -> Iterator[Floats]:
    """Yield vectors on the open states that no policy comes below of a least value, and that some policy attains of a largest."""
    goal, whole, own = task.goal, equations.whole, equations.node[task.open]
    kept: Floats | None = parts.get("lower")
    if kept is not None and (goal.maximise or never_falls(whole, kept[own])):
        yield kept[own]
    if goal.maximise or goal.kind is Kind.PROBABILITY or not _pays(whole):
        return
    guess: Floats | None = parts.get("guess")
    if guess is not None and np.isfinite(guess).all() and (guess >= 0.0).all():
        scaled = _scaled(whole, guess[own], -1.0)
        if scaled is not None:
            yield scaled


def _above(task: Task, equations: Equations, parts: Mapping[str, Any]) -> Iterator[Floats]:
    """Yield vectors on the open states that no policy comes above of a largest value, and that some policy keeps below of a least."""
    goal, (node, core, whole) = task.goal, equations
    own = node[task.open]
    kept: Floats | None = parts.get("upper")
    if kept is not None and goal.maximise and (goal.signed or (kept >= 0.0).all()) and never_rises(whole, kept[own]):
        yield kept[own]
    guess: Floats | None = parts.get("guess")
    if goal.maximise or goal.kind is Kind.PROBABILITY or not _pays(core) or guess is None:
        return
    if np.isfinite(guess).all() and (guess >= 0.0).all():
        total, _ = drift(core, guess)
        taken = rows_of(core, least_rows(core, total))
        scaled = _scaled(taken, guess, 1.0)  # positive costs: a policy that it holds for comes to an end
        if scaled is not None:
            yield scaled[own]


def _pays(system: System) -> bool:
    """Return whether every row pays something, so that values can be scaled."""
    return not system.signed and bool(system.cost.min() > 0.0) and bool(np.isfinite(system.cost).all())


def _scaled(system: System, values: Floats, sign: float) -> Floats | None:
    """Return (1 + sign · h) · values for an h that passes the check, None where none does."""
    total, error = drift(system, values)
    need = float(((sign * total + error) / system.cost).max(initial=0.0)) * ROOM + 1e-12
    if sign > 0.0:  # the drift is scaled, too
        need = need / (1.0 - need) * ROOM if need < MOST else np.inf
    if not need <= (MOST if sign < 0.0 else MOST / (1.0 - MOST)):
        return None
    moved: Floats = (1.0 + sign * need) * values
    return moved if (never_falls if sign < 0.0 else never_rises)(system, moved) else None


def _of_policy(core: System, parts: Mapping[str, Any]) -> tuple[Floats | None, Floats | None]:
    """Return the bounds of the policy so far, None where they are not proved: also where it may not come to an end."""
    rows: Nodes | None = parts.get("rows")
    solved: Solved | None = parts.get("solved")
    if rows is None or solved is None or not _arrives(core, rows):
        return None, None
    tight = Tight(Parts(solved.high, solved.low), np.arange(core.nodes), solved.inverse, solved.scale)
    return chain_bounds(rows_of(core, rows), tight)


def _arrives(core: System, rows: Nodes) -> bool:
    """Return whether a sink can be reached from every node along rows of a policy, which then happens with probability 1."""
    index = core.index
    sinks: Bools = np.arange(index.states) >= core.nodes
    taken = np.zeros(core.rows, dtype=np.bool_)
    taken[rows] = True
    return bool(graph.can_reach(index, sinks, ~sinks, taken).all())
