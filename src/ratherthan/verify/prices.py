"""A model and the name of a reward enter, what each choice pays leaves: rounded with a bound of the error, and in fractions.

A reward has parts of states, choices and branches; what a choice pays at once is r(s, a) = state + choice + Σ δ · branch.
A weighted sum of rewards (``distance + 10 * risk``) pays the weighted sum of what its terms pay; no name counts steps, r = 1.
Which choices pay *nothing* is told by the parts, not by a rounded sum.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from ratherthan.errors import ExplanationError
from ratherthan.model.mdp import MDP, Bools, Floats, Reward
from ratherthan.model.weights import weights_of

__all__ = ["Prices", "prices_of"]

ROUNDING = 1.12e-16
"""A little more than the unit roundoff of a double."""
SMALLEST = 5e-324
"""What is paid stays positive, however small a probability made it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Prices:
    """What the choices of a model pay under one reward.

    Parameters
    ----------
    mdp : MDP
    terms : tuple of (float, Reward), optional
        The rewards that are added up, each with its weight; None counts steps.
    """

    mdp: MDP
    terms: tuple[tuple[float, Reward], ...] | None

    def _parts(self) -> Iterator[tuple[float, str, Floats]]:
        for weight, reward in self.terms or ():
            yield from ((weight, part, values) for part, values in reward.parts())

    def _spread(self, part: str, values: Floats) -> Floats:
        """Return what one part pays by each choice, on the average over its branches, ``[C]``."""
        mdp = self.mdp
        if part == "choice":
            return values
        if part == "state":
            return np.repeat(values, np.diff(mdp.state_to_choices))
        begin = mdp.choice_to_branches[:-1]
        sums = np.add.reduceat(mdp.branch_to_probability, begin)
        mean: Floats = np.add.reduceat(mdp.branch_to_probability * values, begin) / sums
        return mean

    @cached_property
    def price(self) -> Floats:
        """The expected immediate reward of each choice, ``[C]``."""
        if self.terms is None:
            return np.ones(self.mdp.choices)
        total = np.zeros(self.mdp.choices)
        with np.errstate(over="ignore", invalid="ignore"):
            for weight, part, values in self._parts():
                total = total + weight * self._spread(part, values)
        if (self.signs >= 0).all():
            total = np.where(self.pays, np.maximum(total, SMALLEST), 0.0)
        return total

    @cached_property
    def blur(self) -> Floats:
        """A bound of the rounding error of `price`, ``[C]``."""
        if self.terms is None:
            return np.zeros(self.mdp.choices)
        size, count = np.zeros(self.mdp.choices), 0
        with np.errstate(over="ignore"):
            for weight, part, values in self._parts():
                size, count = size + abs(weight) * self._spread(part, np.abs(values)), count + 1
        degree = np.diff(self.mdp.choice_to_branches)
        blur: Floats = (2 * degree + 3 * count + 8) * ROUNDING * size + np.where(
            size > 0.0, (degree + count) * 1e-320, 0
        )
        return blur

    @cached_property
    def signs(self) -> Floats:
        """The least sign of any part that each choice has, ``[C]``: -1 where something negative may be paid."""
        least = np.zeros(self.mdp.choices)
        for _, part, values in self._parts():
            if part == "branch":
                values = np.minimum.reduceat(values, self.mdp.choice_to_branches[:-1])
                part = "choice"
            least = np.minimum(least, np.sign(self._spread(part, values)))
        return least

    @cached_property
    def pays(self) -> Bools:
        """Which choices have a part that is not zero, ``[C]``."""
        if self.terms is None:
            return np.ones(self.mdp.choices, dtype=np.bool_)
        found = np.zeros(self.mdp.choices, dtype=np.bool_)
        for weight, part, values in self._parts():
            if weight == 0.0:
                continue
            if part == "branch":
                found |= np.logical_or.reduceat(values != 0, self.mdp.choice_to_branches[:-1])
            else:
                found |= self._spread(part, (values != 0).astype(np.float64)) > 0
        return found

    @cached_property
    def largest(self) -> float:
        """The largest amount, without its sign, of which anything that is paid is made up."""
        if self.terms is None:
            return 1.0
        with np.errstate(over="ignore"):
            amounts = [abs(weight) * float(np.abs(values).max(initial=0.0)) for weight, _, values in self._parts()]
        return min(max(amounts, default=0.0), float(np.finfo(np.float64).max))

    def exactly(self, choice: int) -> Fraction:
        """Return what one choice pays as a fraction, its probabilities divided by their sum."""
        if self.terms is None:
            return Fraction(1)
        mdp, branches, total = self.mdp, self.mdp.branches_of(choice), Fraction(0)
        for weight, part, values in self._parts():
            if part == "choice":
                paid = Fraction(float(values[choice]))
            elif part == "state":
                paid = Fraction(float(values[mdp.state_of(choice)]))
            else:
                chances = [Fraction(float(p)) for p in mdp.branch_to_probability[branches]]
                amounts = [Fraction(float(b)) for b in values[branches]]
                paid = sum((p * b for p, b in zip(chances, amounts, strict=True)), Fraction(0)) / sum(chances)
            total += Fraction(weight) * paid
        return total


def prices_of(mdp: MDP, name: str | None) -> Prices:
    """Return what a reward of a model, or a weighted sum of its rewards, pays.

    Parameters
    ----------
    mdp : MDP
    name : str, optional
        None counts steps.

    Raises
    ------
    ExplanationError
        If the model has no such reward, or its parts add up to more than the largest double.
    """
    if name is None:
        return Prices(mdp=mdp, terms=None)
    weights = weights_of(name, mdp.rewards)
    if weights is None:
        there = ", ".join(f"'{known}'" for known in mdp.rewards) or "none"
        raise ExplanationError(
            f"The property of an explanation must name a reward of the model, got '{name}'; there are: {there}.",
            reward=name,
        )
    found = Prices(mdp=mdp, terms=tuple((weight, mdp.rewards[part]) for part, weight in weights.items()))
    finite = np.isfinite(found.price) & np.isfinite(found.blur)
    if not finite.all():
        choice = int(np.argmin(finite))
        raise ExplanationError(
            f"Rewards must add up to finite numbers, but those of '{name}' exceed the largest double at choice {choice}. "
            "Such a model has no explanation for this property.",
            choice=choice,
        )
    return found
