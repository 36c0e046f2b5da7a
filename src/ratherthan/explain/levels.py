"""The judges of all levels enter, one after the other; the claims about a choice leave, each with its level. No words here.

Objectives in order are compared in order: a further level speaks only of the choices that are equal at all levels before. It is
silent where a level before is open, where the choice taken is not among the best of a level before, and where the level has
ended.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ratherthan.explain.claims import Judge
from ratherthan.explain.explanation import Claim, Measured
from ratherthan.explain.measures import Factors, spread_of
from ratherthan.factors import Interval

__all__ = ["Judges"]

_EQUAL_AT_THE_TOP = ("among the best", "equal step")


@dataclass(frozen=True, kw_only=True, eq=False)
class Judges:
    """Decides the claims of single choices, level by level.

    Parameters
    ----------
    factors : Factors
    """

    factors: Factors

    @cached_property
    def levels(self) -> tuple[Judge, ...]:
        """One judge per level."""
        solution, asked = self.factors.solution, self.factors.asked
        return tuple(
            Judge(solution=solution, measures=measures, asked=asked, level=k)
            for k, measures in enumerate(self.factors.levels)
        )

    def outcome(self, state: int, choice: int) -> list[Claim]:
        """Return the claims about how the choice taken compares with the others."""
        rivals = [other for other in self.factors.solution.problem.mdp.choices_of(state) if other != choice]
        claims: list[Claim] = []
        for judge in self.levels:
            if judge.level > 0 and self.factors.ended[judge.level][state]:
                break
            found = judge.outcome(choice, rivals)
            claims += found
            if not any(claim.claim in _EQUAL_AT_THE_TOP for claim in found):
                break
            own = judge.measured(choice)
            rivals = [other for other in rivals if judge.relation(own, judge.measured(other)) == "equal"]
        return claims

    def contrast(self, state: int, choice: int, foil: int) -> list[Claim]:
        """Return the claims about the choice taken rather than one other: a level speaks where all before are equal."""
        claims: list[Claim] = []
        for judge in self.levels:
            if judge.level > 0 and self.factors.ended[judge.level][state]:
                break
            claim = judge.against(choice, foil)
            if claim is None:
                break
            claims.append(claim)
            own = claim.evidence.taken
            assert isinstance(own, Measured)
            if claim.claim != "equal" or own.number.infinite or judge.certain_loss([own]):
                break
        return claims

    def equivalent(self, state: int) -> bool:
        """Whether all choices of a state have finite and equal numbers at every level that has not ended there."""
        running = [judge for judge in self.levels if judge.level == 0 or not self.factors.ended[judge.level][state]]
        return all(judge.equivalent(state) for judge in running)

    def spread(self, state: int) -> tuple[Interval, Interval]:
        """Return λmax and λmin of a state at the first level, from q or on request from ω."""
        own = self.factors.solution.problem.mdp.choices_of(state)
        return spread_of(self.factors.measures, own, omega=self.factors.asked.omega)

    def difference(self, state: int, level: int = 0) -> tuple[Interval, Interval]:
        """Return the largest and the smallest q of a state at a level."""
        return spread_of(self.factors.levels[level], self.factors.solution.problem.mdp.choices_of(state))
