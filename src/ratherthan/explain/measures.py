"""A Solution and a question enter; the numbers that claims rest on leave: factors per level, computed on first use.

What does not depend on the state asked about is kept for the next question (`ratherthan.explain.shared`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ratherthan.explain.question import Question
from ratherthan.explain.shared import kept
from ratherthan.factors import (
    Compared,
    Constrictiveness,
    Counts,
    Criticality,
    Effort,
    Interval,
    Nearer,
    Responsibility,
    compared_at,
    constrictiveness,
    count_decisions,
    critical_states,
    critical_states_of_levels,
    nearer_goal,
    responsibility,
)
from ratherthan.model.mdp import Bools
from ratherthan.solve.levels import ended_at
from ratherthan.solve.solution import Solution

__all__ = ["Factors", "spread_of"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Factors:
    """The factors of a solution under one question, computed on first use and shared."""

    solution: Solution
    asked: Question

    @property
    def measures(self) -> Responsibility:
        """Impact, action values and responsibility of every choice, for the first level."""
        return self.levels[0]

    @cached_property
    def levels(self) -> tuple[Responsibility, ...]:
        """The same for every level of the objective, ``[K]``."""
        return tuple(self._level(k) for k in range(len(self.solution.objectives)))

    def _level(self, k: int) -> Responsibility:
        """Return the numbers of one level."""
        solution, of_policy = self.solution, self.asked.policy_values
        return kept(
            solution,
            ("measures", k, of_policy),
            lambda: responsibility(solution, objective=k, policy_values=of_policy),
        )

    @cached_property
    def ended(self) -> tuple[Bools, ...]:
        """Where each level has ended, ``[K]`` of ``[S]``."""
        return tuple(ended_at(self.solution, k) for k in range(len(self.solution.objectives)))

    @cached_property
    def compared(self) -> tuple[Compared, ...]:
        """Which choices each level compares, ``[K]`` of ``[C]``."""
        return compared_at(self.solution, self.levels, omega=self.asked.omega, tolerance=self.asked.tolerance)

    @cached_property
    def critical(self) -> Criticality:
        """The critical states."""
        return kept(self.solution, ("critical", *self._standard), self._critical)

    @property
    def _standard(self) -> tuple[float, bool, float, bool]:
        """By what it is judged whether a state is critical."""
        return self.asked.alpha, self.asked.omega, self.asked.tolerance, self.asked.policy_values

    def _critical(self) -> Criticality:
        """Return the critical states."""
        asked = self.asked
        if len(self.solution.objectives) > 1:
            return critical_states_of_levels(
                self.solution, self.levels, alpha=asked.alpha, omega=asked.omega, tolerance=asked.tolerance
            )
        return critical_states(
            self.solution.problem.mdp,
            self.measures,
            self.solution.ended,
            alpha=asked.alpha,
            omega=asked.omega,
            tolerance=asked.tolerance,
        )

    @cached_property
    def _counted(self) -> dict[int, Constrictiveness]:
        """What was counted so far."""
        return kept(self.solution, ("counts", *self._standard, self.asked.search), dict[int, Constrictiveness])

    def counts(self, choices: Iterable[int]) -> dict[int, Constrictiveness]:
        """Return how many decisions each of `choices` leaves open. Asked for together they are found much faster."""
        wanted = list(choices)
        missing = [choice for choice in wanted if choice not in self._counted]
        if missing:
            self._counted.update(self._count(missing))
        return {choice: self._counted[choice] for choice in wanted}

    def counted(self, choices: npt.NDArray[np.int64], effort: Effort) -> Counts:
        """Return how many decisions each of many choices leaves open, with no more work than is granted."""
        solution = self.solution
        return count_decisions(
            solution.problem.mdp,
            self.critical,
            solution.ended,
            choices,
            search=self.asked.search,
            nearer=self._nearer(),
            effort=effort,
        )

    def _count(self, choices: Iterable[int]) -> dict[int, Constrictiveness]:
        """Return how many decisions each of `choices` leaves open."""
        return constrictiveness(
            self.solution.problem.mdp,
            self.critical,
            self.solution.ended,
            choices,
            search=self.asked.search,
            nearer=self._nearer(),
        )

    def _nearer(self) -> tuple[Nearer, Nearer] | None:
        """Return which branches lead to better values, where only these are followed."""
        solution = self.solution
        if not self.asked.search.toward_goal:
            return None
        if self.asked.policy_values:
            lower, upper = solution.policy_lower[0], solution.policy_upper[0]
        else:
            lower, upper = solution.lower[0], solution.upper[0]
        return nearer_goal(lower, upper, maximise=solution.objectives[0].maximise, tolerance=self.asked.tolerance)

    def further_spreads(self, state: int) -> tuple[tuple[Interval, Interval] | None, ...]:
        """Return λmax and λmin for each level after the first, among the choices that are compared there."""
        own = self.solution.problem.mdp.choices_of(state)
        here = slice(own.start, own.stop)
        found: list[tuple[Interval, Interval] | None] = []
        for k in range(1, len(self.levels)):
            certain, possible = (mask[here] for mask in self.compared[k])
            choices = [choice for choice, chosen in zip(own, certain, strict=True) if chosen]
            settled = not self.ended[k][state] and len(choices) > 1 and bool((certain == possible).all())
            found.append(spread_of(self.levels[k], choices, omega=self.asked.omega) if settled else None)
        return tuple(found)


def spread_of(measures: Responsibility, choices: Iterable[int], *, omega: bool = False) -> tuple[Interval, Interval]:
    """Return the largest and the smallest number of some choices, from q or on request from ω, with their bounds."""
    numbers = [measures.measured(choice, omega=omega) for choice in choices]
    values, lowers, uppers = zip(*((number.value, number.lower, number.upper) for number in numbers), strict=True)
    return (
        Interval(value=max(values), lower=max(lowers), upper=max(uppers)),
        Interval(value=min(values), lower=min(lowers), upper=min(uppers)),
    )
