"""One claim of a step and the re-checker's own numbers enter, what is wrong with it leaves: from its evidence and on the model.

A claim holds if (1) its evidence is of this step and complete: the choice taken and every alternative that it must be compared
with, each under its name; (2) every number of the evidence agrees with the model: it lies between its bounds, the true one
may too, and the bounds are not wider than they need be; (3) the claim follows from the numbers of the evidence; (4) it
follows from the re-checker's own numbers. If (4) is left open the claim is undecided.

A claim of a level after the first speaks of the choices that are equal to the one taken at every level before, and of no
others: which these are must follow from the claim of the level before, whose numbers are checked likewise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ratherthan.explain.explanation import Claim, Measured, Step, Tally
from ratherthan.explain.question import Question
from ratherthan.verify.frame import Frame
from ratherthan.verify.interval import Interval, Order, order
from ratherthan.verify.levels import Levels
from ratherthan.verify.measure import GROSS, Measures
from ratherthan.verify.numbers import disagreement, vague
from ratherthan.verify.predicates import (
    ABOUT_COUNTS,
    CONTRAST,
    COUNTED,
    FLEXIBLE,
    FLEXIBLE_CONTRAST,
    IMPOSSIBLE,
    OPTIMAL,
    PREDICATES,
    STEPWISE,
    WITH_SUCCESSORS,
    Decision,
    Seen,
)
from ratherthan.verify.values import Band

__all__ = ["ClaimCheck"]

SOME = ("not best", "worse step", "avoids")
"""Claims about those alternatives alone whose numbers make it so."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClaimCheck:
    """Checks one claim of a step.

    Parameters
    ----------
    levels : Levels
    step : Step
    claim : Claim
    rivals : list of int
        The alternatives that the level of the claim compares.
    """

    levels: Levels
    step: Step
    claim: Claim
    rivals: list[int]

    @property
    def asked(self) -> Question:
        """The question."""
        return self.levels.asked

    @property
    def frame(self) -> Frame:
        """The frame of the claim's level."""
        return self.levels.frames[self.claim.level]

    @property
    def measures(self) -> Measures:
        """The numbers that count at the claim's level."""
        return self.levels.measures[self.claim.level]

    @property
    def best(self) -> Band:
        """The optimum ρ at the claim's level."""
        return self.levels.best[self.claim.level]

    @property
    def followed(self) -> Band:
        """The policy's value ρ^π at the claim's level."""
        return self.levels.followed[self.claim.level]

    def verdict(self) -> tuple[str | None, bool]:
        """Return what is wrong with the claim, and whether it is open."""
        flaw = self._evidence(self.claim)
        if flaw is not None:
            return flaw, False
        flaw, is_open = self._decided(self.claim)
        return flaw, is_open or self._vague(self.claim)

    def _number(self, claimed: Interval, band: Band, state: int) -> str | None:
        """Return how a value of a state disagrees with the model."""
        silent = band.silent is not None and bool(band.silent[state])
        return disagreement(claimed, band[state], self.levels, self.measures, silent=silent)

    def _evidence(self, claim: Claim) -> str | None:
        """Return what is wrong with a claim's evidence, whatever it claims."""
        return self._fits(claim) or self._rows(claim) or self._successors(claim)

    def _fits(self, claim: Claim) -> str | None:
        """Return what is wrong with the kind of claim, or with the choices it compares."""
        if claim.claim not in self._askable():
            return "it was not asked for"
        if claim.level and claim.claim in (*ABOUT_COUNTS, "only way on"):
            return "it is no matter of a further level"
        rows, taken = claim.evidence.others, claim.evidence.taken
        kind = Tally if claim.claim in ABOUT_COUNTS else Measured
        if not all(isinstance(row, kind) for row in (taken, *rows)):
            return "its evidence is of another kind"
        if taken.choice != self.step.choice:
            return f"its evidence is of choice {taken.choice}, but choice {self.step.choice} is taken"
        others = self.rivals
        wanted = self._compared(claim.claim, others)
        got = [row.choice for row in rows]
        if wanted is not None and got != wanted:
            return f"it must be compared with the choices {wanted}, got {got}"
        if not set(got) <= set(others) or len(set(got)) != len(got):
            return f"it must be compared with other choices that its level compares, each once, got {got}"
        return None

    def _askable(self) -> tuple[str, ...]:
        """Return which claims the question asks for."""
        factors = self.asked.factors
        names: tuple[str, ...] = ()
        if "responsibility" in factors:
            names += CONTRAST if self.step.foil is not None else STEPWISE if self.asked.policy_values else OPTIMAL
        if "constrictiveness" in factors:
            names += FLEXIBLE_CONTRAST if self.step.foil is not None else FLEXIBLE
        return names

    def _compared(self, name: str, others: list[int]) -> list[int] | None:
        """Return the choices that a claim must be compared with, None where that depends on their numbers."""
        if name in SOME:
            return None
        if self.step.foil is not None:
            return [choice for choice in others if self.frame.mdp.action_name(choice) == self.step.foil]
        return others

    def _rows(self, claim: Claim) -> str | None:
        """Return which number or count of the evidence disagrees with the model."""
        for row in (claim.evidence.taken, *claim.evidence.others):
            if isinstance(row, Measured):
                flaw = disagreement(
                    row.number,
                    self.measures.number(row.choice),
                    self.levels,
                    self.measures,
                    silent=self.measures.silent(row.choice),
                )
                fate, known = self.measures.fate(row.choice), self.measures.decided(row.choice)
                if flaw is None and row.fate != fate and known:
                    flaw = f"means '{fate}', got '{row.fate}'"
                if flaw:
                    return f"the number of '{row.action}' {flaw}"
            else:
                flaw = self._tally(row)
                if flaw:
                    return flaw
        return None

    def _vague(self, claim: Claim) -> bool:
        """Return whether less is known here of some number than the evidence says, or much more."""
        tallies = [row for row in (claim.evidence.taken, *claim.evidence.others) if isinstance(row, Tally)]
        if not all(self.levels.counts.count(row.choice)[1].contains(row) for row in tallies):
            return True
        rows = [row for row in (claim.evidence.taken, *claim.evidence.others) if isinstance(row, Measured)]
        pairs = [(self.measures.number(row.choice), row.number) for row in rows]
        for state, optimum, followed in claim.evidence.follows:
            pairs += [(self.best[state], optimum), (self.followed[state], followed)]
        return any(vague(told, own, self.levels, self.measures) for own, told in pairs)

    def _tally(self, row: Tally) -> str | None:
        own, _, excused = self.levels.counts.count(row.choice)
        if not (row.lower <= row.upper and own.meets(row)):
            return (
                f"'{row.action}' leaves {own.lower:g} to {own.upper:g} decisions open, got {row.lower} to {row.upper}"
            )
        if not excused.contains(row):
            return f"the count of '{row.action}' is known better than {row.lower} to {row.upper}"
        return None

    def _successors(self, claim: Claim) -> str | None:
        """Return what is wrong with ρ and ρ^π at the successors."""
        follows = claim.evidence.follows
        if claim.claim not in WITH_SUCCESSORS or self.asked.policy_values:
            return "it says nothing of successors, but some are given" if follows else None
        mdp = self.frame.mdp
        wanted = np.unique(mdp.branch_to_target[mdp.branches_of(self.step.choice)]).tolist()
        if [state for state, _, _ in follows] != wanted:
            return f"its successors are {wanted}, got {[state for state, _, _ in follows]}"
        for state, optimum, followed in follows:
            flaw = self._number(optimum, self.best, state)
            if flaw:
                return f"the best value at state {state} {flaw}"
            flaw = self._number(followed, self.followed, state)
            if flaw:
                return f"the policy's value at state {state} {flaw}"
        return None

    def _decided(self, claim: Claim) -> tuple[str | None, bool]:
        """Return why a claim does not hold, and whether it is open, by its evidence and by the model."""
        if claim.claim in ABOUT_COUNTS:
            return self._counted(claim)
        told = self._judged(claim, self._as_told(claim))
        if told is not True:
            return "it does not follow from its evidence", False
        own = self._judged(claim, self._as_known(claim))
        if own is False and all(map(self.measures.decided, self._choices(claim))):
            return "it does not hold on the model", False
        flaw, is_open = self._left_out(claim)
        return flaw, is_open or own is not True

    def _choices(self, claim: Claim) -> list[int]:
        return [row.choice for row in (claim.evidence.taken, *claim.evidence.others)]

    def _counted(self, claim: Claim) -> tuple[str | None, bool]:
        taken, others = claim.evidence.taken, claim.evidence.others
        assert isinstance(taken, Tally)
        compare, contradicts = COUNTED[claim.claim], IMPOSSIBLE[claim.claim]
        if not others or not all(isinstance(other, Tally) and compare(taken, other) for other in others):
            return "it does not follow from its evidence", False
        own = self.levels.counts.count(taken.choice)[0]
        rest = [self.levels.counts.count(other.choice)[0] for other in others]
        if any(contradicts(own, other) for other in rest):
            return "it does not hold on the model", False
        return None, not all(compare(own, other) for other in rest)

    def _judged(self, claim: Claim, seen: Seen) -> Decision:
        if claim.claim == "only way on":
            return len(self.frame.mdp.choices_of(self.step.state)) == 1
        if claim.claim == "hopeless":
            return self._hopeless(seen)
        return PREDICATES[claim.claim](seen) if seen.relations else False

    def _hopeless(self, seen: Seen) -> Decision:
        """Return whether no choice is sure to arrive (a least cost), or none can arrive at all (a largest probability)."""
        if self.frame.costs:
            return seen.own_fate is not None and all(fate is not None for fate in seen.fates.values())
        return self.frame.maximise and all(number.lower == number.upper == 0.0 for number in seen.numbers)

    def _as_told(self, claim: Claim) -> Seen:
        """Return what the evidence says."""
        taken = claim.evidence.taken
        rows = [row for row in claim.evidence.others if isinstance(row, Measured)]
        assert isinstance(taken, Measured)
        return Seen(
            relations={row.choice: self._relation(taken.number, row.number) for row in rows},
            fates={row.choice: row.fate for row in rows},
            numbers=[taken.number, *(row.number for row in rows)],
            own=taken.number,
            own_fate=taken.fate,
            keeps=[self._keeps(optimum, followed) for _, optimum, followed in claim.evidence.follows],
        )

    def _as_known(self, claim: Claim) -> Seen:
        """Return what the model says."""
        taken, rows = self.step.choice, [row.choice for row in claim.evidence.others]
        own = self.measures.number(taken)
        follows = [state for state, _, _ in claim.evidence.follows]
        return Seen(
            relations={row: self._relation(own, self.measures.number(row)) for row in rows},
            fates={row: self.measures.fate(row) for row in rows},
            numbers=[own, *(self.measures.number(row) for row in rows)],
            own=own,
            own_fate=self.measures.fate(taken),
            keeps=[self._keeps(self.best[state], self.followed[state]) for state in follows],
        )

    def _relation(self, own: Interval, other: Interval) -> str:
        found = order(own, other, self.asked.tolerance)
        if found in (Order.EQUAL, Order.OPEN):
            return str(found.value)
        return "better" if (found is Order.GREATER) == self.frame.maximise else "worse"

    def _keeps(self, optimum: Interval, followed: Interval) -> Decision:
        found = order(optimum, followed, self.asked.tolerance)
        return None if found is Order.OPEN else found is Order.EQUAL

    def _left_out(self, claim: Claim) -> tuple[str | None, bool]:
        """Return which alternative a claim about some alternatives must name too, and whether there is one it should name."""
        if claim.claim not in SOME:
            return None, False
        is_open, least = False, self.measures.coarse(self.levels.slack) / GROSS
        named = {row.choice for row in claim.evidence.others}
        own = self.measures.number(self.step.choice)
        for choice, number in self.measures.numbers(self.step.state).items():
            if choice in named or choice not in self.rivals:
                continue
            if claim.claim == "avoids":
                belongs = self.measures.fate(choice) is not None
            else:
                clear = order(own, number, 10 * self.asked.tolerance)
                known = clear in (Order.GREATER, Order.LESS) and self._relation(own, number) == "worse"
                belongs = known and self._relation(own.widened(GROSS, least), number.widened(GROSS, least)) == "worse"
                is_open |= known and not belongs
            if belongs:
                return f"it leaves out '{self.frame.mdp.action_name(choice)}'", False
        return None, is_open
