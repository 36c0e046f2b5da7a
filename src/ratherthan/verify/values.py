"""A frame enters, bounds of its optimum and of a policy's value leave, for every state, by the re-checker's own means.

The searches of `frame` find what the graph alone decides. Minimising a cost, the value is ∞ outside X, where the target is
reached with probability 1, and 0 where that costs nothing. Maximising a cost it is ∞ where the target can be missed, and 0
where nothing is paid. A largest probability is 0 where the target cannot be reached and 1 where it can be reached for sure; a
least one is 0 where the target can be avoided and 1 where it cannot be missed. The rest is *open*: few states are solved in
exact fractions (`exact`), many are bounded by sweeps (`sweeps`).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from ratherthan.model.mdp import Bools, Floats
from ratherthan.verify.candidates import Budget
from ratherthan.verify.equations import Open
from ratherthan.verify.exact import best_exactly, followed_exactly
from ratherthan.verify.frame import Array, Frame
from ratherthan.verify.interval import Bounds
from ratherthan.verify.sweeps import prove

__all__ = ["Band", "arriving", "following", "optimum"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """Bounds of a value per state.

    Parameters
    ----------
    lower, upper : array of float, ``[S]``
        -∞ and ∞ where nothing is known.
    """

    lower: Floats  # [S]
    upper: Floats  # [S]

    def __getitem__(self, state: int) -> Bounds:
        """Return the bounds of one state."""
        return Bounds(float(self.lower[state]), float(self.upper[state]))


def optimum(frame: Frame, budget: Budget) -> Band:
    """Return bounds of the optimal value of every state.

    Parameters
    ----------
    frame : Frame
    budget : Budget
    """
    if frame.costs:
        return _greatest_cost(frame, budget) if frame.maximise else _least_cost(frame, budget)
    return _greatest_chance(frame, budget) if frame.maximise else _least_chance(frame, budget)


def _none(frame: Frame) -> Array:
    return np.full(frame.mdp.states, -1, dtype=np.int64)


def _least_cost(frame: Frame, budget: Budget) -> Band:
    finite = frame.sure(frame.target, frame.running)
    free = frame.sure(frame.target, finite, ~frame.pays)
    open_ = finite & ~free
    rows = frame.rows_within(finite) & open_[frame.row_state]
    block, _ = frame.blocks(open_, rows & ~frame.pays)
    known = np.where(finite, 0.0, np.inf)
    return _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=block), budget)


def _greatest_cost(frame: Frame, budget: Budget) -> Band:
    everything = np.ones(frame.mdp.states, dtype=np.bool_)
    dodging = frame.keep(frame.running, ~everything)
    infinite = frame.reach(dodging, frame.running)
    paying = np.zeros(frame.mdp.states, dtype=np.bool_)
    paying[frame.row_state[frame.pays]] = True
    open_ = frame.reach(paying & frame.running & ~infinite, frame.running & ~infinite)
    known = np.where(infinite, np.inf, 0.0)
    return _bounded(Open(frame=frame, open=open_, rows=open_[frame.row_state], known=known, block=_none(frame)), budget)


def _greatest_chance(frame: Frame, budget: Budget) -> Band:
    sure = frame.sure(frame.target, frame.running)
    open_ = frame.reach(frame.target, frame.running) & ~sure
    rows = open_[frame.row_state]
    block, _ = frame.blocks(open_, rows)
    known = np.where(sure, 1.0, 0.0)
    return _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=block), budget)


def _least_chance(frame: Frame, budget: Budget) -> Band:
    avoiding = frame.keep(~frame.target, frame.out)
    open_ = frame.running & ~avoiding
    missing = frame.reach(avoiding, frame.running)
    sure = ~missing
    open_ &= missing
    known = np.where(sure, 1.0, 0.0)
    return _bounded(Open(frame=frame, open=open_, rows=open_[frame.row_state], known=known, block=_none(frame)), budget)


def _bounded(problem: Open, budget: Budget) -> Band:
    """Bound the open states, exactly where they are few."""
    frame, opened = problem.frame, np.flatnonzero(problem.open)
    lower, upper = problem.known.copy(), problem.known.copy()
    if 0 < len(opened) <= budget.exact:
        first = _towards(frame, ~problem.open, problem.open, problem.rows)
        for state, value in best_exactly(frame, opened, problem.rows, problem.known, first).items():
            _place(lower, upper, state, value)
    elif len(opened):
        _take_up(problem, budget, lower, upper)
    return Band(lower=lower, upper=upper)


def _take_up(problem: Open, budget: Budget, lower: Floats, upper: Floats) -> None:
    low, high = prove(problem, budget)
    most = np.inf if problem.frame.costs else 1.0
    lower[problem.open] = np.maximum(low[problem.open], 0.0)
    upper[problem.open] = np.minimum(high[problem.open], most)


def _place(lower: Floats, upper: Floats, state: int, value: Fraction) -> None:
    bounds = Bounds.around(value)
    lower[state], upper[state] = bounds.lower, bounds.upper


def _towards(frame: Frame, to: Bools, via: Bools, rows: Bools) -> Array:
    """Return for each state of `via` the first choice with a branch nearer to `to`, by layers, ``[S]``."""
    taken = np.full(frame.mdp.states, -1, dtype=np.int64)
    seen = to.copy()
    frontier = np.flatnonzero(to)
    while len(frontier):
        into = np.unique(frame.rows_into(frontier))
        into = into[rows[into]]
        into = into[via[frame.row_state[into]] & ~seen[frame.row_state[into]]]
        frontier, where = np.unique(frame.row_state[into], return_index=True)
        taken[frontier] = into[where]
        seen[frontier] = True
    return taken


def following(frame: Frame, weight: Floats, budget: Budget) -> Band:
    """Return bounds of the value of a policy in every state.

    Parameters
    ----------
    frame : Frame
    weight : array of float, ``[C]``
        How often the policy takes each choice of its state. Where it says nothing, and where that can be reached, the bounds
        are -∞ and ∞.
    budget : Budget
    """
    taken = weight > 0
    said = np.zeros(frame.mdp.states, dtype=np.bool_)
    said[frame.row_state[taken]] = True
    arrives = frame.reach(frame.target, frame.running, taken)
    silent = frame.reach(frame.running & ~said, frame.running, taken)
    stuck = frame.reach(~arrives, frame.running, taken)
    if frame.costs:
        paying = np.zeros(frame.mdp.states, dtype=np.bool_)
        paying[frame.row_state[frame.pays & taken]] = True
        open_ = frame.reach(paying & frame.running & ~stuck, frame.running & ~stuck, taken)
        known = np.where(stuck & ~frame.target, np.inf, 0.0)
    else:
        open_ = arrives & stuck & frame.running
        known = np.where(arrives, 1.0, 0.0)
    open_ &= ~silent
    problem = Open(
        frame=frame, open=open_, rows=taken & open_[frame.row_state], known=known, block=_none(frame), weight=weight
    )
    lower, upper = known.copy(), known.copy()
    opened = np.flatnonzero(open_)
    if 0 < len(opened) <= budget.exact:
        for state, value in followed_exactly(frame, opened, weight, known).items():
            _place(lower, upper, state, value)
    elif len(opened):
        _take_up(problem, budget, lower, upper)
    lower[silent], upper[silent] = -np.inf, np.inf
    return Band(lower=lower, upper=upper)


def arriving(frame: Frame, weight: Floats, budget: Budget) -> Band:
    """Return bounds of the probability that a policy reaches the goal, from every state.

    Parameters
    ----------
    frame, weight, budget
        As in `following`.
    """
    chance = Frame(
        mdp=frame.mdp,
        maximise=True,
        costs=False,
        reward=None,
        target=frame.goal,
        out=frame.hazard,
        row_state=frame.row_state,
        entry_row=frame.entry_row,
    )
    return following(chance, weight, budget)
