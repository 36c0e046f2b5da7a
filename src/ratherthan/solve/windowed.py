"""A task with positive costs enters; its optimum leaves, found by windowed sweeps and proved by scaling. No equation is solved.

Let v ≥ 0 be what the sweeps found (`windows`), D(a) its drift along row a, and c(a) > 0 what the row pays. The drift of (1 + h) v is
(1 + h) D(a) - h c(a). So (1 - h) v passes ``never_falls`` as soon as h c(a) ≥ -D(a) along every row, which proves it a lower
bound of every policy that arrives; and (1 + h) v passes ``never_rises`` along the rows of one policy as soon as h c(a) ≥ D(a) (1 + h)
there. That policy then arrives with probability 1: (1 + h) v falls by at least the least cost at every step, and is never below 0.
So both bounds are proved by one pass each over the rows, whatever the sweeps did, and the policy's value lies between the same two.

Which h is tried follows from the largest D(a) / c(a). With a residual below 1e-8 of the least cost it is at most some 5e-8.

Rows are tied up to a gap of a few residuals, and the first listed of a state's tied choices is taken: what that loses is part of h.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model._kernels import is_compiled
from ratherthan.model.mdp import Floats
from ratherthan.solve.certify import never_falls, never_rises
from ratherthan.solve.chain import Evaluated
from ratherthan.solve.goal import Kind, Task
from ratherthan.solve.optimum import Optimum
from ratherthan.solve.system import System, drift, rows_of
from ratherthan.solve.tied import fixed_best
from ratherthan.solve.windows import Windows, sweep_windows

__all__ = ["suits_windows", "windowed_optimum"]

Nodes = npt.NDArray[np.int64]
Progress = Callable[[str], None]

FEWEST = 3000
"""From how many nodes on windows are tried before equations: below, these are solved at once, and to the last digit."""
WIDEST = 1e-7
"""Up to which h the bounds are of use."""
TIE = 4.0
"""Up to how many residuals a row may fall behind the best and be tied."""
ROOM = 1.0 + 1e-6
TRIES = 3
SETTINGS = Windows()


def suits_windows(task: Task, core: System, whole: System) -> bool:
    """Return whether windowed sweeps are worth a try: many states, a cost to be kept small, and all costs positive."""
    goal = task.goal
    if goal.kind is not Kind.COST or goal.maximise or goal.signed or core is not whole or core.nodes < FEWEST:
        return False
    if len(core.target) > np.iinfo(np.int32).max:  # the sweeps count in 32 bits
        return False
    return is_compiled(len(core.target)) and bool(core.cost.min() > 0.0) and bool(np.isfinite(core.cost).all())


def windowed_optimum(
    task: Task, core: System, settings: Windows = SETTINGS, progress: Progress | None = None
) -> Optimum | None:
    """Return the optimum of a task, None where the sweeps came to no end or nothing could be proved.

    Parameters
    ----------
    task : Task
        With `suits_windows`.
    core : System
        Its equations, a node for every open state.
    settings : Windows
    progress : callable, optional
    """
    found = sweep_windows(core, settings, progress)
    if not found.converged:
        return None
    if progress is not None:
        progress("proving the bounds")
    total, error = drift(core, found.values)
    begin = core.node_to_rows[:-1]
    least = np.minimum.reduceat(total, begin)
    allowed = TIE * settings.residual * float(core.cost.min()) + 4.0 * error
    near = total - least[core.row_node] <= allowed
    tied = fixed_best(task)
    tied[core.source[near]] = True
    choice = np.where(task.open | task.arriving, graph.first_listed(task.goal.index, tied), task.elsewhere)
    rows = _rows_taken(core, near)
    below = _scaled(core, found.values, (error - total) / core.cost, never_falls, -1.0)
    taken = rows_of(core, rows)
    above = _scaled(taken, found.values, ((error + total) / core.cost)[rows], never_rises, 1.0)
    if below is None or above is None:
        return None
    values, lower, upper = (task.fixed.copy() for _ in range(3))
    for whole, part in ((values, found.values), (lower, below), (upper, above)):
        whole[task.open] = part
    attained = Evaluated(
        values=values, lower=lower, upper=upper, open=task.open, lost=np.zeros(len(values), dtype=np.bool_), solves=0
    )
    residual = float(np.abs(least).max())
    sweeps = round(found.visits)
    return Optimum(values, lower, upper, choice, tied, attained, "windowed sweeps", sweeps, residual, task)


def _rows_taken(core: System, near: npt.NDArray[np.bool_]) -> Nodes:
    """Return the first listed tied row of each node."""
    candidates = np.flatnonzero(near)
    first: Nodes = candidates[np.searchsorted(candidates, core.node_to_rows[:-1])]
    return first


def _scaled(system: System, values: Floats, need: Floats, passes: Callable[..., bool], sign: float) -> Floats | None:
    """Return (1 + sign · h) · values with an h that passes the check, None where none does that is of use."""
    share = max(float(need.max()), 0.0) * ROOM + 1e-15
    for _ in range(TRIES):
        if not share <= WIDEST:
            return None
        moved = (1.0 + sign * share) * values
        if passes(system, moved):
            return moved
        share *= 2.0
    return None
