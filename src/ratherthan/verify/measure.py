"""Bounds of values enter; the action values of every choice leave, with bounds, and what infinite ones mean.

The number of a choice is q = r + γ Σ δ(s, a, s') ρ(s'), or ω = Σ δ(s, a, s') ρ(s') where that was asked for. A mean lies between the
smallest and the largest of what it is taken of, so equal values have that value exactly.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ratherthan.model.mdp import Bools, Floats
from ratherthan.verify.frame import Frame
from ratherthan.verify.interval import Bounds, Ends, largest, smallest
from ratherthan.verify.values import Band

__all__ = ["GROSS", "ROUNDED", "Measures"]

ROUNDING = 1.12e-16
GROSS = 1e-4
"""By which share of itself a number may be known less well than it can be: it is vague then, but no forgery."""
ROUNDED = 1e-9
"""What is less than this share of the largest number may be blurred by rounding."""
LARGEST = float(np.finfo(np.float64).max) * (1 - 1e-12)
"""What adds up to more than the largest double is at least this."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Measures:
    """The numbers of all choices under one level of an objective.

    Parameters
    ----------
    frame : Frame
    band : Band
        Of the values that count: the optimum, or those of the policy.
    omega : bool
        Let λ and what is critical rest on ω instead of q.
    arriving : array of bool, ``[S]``
        From where the goal of the first level can be reached at all.
    further : bool
        Whether it is a level after the first.
    """

    frame: Frame
    band: Band
    omega: bool
    arriving: Bools  # [S]
    further: bool = False

    @cached_property
    def ends(self) -> Ends:
        """The lower and upper bounds of all action values q, ``[C]`` each."""
        return self._ends(self.band.lower, -1.0, omega=False), self._ends(self.band.upper, 1.0, omega=False)

    @cached_property
    def lambda_ends(self) -> Ends:
        """The same of what decides λ and criticality: q, or on request ω."""
        if not self.omega:
            return self.ends
        return self._ends(self.band.lower, -1.0, omega=True), self._ends(self.band.upper, 1.0, omega=True)

    def _ends(self, values: Floats, away: float, *, omega: bool) -> Floats:
        mdp = self.frame.mdp
        begin = mdp.choice_to_branches[:-1]
        near = values[mdp.branch_to_target]
        finite = np.where(np.isfinite(near), near, 0.0)
        total = np.add.reduceat(self.frame.share * finite, begin)
        size = np.add.reduceat(np.abs(self.frame.share * finite), begin)
        degree = np.diff(mdp.choice_to_branches)
        mean = total + away * (2 * degree + 12) * ROUNDING * size
        clip = np.maximum.reduceat(near, begin) if away > 0 else np.minimum.reduceat(near, begin)
        mean = np.minimum(mean, clip) if away > 0 else np.maximum(mean, clip)
        mean = np.where(np.isfinite(mean), mean, 0.0)  # what is infinite is set below
        if not omega:
            price, discount = self.frame.price, self.frame.discount
            moved = (price != 0) | (discount < 1.0)
            with np.errstate(over="ignore"):
                size = np.minimum(np.abs(price) + np.where(moved, np.abs(mean), 0.0), LARGEST)
                mean = price + discount * mean + away * ((2 * degree + 14) * ROUNDING * size + self.frame.blur)
            mean = np.maximum(mean, -LARGEST) if away > 0 else np.minimum(mean, LARGEST)  # an overflow is no infinity
        infinities = (np.inf, -np.inf) if self.frame.demanding and self.frame.maximise else (-np.inf, np.inf)
        for infinity in infinities:  # the last one wins: ∞ for a cost, whatever is missed where arrival is demanded
            hit = np.logical_or.reduceat(near == infinity, begin)
            mean[hit] = infinity
        return mean

    @cached_property
    def size(self) -> float:
        """The size of values where signs may differ: what is near 0 need not be known better than others; else 0."""
        if not self.frame.signed:
            return 0.0
        ends = np.concatenate([self.band.lower, self.band.upper, self.frame.price])
        return float(np.abs(ends[np.isfinite(ends)]).max(initial=0.0))

    def silent(self, choice: int) -> bool:
        """Return whether the number of a choice rests on what the policy does where it says nothing."""
        mdp, silent = self.frame.mdp, self.band.silent
        return silent is not None and bool(silent[mdp.branch_to_target[mdp.branches_of(choice)]].any())

    def number(self, choice: int) -> Bounds:
        """Return the number of one choice."""
        return Bounds(float(self.ends[0][choice]), float(self.ends[1][choice]))

    def numbers(self, state: int) -> dict[int, Bounds]:
        """Return the numbers of a state's choices."""
        return {choice: self.number(choice) for choice in self.frame.mdp.choices_of(state)}

    def spread(self, choices: Iterable[int]) -> tuple[Bounds, Bounds]:
        """Return λmax and λmin of some choices."""
        lower, upper = self.lambda_ends
        numbers = [Bounds(float(lower[c]), float(upper[c])) for c in choices]
        return largest(numbers), smallest(numbers)

    def difference(self, state: int) -> tuple[Bounds, Bounds]:
        """Return the largest and the smallest action value of a state."""
        numbers = self.numbers(state).values()
        return largest(numbers), smallest(numbers)

    def fate(self, choice: int) -> str | None:
        """Return what an infinite number of a cost to be kept small means, None where it is not that."""
        frame = self.frame
        if not frame.costs or frame.endless or (frame.maximise and not frame.demanding):
            return None
        missed = -np.inf if frame.maximise else np.inf
        if self.number(choice) != Bounds(missed, missed):
            return None
        targets = frame.mdp.branch_to_target[frame.mdp.branches_of(choice)]
        return "may fail" if self.further or bool(self.arriving[targets].any()) else "dead end"

    def decided(self, choice: int) -> bool:
        """Return whether it is known of a choice whether its number is infinite."""
        number = self.number(choice)
        return number.finite or number.infinite

    def coarse(self, slack: float) -> float:
        """Return how much a number near 0 may be blurred by rounding, as those are that it was added up of."""
        return max(slack * self.size, ROUNDED * self._scale) if np.isfinite(slack) else 0.0

    @cached_property
    def _scale(self) -> float:
        """The largest number in sight: of the values, and of what is paid on any branch; at least 1 for probabilities."""
        ends = np.concatenate([self.band.lower, self.band.upper, self.frame.price])
        paid = 1.0 if self.frame.prices is None else self.frame.prices.largest
        return float(np.abs(ends[np.isfinite(ends)]).max(initial=paid))

    def widened(self, slack: float) -> Ends:
        """Return the ends on which λ rests, wider by a share of the numbers; ∞ stays what it is."""
        return self._wider(slack, slack * self.size)

    def blurred(self, slack: float) -> Ends:
        """Return the same as wide as the ends may be without being a forgery."""
        return self._wider(GROSS, self.coarse(slack))

    def _wider(self, share: float, least: float) -> Ends:
        if math.isinf(share):
            lower, upper = (np.where(np.isfinite(end), np.inf, 0.0) for end in self.lambda_ends)
        else:
            lower, upper = (
                np.where(np.isfinite(end), np.maximum(share * np.abs(end), least), 0.0) for end in self.lambda_ends
            )
        return self.lambda_ends[0] - lower, self.lambda_ends[1] + upper
