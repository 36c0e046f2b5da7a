"""A task with its systems enters, its optimum leaves with proved bounds: sweeps or corrections, then a margin, then the check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import is_compiled
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.policy import Policy
from ratherthan.model.watch import look
from ratherthan.solve.certify import Parts, never_falls, never_rises, outward
from ratherthan.solve.chain import Evaluated, Guess, chain_of, evaluated
from ratherthan.solve.contracting.corrections import corrected, eliminable, repaired
from ratherthan.solve.contracting.discounting import discounted_values
from ratherthan.solve.contracting.field import Field, begin_with, field_of, residual_of, swept
from ratherthan.solve.contracting.proof import bounded_by, gaps_of, margins_for
from ratherthan.solve.goal import Task
from ratherthan.solve.policy_iteration import rows_towards_sinks
from ratherthan.solve.precise import width_aimed_at
from ratherthan.solve.system import System
from ratherthan.solve.tied import first_tied

__all__ = ["Contracted", "chain_bounds_at_size", "contracted", "suits_contraction"]

Nodes = npt.NDArray[np.int64]

FEWEST = 3000
"""From how many nodes on: below, equations are solved at once, and to the last digit."""
GOOD = 100.0
"""Up to how many times the width aimed at no equation is solved to do better."""
FINER = 1e-2
SWEPT, SHIFTED = "sweeps", "discounted sweeps"
ROUGH = "policy iteration with rough solves"
ENOUGH = 30.0
"""How many times that is enough."""
TRIES = 3


class Contracted(NamedTuple):
    """What was found: values of nodes, the bound that no policy beats (None: not proved), a policy and its proved values."""

    values: Floats  # [n]
    bound: Floats | None  # [N], of the open states
    choice: Nodes  # [S]
    tied: Bools  # [C]
    attained: Evaluated
    residual: float
    engine: str
    rounds: int
    width: float

    @property
    def good(self) -> bool:
        """Whether the bounds are narrow enough for comparisons."""
        return self.width <= GOOD * width_aimed_at()


@dataclass(frozen=True, kw_only=True, eq=False)
class _Work:
    """A task with its systems: with end components collapsed, and as it is; and the node of each state."""

    task: Task
    core: System
    whole: System
    node: Nodes

    @property
    def own(self) -> Nodes:
        """The node of each open state, ``[N]``."""
        found: Nodes = self.node[self.task.open]
        return found


def suits_contraction(task: Task, core: System) -> bool:
    """Return whether sweeps are worth a try: many states, and something that is counted."""
    if not task.goal.counts_cost or core.nodes < FEWEST or len(core.target) > np.iinfo(np.int32).max:
        return False
    return is_compiled(len(core.target)) and bool(np.isfinite(core.cost).all())


def contracted(
    task: Task, systems: tuple[System, System], node: Nodes, *, finest: int = 0
) -> tuple[Contracted | None, Nodes | None]:
    """Return the optimum of a task by sweeps, None where these came to no end; and rows for others to begin with.

    Parameters
    ----------
    task : Task
        With `suits_contraction`.
    systems : tuple of System
        With end components collapsed, and as it is.
    node : array of int, ``[S]``
        The node of each state.
    finest : int
        Which tolerance for ties to take; the later, the finer.
    """
    core, whole = systems
    work = _Work(task=task, core=core, whole=whole, node=node)
    goal = task.goal
    unit = _unit(core)
    field = field_of(core, goal.maximise, discounted=goal.discount < 1.0)
    if goal.discount == 1.0:
        begin_with(field, rows_towards_sinks(core), unit=unit)
    aim = width_aimed_at()
    wanted = aim * unit
    best: Contracted | None = None
    way: str | None = None
    for number in range(1, TRIES + 1):
        way = _valued(field, goal.discount, wanted, unit, way)
        if way is None:
            break
        found = _proved(work, field, finest, way)._replace(rounds=number)
        if best is None or found.width <= best.width:
            best = found
        if found.width <= ENOUGH * aim:
            break
        wanted *= FINER
    return best, repaired(core, field.rows_taken()) if np.isfinite(field.values).all() else None


def _valued(field: Field, discount: float, wanted: float, unit: float, before: str | None) -> str | None:
    """Bring a field's values to a residual, by the way that led to a coarser one if any; return by which, None where none does."""
    if discount < 1.0:
        return SHIFTED if discounted_values(field, discount, wanted / unit) else None
    single = len(field.rows.cost) == len(field.order)  # nothing to choose: no need to look around before going on
    first, finer = (1e-2 * unit, 1e-5) if single else (unit, 1e-2)
    if before != ROUGH and swept(field, max(wanted, _floor(field)), unit=first, finer=finer):
        return SWEPT
    if not np.isfinite(field.values).all():
        return None
    floor = _floor(field)
    if before is not None and residual_of(field) <= floor:
        return before
    if before is None and eliminable(field):
        return None
    coarse = wanted if before is not None else ENOUGH * wanted
    return ROUGH if corrected(field, max(coarse, floor), unit=unit) else None


