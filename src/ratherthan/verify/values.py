"""A frame enters, bounds of its optimum and of a policy's value leave, for every state, by the re-checker's own means.

The searches of `frame` find what the graph alone decides. Minimising a cost, the value is ∞ outside X, where the target is
reached with probability 1, and 0 where that costs nothing. Maximising a cost it is ∞ where the target can be missed, and 0
where nothing is paid. A largest probability is 0 where the target cannot be reached and 1 where it can be reached for sure; a
least one is 0 where the target can be avoided and 1 where it cannot be missed. The rest is *open*: few states are solved in
exact fractions (`exact`), many are bounded by sweeps (`sweeps`).

Where arrival is demanded and rewards have any sign, the value is -∞ (minimised: ∞) outside X, and 0 where nothing can be paid
any more; in the rest it may be ∞ (-∞), which no graph tells: `exact` and `growth` do. The expected total is the limit of the
expected sums of the first k rewards. With a discount the value is 0 where nothing can be paid any more.

Where only policies count that surely end, the least probability of the target is 0 where a run can surely end elsewhere, and to
go round without an end is no way to keep off it: as for costs of nothing, what can be gone round in is one state. The largest
cost is then a reward until a goal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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


HARD = 4
"""Where sweeps cannot tell, so many times as many states are solved in fractions."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """Bounds of a value per state.

    Parameters
    ----------
    lower, upper : array of float, ``[S]``
        -∞ and ∞ where nothing is known.
    silent : array of bool, ``[S]``, optional
        Where nothing can be known, because the policy may come to a state that it says nothing of.
    """

    lower: Floats  # [S]
    upper: Floats  # [S]
    silent: Bools | None = None  # [S]

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
    if frame.endless:
        return _discounted(frame, budget)
    if frame.demanding:
        return _gathered(frame, budget)
    if frame.costs:
        if frame.maximise and frame.ending:
            return _gathered(replace(frame, demanding=True), budget)
        return _greatest_cost(frame, budget) if frame.maximise else _least_cost(frame, budget)
    if not frame.maximise and frame.ending:
        return _least_chance_ending(frame, budget)
    return _greatest_chance(frame, budget) if frame.maximise else _least_chance(frame, budget)


def _none(frame: Frame) -> Array:
    return np.full(frame.mdp.states, -1, dtype=np.int64)


def _least_cost(frame: Frame, budget: Budget) -> Band:
    finite = frame.sure(frame.target, frame.running, frame.usable)
    free = frame.sure(frame.target, finite, frame.usable & ~frame.pays)
    open_ = finite & ~free
    rows = frame.rows_within(finite) & open_[frame.row_state] & frame.usable
    block, _ = frame.blocks(open_, rows & ~frame.pays)
    known = np.where(finite, 0.0, np.inf)
    return _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=block), budget)


def _greatest_cost(frame: Frame, budget: Budget) -> Band:
    nowhere = np.zeros(frame.mdp.states, dtype=np.bool_)
    dodging = frame.keep(frame.running, nowhere, frame.usable)
    infinite = frame.reach(dodging, frame.running, frame.usable)
    open_ = _paying(frame, frame.running & ~infinite, frame.usable)
    rows = open_[frame.row_state] & frame.usable
    known = np.where(infinite, np.inf, 0.0)
    return _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=_none(frame)), budget)


def _paying(frame: Frame, inside: Bools, rows: Bools) -> Bools:
    """Return from where in a set something can still be paid along some rows, ``[S]``."""
    paying = np.zeros(frame.mdp.states, dtype=np.bool_)
    paying[frame.row_state[frame.pays & rows]] = True
    return frame.reach(paying & inside, inside, rows)


def _discounted(frame: Frame, budget: Budget) -> Band:
    open_ = _paying(frame, frame.running, frame.usable)
    rows, known = open_[frame.row_state] & frame.usable, np.zeros(frame.mdp.states)
    return _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=_none(frame)), budget)


def _gathered(frame: Frame, budget: Budget) -> Band:
    arriving = frame.sure(frame.target, frame.running, frame.usable)
    rows = frame.rows_within(arriving) & frame.usable
    open_ = _paying(frame, arriving & frame.running, rows)
    rows &= open_[frame.row_state]
    block, _ = frame.blocks(open_, rows & ~frame.pays)
    known = np.where(arriving, 0.0, _hopeless(frame))
    return _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=block), budget)


def _hopeless(frame: Frame) -> float:
    """Return the value where arrival is demanded and nobody arrives."""
    return -np.inf if frame.maximise else np.inf


def _greatest_chance(frame: Frame, budget: Budget) -> Band:
    sure = frame.sure(frame.target, frame.running, frame.usable)
    open_ = frame.reach(frame.target, frame.running, frame.usable) & ~sure
    rows = open_[frame.row_state] & frame.usable
    block, _ = frame.blocks(open_, rows)
    known = np.where(sure, 1.0, 0.0)
    return _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=block), budget)


def _least_chance(frame: Frame, budget: Budget) -> Band:
    avoiding = frame.keep(~frame.target, frame.out, frame.usable | ~frame.running[frame.row_state])
    open_ = frame.running & ~avoiding
    missing = frame.reach(avoiding, frame.running, frame.usable)
    sure = ~missing
    open_ &= missing
    rows = open_[frame.row_state] & frame.usable
    known = np.where(sure, 1.0, 0.0)
    return _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=_none(frame)), budget)


def _least_chance_ending(frame: Frame, budget: Budget) -> Band:
    """Bound the least probability of policies that do not put off the end for ever; nothing is known where there are none."""
    ending = frame.sure(frame.target | frame.out, frame.running, frame.usable)
    rows = frame.rows_within(ending) & frame.usable
    safe = frame.sure(frame.out, frame.running, rows)
    open_ = frame.reach(frame.out, frame.running, rows) & frame.running & ending & ~safe
    rows &= open_[frame.row_state]
    block, _ = frame.blocks(open_, rows)
    known = np.where(safe, 0.0, 1.0)
    band = _bounded(Open(frame=frame, open=open_, rows=rows, known=known, block=block), budget)
    return Band(lower=np.where(ending, band.lower, 0.0), upper=band.upper)


def _bounded(problem: Open, budget: Budget) -> Band:
    """Bound the open states, exactly where they are few."""
    frame, opened = problem.frame, np.flatnonzero(problem.open)
    lower, upper = problem.known.copy(), problem.known.copy()
    if len(opened) > budget.exact:
        _take_up(problem, budget, lower, upper)
    # going round for what cancels is told from a gain by fractions alone
    unknown = (lower < upper) & (np.isinf(lower) | np.isinf(upper))
    hard = frame.demanding and len(opened) <= HARD * budget.exact and bool(unknown.any())
    if 0 < len(opened) <= budget.exact or hard:
        first = _towards(frame, ~problem.open, problem.open, problem.rows)
        for state, value in best_exactly(frame, opened, problem.rows, problem.known, first).items():
            _place(lower, upper, state, value if value is not None else -_hopeless(frame))
    return Band(lower=lower, upper=upper)


def _take_up(problem: Open, budget: Budget, lower: Floats, upper: Floats) -> None:
    low, high = prove(problem, budget)
    if not problem.frame.signed:
        low, high = np.maximum(low, 0.0), np.minimum(high, np.inf if problem.frame.costs else 1.0)
    lower[problem.open], upper[problem.open] = low[problem.open], high[problem.open]


def _place(lower: Floats, upper: Floats, state: int, value: Fraction | float) -> None:
    bounds = Bounds.around(value) if isinstance(value, Fraction) else Bounds(value, value)
    lower[state], upper[state] = bounds.lower, bounds.upper


def _towards(frame: Frame, to: Bools, via: Bools, rows: Bools) -> Array:
    """Return for each state of `via` the first choice with a branch nearer to `to`, by layers, ``[S]``."""
    taken = np.full(frame.mdp.states, -1, dtype=np.int64)
    if frame.endless:  # every choice ends with the chance 1 - γ
        choices = np.flatnonzero(rows)[::-1]
        taken[frame.row_state[choices]] = choices
        return taken
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
    if frame.endless:
        open_, known = _paying(frame, frame.running, taken), np.zeros(frame.mdp.states)
    elif frame.costs:
        open_ = _paying(frame, frame.running & ~stuck, taken)
        missed = _hopeless(frame) if frame.demanding else np.inf
        known = np.where(stuck & ~frame.target, missed, 0.0)
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
    return Band(lower=lower, upper=upper, silent=silent)


def arriving(frame: Frame, weight: Floats, budget: Budget) -> Band:
    """Return bounds of the probability that a policy reaches the goal, from every state.

    Parameters
    ----------
    frame, weight, budget
        As in `following`.
    """
    chance = Frame(mdp=frame.mdp, maximise=True, target=frame.goal, out=frame.hazard)
    return following(chance, weight, budget)
