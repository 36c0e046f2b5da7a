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
from ratherthan.solve.chain import Evaluated, Guess, chain_of, evaluated
from ratherthan.solve.contracting.corrections import corrected, repaired
from ratherthan.solve.contracting.discounting import discounted_values
from ratherthan.solve.contracting.eliminated import begin_exactly, improved
from ratherthan.solve.contracting.field import BRIEFLY, Field, begin_with, field_of, residual_of, swept
from ratherthan.solve.contracting.proof import bounded_by, gaps_of, margins_for
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.goal import Task
from ratherthan.solve.policy_iteration import rows_towards_sinks
from ratherthan.solve.precise import width_aimed_at
from ratherthan.solve.system import System
from ratherthan.solve.tied import first_tied

__all__ = [
    "ENOUGH",
    "EXACT",
    "FINER",
    "ROUGH",
    "TRIES",
    "Contracted",
    "contracted",
    "is_large",
    "largest_share",
    "suits_contraction",
    "unit_of",
    "valued",
]

Nodes = npt.NDArray[np.int64]

FEWEST = 3000
"""From how many nodes on: below, equations are solved at once, and to the last digit."""
GOOD = 100.0
"""Up to how many times the width aimed at no equation is solved to do better."""
FINER = 1e-2
SWEPT, SHIFTED = "sweeps", "discounted sweeps"
ROUGH = "policy iteration with rough solves"
EXACT = "policy iteration by components"
ENOUGH = 30.0
"""How many times that is enough."""
ROOMY = 8.0
"""How many times that sweeps go for at first where sums are discounted."""
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
    return task.goal.counts_cost and is_large(core)


def is_large(system: System) -> bool:
    """Return whether a system has many nodes, but no more branches than are numbered here, and costs that are numbers."""
    if system.nodes < FEWEST or len(system.target) > np.iinfo(np.int32).max:
        return False
    return is_compiled(len(system.target)) and bool(np.isfinite(system.cost).all())


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
    unit = unit_of(core)
    field = field_of(core, goal.maximise, discounted=goal.discount < 1.0)
    equations = None
    if goal.discount == 1.0:
        equations = _begun(field, rows_towards_sinks(core), unit)
    aim = width_aimed_at()
    wanted = aim * unit
    best: Contracted | None = None
    way: str | None = None
    for number in range(1, TRIES + 1):
        way = valued(field, goal.discount, wanted, unit, (way, equations))
        if way is None:
            break
        found = _proved(work, field, finest, way, equations)._replace(rounds=number)
        if best is None or found.width <= best.width:
            best = found
        if found.width <= ENOUGH * aim:
            break
        wanted *= FINER
    return best, repaired(core, field.rows_taken()) if np.isfinite(field.values).all() else None


def _begun(field: Field, rows: Nodes, unit: float) -> Factored | None:
    """Take about the values of a policy that arrives; return its equations if they can be eliminated."""
    equations = Factored(field.system)
    if begin_exactly(field, equations, rows):
        return equations
    begin_with(field, rows, unit=unit)
    return None


def valued(
    field: Field, discount: float, wanted: float, unit: float, known: tuple[str | None, Factored | None]
) -> str | None:
    """Bring a field's values to a residual, by the way that led to a coarser one if any; return by which, None where none does."""
    before, equations = known
    if discount < 1.0:
        return SHIFTED if discounted_values(field, discount, ROOMY * wanted / unit) else None
    single = len(field.rows.cost) == len(field.order)  # nothing to choose: no need to look around before going on
    first, finer = (1e-2 * unit, 1e-5) if single else (unit, 1e-2)
    visits = None if equations is None else (3.0 if single else 1.0) * BRIEFLY
    if before not in (ROUGH, EXACT) and swept(
        field, max(wanted, _floor(field)), unit=first, finer=finer, visits=visits
    ):
        return SWEPT
    if not np.isfinite(field.values).all():
        return None
    floor = _floor(field)
    if before is not None and residual_of(field) <= floor:
        return before
    if equations is not None and before != ROUGH:
        rows = repaired(field.system, field.rows_taken())
        if begin_exactly(field, equations, rows) if single else improved(field, equations, rows, unit=unit):
            return EXACT
    coarse = wanted if before is not None else ENOUGH * wanted
    return ROUGH if corrected(field, max(coarse, floor), unit=unit) else None


def unit_of(system: System) -> float:
    """Return what a step costs, about."""
    size = np.abs(system.cost[system.cost != 0.0])
    return float(size.mean()) if len(size) else 1.0


def _floor(field: Field) -> float:
    """Return which residual rounding leaves in any case."""
    return 1e-14 * float(np.abs(field.values).max())


def _proved(work: _Work, field: Field, finest: int, engine: str, equations: Factored | None) -> Contracted:
    """Return what can be proved of a field's values."""
    task, core, goal = work.task, work.core, work.task.goal
    look("proving the bounds")
    values = field.of_nodes() if goal.signed else np.maximum(field.of_nodes(), 0.0)
    gaps = gaps_of(core, values, goal.maximise, finest)
    exact = (equations, field.rows_taken()) if equations is not None and engine == EXACT else None
    margin = margins_for(core, values, gaps, goal.discount, sweeping=engine != ROUGH, exact=exact)
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
    return largest_share(np.abs(bound - other), size)


def largest_share(wide: Floats, size: Floats) -> float:
    """Return the largest width in relation to a size, ∞ where one is no number."""
    relative = np.divide(wide, size, out=np.where(wide == 0.0, 0.0, np.inf), where=size > 0.0)
    return float(relative.max()) if np.isfinite(relative).all() else np.inf