def _unit(system: System) -> float:
    """Return what a step costs, about."""
    size = np.abs(system.cost[system.cost != 0.0])
    return float(size.mean()) if len(size) else 1.0


def _floor(field: Field) -> float:
    """Return which residual rounding leaves in any case."""
    return 1e-14 * float(np.abs(field.values).max())


def _proved(work: _Work, field: Field, finest: int, engine: str) -> Contracted:
    """Return what can be proved of a field's values."""
    task, core, goal = work.task, work.core, work.task.goal
    look("proving the bounds")
    values = field.of_nodes() if goal.signed else np.maximum(field.of_nodes(), 0.0)
    gaps = gaps_of(core, values, goal.maximise, finest)
    margin = margins_for(core, values, gaps, goal.discount, sweeping=engine != ROUGH)
    tied = task.internal | task.attaining
    tied[core.source[gaps.near]] = True
    choice = first_tied(task, tied)
    bound, guess = None, None
    if margin is not None:
        bound = bounded_by(work.whole, values[work.own], margin[work.own], goal.maximise)
        guess = _spread(work, values, margin)
    attained = evaluated(goal, chain_of(goal, Policy(choice=choice)), guess)
    width = np.inf if bound is None else _width(work, bound, attained)
    return Contracted(values, bound, choice, tied, attained, gaps.residual, engine, 1, width)


def _spread(work: _Work, values: Floats, margin: Floats) -> Guess:
    """Return values and margin on all states."""
    open_, states = work.task.open, len(work.node)
    guess = Guess(*(np.zeros(states) for _ in range(3)))
    guess.high[open_], guess.margin[open_] = values[work.own], margin[work.own]
    return guess


def _width(work: _Work, bound: Floats, attained: Evaluated) -> float:
    """Return the largest relative width of the bounds."""
    goal, open_ = work.task.goal, work.task.open
    other = (attained.lower if goal.maximise else attained.upper)[open_]
    size = np.abs(bound)
    if goal.signed:
        size = np.full(len(bound), max(float(size.max()), float(np.abs(work.core.cost).max())))
    return _largest_share(np.abs(bound - other), size)


def chain_bounds_at_size(system: System, maximise: bool, discount: float) -> tuple[Floats, Floats, Floats] | None:
    """Return the values of a system with one row per node and proved bounds, None where sweeps do not prove them.

    Parameters
    ----------
    system : System
        From every node the sinks are reached with probability 1.
    maximise : bool
        It makes no difference.
    discount : float

    Returns
    -------
    values, lower, upper : array of float, ``[n]``
        The narrowest that were proved, where they are not as narrow as was aimed at.
    """
    if system.nodes < FEWEST or not is_compiled(len(system.target)) or not np.isfinite(system.cost).all():
        return None
    field = field_of(system, maximise, discounted=discount < 1.0)
    unit, aim = _unit(system), width_aimed_at()
    wanted = aim * unit
    best: tuple[Floats, Floats, Floats] | None = None
    way: str | None = None
    for _ in range(TRIES):
        way = _valued(field, discount, wanted, unit, way)
        found = None if way is None else _around(system, field, discount, sweeping=way != ROUGH)
        if found is None:
            break
        best = found
        if _relative(system, found) <= ENOUGH * aim:
            break
        wanted *= FINER
    return best


def _around(system: System, field: Field, discount: float, *, sweeping: bool) -> tuple[Floats, Floats, Floats] | None:
    """Return the values of a field with one row per node and proved bounds, None where these are not proved."""
    values = field.of_nodes() if system.signed else np.maximum(field.of_nodes(), 0.0)
    gaps = gaps_of(system, values, field.sign < 0.0)
    margin = margins_for(system, values, gaps, discount, sweeping=sweeping)
    if margin is None or not (never_falls(system, values, -margin) and never_rises(system, values, margin)):
        return None
    lower, upper = outward(Parts(values, np.zeros(len(values))), margin, signed=system.signed)
    return np.clip(values, lower, upper), lower, upper


def _relative(system: System, found: tuple[Floats, Floats, Floats]) -> float:
    """Return the largest relative width of bounds."""
    values, lower, upper = found
    size = np.abs(values)
    if system.signed:
        size = np.full(len(values), max(float(size.max()), float(np.abs(system.cost).max())))
    return _largest_share(upper - lower, size)


def _largest_share(wide: Floats, size: Floats) -> float:
    """Return the largest width in relation to a size, ∞ where one is no number."""
    relative = np.divide(wide, size, out=np.where(wide == 0.0, 0.0, np.inf), where=size > 0.0)
    return float(relative.max()) if np.isfinite(relative).all() else np.inf
