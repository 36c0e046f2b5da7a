"""An objective on a model and a route enter, what the best alternative of a step comes to without turning back leaves: by plain sweeps.

States of the route up to the step are closed: a branch into one leaves the run where it is, or, where that is worse, counts what it
is worth to be there. All states are swept until nothing changes; where a run cannot come out of what is closed in, nothing helps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ratherthan.model.mdp import Bools, Floats
from ratherthan.verify.frame import Array, Frame, slices
from ratherthan.verify.values import Band

__all__ = ["Found", "Sweeps"]

MOST_WORK, MOST_BRANCHES = 20_000_000, 200_000
"""So many branches are gone through at most, for all steps together, and so many a model may have."""
STILL = 1e-12
PATIENCE, MOST_TOGETHER = 100, 400
"""After so many sweeps of a discounted sum, what its best choices so far come to is found at once, for at most so many states."""


@dataclass(frozen=True)
class Found:
    """What an alternative comes to; `sure` where it is known to be just that, and not only a bound."""

    value: float
    sure: bool


@dataclass(kw_only=True, eq=False)
class Sweeps:
    """Sweeps under one level of an objective.

    Parameters
    ----------
    frame : Frame
    best : Band
        The optimum of the level.
    rows : array of bool, ``[C]``
        The choices that the level compares.
    work : int
        How many branches may still be gone through.
    """

    frame: Frame
    best: Band
    rows: Bools  # [C]
    work: int = MOST_WORK

    def value(self, closed: Array, state: int, choice: int) -> Found | None:
        """Return what the best other choice of a state comes to, None where that takes too much work.

        Parameters
        ----------
        closed : array of int
            The states of the route up to this one, itself included.
        state, choice : int
            Where it stands, and the choice taken there.
        """
        frame, mdp = self.frame, self.frame.mdp
        unbounded = frame.costs and frame.maximise and not frame.demanding and not frame.endless
        if unbounded or not mdp.branches <= min(self.work, MOST_BRANCHES):
            return None
        self.work -= mdp.branches
        shut = np.zeros(mdp.states, dtype=np.bool_)
        shut[closed] = True
        own = frame.usable & self.rows & ~shut[frame.row_state]
        here = np.array([c for c in mdp.choices_of(state) if c != choice and self.rows[c]], dtype=np.int64)
        if len(here) == 0:
            return Found(value=self._sign * np.inf, sure=True)
        own[here] = True
        row = np.flatnonzero(own)
        begin, end = (mdp.choice_to_branches[row + k].astype(np.int64) for k in (0, 1))
        return self._swept(_Rows.of(frame, shut, row, slices(begin, end), end - begin), state)

    @property
    def _sign(self) -> float:
        return -1.0 if self.frame.maximise else 1.0

    def _swept(self, rows: _Rows, state: int) -> Found | None:
        frame = self.frame
        with np.errstate(invalid="ignore"):
            middle = (self.best.lower + self.best.upper) / 2
        worth = self._sign * np.where(self.best.lower == self.best.upper, self.best.lower, middle)
        if np.isnan(worth).any():
            return None
        rising = frame.costs or not frame.maximise
        hard = frame.costs and not frame.endless
        now = worth.copy()
        if not rising:
            now[np.unique(rows.origin)] = 0.0
        elif hard:
            lost, rounds = rows.lost(worth, self.work // max(1, len(rows.target)))
            self.work -= rounds * len(rows.target)
            now[lost] = np.inf
        price, limit = self._sign * frame.price[rows.row], frame.discount
        sweeps = 0
        while self.work > 0:
            sweeps += 1
            self.work -= len(rows.target)
            near = np.where(rows.stays, now[rows.origin], now[rows.target])
            near = np.where(rows.shut, np.maximum(now[rows.origin], worth[rows.target]), near)
            with np.errstate(invalid="ignore"):
                total = price + limit * np.add.reduceat(rows.share * near, rows.first)
            low = np.full(frame.mdp.states, np.inf)
            np.minimum.at(low, rows.state, total)
            place = np.unique(rows.state)
            changed = _change(now[place], low[place])
            now[place] = low[place]
            if changed:
                sure = not hard or bool((frame.price[rows.row] * self._sign > 0.0).all())
                return Found(value=self._sign * float(now[state]), sure=sure)
            if limit < 1.0 and sweeps % PATIENCE == 0 and len(place) <= MOST_TOGETHER:
                self.work -= len(place) ** 2
                now[place] = rows.followed(place, total, now, worth, price=price, limit=limit)
        return None


def _change(before: Floats, after: Floats) -> bool:
    """Return whether nothing changes any more."""
    with np.errstate(invalid="ignore"):
        near = np.abs(after - before) <= STILL * np.abs(after)
    return bool((near | (after == before)).all())


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rows:
    """Choices and their branches: the state that each is of, its target, whether it stays, or leads to what is closed."""

    row: Array  # [m]
    state: Array  # [m]
    first: Array  # [m]
    origin: Array  # [n]
    target: Array  # [n]
    share: Floats  # [n]
    stays: Bools  # [n]
    shut: Bools  # [n]

    @staticmethod
    def of(frame: Frame, shut: Bools, row: Array, branch: Array, counts: Array) -> _Rows:
        """Return the rows of some choices."""
        state = frame.row_state[row]
        origin, target = np.repeat(state, counts), frame.mdp.branch_to_target[branch].astype(np.int64)
        stays = origin == target
        return _Rows(
            row=row,
            state=state,
            first=np.concatenate([[0], np.cumsum(counts)[:-1]]),
            origin=origin,
            target=target,
            share=frame.share[branch],
            stays=stays,
            shut=shut[target] & ~stays,
        )

    def followed(
        self, place: Array, total: Floats, now: Floats, worth: Floats, *, price: Floats, limit: float
    ) -> Floats:
        """Return what states come to if each goes on with the best of its choices, by values `now`: one system of equations.

        Under a discount it has one answer, and sweeps from anywhere come to the same end.
        """
        by_size = np.lexsort((total, self.state))
        best = np.zeros(len(self.row), dtype=np.bool_)
        best[by_size[np.flatnonzero(np.diff(self.state[by_size], prepend=-1))]] = True
        counts = np.diff(np.append(self.first, len(self.target)))
        entry = np.repeat(best, counts)
        number = np.full(len(now), -1, dtype=np.int64)
        number[place] = np.arange(len(place))
        origin, target, share = self.origin[entry], self.target[entry], limit * self.share[entry]
        back = self.stays[entry] | (self.shut[entry] & (now[origin] >= worth[target]))
        known = ~back & (self.shut[entry] | (number[target] < 0))
        matrix, right = np.eye(len(place)), np.zeros(len(place))
        right[number[self.state[best]]] = price[best]
        away = np.where(self.shut[entry], worth[target], now[target])
        np.add.at(right, number[origin[known]], (share * away)[known])
        inner = ~known
        to = np.where(back, origin, target)
        np.subtract.at(matrix, (number[origin[inner]], number[to[inner]]), share[inner])
        return np.asarray(np.linalg.solve(matrix, right))

    def lost(self, worth: Floats, most: int) -> tuple[Array, int]:
        """Return the states from which no choices are sure to lead out of what they can come to, and how many rounds that took.

        After `most` rounds there is no work left for anything else.
        """
        rounds = 0
        alive = np.zeros(len(worth), dtype=np.bool_)
        alive[self.state] = True
        inner = alive.copy()
        while True:
            arrives = self.shut | self.stays | ~inner[self.target] | alive[self.target]
            usable = np.logical_and.reduceat((worth[self.target] < np.inf) & arrives, self.first)
            reached = np.zeros_like(alive)
            while rounds < most:
                rounds += 1
                leads = ~self.shut & ~self.stays & (~inner[self.target] | reached[self.target])
                out = usable & np.logical_or.reduceat(leads, self.first)
                more = np.zeros_like(alive)
                more[self.state[out]] = True
                more &= alive
                if (more == reached).all():
                    break
                reached = more
            if (reached == alive).all() or rounds >= most:
                return np.flatnonzero(inner & ~alive), rounds
            alive = reached
