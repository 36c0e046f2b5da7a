"""A Solution and a question enter, an Explanation leaves: the three factors are computed and the claims decided."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ratherthan.errors import PolicyError, QuestionError
from ratherthan.explain.claims import flexibility, flexibility_against
from ratherthan.explain.explanation import Alternative, Claim, Closing, Explanation, Measured, Step, Trade
from ratherthan.explain.few import left_out, selected
from ratherthan.explain.further import View, further_objectives, views_of
from ratherthan.explain.levels import Judges
from ratherthan.explain.measures import Factors
from ratherthan.explain.obstacles import in_the_way
from ratherthan.explain.openings import openings
from ratherthan.explain.question import Question, question
from ratherthan.explain.recording import recorded
from ratherthan.explain.route import PolicyGraph, Route, route_from
from ratherthan.explain.shared import arriving, graph_of, reached_from
from ratherthan.explain.trades import trade_of
from ratherthan.model.objective import Level, Objective
from ratherthan.solve.solution import Solution
from ratherthan.solve.solver import sharpened

__all__ = ["explain", "initial_state"]

MOST_NAMED = 20
"""How many states of a circle are named in the data."""


def explain(
    solution: Solution,
    kind: str | None = None,
    *,
    also: str | Objective | Iterable[str | Objective] = (),
    asked: Question | None = None,
    **details: Any,
) -> Explanation:
    """Explain a solution's policy.

    Parameters
    ----------
    solution : Solution
        Of `solve` (the optimum) or `evaluate` (a given policy).
    kind : str, optional
        One of the seven kinds: "none", "naive-state", "responsibility", "constrictive", "naive-path", "selective",
        "contrastive" (the default).
    also : iterable of str or objective
        Further objectives under which the plan and its alternatives are judged: objectives, properties, names of the
        source's own properties, or names of rewards, which mean the least of it until the goal of the plan's objective.
    asked : Question, optional
        A question made before; then neither `kind` nor `details` may be given.
    **details
        As in `ratherthan.explain.question.question`: scope, factors, state, rather_than, alpha, omega, policy_values,
        search.

    Returns
    -------
    Explanation

    Raises
    ------
    QuestionError
        If the question does not fit the model: an unknown action or state, several initial states and none chosen; or if
        `also` is no list of objectives.
    PolicyError
        If the policy says nothing at the state asked about.
    PropertyError
        If a further objective cannot be read, asks yes or no, has levels or memory, or stands twice.
    """
    if asked is None:
        asked = question(kind, **details)
    elif kind is not None or details:
        raise QuestionError("Give either a question or its parts, got both.")
    if isinstance(also, str | Objective):
        also = (also,)
    if not isinstance(also, Iterable):
        raise QuestionError(f"Further objectives must be a list of objectives or properties, got {also!r}.")
    wishes = further_objectives(solution, also)
    found = _Explainer(solution=solution, asked=asked, also=wishes).explanation()
    while any(step.critical is None for step in found.steps):  # narrower bounds may decide what is open
        finer = sharpened(solution)
        if finer is None:
            break
        solution, found = finer, _Explainer(solution=finer, asked=asked, also=wishes).explanation()
    return found


def initial_state(solution: Solution) -> int:
    """Return the only initial state.

    Raises
    ------
    QuestionError
        If the model has several; some are listed.
    """
    initial = solution.problem.mdp.initial
    if len(initial) == 1:
        return int(initial[0])
    names = solution.problem.mdp.names
    some = ", ".join(f"{int(s)} ('{names[int(s)]}')" if names.named else str(int(s)) for s in initial[:5])
    more = ", …" if len(initial) > 5 else ""
    raise QuestionError(
        f"A route must begin in one state, but the model has {len(initial)} initial states: {some}{more}. "
        "Pick one with --start STATE (start=… in Python)."
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Explainer:
    solution: Solution
    asked: Question
    also: tuple[Level, ...]

    @cached_property
    def factors(self) -> Factors:
        return Factors(solution=self.solution, asked=self.asked)

    @cached_property
    def judges(self) -> Judges:
        return Judges(factors=self.factors)

    @cached_property
    def views(self) -> tuple[View, ...]:
        return views_of(self.solution, self.also) if self.also else ()

    @property
    def graph(self) -> PolicyGraph:
        return graph_of(self.solution)

    def explanation(self) -> Explanation:
        start = initial_state(self.solution) if self.asked.state is None else self._known(self.asked.state)
        if self.asked.scope == "none":
            return self._record(start)
        if self.asked.scope == "state":
            return self._of_state(start)
        return self._of_route(start)

    def _known(self, state: int) -> int:
        if not 0 <= state < self.solution.problem.mdp.states:
            last = self.solution.problem.mdp.states - 1
            raise QuestionError(f"A state must be a number from 0 to {last}, got {state}.", state=state)
        return state

    def _of_state(self, state: int) -> Explanation:
        if self.solution.ended[state]:
            if self.asked.rather_than is not None:
                self._foil(state, -1)
            outcome = route_from(self.solution, self.graph, state).outcome
            return self._record(state, route_outcome=outcome)
        choices = self._taken(state)
        steps = tuple(self._step(state, choice, share, told=True) for choice, share in choices)
        return self._record(state, steps=steps)

    def _of_route(self, start: int) -> Explanation:
        route = route_from(self.solution, self.graph, start)
        steps = self._steps(route)
        if self.asked.at_most is not None:
            steps = selected(self.factors, route, steps)
        return self._record(
            start,
            route=route.states,
            route_outcome=route.outcome,
            route_probability=min(1.0, route.probability),
            arrival=None if route.outcome == "open end" else arriving(self.solution, start),
            circle=route.circle[:MOST_NAMED],
            circle_size=len(route.circle),
            circle_certain=route.certain,
            **(self._blocked(start) if route.outcome == "no way" else {}),
            totals=tuple(view.value(start) for view in self.views),
            steps=steps,
            closing=self._closing(route, steps),
        )

    def _blocked(self, start: int) -> dict[str, Any]:
        """Return the hazards in the way, or the closed cells of the map that would have to open."""
        hazards = in_the_way(self.solution, start)
        return {"in_the_way": hazards, "openings": () if hazards else openings(self.solution, start)}

    def _steps(self, route: Route) -> tuple[Step, ...]:
        """Return the steps of a route; claims only where a sentence may be said of them."""
        selective, mdp, chance = (
            "selectiveness" in self.asked.factors,
            self.solution.problem.mdp,
            self.solution.policy.chance,
        )
        rows = list(zip(route.states, route.choices, strict=False))
        told = {state: not selective or self.factors.critical.of(state) is not False for state, _ in rows}
        if "constrictiveness" in self.asked.factors:
            self.factors.counts(other for state, _ in rows if told[state] for other in mdp.choices_of(state))
        return tuple(
            self._step(state, choice, 1.0 if chance is None else float(chance[choice]), told=told[state])
            for state, choice in rows
        )

    def _taken(self, state: int) -> list[tuple[int, float]]:
        """Return the choices the policy takes in a state, with their shares, the most frequent first."""
        policy, own = self.solution.policy, self.solution.problem.mdp.choices_of(state)
        if policy.chance is not None:
            shares = [(c, float(policy.chance[c])) for c in own if policy.chance[c] > 0]
            taken = sorted(shares, key=lambda pair: (-pair[1], pair[0]))
        else:
            taken = [(int(policy.choice[state]), 1.0)] if policy.choice[state] >= 0 else []
        if not taken:
            name = self.solution.problem.mdp.names[state]
            raise PolicyError(
                f"The policy must say what to do in the state asked about, but it says nothing at state {state} ('{name}'). "
                "Add an entry for it.",
                state=state,
            )
        return taken[:1]

    def _step(self, state: int, choice: int, share: float, *, told: bool) -> Step:
        mdp = self.solution.problem.mdp
        selective = "selectiveness" in self.asked.factors
        foil = None if self.asked.rather_than is None else self._foil(state, choice)
        others = [foil] if foil is not None else [c for c in mdp.choices_of(state) if c != choice]
        critical = self.factors.critical.of(state) if selective else False
        return Step(
            state=state,
            choice=choice,
            choice_index=choice - mdp.choices_of(state).start,
            action=mdp.action_name(choice),
            share=share,
            critical=critical,
            spread=self.judges.spread(state) if selective else None,
            further_spreads=self.factors.further_spreads(state) if selective else (),
            claims=tuple(self._claims(state, choice, foil)) if told else (),
            trades=self._trades(state, choice, others) if told else (),
            foil=None if foil is None else mdp.action_name(foil),
            alternatives=self._alternatives(others) if foil is not None or (told and critical is not False) else (),
            numbers=self._numbers(state, choice, others) if told and self.asked.detail else (),
        )

    def _alternatives(self, others: Sequence[int]) -> tuple[Alternative, ...]:
        """Return where each of other choices most likely leads, the first listed branch of several."""
        mdp, found = self.solution.problem.mdp, []
        for other in others:
            branches = mdp.branches_of(other)
            likeliest = int(np.argmax(mdp.branch_to_probability[branches]))
            towards = int(mdp.branch_to_target[branches][likeliest])
            found.append(Alternative(action=mdp.action_name(other), towards=towards))
        return tuple(found)

    def _numbers(self, state: int, choice: int, others: Sequence[int]) -> tuple[tuple[Measured, ...], ...]:
        """Return what the choice taken and others come to at each level that has not ended there."""
        if self.solution.ended[state]:
            return ()
        running = [
            judge for judge in self.judges.levels if judge.level == 0 or not self.factors.ended[judge.level][state]
        ]
        return tuple(tuple(judge.measured(one) for one in (choice, *others)) for judge in running)

    def _claims(self, state: int, choice: int, foil: int | None) -> list[Claim]:
        """Return the claims of one step."""
        outcome, counted = "responsibility" in self.asked.factors, "constrictiveness" in self.asked.factors
        if foil is not None:
            claims = self.judges.contrast(state, choice, foil) if outcome else []
            if counted:
                claims += flexibility_against(self.solution, choice, foil, self.factors.counts([choice, foil]))
            return claims
        claims = self.judges.outcome(state, choice) if outcome else []
        if counted:
            counts = self.factors.counts(self.solution.problem.mdp.choices_of(state))
            claims += flexibility(self.solution, state, choice, counts)
        return claims

    def _trades(self, state: int, choice: int, others: Sequence[int]) -> tuple[Trade, ...]:
        """Return how the choice taken compares with each of others under all objectives."""
        if not self.also or "responsibility" not in self.asked.factors:
            return ()
        tolerance = self.asked.tolerance
        return tuple(trade_of(self.views, state, choice, other, tolerance=tolerance) for other in others)

    def _foil(self, state: int, choice: int) -> int:
        """Return the choice that the foil names."""
        mdp, wanted = self.solution.problem.mdp, self.asked.rather_than
        names = {mdp.action_name(other): other for other in mdp.choices_of(state)}
        where = f"state {state}" + (f" ('{mdp.names[state]}')" if mdp.names.named else "")
        if self.solution.ended[state]:
            raise QuestionError(f"Nothing is left to decide at {where}: the objective has ended there.", state=state)
        if wanted not in names:
            raise QuestionError(
                f"'rather than' must name an action of {where}, one of {', '.join(names)}; got '{wanted}'.",
                state=state,
                action=wanted,
            )
        if names[wanted] == choice:
            others = ", ".join(name for name in names if name != wanted) or "there is no other"
            raise QuestionError(
                f"'rather than' must name another action than the one taken; '{wanted}' is taken at {where} "
                f"(others: {others}).",
                state=state,
                action=wanted,
            )
        return names[wanted]

    def _closing(self, route: Route, steps: tuple[Step, ...]) -> Closing:
        """Return what holds of the steps that are not told, and how many critical states lie off the route."""
        if "selectiveness" not in self.asked.factors or route.outcome not in ("arrives", "circles", "open end"):
            return Closing()
        untold = sorted({step.state for step in steps if step.critical is False})
        equal = all(self.judges.equivalent(state) for state in untold)
        largest = None if not untold else 0.0 if equal else self._largest_difference(untold)
        reachable = reached_from(self.solution, route.states[0]).copy()
        reachable[list(route.states)] = False
        certain = int((self.factors.critical.certain & reachable).sum())
        return Closing(
            printed=bool(untold) and (equal or (self.asked.alpha > 0 and largest is not None)),
            largest_difference=largest,
            off_route=certain,
            off_route_open=int((self.factors.critical.possible & reachable).sum()) - certain,
            left_out=left_out(self.judges, steps),
        )

    def _largest_difference(self, untold: list[int]) -> float | None:
        """Return by how much the untold decisions change the first level at most; None where that is open, or nothing."""
        spreads = [self.judges.difference(state) for state in untold]
        if not all(number.finite for spread in spreads for number in spread):
            return None
        return max(high.upper - low.lower for high, low in spreads) or None  # it is a further level that they change

    def _record(self, start: int, **parts: Any) -> Explanation:
        return recorded(self.solution, self.asked, self.also, start, **parts)
