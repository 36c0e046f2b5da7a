"""The numbers of one state's choices under one level enter, the claims that hold of the choice taken leave. No words here.

A claim is made only where the bounds decide it (`ratherthan.factors.compare`): what stays open yields none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ratherthan.explain.explanation import Claim, Evidence, Measured, Tally
from ratherthan.explain.question import Question
from ratherthan.factors import Comparison, Constrictiveness, Interval, Responsibility, compare
from ratherthan.model.objective import ExpectedCost, ExpectedReward, Level
from ratherthan.solve.solution import Solution

__all__ = ["Judge", "fate_of", "flexibility", "flexibility_against", "relation_of"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Judge:
    """Decides the claims of single choices under one level of the objective.

    Parameters
    ----------
    solution : Solution
    measures : Responsibility
        Of this level.
    asked : Question
    level : int
    """

    solution: Solution
    measures: Responsibility
    asked: Question
    level: int = 0

    @property
    def objective(self) -> Level:
        """What is wanted at this level."""
        return self.solution.objectives[self.level]

    def measured(self, choice: int) -> Measured:
        """Return a choice with its action value q and, where that is infinitely bad, its fate."""
        number = self.measures.measured(choice)
        fate = fate_of(self.solution, choice, number, self.objective)
        return Measured(
            choice=choice,
            action=self.solution.problem.mdp.action_name(choice),
            number=number,
            fate="may fail" if fate is not None and self.level > 0 else fate,
        )

    def outcome(self, choice: int, rivals: Sequence[int]) -> list[Claim]:
        """Return the claims about how the choice taken compares with all its rivals, and the details that go with them.

        Parameters
        ----------
        choice : int
        rivals : sequence of int
            The other choices of the state; beyond the first level those that are equal at all levels before.
        """
        own = self.measured(choice)
        others = [self.measured(other) for other in rivals]
        claims = [self._claim("only way on", own, [])] if not others else []
        if self._hopeless([own, *others]):
            return [self._claim("hopeless", own, others), *claims]
        relations = [self.relation(own, other) for other in others]
        better = [other for other, relation in zip(others, relations, strict=True) if relation == "worse"]
        if better:
            claims.append(self._claim("worse step" if self.asked.policy_values else "not best", own, better))
        elif others and all(relation in ("better", "equal") for relation in relations):
            main = self._at_the_top(own, others, alone="equal" not in relations)
            claims += [main] if main else []
        infinite = [other for other in others if other.fate is not None]
        if own.number.finite and infinite:
            claims.append(self._claim("avoids", own, infinite))
        return claims

    def _at_the_top(self, own: Measured, others: list[Measured], *, alone: bool) -> Claim | None:
        """Return the claim of a choice that no other beats."""
        if self.asked.policy_values:
            return self._claim("better step" if alone else "equal step", own, others)
        follows = self._follows(own.choice)
        relations = [compare(rho, followed, self.asked.tolerance) for _, rho, followed in follows]
        if all(relation is Comparison.EQUAL for relation in relations):
            return self._claim("best" if alone else "among the best", own, others, follows)
        if any(relation in (Comparison.GREATER, Comparison.LESS) for relation in relations):
            return self._claim("right start only", own, others, follows)
        return None

    def against(self, choice: int, foil: int) -> Claim | None:
        """Return the claim about the choice taken rather than one other; None where it is open."""
        own, other = self.measured(choice), self.measured(foil)
        relation = self.relation(own, other)
        if relation == "open":
            return None
        follows = () if self.asked.policy_values or relation != "better" else self._follows(choice)
        return self._claim(relation, own, [other], follows)

    def relation(self, own: Measured, other: Measured) -> str:
        """Return whether `own` is "better" or "worse" than, "equal" to `other`, or it is "open"."""
        return relation_of(own.number, other.number, maximise=self.objective.maximise, tolerance=self.asked.tolerance)

    def _hopeless(self, rows: list[Measured]) -> bool:
        """Whether no choice is sure to arrive (an expected total), or none can arrive at all (a probability)."""
        if isinstance(self.objective, ExpectedCost | ExpectedReward):
            return all(row.fate is not None for row in rows)
        return self.certain_loss(rows)

    def certain_loss(self, rows: Sequence[Measured]) -> bool:
        """Whether the objective is a chance to be kept large, and it is nil with all of some choices."""
        if not self.objective.maximise or hasattr(self.objective, "reward"):
            return False
        return all(row.number.lower == row.number.upper == 0.0 for row in rows)

    def _follows(self, choice: int) -> tuple[tuple[int, Interval, Interval], ...]:
        """Return every successor with ρ and ρ^π."""
        mdp, solution, k = self.solution.problem.mdp, self.solution, self.level
        targets = np.unique(mdp.branch_to_target[mdp.branches_of(choice)])
        return tuple(
            (
                int(t),
                _interval(solution.values[k, t], solution.lower[k, t], solution.upper[k, t]),
                _interval(solution.policy_values[k, t], solution.policy_lower[k, t], solution.policy_upper[k, t]),
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
        self,
        name: str,
        own: Measured,
        others: list[Measured],
        follows: tuple[tuple[int, Interval, Interval], ...] = (),
    ) -> Claim:
        return Claim(
            claim=name,
            against=tuple(other.action for other in others),
            evidence=Evidence(taken=own, others=tuple(others), follows=follows),
            level=self.level,
        )


def relation_of(own: Interval, other: Interval, *, maximise: bool, tolerance: float) -> str:
    """Return whether `own` is "better" or "worse" than, "equal" to `other`, or it is "open"."""
    relation = compare(own, other, tolerance)
    if relation in (Comparison.EQUAL, Comparison.OPEN):
        return str(relation.value)
    return "better" if (relation is Comparison.GREATER) == maximise else "worse"


def fate_of(solution: Solution, choice: int, number: Interval, objective: Level) -> str | None:
    """Return what it means that a total is infinitely bad: "dead end" or "may fail"; None where it is not.

    A largest expected cost has no such fate: it is infinite where the goal can be dodged, which is not bad.
    """
    if not number.infinite or not _demands_arrival(objective) or (number.lower > 0) == objective.maximise:
        return None
    mdp = solution.problem.mdp
    targets = mdp.branch_to_target[mdp.branches_of(choice)]
    return "may fail" if bool(solution.can_arrive[targets].any()) else "dead end"


def _demands_arrival(objective: Level) -> bool:
    return isinstance(objective, ExpectedReward) or (isinstance(objective, ExpectedCost) and not objective.maximise)


def flexibility(solution: Solution, state: int, choice: int, counts: dict[int, Constrictiveness]) -> list[Claim]:
    """Return the claim about how many decisions the choice leaves open, compared with all others."""
    own = _tally(solution, choice, counts)
    others = [_tally(solution, c, counts) for c in solution.problem.mdp.choices_of(state) if c != choice]
    if others and all(own.lower > other.upper for other in others):
        return [_counted("most flexible", own, others)]
    if others and all(own.lower == own.upper == other.lower == other.upper for other in others):
        return [_counted("equally flexible", own, others)]
    return []


def flexibility_against(solution: Solution, choice: int, foil: int, counts: dict[int, Constrictiveness]) -> list[Claim]:
    """Return the claim about how many decisions the choice leaves open, compared with one other."""
    mine, its = _tally(solution, choice, counts), _tally(solution, foil, counts)
    if mine.lower > its.upper:
        return [_counted("more flexible", mine, [its])]
    if mine.upper < its.lower:
        return [_counted("less flexible", mine, [its])]
    if mine.lower == mine.upper == its.lower == its.upper:
        return [_counted("as flexible", mine, [its])]
    return []


def _tally(solution: Solution, choice: int, counts: dict[int, Constrictiveness]) -> Tally:
    count = counts[choice]
    return Tally(choice=choice, action=solution.problem.mdp.action_name(choice), lower=count.lower, upper=count.upper)


def _counted(name: str, own: Tally, others: list[Tally]) -> Claim:
    return Claim(
        claim=name,
        against=tuple(other.action for other in others),
        evidence=Evidence(taken=own, others=tuple(others)),
    )


def _interval(value: float, lower: float, upper: float) -> Interval:
    return Interval(value=float(value), lower=float(lower), upper=float(upper))
