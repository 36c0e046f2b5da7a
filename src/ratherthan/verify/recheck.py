"""A stored explanation and a model enter, Verdicts leave: every part is re-derived from the model and compared.

What is checked, field by field
-------------------------------
Refused at once (ExplanationError), whatever the model: a document that has not the form of the schema or is of another
``version``; a ``digest`` that is not that of the content; a ``text`` that is not what the data say, with the words of the
``lexicon``; a ``kind`` that is not the name of ``scope``, ``factors`` and ``rather_than``; a ``tolerance`` above 0.0001;
an unknown ``outcome``; names of actions in ``against`` that are not those of the evidence; a ``property`` that does not fit
the model, or ``objective`` and ``levels`` that say something else; further objectives (``also``) likewise; ``states`` that are
not the model's, or are called otherwise or lie elsewhere; ``choice``, ``choice_index``, ``action``, ``state_name`` and ``foil``
of a step that do not belong together; ``unfolded`` numbers that are not those of the product; a ``world`` that is not the
model's map, and ``alternatives`` that are no other actions of their state or lead elsewhere (`shown`).

Compared with the model, each with a verdict:

==============================  =====================================================================================
``product``                     for a mission: the model with what must be remembered, built anew (`product`, `missions`)
``model``                       the numbers of states, choices and branches
``names``                       of states of a product: over where they are over, and how many steps are left
``start``, ``state``            the state asked about, else an initial state
``policy``                      choices of the model, shares that sum to 1, the states it reaches and no others; where it
                                is not ``given``, its values must be the optimum (which of several is not prescribed)
``route``, ``route_outcome``    a path of the policy from the start, with its outcome; the most probable one, of several
                                the first listed
``circle`` …, ``in_the_way``    where the policy goes round for ever; what can be reached at all; hazards on a shortest way
``openings``                    closed cells of a map: with them open there is a way, and no fewer would do
``route_probability``           the product along the route
``arrival_probability``         with its bounds: the chance that the policy arrives
``totals``                      what the whole plan comes to under each objective
``steps``                       the choice is the policy's, with its ``share``; ``critical``, ``spread`` and
                                ``further_spreads`` under ``alpha``, ``impact``, ``values`` and ``tolerance``; every claim at
                                its ``level`` (`claims`), its numbers, counts (``search``), alternatives and successors;
                                ``trades`` with every other action (`trades`)
``told``, ``rank``              where there are few sentences: that those steps are told that rank highest, and the ranks (`few`)
``numbers``                     what each alternative comes to at each level, where details are given
``left out``                    how many steps are not told that matter, and by how much they differ at most
``closing``                     printed, largest_difference, off_route, off_route_open
==============================  =====================================================================================

Left undecided: words that are not the model's own, unless the same lexicon is given; a product that is too large to be built
again; what a further level rests on where it is not plain which choices are best at the level before: they differ by less than
a ten-millionth and more than rounding, or more and more can be gathered with them; or where no one plan is known to attain all
levels (`attained`). Large models in which a run can go round for rewards of both signs that cancel are undecided, too. And a
number that contains the truth, but is known less well than it could be: only one that says next to nothing is a forgery.
Not compared: ``source``, which is only where the model came from, and fields that do not matter to the question, such as
``alpha`` where no critical state is spoken of. What the explanation leaves unsaid is no fault of it, but an alternative or a
detail that it must name is.

Nothing of the code that made the explanation is used: values are bounded by exact policy iteration or by sweeps (`values`),
everything else by plain searches.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ratherthan.explain.explanation import Explanation
from ratherthan.model.objective import Level
from ratherthan.model.problem import Problem
from ratherthan.verify.candidates import Budget
from ratherthan.verify.closing import ClosingCheck
from ratherthan.verify.document import OUTCOMES, load, refuse_foreign, refuse_retold
from ratherthan.verify.few import FewCheck
from ratherthan.verify.frame import Frame
from ratherthan.verify.levels import Levels, levels_on
from ratherthan.verify.missions import TooLargeError
from ratherthan.verify.policy import PolicyCheck
from ratherthan.verify.product import misnamed, unfolded_for
from ratherthan.verify.route import RouteCheck
from ratherthan.verify.shown import refuse_foreign_pictures
from ratherthan.verify.steps import StepCheck
from ratherthan.verify.trades import TradeCheck, View, views_of
from ratherthan.verify.values import Band, arriving
from ratherthan.verify.verdict import Check, Verdict, Verdicts
from ratherthan.verify.wanted import further_of, objective_of

__all__ = ["verify"]

SLACK = 1e-5
"""A certified number is known to about 1e-6 of itself or better; what is decided with ten times that must be decided."""


def verify(document: Mapping[str, Any] | str | Path, problem: Problem, *, budget: Budget | None = None) -> Verdicts:
    """Check every part of a stored explanation against a model.

    Parameters
    ----------
    document : mapping, str or Path
        The explanation as a JSON document, or the path of one.
    problem : Problem
        The model; its own objective does not matter.
    budget : Budget, optional
        How much work may be done before a number is left open.

    Returns
    -------
    Verdicts

    Raises
    ------
    ExplanationError
        If the document is broken, was tampered with, or speaks of states and actions that the model has not.
    """
    told, text = load(document)
    wanted = objective_of(told, problem)
    further = further_of(told, problem, wanted)
    try:
        problem, flaw = unfolded_for(problem, wanted)
    except TooLargeError:
        refuse_retold(told, text)
        reason = "there is more to be remembered on the way than was gone through"
        return Verdicts(checks=(Check(what="product", where="", verdict=Verdict.UNDECIDED, reason=reason),))
    if flaw is not None:
        return Verdicts(checks=(Check(what="product", where="", verdict=Verdict.FAILS, reason=flaw),))
    mdp = problem.mdp
    if told.size != (mdp.states, mdp.choices, mdp.branches):
        got = f"it has {mdp.states} states, {mdp.choices} choices and {mdp.branches} branches"
        reason = f"{got}; the explanation is of {told.size[0]}, {told.size[1]} and {told.size[2]}"
        return Verdicts(checks=(Check(what="model", where="", verdict=Verdict.FAILS, reason=reason),))
    refuse_foreign(told, problem)
    refuse_retold(told, text)
    frames = levels_on(problem, wanted)
    refuse_foreign_pictures(told, problem, frames[0])
    recheck = _Recheck(told=told, problem=problem, frames=frames, further=further, budget=budget or Budget())
    return Verdicts(checks=tuple(recheck.checks()))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Recheck:
    """Everything that is re-derived for one explanation, on first use."""

    told: Explanation
    problem: Problem
    frames: tuple[Frame, ...]
    further: tuple[Level, ...]
    budget: Budget

    @property
    def frame(self) -> Frame:
        """The frame of the first level."""
        return self.frames[0]

    @cached_property
    def initial(self) -> frozenset[int]:
        """The initial states of the model."""
        return frozenset(map(int, self.problem.mdp.initial))

    def checks(self) -> list[Check]:
        """Return all checks in the order of the document."""
        told = self.told
        found = [
            *([self._check("product", None)] if self.problem.unfolding is not None else []),
            self._check("model", None),
            self._words(),
            self._check("names", misnamed(self.problem, told.states)),
            self._check("start", self._start()),
            self.policy.entries(),
        ]
        if found[-1].verdict is Verdict.FAILS:
            return found
        if not told.policy.given:
            found.append(self.policy.attains(self.levels))
        if told.question.scope == "route":
            found += RouteCheck(
                problem=self.problem,
                frame=self.frame,
                moves=self.policy.moves,
                explanation=told,
                arrival=self.arrival,
                slack=self.slack,
            ).checks()
        else:
            found.append(self._check("route_outcome", self._no_route()))
        trades = TradeCheck(told=told, levels=self.levels, views=self._views())
        found.append(trades.totals())
        for step in told.steps:
            found.append(self.policy.step(step))
            found += StepCheck(levels=self.levels, step=step).checks()
            found += trades.checks(step)
        found += FewCheck(told=told, levels=self.levels).checks()
        reached = self.policy.reached([told.start])
        found.append(ClosingCheck(told=told, levels=self.levels, reached=reached).check())
        return found

    def _check(self, what: str, reason: str | None) -> Check:
        verdict = Verdict.FAILS if reason else Verdict.HOLDS
        return Check(what=what, where="", verdict=verdict, reason=reason or "")

    @cached_property
    def policy(self) -> PolicyCheck:
        """The policy that is listed."""
        return PolicyCheck(frame=self.frame, told=self.told, initial=self.initial)

    @cached_property
    def slack(self) -> float:
        """By which share of itself a number may be less well known in the explanation."""
        return SLACK if self.told.outcome == OUTCOMES[0] else math.inf

    @cached_property
    def levels(self) -> Levels:
        """The numbers of all levels."""
        told = self.told
        return Levels(
            frames=self.frames,
            asked=told.question,
            weight=self.policy.weight,
            given=told.policy.given,
            slack=self.slack,
            budget=self.budget,
        )

    @cached_property
    def arrival(self) -> Band | None:
        """Bounds of the chance that the policy arrives; None where the objective has no goal."""
        if self.frame.aimless and self.frame.running[self.told.start]:
            return None
        return arriving(self.frame, self.policy.weight, self.budget)

    def _views(self) -> tuple[View, ...]:
        """Return the plan under each of its own levels and each further objective, where there are any."""
        return views_of(self.levels, self.problem, self.further) if self.further else ()

    def _words(self) -> Check:
        """Check the words: what others than the model's own mean cannot be decided."""
        if self.told.lexicon == self.problem.lexicon:
            return Check(what="words", where="", verdict=Verdict.HOLDS)
        reason = "they are not the model's own; where they were given with a lexicon, give the same one here"
        return Check(what="words", where="", verdict=Verdict.UNDECIDED, reason=reason)

    def _start(self) -> str | None:
        told = self.told
        if told.question.state is not None or told.start in self.initial:
            return None
        return f"it must be an initial state, {sorted(self.initial)[:5]}, got {told.start}"

    def _no_route(self) -> str | None:
        """Return what is wrong where no route was asked for."""
        told, frame = self.told, self.frame
        expected = "none"
        if told.question.scope == "state" and not frame.running[told.start]:
            expected = "there" if frame.goal[told.start] and not frame.aimless else "ended"
        if told.route_outcome != expected:
            return f"it is '{expected}', got '{told.route_outcome}'"
        if told.circle or told.circle_size or told.in_the_way or told.openings or not told.circle_certain:
            return "nothing can be said of a route that was not asked for"
        states = [told.start] if told.question.scope == "state" and expected == "none" else []
        if [step.state for step in told.steps] != states:
            return f"there must be steps at the states {states}, got {[step.state for step in told.steps]}"
        return None
