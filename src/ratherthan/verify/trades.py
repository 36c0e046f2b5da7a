"""How a choice compares with others under several objectives enters, and bounds of the plan under each; checks leave.

The alternative b at s means: take b once, then go on with the plan π. Under objective j it comes to

    q^π_j(s, b) = r_j(s, b) + γ_j · Σ δ(s, b, s') · ρ^π_j(s').

The levels of the plan's own objective come first. Under a further one the plan is followed until its own objective has ended:
there a run stays for nothing, so what a further objective has not reached by then it never will. Where objective j has ended
itself at s, every choice comes to ρ^π_j(s).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ratherthan.explain.explanation import Explanation, Judged, Measured, Step, Trade
from ratherthan.model.objective import Level
from ratherthan.model.problem import Problem
from ratherthan.verify.aims import frame_of
from ratherthan.verify.interval import Bounds, Interval, Order, order
from ratherthan.verify.levels import Levels
from ratherthan.verify.measure import Measures
from ratherthan.verify.numbers import disagreement, vague
from ratherthan.verify.values import following
from ratherthan.verify.verdict import Check, Verdict

__all__ = ["TradeCheck", "View", "views_of"]


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """The plan under one objective: its numbers are q^π, its band is ρ^π."""

    measures: Measures

    def number(self, state: int, choice: int) -> tuple[Bounds, bool]:
        """Return what a choice and then the plan come to, and whether that rests on what the policy does not say."""
        measures = self.measures
        if not measures.frame.running[state]:
            silent = measures.band.silent
            return measures.band[state], silent is not None and bool(silent[state])
        return measures.number(choice), measures.silent(choice)

    def fate(self, state: int, choice: int) -> tuple[str | None, bool]:
        """Return what an infinite number means, and whether that is known."""
        if not self.measures.frame.running[state]:
            return None, True
        return self.measures.fate(choice), self.measures.decided(choice)


def views_of(levels: Levels, problem: Problem, further: Sequence[Level]) -> tuple[View, ...]:
    """Return the plan under each of its own levels and under each further objective.

    Parameters
    ----------
    levels : Levels
    problem : Problem
        On which the plan is judged.
    further : sequence of objectives
    """
    views = [View(measures=measures) for measures in levels.policy_measures]
    over = ~levels.first.running
    for level in further:
        frame = frame_of(problem, level)
        frame = replace(frame, out=frame.out | (over & ~frame.target))
        band = following(frame, levels.weight, levels.budget)
        views.append(View(measures=Measures(frame=frame, band=band, omega=False, arriving=frame.can_arrive)))
    return tuple(views)


@dataclass(frozen=True, kw_only=True, eq=False)
class TradeCheck:
    """Checks what is said of a plan under several objectives.

    Parameters
    ----------
    told : Explanation
    levels : Levels
    views : tuple of View
        One per objective.
    """

    told: Explanation
    levels: Levels
    views: tuple[View, ...]

    def totals(self) -> Check:
        """Return the check of what the whole plan comes to."""
        told, wanted = self.told, len(self.views) if self.told.also and self.told.question.scope == "route" else 0
        if len(told.totals) != wanted:
            return self._check("totals", None, f"there must be {wanted}, got {len(told.totals)}", is_open=False)
        open_ = False
        for view, total in zip(self.views, told.totals, strict=False):
            own, silent = view.measures.band[told.start], view.measures.band.silent
            unknown = silent is not None and bool(silent[told.start])
            flaw = disagreement(total, own, self.levels, view.measures, silent=unknown)
            if flaw:
                return self._check("totals", None, f"one {flaw}", is_open=False)
            open_ |= vague(total, own, self.levels, view.measures)
        return self._check("totals", None, None, is_open=open_)

    def checks(self, step: Step) -> list[Check]:
        """Return a check per comparison of a step, and one of what is missing."""
        found = []
        for trade in step.trades:
            flaw, is_open = self._trade(step, trade)
            found.append(self._check(trade.claim, step, flaw, is_open=is_open))
        if self.told.also or step.trades:
            found.append(self._check("trades", step, self._together(step), is_open=False))
        return found

    def _check(self, what: str, step: Step | None, flaw: str | None, *, is_open: bool) -> Check:
        verdict = Verdict.FAILS if flaw else Verdict.UNDECIDED if is_open else Verdict.HOLDS
        state = self.told.start if step is None else step.state
        return Check(
            what=what, where=self.levels.first.mdp.names[state], state=state, verdict=verdict, reason=flaw or ""
        )

    def _trade(self, step: Step, trade: Trade) -> tuple[str | None, bool]:
        """Return what is wrong with a comparison, and whether it is open."""
        if [judged.objective for judged in trade.judged] != list(range(len(self.views))):
            return f"it must be judged under all {len(self.views)} objectives, in order", False
        is_open = False
        for view, judged in zip(self.views, trade.judged, strict=True):
            flaw, not_known = self._judged(step, view, judged)
            if flaw:
                return f"under objective {judged.objective + 1} {flaw}", False
            is_open |= not_known
        if {judged.other.choice for judged in trade.judged} != {trade.judged[0].other.choice}:
            return "it must be compared with one action", False
        if _claim({judged.relation for judged in trade.judged}) != trade.claim:
            return "it does not follow from its evidence", False
        return None, is_open

    def _judged(self, step: Step, view: View, judged: Judged) -> tuple[str | None, bool]:
        """Return what is wrong with a comparison under one objective, and whether it is open."""
        others = [c for c in self.levels.first.mdp.choices_of(step.state) if c != step.choice]
        if judged.taken.choice != step.choice or judged.other.choice not in others:
            return "the choice taken must be compared with another of the state", False
        open_ = False
        for row in (judged.taken, judged.other):
            flaw = self._row(step.state, view, row)
            if flaw:
                return f"the number of '{row.action}' {flaw}", False
            own = view.number(step.state, row.choice)[0]
            open_ |= vague(row.number, own, self.levels, view.measures)
        told = self._relation(view, judged.taken.number, judged.other.number)
        if told != judged.relation:
            return f"it is {told} by its numbers, got {judged.relation}", False
        own, other = (view.number(step.state, row.choice)[0] for row in (judged.taken, judged.other))
        known = self._relation(view, own, other)
        if "open" not in (known, told) and known != told:
            return f"it is {known} on the model, got {told}", False
        return None, open_ or (known == "open" and told != "open")

    def _row(self, state: int, view: View, row: Measured) -> str | None:
        own, silent = view.number(state, row.choice)
        flaw = disagreement(row.number, own, self.levels, view.measures, silent=silent)
        fate, known = view.fate(state, row.choice)
        if flaw is None and known and row.fate != fate:
            return f"means '{fate}', got '{row.fate}'"
        return flaw

    def _relation(self, view: View, own: Interval, other: Interval) -> str:
        found = order(own, other, self.told.question.tolerance)
        if found in (Order.EQUAL, Order.OPEN):
            return str(found.value)
        return "better" if (found is Order.GREATER) == view.measures.frame.maximise else "worse"

    def _together(self, step: Step) -> str | None:
        """Return what is wrong with the comparisons of a step taken together."""
        asked, got = self.told.question, [trade.judged[0].other.choice for trade in step.trades]
        selective = asked.scope == "route" and "selectiveness" in asked.factors
        mdp = self.levels.first.mdp
        others = [choice for choice in mdp.choices_of(step.state) if choice != step.choice]
        if not self.told.also or "responsibility" not in asked.factors or (selective and step.critical is False):
            others = []
        elif step.foil is not None:
            others = [choice for choice in others if mdp.action_name(choice) == step.foil]
        return None if got == others else f"comparisons must be with {others}, each once and in order, got {got}"


def _claim(relations: set[str]) -> str:
    """Return what may be claimed where an alternative stands so to the choice taken under all objectives together."""
    if {"better", "worse"} <= relations:
        return "trade"
    if "open" in relations:
        return "open"
    if relations == {"equal"}:
        return "indifferent"
    return "dominated" if "worse" in relations else "better on all"
