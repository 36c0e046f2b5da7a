"""One step of an explanation and the re-checker's own numbers enter, checks leave: critical or not, every claim, what is missing.

The claims of a step are taken level by level. A further level speaks only where the choice taken is among the best of the level
before, and only of the alternatives that are equal to it there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from ratherthan.explain.explanation import Claim, Measured, Step
from ratherthan.verify.claims import ClaimCheck
from ratherthan.verify.interval import Bounds, Interval, Order, above, order
from ratherthan.verify.levels import Levels
from ratherthan.verify.numbers import disagreement, vague
from ratherthan.verify.predicates import COUNTED, FLEXIBLE
from ratherthan.verify.verdict import Check, Verdict

__all__ = ["StepCheck"]

AT_THE_TOP = ("among the best", "equal step")
"""The claims after which a further level speaks."""

Spread = tuple[Interval, Interval]


@dataclass(frozen=True, kw_only=True, eq=False)
class StepCheck:
    """Checks one step.

    Parameters
    ----------
    levels : Levels
    step : Step
    """

    levels: Levels
    step: Step

    def checks(self) -> list[Check]:
        """Return a check of what is critical, one per claim, and one of what is missing."""
        found = [self._check("critical", self._critical(), self._critical_is_open())]
        for claim in self.step.claims:
            flaw, is_open = self._claim(claim)
            found.append(self._check(claim.claim, flaw, is_open))
        found.append(self._check("claims", self._together(), is_open=self._unsaid(1) is not None))
        if self.step.numbers:
            flaw, is_open = self._numbers()
            found.append(self._check("numbers", flaw, is_open))
        return found

    def _check(self, what: str, flaw: str | None, is_open: bool) -> Check:
        verdict = Verdict.FAILS if flaw else Verdict.UNDECIDED if is_open else Verdict.HOLDS
        name = self.levels.first.mdp.names[self.step.state]
        return Check(what=what, where=name, state=self.step.state, verdict=verdict, reason=flaw or "")

    @cached_property
    def _choices(self) -> range:
        return self.levels.first.mdp.choices_of(self.step.state)

    @property
    def _others(self) -> list[int]:
        return [choice for choice in self._choices if choice != self.step.choice]

    # -- critical states

    def _critical(self) -> str | None:
        """Return what is wrong with the step's flag and its spreads."""
        step = self.step
        if "selectiveness" not in self.levels.asked.factors:
            plain = step.critical is False and step.spread is None and not step.further_spreads
            return None if plain else "whether it is critical was not asked"
        if step.spread is None or len(step.further_spreads) != len(self.levels.frames) - 1:
            return "the largest and the smallest number of every level must be given"
        flaw = self._spread(0, step.spread, self._choices) or self._further()
        if flaw:
            return flaw
        flaw = self._told()
        own_view = self.levels.is_critical(step.state)
        if flaw is None and step.critical is not None and own_view is not None and own_view != step.critical:
            return f"on the model it is {own_view}"
        return flaw

    def _spread(self, level: int, told: Spread, choices: list[int] | range) -> str | None:
        """Return what is wrong with the largest and the smallest number of some choices."""
        measures = self.levels.measures[level]
        silent = any(map(measures.silent, choices))
        for name, claimed, own in zip(("largest", "smallest"), told, measures.spread(choices), strict=True):
            half_known = math.isinf(claimed.upper) if name == "largest" else math.isinf(claimed.lower)
            flaw = disagreement(claimed, own, self.levels, measures, silent=silent and not half_known)
            if flaw:
                return f"the {name} number {flaw}"
        return None

    def _group(self, level: int) -> tuple[list[int], bool]:
        """Return the choices that a level compares for sure, and whether these are all that it may compare."""
        sure, maybe = (mask[self._choices.start : self._choices.stop] for mask in self.levels.compared[level])
        return [choice for choice, hit in zip(self._choices, sure, strict=True) if hit], bool((sure == maybe).all())

    def _further(self) -> str | None:
        """Return what is wrong with the spreads of further levels; those that are left out say nothing."""
        for level, told in enumerate(self.step.further_spreads, start=1):
            if told is None:
                continue
            group, settled = self._group(level)
            if not self.levels.frames[level].running[self.step.state]:
                return f"level {level + 1} has ended here, but its numbers are given"
            if settled and len(group) < 2:
                return f"level {level + 1} compares no two choices, but its numbers are given"
            flaw = self._spread(level, told, group) if settled else None
            if flaw:
                return flaw
        return None

    def _told(self) -> str | None:
        """Return how the flag contradicts the numbers that are given for it."""
        step, asked = self.step, self.levels.asked
        assert step.spread is not None
        first = len(self._choices) > 1 and above(*step.spread, asked.alpha, asked.tolerance)
        further = [None if spread is None else above(*spread, 0.0, asked.tolerance) for spread in step.further_spreads]
        if True in (first, *further):
            told: bool | None = True
        elif None in further:
            return None  # what a level compares is not told, so that its numbers need not decide it
        else:
            told = None if first is None else False
        return None if told == step.critical else f"its numbers make it {told}, it says {step.critical}"

    def _critical_is_open(self) -> bool:
        if "selectiveness" not in self.levels.asked.factors:
            return False
        if self._spread_is_vague():
            return True
        known = self.levels.is_critical(self.step.state) is not None
        if self.step.critical is None:  # it is said to be open: with one level that must follow from the numbers
            return known and len(self.levels.frames) > 1 and not math.isinf(self.levels.slack)
        unsettled = any(
            spread is not None and not self._group(level)[1]
            for level, spread in enumerate(self.step.further_spreads, start=1)
        )
        return unsettled or not known

    def _spread_is_vague(self) -> bool:
        """Return whether the numbers that are given for the flag are known less well than they could be."""
        levels, told = self.levels, [self.step.spread, *self.step.further_spreads]
        return any(
            not own.covers(claimed, levels.slack, levels.measures[level].size)
            for level, spread in enumerate(told)
            if spread is not None and (level == 0 or self._group(level)[1])
            for claimed, own in zip(spread, self._own_spread(level), strict=True)
            if not (levels.given and (claimed.lower, claimed.upper) == (-math.inf, math.inf))
        )

    def _own_spread(self, level: int) -> tuple[Bounds, Bounds]:
        return self.levels.measures[level].spread(self._group(level)[0] if level else self._choices)

    def _numbers(self) -> tuple[str | None, bool]:
        """Return what is wrong with the numbers of all choices that are given for details, and whether they are open."""
        step, levels, is_open = self.step, self.levels, False
        if not levels.asked.detail:
            return "details were not asked for", False
        running = [k for k, frame in enumerate(levels.frames) if k == 0 or frame.running[step.state]]
        names = levels.first.mdp.action_name
        others = [c for c in self._others if step.foil is None or names(c) == step.foil]
        if len(step.numbers) != len(running) or not levels.first.running[step.state]:
            return f"there must be numbers of {len(running)} levels, got {len(step.numbers)}", False
        for level, rows in zip(running, step.numbers, strict=True):
            if [(row.choice, row.action) for row in rows] != [(c, names(c)) for c in (step.choice, *others)]:
                return "there must be numbers of the choice taken, and of each other one in turn", False
            measures = levels.measures[level]
            for row in rows:
                own, silent = measures.number(row.choice), measures.silent(row.choice)
                flaw = disagreement(row.number, own, levels, measures, silent=silent)
                if flaw is None and row.fate != measures.fate(row.choice) and measures.decided(row.choice):
                    flaw = f"means '{measures.fate(row.choice)}', got '{row.fate}'"
                if flaw:
                    return f"the number of '{row.action}' {flaw}", False
                is_open |= vague(row.number, own, levels, measures)
        return None, is_open

    # -- claims

    def _claim(self, claim: Claim) -> tuple[str | None, bool]:
        """Return what is wrong with a claim, and whether it is open."""
        if claim.level >= len(self.levels.frames):
            return f"the objective has {len(self.levels.frames)} levels, got level {claim.level + 1}", False
        rivals, flaw, is_open = self._rivals(claim.level)
        if flaw is not None:
            return flaw, False
        if claim.level and not self.levels.frames[claim.level].running[self.step.state]:
            return "its level has ended here", False
        flaw, vague = ClaimCheck(levels=self.levels, step=self.step, claim=claim, rivals=rivals).verdict()
        return flaw, vague or is_open

    def _rivals(self, level: int) -> tuple[list[int], str | None, bool]:
        """Return the alternatives that a level compares, what is wrong with comparing them, and whether that is open."""
        rivals, is_open = self._others, False
        for before in range(level):
            names = ("equal",) if self.step.foil is not None else AT_THE_TOP
            tops = [claim for claim in self.step.claims if claim.level == before and claim.claim in names]
            if not tops:
                return [], f"level {before + 1} does not say that several choices are equal", False
            own, left = tops[0].evidence.taken, []
            if self.step.foil is not None and self._lost(before):
                return [], f"nothing can be gained at level {before + 1}, so that no further level matters", False
            for row in tops[0].evidence.others:
                if not isinstance(row, Measured) or not isinstance(own, Measured):
                    return [], "its evidence is of another kind", False
                if order(own.number, row.number, self.levels.asked.tolerance) is not Order.EQUAL:
                    continue
                known = self._known_order(before, row.choice)
                if known not in (Order.EQUAL, Order.OPEN):
                    return [], f"'{row.action}' is not equal at level {before + 1}", False
                is_open |= known is Order.OPEN
                left.append(row.choice)
            rivals = left
        return rivals, None, is_open

    def _lost(self, level: int) -> bool:
        """Return whether the choice taken comes to an infinite number, or never to what is to be reached."""
        number, frame = self.levels.measures[level].number(self.step.choice), self.levels.frames[level]
        return number.infinite or (not frame.costs and frame.maximise and number.upper == 0.0)

    def _known_order(self, level: int, choice: int) -> Order:
        numbers = self.levels.measures[level]
        return order(numbers.number(self.step.choice), numbers.number(choice), self.levels.asked.tolerance)

    def _together(self) -> str | None:
        """Return what is wrong with the claims of the step taken together."""
        names = [(claim.level, claim.claim) for claim in self.step.claims]
        if len(set(names)) != len(names):
            return "a claim is made twice"
        if [level for level, _ in names if level] != sorted(level for level, _ in names if level):
            return "claims must be in the order of their levels"
        known: dict[tuple[int, int], Interval] = {}
        for claim in self.step.claims:
            for row in (claim.evidence.taken, *claim.evidence.others):
                place = claim.level, row.choice
                if isinstance(row, Measured) and known.setdefault(place, row.number) != row.number:
                    return f"two numbers are given for '{row.action}'"
        first = [number for (level, _), number in known.items() if level == 0]
        if self.step.spread is not None and not self.levels.asked.omega and len(first) == len(self._choices):
            high = max(number.upper for number in first), max(number.lower for number in first)
            low = min(number.upper for number in first), min(number.lower for number in first)
            if [(x.upper, x.lower) for x in self.step.spread] != [high, low]:
                return "the largest and the smallest number are not those of its evidence"
        return self._unsaid(2)

    def _unsaid(self, how: int) -> str | None:
        """Return which claim is not made that holds for everyone who knows well (1), or just well enough (2), what it rests on."""
        names = [claim.claim for claim in self.step.claims if claim.level == 0]
        asked, levels = self.levels.asked, self.levels
        told = self.step.critical is not False or "selectiveness" not in asked.factors or asked.scope == "state"
        if not told or self.step.foil is not None or math.isinf(levels.slack):
            return None
        others, measures = self._others, levels.measures[0]
        exact = not asked.search.toward_goal  # else what is near the goal may be open to one and not to the other
        flexible = "constrictiveness" in asked.factors and bool(others) and exact
        missing = self._flexibility_missing(names, others, how) if flexible else None
        if missing or "responsibility" not in asked.factors or "hopeless" in names:
            return missing
        if not others and "only way on" not in names:
            return "that it is the only way on is not said"
        fated = any(measures.fate(choice) is not None for choice in others)
        if fated and measures.number(self.step.choice).finite and "avoids" not in names:
            return "what it avoids is not said"
        return None

    def _flexibility_missing(self, names: list[str], others: list[int], how: int) -> str | None:
        """Return which claim about counts holds for everyone who knows the numbers so well, and is not made."""
        own = self.levels.counts.count(self.step.choice)[how]
        rest = [self.levels.counts.count(choice)[how] for choice in others]
        for name in FLEXIBLE:
            if name not in names and all(COUNTED[name](own, other) for other in rest):
                return f"that it is {name} is not said"
        return None
