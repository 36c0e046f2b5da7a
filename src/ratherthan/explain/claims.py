"""The numbers of one state's choices enter, the claims that hold of the choice taken leave. There are no words here.

A claim is made only where the bounds decide it (`ratherthan.factors.compare`): what stays open yields none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ratherthan.explain.explanation import Claim, Evidence, Measured, Tally
from ratherthan.explain.question import Question
from ratherthan.factors import Comparison, Constrictiveness, Interval, Responsibility, compare
from ratherthan.model.objective import ExpectedCost, ReachAvoid
from ratherthan.solve.solution import Solution

__all__ = ["Judge"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Judge:
    """Decides the claims of single choices.

    Parameters
    ----------
    solution : Solution
    measures : Responsibility
    asked : Question
    """

    solution: Solution
    measures: Responsibility
    asked: Question

    def measured(self, choice: int) -> Measured:
        """Return a choice with its action value q and, where that is an infinite cost, its fate."""
        number = self.measures.measured(choice)
        return Measured(
            choice=choice,
            action=self.solution.problem.mdp.action_name(choice),
            number=number,
            fate=self._fate(choice) if number.infinite and number.lower > 0 and self._cost_to_avoid() else None,
        )

    def spread(self, state: int) -> tuple[Interval, Interval]:
        """Return λmax and λmin of a state with their bounds, from q or on request from ω."""
        own = self.solution.problem.mdp.choices_of(state)
        numbers = [self.measures.measured(choice, omega=self.asked.omega) for choice in own]
        return _extreme(numbers, highest=True), _extreme(numbers, highest=False)

    def difference(self, state: int) -> tuple[Interval, Interval]:
        """Return the largest and the smallest q of a state with their bounds."""
        numbers = [self.measures.measured(choice) for choice in self.solution.problem.mdp.choices_of(state)]
        return _extreme(numbers, highest=True), _extreme(numbers, highest=False)

    def outcome(self, state: int, choice: int) -> list[Claim]:
        """Return the claims about how the choice taken compares with all others, and the details that go with them."""
        own = self.measured(choice)
        others = [self.measured(c) for c in self.solution.problem.mdp.choices_of(state) if c != choice]
        claims = [self._only_way(own)] if not others else []
        if self._hopeless([own, *others]):
            return [_claim("hopeless", own, others), *claims]
        relations = [self._relation(own, other) for other in others]
        better = [other for other, relation in zip(others, relations, strict=True) if relation == "worse"]
        if better:
            claims.append(_claim("worse step" if self.asked.policy_values else "not best", own, better))
        elif others and all(relation in ("better", "equal") for relation in relations):
            main = self._at_the_top(own, others, alone="equal" not in relations)
            claims += [main] if main else []
        infinite = [other for other in others if other.fate is not None]
        if own.number.finite and infinite:
            claims.append(_claim("avoids", own, infinite))
        return claims

    def _only_way(self, own: Measured) -> Claim:
        return _claim("only way on", own, [])

    def _at_the_top(self, own: Measured, others: list[Measured], *, alone: bool) -> Claim | None:
        """Return the claim of a choice that no other beats."""
        if self.asked.policy_values:
            return _claim("better step" if alone else "equal step", own, others)
        follows = self._follows(own.choice)
        relations = [compare(rho, followed, self.asked.tolerance) for _, rho, followed in follows]
        if all(relation is Comparison.EQUAL for relation in relations):
            return _claim("best" if alone else "among the best", own, others, follows)
        if any(relation in (Comparison.GREATER, Comparison.LESS) for relation in relations):
            return _claim("right start only", own, others, follows)
        return None

    def flexibility(self, state: int, choice: int, counts: dict[int, Constrictiveness]) -> list[Claim]:
        """Return the claim about how many decisions the choice leaves open, compared with all others."""
        own = self._tally(choice, counts)
        others = [self._tally(c, counts) for c in self.solution.problem.mdp.choices_of(state) if c != choice]
        if others and all(own.lower > other.upper for other in others):
            return [_claim("most flexible", own, others)]
        if others and all(own.lower == own.upper == other.lower == other.upper for other in others):
            return [_claim("equally flexible", own, others)]
        return []

    def contrast(self, choice: int, foil: int, counts: dict[int, Constrictiveness] | None) -> list[Claim]:
        """Return the claims about the choice taken rather than one other."""
        claims = []
        if "responsibility" in self.asked.factors:
            own, other = self.measured(choice), self.measured(foil)
            relation = self._relation(own, other)
            if relation != "open":
                follows = () if self.asked.policy_values else self._follows(choice)
                claims.append(_claim(relation, own, [other], follows if relation == "better" else ()))
        if counts is not None:
            mine, its = self._tally(choice, counts), self._tally(foil, counts)
            if mine.lower > its.upper:
                claims.append(_claim("more flexible", mine, [its]))
            elif mine.upper < its.lower:
                claims.append(_claim("less flexible", mine, [its]))
            elif mine.lower == mine.upper == its.lower == its.upper:
                claims.append(_claim("as flexible", mine, [its]))
        return claims

    def _relation(self, own: Measured, other: Measured) -> str:
        """Return whether `own` is "better" or "worse" than, "equal" to `other`, or it is "open"."""
        relation = compare(own.number, other.number, self.asked.tolerance)
        if relation in (Comparison.EQUAL, Comparison.OPEN):
            return str(relation.value)
        return "better" if (relation is Comparison.GREATER) == self.solution.objectives[0].maximise else "worse"

    def _tally(self, choice: int, counts: dict[int, Constrictiveness]) -> Tally:
        count = counts[choice]
        return Tally(
            choice=choice,
            action=self.solution.problem.mdp.action_name(choice),
            lower=count.lower,
            upper=count.upper,
        )

    def _hopeless(self, rows: list[Measured]) -> bool:
        """Whether no choice is sure to arrive (an expected cost), or none can arrive at all (a probability)."""
        objective = self.solution.objectives[0]
        if isinstance(objective, ReachAvoid):
            return objective.maximise and all(row.number.lower == row.number.upper == 0.0 for row in rows)
        return all(row.fate is not None for row in rows)

    def _cost_to_avoid(self) -> bool:
        objective = self.solution.objectives[0]
        return isinstance(objective, ExpectedCost) and not objective.maximise

    def _fate(self, choice: int) -> str:
        mdp = self.solution.problem.mdp
        targets = mdp.branch_to_target[mdp.branches_of(choice)]
        return "may fail" if bool(self.solution.can_arrive[targets].any()) else "dead end"

    def _follows(self, choice: int) -> tuple[tuple[int, Interval, Interval], ...]:
        """Return every successor with ρ and ρ^π."""
        mdp, solution = self.solution.problem.mdp, self.solution
        targets = np.unique(mdp.branch_to_target[mdp.branches_of(choice)])
        return tuple(
            (
                int(t),
                _interval(solution.values[0, t], solution.lower[0, t], solution.upper[0, t]),
                _interval(solution.policy_values[0, t], solution.policy_lower[0, t], solution.policy_upper[0, t]),
            )
            for t in targets
        )

    def equivalent(self, state: int) -> bool:
        """Whether all choices of a state have finite and equal numbers."""
        numbers = [self.measured(choice).number for choice in self.solution.problem.mdp.choices_of(state)]
        first = numbers[0]
        pairs = [(x, y) for i, x in enumerate(numbers) for y in numbers[i + 1 :]]
        return first.finite and all(compare(x, y, self.asked.tolerance) is Comparison.EQUAL for x, y in pairs)


def _claim(
    name: str,
    own: Measured | Tally,
    others: list[Measured] | list[Tally],
    follows: tuple[tuple[int, Interval, Interval], ...] = (),
) -> Claim:
    return Claim(
        claim=name,
        against=tuple(other.action for other in others),
        evidence=Evidence(taken=own, others=tuple(others), follows=follows),
    )


def _interval(value: float, lower: float, upper: float) -> Interval:
    return Interval(value=float(value), lower=float(lower), upper=float(upper))


def _extreme(numbers: list[Interval], *, highest: bool) -> Interval:
    choose: Callable[[Iterable[float]], float] = max if highest else min
    return Interval(
        value=choose(number.value for number in numbers),
        lower=choose(number.lower for number in numbers),
        upper=choose(number.upper for number in numbers),
    )
