"""The claims of one step and the re-checker's own numbers enter, checks leave: each claim from its evidence and on the model.

A claim holds if (1) its evidence is of this step and complete: the choice taken and every alternative that it must be compared
with, each under its name; (2) every number of the evidence agrees with the model: it lies between its bounds, the true one
may too, and the bounds are not wider than they need be; (3) the claim follows from the numbers of the evidence; (4) it
follows from the re-checker's own numbers. If (4) is left open the claim is undecided.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ratherthan.explain.explanation import Claim, Measured, Step, Tally
from ratherthan.explain.question import Question
from ratherthan.verify.frame import Frame
from ratherthan.verify.interval import Bounds, Interval, Order, above, order
from ratherthan.verify.measure import Measures
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
from ratherthan.verify.verdict import Check, Verdict

__all__ = ["StepCheck"]

VAGUE = 1e-6
"""By which share of a number the bounds known here may reach beyond those of the evidence and still confirm it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StepCheck:
    """Checks the claims of one step.

    Parameters
    ----------
    frame : Frame
    asked : Question
    measures : Measures
        The numbers that count for this question.
    best, followed : Band
        ρ and ρ^π.
    given : bool
        Whether the policy was given, rather than the optimum.
    step : Step
    """

    frame: Frame
    asked: Question
    measures: Measures
    best: Band
    followed: Band
    given: bool
    step: Step

    def checks(self) -> list[Check]:
        """Return a check per claim, one of the spread, and one of what is missing."""
        found = [self._check("critical", self._critical(), self._critical_is_open())]
        for claim in self.step.claims:
            flaw = self._evidence(claim)
            flaw, is_open = self._decided(claim) if flaw is None else (flaw, False)
            found.append(self._check(claim.claim, flaw, is_open or self._vague(claim)))
        found.append(self._check("claims", self._together(), is_open=False))
        return found

    def _check(self, what: str, flaw: str | None, is_open: bool) -> Check:
        verdict = Verdict.FAILS if flaw else Verdict.UNDECIDED if is_open else Verdict.HOLDS
        name = self.frame.mdp.names[self.step.state]
        return Check(what=what, where=name, state=self.step.state, verdict=verdict, reason=flaw or "")

    # -- critical states

    def _critical(self) -> str | None:
        """Return what is wrong with the step's flag and its spread."""
        step, several = self.step, len(self.frame.mdp.choices_of(self.step.state)) > 1
        if "selectiveness" not in self.asked.factors:
            plain = step.critical is False and step.spread is None
            return None if plain else "whether it is critical was not asked"
        if step.spread is None:
            return "the largest and the smallest number are missing"
        for name, claimed, own in zip(
            ("largest", "smallest"), step.spread, self.measures.spread(step.state), strict=True
        ):
            flaw = self._number(claimed, own)
            if flaw:
                return f"the {name} number {flaw}"
        told = several and above(*step.spread, self.asked.alpha, self.asked.tolerance)
        if told != step.critical:
            return f"its numbers make it {told}, it says {step.critical}".replace("None", "open")
        own_view = self.measures.is_critical(step.state)
        if step.critical is not None and own_view is not None and own_view != step.critical:
            return f"on the model it is {own_view}"
        return None

    def _critical_is_open(self) -> bool:
        wanted = "selectiveness" in self.asked.factors and self.step.critical is not None
        return wanted and self.measures.is_critical(self.step.state) is None

    # -- evidence

    def _number(self, claimed: Interval, own: Bounds) -> str | None:
        """Return how a number of the evidence disagrees with the model."""
        value = getattr(claimed, "value", claimed.lower)
        if not claimed.lower <= value <= claimed.upper:
            return f"must lie between its bounds, got {value!r} and [{claimed.lower!r}, {claimed.upper!r}]"
        if not own.meets(claimed):
            return f"lies in [{own.lower:.12g}, {own.upper:.12g}], got [{claimed.lower:.12g}, {claimed.upper:.12g}]"
        if self.given and (claimed.lower, claimed.upper) == (-math.inf, math.inf):
            return None  # it is said that nothing is known, as where the policy says nothing
        if own.lower == -math.inf < claimed.lower:
            return "is not known: the policy that is listed says nothing of a state it comes to"
        if own.lower > -math.inf and not own.covers(claimed, self.measures.slack):
            return f"is known better than to lie in [{claimed.lower:.12g}, {claimed.upper:.12g}]"
        return None

    def _evidence(self, claim: Claim) -> str | None:
        """Return what is wrong with a claim's evidence, whatever it claims."""
        return self._fits(claim) or self._rows(claim) or self._successors(claim)

    def _fits(self, claim: Claim) -> str | None:
        """Return what is wrong with the kind of claim, or with the choices it compares."""
        if claim.claim not in self._askable():
            return "it was not asked for"
        rows, taken = claim.evidence.others, claim.evidence.taken
        kind = Tally if claim.claim in ABOUT_COUNTS else Measured
        if not all(isinstance(row, kind) for row in (taken, *rows)):
            return "its evidence is of another kind"
        if taken.choice != self.step.choice:
            return f"its evidence is of choice {taken.choice}, but choice {self.step.choice} is taken"
        others = [choice for choice in self.frame.mdp.choices_of(self.step.state) if choice != self.step.choice]
        wanted = self._compared(claim.claim, others)
        got = [row.choice for row in rows]
        if wanted is not None and got != wanted:
            return f"it must be compared with the choices {wanted}, got {got}"
        if not set(got) <= set(others) or len(set(got)) != len(got):
            return f"it must be compared with other choices of the state, each once, got {got}"
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
        if name in ("not best", "worse step", "avoids"):
            return None
        if self.step.foil is not None:
            return [choice for choice in others if self.frame.mdp.action_name(choice) == self.step.foil]
        return others

    def _rows(self, claim: Claim) -> str | None:
        """Return which number or count of the evidence disagrees with the model."""
        for row in (claim.evidence.taken, *claim.evidence.others):
            if isinstance(row, Measured):
                flaw = self._number(row.number, self.measures.number(row.choice))
                fate = self.measures.fate(row.choice) if row.number.lower == math.inf else None
                if flaw is None and row.fate != fate:
                    flaw = f"means '{fate}', got '{row.fate}'"
                if flaw:
                    return f"the number of '{row.action}' {flaw}"
            else:
                flaw = self._tally(row)
                if flaw:
                    return flaw
        return None

    def _vague(self, claim: Claim) -> bool:
        """Return whether less is known here of some number than the evidence says."""
        rows = [row for row in (claim.evidence.taken, *claim.evidence.others) if isinstance(row, Measured)]
        pairs = [(self.measures.number(row.choice), row.number) for row in rows]
        for state, optimum, followed in claim.evidence.follows:
            pairs += [(self.best[state], optimum), (self.followed[state], followed)]
        return any(own.vague(told, VAGUE) for own, told in pairs)

    def _tally(self, row: Tally) -> str | None:
        own, admitted = self.measures.count(row.choice)
        if not (row.lower <= row.upper and own.meets(row)):
            return (
                f"'{row.action}' leaves {own.lower:g} to {own.upper:g} decisions open, got {row.lower} to {row.upper}"
            )
        if row.lower < admitted.lower or row.upper > admitted.upper:
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
            flaw = self._number(optimum, self.best[state])
            if flaw:
                return f"the best value at state {state} {flaw}"
            flaw = self._number(followed, self.followed[state])
            if flaw:
                return f"the policy's value at state {state} {flaw}"
        return None

    # -- claims

    def _decided(self, claim: Claim) -> tuple[str | None, bool]:
        """Return why a claim does not hold, and whether it is open, by its evidence and by the model."""
        if claim.claim in ABOUT_COUNTS:
            return self._counted(claim)
        told = self._judged(claim, self._as_told(claim))
        if told is not True:
            return "it does not follow from its evidence", False
        own = self._judged(claim, self._as_known(claim))
        if own is False:
            return "it does not hold on the model", False
        return self._left_out(claim), own is None

    def _counted(self, claim: Claim) -> tuple[str | None, bool]:
        taken, others = claim.evidence.taken, claim.evidence.others
        assert isinstance(taken, Tally)
        compare, contradicts = COUNTED[claim.claim], IMPOSSIBLE[claim.claim]
        if not others or not all(isinstance(other, Tally) and compare(taken, other) for other in others):
            return "it does not follow from its evidence", False
        own = self.measures.count(taken.choice)[0]
        rest = [self.measures.count(other.choice)[0] for other in others]
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

    def _left_out(self, claim: Claim) -> str | None:
        """Return which alternative a claim about some alternatives should name too."""
        if claim.claim not in ("not best", "worse step", "avoids"):
            return None
        named = {row.choice for row in claim.evidence.others}
        own = self.measures.number(self.step.choice)
        for choice, number in self.measures.numbers(self.step.state).items():
            if choice in named or choice == self.step.choice:
                continue
            if claim.claim == "avoids":
                belongs = self.measures.fate(choice) is not None
            else:
                clear = order(own, number, 10 * self.asked.tolerance)
                belongs = clear in (Order.GREATER, Order.LESS) and self._relation(own, number) == "worse"
            if belongs:
                return f"it leaves out '{self.frame.mdp.action_name(choice)}'"
        return None

    def _together(self) -> str | None:
        """Return what is wrong with the claims of the step taken together."""
        names = [claim.claim for claim in self.step.claims]
        if len(set(names)) != len(names):
            return "a claim is made twice"
        known: dict[int, Interval] = {}
        for claim in self.step.claims:
            for row in (claim.evidence.taken, *claim.evidence.others):
                if isinstance(row, Measured) and known.setdefault(row.choice, row.number) != row.number:
                    return f"two numbers are given for '{row.action}'"
        if (
            self.step.spread is not None
            and not self.asked.omega
            and len(known) == len(self.frame.mdp.choices_of(self.step.state))
        ):
            high = max(number.upper for number in known.values()), max(number.lower for number in known.values())
            low = min(number.upper for number in known.values()), min(number.lower for number in known.values())
            if [(x.upper, x.lower) for x in self.step.spread] != [high, low]:
                return "the largest and the smallest number are not those of its evidence"
        return self._missing(names)

    def _missing(self, names: list[str]) -> str | None:
        """Return which claim that holds, and that was asked for, is not made."""
        told = self.step.critical is not False or "selectiveness" not in self.asked.factors
        if not told or self.step.foil is not None or math.isinf(self.measures.slack):
            return None
        others = [choice for choice in self.frame.mdp.choices_of(self.step.state) if choice != self.step.choice]
        exact = not self.asked.search.toward_goal  # else what is near the goal may be open to one and not to the other
        flexible = "constrictiveness" in self.asked.factors and bool(others) and exact
        missing = self._flexibility_missing(names, others) if flexible else None
        if missing or "responsibility" not in self.asked.factors or "hopeless" in names:
            return missing
        if not others and "only way on" not in names:
            return "that it is the only way on is not said"
        fated = any(self.measures.fate(choice) is not None for choice in others)
        if fated and self.measures.number(self.step.choice).finite and "avoids" not in names:
            return "what it avoids is not said"
        return None

    def _flexibility_missing(self, names: list[str], others: list[int]) -> str | None:
        """Return which claim about counts holds for everyone who knows the numbers well, and is not made."""
        own = self.measures.count(self.step.choice)[1]
        rest = [self.measures.count(choice)[1] for choice in others]
        for name in FLEXIBLE:
            if name not in names and all(COUNTED[name](own, other) for other in rest):
                return f"that it is {name} is not said"
        return None
