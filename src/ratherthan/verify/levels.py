"""The levels of an objective enter; for each leaves its frame, bounds of its optimum and of the policy's value, and its numbers.

A plan that wants several things in order makes the second as good as it can be among the plans that are best for the first. So
level k is optimised over the choices that are *tied* at every level before: equal to the best. The run ends where level 0
has ended, or where the largest probability it asked for has become 0; a level may have ends of its own besides.

How nearly equal two choices must be to be tied is up to whoever solved it, between rounding and the tolerance of comparisons.
Where that matters, the optimum lies between that of the choices that are tied for sure and that of those that may be: more
choices are never worse. (A bound that needs this is wide, and what rests on it is left undecided.) Nor do all policies that take
tied choices attain what these promise: see `attained`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ratherthan.explain.question import Question
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.objective import Objective, levels_of
from ratherthan.model.problem import Problem
from ratherthan.verify.aims import frame_of
from ratherthan.verify.attained import attaining, hopeless_in, leading_to, must_end, over_of, unbounded_in, without
from ratherthan.verify.candidates import Budget
from ratherthan.verify.counts import Counts, Tree
from ratherthan.verify.frame import Frame
from ratherthan.verify.groups import Compared, Critical, compared, critical, extremes
from ratherthan.verify.interval import Ends
from ratherthan.verify.measure import GROSS, Measures
from ratherthan.verify.values import Band, following, optimum

__all__ = ["Levels", "levels_on"]

LOSS = 1e-9
"""By which share of itself the value of a policy that counts as optimal may miss the optimum, where it is not listed."""
TIED = 1e-13
"""Choices whose numbers differ by no more than this share are tied for everyone."""
ALIKE = 1e-9
"""And by no more than this share, if the bounds allow them to be equal."""
APART = 1e-7
"""Choices whose numbers differ by more than this share are tied for nobody."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Levels:
    """An objective's levels on a model, under one question and with one policy.

    Parameters
    ----------
    frames : tuple of Frame
        One per level; none restricts the choices.
    asked : Question
    weight : array of float, ``[C]``
        How often the policy takes each choice of its state.
    given : bool
        Whether the policy was given, rather than the optimum.
    slack : float
        By which share of itself a number may be less well known to whoever made the explanation; ∞ for any share.
    budget : Budget
    """

    frames: tuple[Frame, ...]
    asked: Question
    weight: Floats  # [C]
    given: bool
    slack: float
    budget: Budget

    @property
    def first(self) -> Frame:
        """The frame of the first level."""
        return self.frames[0]

    @cached_property
    def best(self) -> tuple[Band, ...]:
        """Bounds of the optimum ρ of each level."""
        found = [self._between(self.first, Compared(self._every, self._every))]
        tied = self._tied(self.first, found[0], Compared(self._every, self._every))
        lost = unbounded_in(self.first, found[0])
        for k, frame in enumerate(self.frames[1:], start=1):
            lost = leading_to(self.first, lost, tied.maybe)
            band = self._between(must_end(self.first, frame), tied)
            worse = np.zeros_like(lost)
            if not self.attainable(k):
                attained = attaining(self.frames[: k + 1], self._tied(frame, band, tied).sure) & ~lost
                hopeless = np.isinf(found[0].lower) | np.isinf(found[0].upper)
                lost, worse = lost | (~attained & hopeless), ~attained | (unbounded_in(frame, band) & ~lost)
            known = ~frame.running | hopeless_in(frame, band)
            found.append(without(band, worse & ~known, lost & ~known, maximise=frame.maximise))
            tied = self._tied(frame, found[-1], tied)
            lost |= worse | unbounded_in(frame, band)
        return tuple(found)

    @property
    def _every(self) -> Bools:
        return np.ones(self.first.mdp.choices, dtype=np.bool_)

    def _between(self, frame: Frame, tied: Compared) -> Band:
        """Return bounds of the optimum over the tied choices."""
        most = optimum(replace(frame, permitted=tied.maybe), self.budget)
        if (tied.sure == tied.maybe).all():
            return most
        least = optimum(replace(frame, permitted=tied.sure), self.budget)
        low, high = np.minimum(least.lower, most.lower), np.maximum(least.upper, most.upper)
        offered = np.zeros(frame.mdp.states, dtype=np.bool_)
        offered[frame.row_state[tied.sure]] = True
        stuck = leading_to(frame, ~offered & frame.running, tied.maybe)
        return without(Band(lower=low, upper=high), stuck & frame.running, stuck & False, maximise=frame.maximise)

    def _tied(self, frame: Frame, band: Band, before: Compared) -> Compared:
        """Return which of the choices tied so far are tied at a level, too, ``[C]`` each."""
        measures = self._measures(frame, band)
        lower, upper = measures.ends
        count = np.diff(frame.mdp.state_to_choices)
        ended = ~frame.running[frame.row_state]
        sides = []
        for group in (before.maybe, before.sure):
            high, low = extremes(frame.mdp, measures.ends, group)
            best = high if frame.maximise else low
            sides.append((np.repeat(best[0], count), np.repeat(best[1], count)))
        with np.errstate(invalid="ignore"):
            most = sides[0][1] - lower if frame.maximise else upper - sides[0][0]
            least = sides[1][0] - upper if frame.maximise else lower - sides[1][1]
        same = (lower == upper) & (sides[0][0] == lower) & (sides[0][1] == lower)
        size = np.maximum(np.abs(np.where(np.isfinite(lower), lower, 0.0)), measures.size)
        size = np.maximum(size, np.abs(np.where(np.isfinite(sides[0][0]), sides[0][0], 0.0)))
        near = same | (most <= TIED * size) | ((least <= 0.0) & (most <= ALIKE * size))
        apart = ~same & (least > APART * size)
        if frame.demanding:  # what is infinite no policy attains: which choices are best there is anybody's guess
            favourable = np.inf if frame.maximise else -np.inf
            apart &= sides[0][0] != favourable
        return Compared(before.sure & (near | ended), before.maybe & (~apart | ended))

    @cached_property
    def followed(self) -> tuple[Band, ...]:
        """Bounds of ρ^π of each level, the value of the policy that is listed."""
        return tuple(following(frame, self.weight, self.budget) for frame in self.frames)

    def _measures(self, frame: Frame, band: Band) -> Measures:
        return Measures(
            frame=frame,
            band=band,
            omega=self.asked.omega,
            arriving=self.first.can_arrive,
            further=frame is not self.first,
        )

    @cached_property
    def measures(self) -> tuple[Measures, ...]:
        """The numbers of each level that count for the question."""
        return self.policy_measures if self.asked.policy_values else tuple(map(self._measures, self.frames, self.best))

    @cached_property
    def policy_measures(self) -> tuple[Measures, ...]:
        """The numbers of each level if the policy is followed after the choice."""
        return tuple(self._measures(frame, self._judging(level)) for level, frame in enumerate(self.frames))

    def attainable(self, level: int) -> bool:
        """Return whether one policy surely attains a level beside those before: it is the first, or both end together.

        What is best for a level that ends sooner, or never, may go round for ever for the first one; no policy need attain both.
        """
        if level == 0:
            return True
        frame, first = self.frames[level], self.first
        arrives = frame.costs and not frame.endless and (frame.demanding or not frame.maximise)
        return arrives and bool((frame.running == (first.running & first.can_arrive)).all())

    def unbounded(self, level: int) -> Bools:
        """Return where more and more can be gathered, which no policy attains, ``[S]``."""
        frame, best = self.frames[level], self.best[level]
        if not frame.demanding:
            return np.zeros(frame.mdp.states, dtype=np.bool_)
        unbounded: Bools = best.upper == np.inf if frame.maximise else best.lower == -np.inf
        return unbounded

    def _judging(self, level: int) -> Band:
        """Return ρ^π; an optimal policy attains ρ also where it is not listed, but for rounding."""
        best, followed = self.best[level], self.followed[level]
        if self.given:
            return followed
        said = np.zeros(self.first.mdp.states, dtype=np.bool_)
        said[self.first.row_state[self.weight > 0]] = True
        known = said | ~self.first.running
        lower, upper = (np.where(np.isfinite(end), end, 0.0) for end in (best.lower, best.upper))
        lower = np.where(np.isfinite(best.lower), lower - LOSS * np.abs(lower), best.lower)
        upper = np.where(np.isfinite(best.upper), upper + LOSS * np.abs(upper), best.upper)
        unknown = self.unbounded(level) | (not self.attainable(level))
        lower, upper = np.where(unknown, -np.inf, lower), np.where(unknown, np.inf, upper)
        silent = None if followed.silent is None else followed.silent & known
        return Band(
            lower=np.where(known, followed.lower, lower), upper=np.where(known, followed.upper, upper), silent=silent
        )

    @cached_property
    def compared(self) -> list[Compared]:
        """Which choices each level compares."""
        return compared(self.frames, self._ends, self.asked.tolerance)

    @cached_property
    def _ends(self) -> list[Ends]:
        return [measures.lambda_ends for measures in self.measures]

    @cached_property
    def critical(self) -> Critical:
        """Which states are critical."""
        return critical(self.frames, self._ends, self.asked.alpha, self.asked.tolerance)

    @property
    def most_slack(self) -> float:
        """By which share of itself a number may be less well known before it is taken for forged."""
        return max(self.slack, GROSS)

    @cached_property
    def admitted(self) -> Critical:
        """Which states whoever made the explanation should know to be critical, and which he may have left open."""
        return self._known_to([measures.widened(self.slack) for measures in self.measures])

    @cached_property
    def excused(self) -> Critical:
        """Likewise, if the numbers were known as little as they may be: what he must know, and what he may have left open."""
        return self._known_to([measures.blurred(self.slack) for measures in self.measures])

    def _known_to(self, ends: list[Ends]) -> Critical:
        """Return what is critical to whom the numbers are known so well."""
        if np.isinf(self.slack):
            several = (np.diff(self.first.mdp.state_to_choices) > 1) & self.first.running
            return Critical(np.zeros_like(several), several)
        return critical(self.frames, ends, self.asked.alpha, self.asked.tolerance)

    def is_critical(self, state: int) -> bool | None:
        """Return whether a state is critical, None where the bounds leave it open."""
        return True if self.critical.sure[state] else None if self.critical.maybe[state] else False

    @cached_property
    def counts(self) -> Counts:
        """How many decisions choices leave open."""
        return Counts(
            frame=self.first,
            band=self.measures[0].band,
            critical=self.critical,
            admitted=self.admitted,
            excused=self.excused,
            tolerance=self.asked.tolerance,
            tree=Tree(horizon=self.asked.search.horizon, toward_goal=self.asked.search.toward_goal),
        )


def levels_on(problem: Problem, objective: Objective) -> tuple[Frame, ...]:
    """Return the frames of an objective's levels, each with the ends of the run in it.

    Raises
    ------
    PropertyError, ExplanationError
        If a level does not fit the model.
    """
    levels = levels_of(objective)
    first = frame_of(problem, levels[0])
    return (first, *(_ended(frame_of(problem, level), over_of(first)) for level in levels[1:]))


def _ended(frame: Frame, over: Bools) -> Frame:
    """Return a frame in which the run ends somewhere else, too: what was not reached then never will be."""
    if frame.costs and not frame.endless:
        return replace(frame, target=frame.target | over)
    return replace(frame, out=frame.out | (over & ~frame.target))
