"""A stored explanation and a model enter, Verdicts leave: every part is re-derived from the model and compared.

What is checked, field by field
-------------------------------
Refused at once (ExplanationError), whatever the model: a document that has not the form of the schema or is of another
``version``; a ``digest`` that is not that of the content; a ``text`` that is not what the data say, with the words of the
``lexicon``; a ``kind`` that is not the name of ``scope``, ``factors`` and ``rather_than``; a ``tolerance`` above one per cent;
an unknown ``outcome``; names of actions in ``against`` that are not those of the evidence; a ``property`` that does not fit
the model, or an ``objective`` that says something else; ``states`` that are not the model's, or are called otherwise or lie
elsewhere; ``choice``, ``choice_index``, ``action``, ``state_name`` and ``foil`` of a step that do not belong together.

Compared with the model, each with a verdict:

==============================  =====================================================================================
``model``                       the numbers of states, choices and branches
``start``, ``state``            the state asked about, else an initial state
``policy``                      choices of the model, shares that sum to 1, the states it reaches and no others; where it
                                is not ``given``, its values must be the optimum (which of several is not prescribed)
``route``, ``route_outcome``    a path of the policy from the start, with its outcome; the most probable one, of several
                                the first listed
``circle`` …, ``in_the_way``    where the policy goes round for ever; what can be reached at all; hazards on a shortest way
``route_probability``           the product along the route
``arrival_probability``         with its bounds: the chance that the policy arrives
``steps``                       the choice is the policy's, with its ``share``; ``critical`` and ``spread`` under ``alpha``,
                                ``impact``, ``values`` and ``tolerance``; every claim (`claims`), its numbers, counts
                                (``search``), alternatives and successors
``closing``                     printed, largest_difference, off_route, off_route_open
==============================  =====================================================================================

Left undecided: words that are not the model's own, unless the same lexicon is given. Not compared: ``source``, which is only
where the model came from, and fields that do not matter to the question, such as ``alpha`` where no critical state is spoken
of. What the explanation leaves unsaid is
no fault of it, but an alternative or a detail that it must name is.

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

import numpy as np

from ratherthan.explain.explanation import Explanation
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.objective import Objective
from ratherthan.model.problem import Problem
from ratherthan.verify.candidates import Budget
from ratherthan.verify.claims import StepCheck
from ratherthan.verify.closing import ClosingCheck
from ratherthan.verify.document import OUTCOMES, load, objective_of, refuse_foreign, refuse_retold
from ratherthan.verify.frame import Frame, frame_of
from ratherthan.verify.measure import Measures, Tree
from ratherthan.verify.policy import PolicyCheck
from ratherthan.verify.route import RouteCheck
from ratherthan.verify.values import Band, arriving, following, optimum
from ratherthan.verify.verdict import Check, Verdict, Verdicts

__all__ = ["verify"]

SLACK = 1e-5
"""A certified number is known to about 1e-6 of itself or better; what is decided with ten times that must be decided."""
LOSS = 1e-9
"""By which share of itself the value of a policy that counts as optimal may miss the optimum, where it is not listed."""


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
    mdp = problem.mdp
    if told.size != (mdp.states, mdp.choices, mdp.branches):
        got = f"it has {mdp.states} states, {mdp.choices} choices and {mdp.branches} branches"
        reason = f"{got}; the explanation is of {told.size[0]}, {told.size[1]} and {told.size[2]}"
        return Verdicts(checks=(Check(what="model", where="", verdict=Verdict.FAILS, reason=reason),))
    wanted = objective_of(told, problem)
    refuse_foreign(told, problem)
    refuse_retold(told, text)
    return Verdicts(checks=tuple(_Recheck.of(told, problem, wanted, budget or Budget()).checks()))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Recheck:
    """Everything that is re-derived for one explanation, on first use."""

    told: Explanation
    frame: Frame
    initial: frozenset[int]
    budget: Budget
    lexicon: Lexicon

    @staticmethod
    def of(told: Explanation, problem: Problem, wanted: Objective, budget: Budget) -> _Recheck:
        """Set the re-check of an explanation up."""
        frame, initial = frame_of(problem, wanted), frozenset(map(int, problem.mdp.initial))
        return _Recheck(told=told, frame=frame, initial=initial, budget=budget, lexicon=problem.lexicon)

    def checks(self) -> list[Check]:
        """Return all checks in the order of the document."""
        told = self.told
        found = [
            self._check("model", None),
            self._words(),
            self._check("start", self._start()),
            self.policy.entries(),
        ]
        if found[-1].verdict is Verdict.FAILS:
            return found
        if not told.policy.given:
            found.append(self.policy.attains(self.best, self.followed))
        if told.question.scope == "route":
            found += RouteCheck(
                frame=self.frame, moves=self.policy.moves, explanation=told, arrival=self.arrival, slack=self.slack
            ).checks()
        else:
            found.append(self._check("route_outcome", self._no_route()))
        for step in told.steps:
            found.append(self.policy.step(step))
            found += StepCheck(
                frame=self.frame,
                asked=told.question,
                measures=self.measures,
                best=self.best,
                followed=self.followed,
                given=told.policy.given,
                step=step,
            ).checks()
        reached = self.policy.reached([told.start])
        found.append(ClosingCheck(told=told, measures=self.measures, reached=reached).check())
        return found

    def _check(self, what: str, reason: str | None) -> Check:
        verdict = Verdict.FAILS if reason else Verdict.HOLDS
        return Check(what=what, where="", verdict=verdict, reason=reason or "")

    @cached_property
    def policy(self) -> PolicyCheck:
        """The policy that is listed."""
        return PolicyCheck(frame=self.frame, told=self.told, initial=self.initial)

    @cached_property
    def best(self) -> Band:
        """Bounds of the optimum ρ."""
        return optimum(self.frame, self.budget)

    @cached_property
    def followed(self) -> Band:
        """Bounds of ρ^π, the value of the policy that is listed."""
        return following(self.frame, self.policy.weight, self.budget)

    @cached_property
    def slack(self) -> float:
        """By which share of itself a number may be less well known in the explanation."""
        return SLACK if self.told.outcome == OUTCOMES[0] else math.inf

    @cached_property
    def measures(self) -> Measures:
        """The numbers that count for the question."""
        asked = self.told.question
        return Measures(
            frame=self.frame,
            band=self._judging() if asked.policy_values else self.best,
            omega=asked.omega,
            alpha=asked.alpha,
            tolerance=asked.tolerance,
            tree=Tree(horizon=asked.search.horizon, toward_goal=asked.search.toward_goal),
            slack=self.slack,
        )

    def _judging(self) -> Band:
        """Return ρ^π; an optimal policy attains ρ also where it is not listed, but for rounding."""
        if self.told.policy.given:
            return self.followed
        known, best = self.policy.said | ~self.frame.running, self.best
        finite = np.isfinite(best.upper)
        lower = np.where(finite, best.lower * (1 - LOSS), best.lower)
        upper = np.where(finite, np.where(finite, best.upper, 0.0) * (1 + LOSS), best.upper)
        return Band(
            lower=np.where(known, self.followed.lower, lower), upper=np.where(known, self.followed.upper, upper)
        )

    @cached_property
    def arrival(self) -> Band | None:
        """Bounds of the chance that the policy arrives; None where the objective has no goal."""
        if self.frame.risk and self.frame.running[self.told.start]:
            return None
        return arriving(self.frame, self.policy.weight, self.budget)

    def _words(self) -> Check:
        """Check the words: what others than the model's own mean cannot be decided."""
        if self.told.lexicon == self.lexicon:
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
            expected = "there" if frame.goal[told.start] and not frame.risk else "ended"
        if told.route_outcome != expected:
            return f"it is '{expected}', got '{told.route_outcome}'"
        if told.circle or told.circle_size or told.in_the_way or not told.circle_certain:
            return "nothing can be said of a route that was not asked for"
        states = [told.start] if told.question.scope == "state" and expected == "none" else []
        if [step.state for step in told.steps] != states:
            return f"there must be steps at the states {states}, got {[step.state for step in told.steps]}"
        return None
