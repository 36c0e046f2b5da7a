"""A task with positive costs enters; its optimum leaves, found by windowed sweeps and proved by scaling. No equation is solved.

The rows are those of the model itself, in the order in which the states are met from the goal on; loops of a row to its own state
are taken out, and what is left is scaled to sum to 1: a row then says what leaving the state costs, and where to.

**Proof.** Let v ≥ 0 be what the sweeps found (`windows`), D(a) its drift along row a (`system`), and c(a) > 0 what the row pays. The
drift of (1 - h) v is (1 - h) D(a) + h c(a). So (1 - h) v ≤ cost + P (1 - h) v along every row as soon as h c(a) ≥ -D(a) along every
row; every policy that arrives then costs at least (1 - h) v, as v is bounded and 0 at the goal (`certify`). And the drift of
(1 + h) v is (1 + h) D(a) - h c(a): along the rows of one policy (1 + h) v does not rise as soon as h c(a) ≥ (1 + h) D(a) there. As
(1 + h) v is nowhere negative and falls by at least the least cost at every step, that policy arrives with probability 1, and
costs at most (1 + h) v. Which h it takes is told by one pass over the rows that trusts nothing: neither the sweeps nor the order.

**Rounding.** Taken for D(a) is what makes the need larger, the drift as computed plus or less e(a) = 6 (k + 8) u · (c + Σ p |δ|) with
k the branches of the longest row, loops included, δ the differences of v, and u = 2⁻⁵³: k u for the sum of p that leaves, by which
cost and p are divided, 2 (k + 4) u as the model's p may miss 1 by that much, k u for the sum in r̄, (k + 3) u for the sum, the products
and the differences. Products that underflow add 1e-322 each, and as much times δ for p that do. The bounds are rounded outward.

With a residual of r in units of the least cost, h is at most some r. Rows are tied up to a gap of a few residuals, and the first
listed of a state's tied choices is taken: what that loses is part of h.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import LimitError
from ratherthan.model import graph
from ratherthan.model._kernels import LEAST_WORK, compiled, is_compiled
from ratherthan.model.mdp import Bools, Floats, Ints
from ratherthan.model.watch import current, keep, room_for
from ratherthan.solve._kernels import Needs, Swept, scaling_needs, sinks_first, swept_rows
from ratherthan.solve.chain import Evaluated
from ratherthan.solve.goal import Kind, Task
from ratherthan.solve.optimum import Optimum
from ratherthan.solve.precise import precision_wanted
from ratherthan.solve.system import ROUNDING
from ratherthan.solve.tied import first_tied, fixed_best
from ratherthan.solve.windows import Sweeping, Windows, begin_sweeps, sweep_on, widened

__all__ = ["suits_windows", "windowed_optimum"]

Progress = Callable[[str], None]

FEWEST = 3000
"""From how many states on windows are tried before equations: below, these are solved at once, and to the last digit."""
SHARE, MOST = 0.05, 5e-8
"""The residual to come to in units of the least cost: a share of the precision that is wanted, and how much it may be at most."""
USEFUL = 2.0
"""Up to how many such residuals h is of use; where sweeps can do no more, what ties may lose comes on top."""
TIE = 4.0
"""Up to how many residuals a row may fall behind the best and be tied; the plan that takes such rows may lose as much."""
ROOM = 1.0 + 1e-6
TINY = 1e-15
MOST_ABOVE = 0.999
"""Above which need nothing is told of an upper bound when a limit stops the sweeps."""
BYTES = 12, 16
"""Of memory per branch, and per choice."""
LARGE = 30_000_000
"""From how many branches on memory counts more than some seconds."""


def suits_windows(task: Task) -> bool:
    """Return whether windowed sweeps are worth a try: many states, a cost to be kept small, and nothing that is free of charge."""
    goal, index = task.goal, task.goal.index
    if goal.kind is not Kind.COST or goal.maximise or goal.signed:
        return False
    if index.work > np.iinfo(np.int32).max or not is_compiled(index.work):  # the sweeps count in 32 bits
        return False
    return int(np.count_nonzero(task.open)) >= FEWEST and bool((goal.costly | ~task.allowed).all())


def windowed_optimum(task: Task, settings: Windows | None = None, progress: Progress | None = None) -> Optimum | None:
    """Return the optimum of a task, None where the sweeps came to no end or nothing could be proved.

    Parameters
    ----------
    task : Task
        With `suits_windows`.
    settings : Windows, optional
        By default as fine as the precision that is wanted.
    progress : callable, optional
    """
    settings = settings or Windows(residual=min(SHARE * precision_wanted(), MOST))
    level, order = _nearest(task)
    swept = _rows(task, order)
    if not (swept.least > 0.0 and swept.largest < np.inf) or _without_cycles(swept):
        return None
    state = begin_sweeps(level[order], swept.least, settings)
    tied = fixed_best(task)
    try:
        needs = _swept(swept, state, tied, settings, progress)
    except LimitError:
        _keep(task, order, swept, state)
        raise
    del swept  # what follows needs room
    return None if needs is None else _proved(task, state, (order, tied), needs)


def _nearest(task: Task) -> tuple[Ints, Ints]:
    """Return how far from the target states are, and the open ones, the nearest first."""
    index, target = task.goal.index, task.goal.target
    if task.nearest is not None:
        level, order = task.nearest
        return level, order[task.open[order]]
    level = graph.levels_to(index, target | (task.fixed == 0.0) & ~task.open, task.open, task.allowed)
    open_ = np.flatnonzero(task.open)
    return level, open_[np.argsort(level[open_], kind="stable")]


def _rows(task: Task, order: Ints) -> Swept:
    """Return the rows of the open states in an order."""
    goal, index = task.goal, task.goal.index
    room_for(BYTES[0] * index.work + BYTES[1] * index.choices, "The equations of this model")
    rank: npt.NDArray[np.int32] = np.where(np.isfinite(task.fixed), np.int32(len(order)), np.int32(-1))
    rank[order] = np.arange(len(order), dtype=np.int32)
    rows = index.state_to_choices, index.choice_to_branches, index.branch_to_target
    if index.work > LARGE:
        index.forget()
    made: Swept = compiled(swept_rows, index.work)(rows, goal.probability, goal.cost, order, rank)
    return made


def _without_cycles(swept: Swept) -> bool:
    """Return whether no state leads back to itself: then one backward pass does it (`layered`)."""
    if swept.loops:
        return False
    rows = swept.rows
    begin: Any = rows.row_to_branches[rows.node_to_rows]
    target: Any = rows.target
    return len(compiled(sinks_first, len(target))(begin, target)) > 0


def _swept(
    swept: Swept, state: Sweeping, tied: Bools, settings: Windows, progress: Progress | None
) -> tuple[float, float, float] | None:
    """Sweep until it can be proved; return by what share values must be made smaller and larger, and the residual, or None."""
    limits = (TIE * settings.residual * swept.least, (swept.longest + 8) * ROUNDING)
    while sweep_on(swept.rows, state, settings, progress):
        before = state.residual
        needs: Needs = compiled(scaling_needs, max(len(swept.rows.target), LEAST_WORK))(
            swept.rows, swept.source, state.values, limits, tied
        )
        state.residual = needs.residual
        shares = _shares(needs, state.values)
        if shares is not None and max(shares[:2]) <= USEFUL * settings.residual:
            return shares
        if needs.residual <= settings.residual * swept.least or not widened(state, before):
            # no finer sweep makes rows that are nearly tied lose less
            bearable = (
                shares is not None and max(shares[0], shares[1] - TIE * settings.residual) <= USEFUL * settings.residual
            )
            return shares if bearable else None
    return None


def _shares(needs: Needs, values: Floats) -> tuple[float, float, float] | None:
    """Return the h of the lower and of the upper bound, and the residual, None where there are none."""
    below = needs.below * ROOM + TINY
    above = needs.above / (1.0 - needs.above) * ROOM + TINY if needs.above < 0.5 else np.inf
    sound = bool(np.isfinite(values).all()) and float(values.min()) >= 0.0
    return (below, above, needs.residual) if sound and below < 0.5 and above < 0.5 else None


def _proved(task: Task, state: Sweeping, found: tuple[Ints, Bools], shares: tuple[float, float, float]) -> Optimum:
    """Return the optimum on all states."""
    order, tied = found
    part, (below, above, residual) = state.values[: len(order)], shares
    values, lower, upper = (task.fixed.copy() for _ in range(3))
    values[order] = part
    lower[order] = np.maximum(np.nextafter((1.0 - below) * part, -np.inf), 0.0)
    upper[order] = np.nextafter((1.0 + above) * part, np.inf)
    first = graph.first_listed(task.goal.index, tied)
    choice = np.where(task.open | task.arriving, first, task.elsewhere)
    free = task.arriving & ~task.open
    if free.any():  # from there the goal costs nothing: nor does going round
        arriving = first_tied(task, tied & task.open[task.goal.index.choice_to_state] | task.attaining)
        choice = np.where(free, arriving, choice)
    lost = np.zeros(len(values), dtype=np.bool_)
    attained = Evaluated(values=values, lower=lower, upper=upper, open=task.open, lost=lost, solves=0)
    sweeps = round(state.visits / len(order))
    return Optimum(values, lower, upper, choice, tied, attained, "windowed sweeps", sweeps, residual, task)


def _keep(task: Task, order: Ints, swept: Swept, state: Sweeping) -> None:
    """Lay down what is known when a limit stops the sweeps: values, and the bounds that scaling proves, which one pass tells."""
    if current().board.kept.get("task") is not task:
        return
    guess, part = task.fixed.copy(), state.values[: len(order)]
    guess[order] = part
    limits = (0.0, (swept.longest + 8) * ROUNDING)
    scratch = np.zeros(task.goal.index.choices, dtype=np.bool_)
    needs: Needs = compiled(scaling_needs, max(len(swept.rows.target), LEAST_WORK))(
        swept.rows, swept.source, state.values, limits, scratch
    )
    lower, upper = np.zeros(len(order)), np.full(len(order), np.inf)
    if np.isfinite(part).all() and float(part.min()) >= 0.0:
        below, above = needs.below * ROOM + TINY, needs.above * ROOM
        if below < 1.0:
            lower = np.maximum(np.nextafter((1.0 - below) * part, -np.inf), 0.0)
        if above < MOST_ABOVE:
            upper = np.nextafter((1.0 + above / (1.0 - above) * ROOM + TINY) * part, np.inf)
    bounds = np.zeros(len(guess)), np.full(len(guess), np.inf)
    bounds[0][order], bounds[1][order] = lower, upper
    keep(guess=guess[task.open], bounds=(bounds[0][task.open], bounds[1][task.open]), engine="windowed sweeps")
