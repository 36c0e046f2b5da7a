"""A Solution and a question enter, an Explanation leaves: the three factors are computed and the claims decided."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ratherthan.errors import PolicyError, QuestionError
from ratherthan.explain.claims import Judge
from ratherthan.explain.explanation import (
    Closing,
    Explanation,
    ObjectiveRecord,
    PolicyRecord,
    StateRecord,
    Step,
)
from ratherthan.explain.question import Question, question
from ratherthan.explain.route import PolicyGraph, Route, policy_graph, reachable_at_all, route_from
from ratherthan.factors import (
    Constrictiveness,
    Criticality,
    Interval,
    Responsibility,
    constrictiveness,
    critical_states,
    nearer_goal,
    responsibility,
)
from ratherthan.model.objective import ExpectedCost, Objective, ReachAvoid
from ratherthan.solve.solution import Solution
from ratherthan.solve.solver import arrival

__all__ = ["Factors", "explain", "initial_state"]

MOST_NAMED = 20
"""How many states of a circle are named in the data."""


def explain(
    solution: Solution, kind: str | None = None, *, asked: Question | None = None, **details: Any
) -> Explanation:
    """Explain a solution's policy.

    Parameters
    ----------
    solution : Solution
        Of `solve` (the optimum) or `evaluate` (a given policy).
    kind : str, optional
        One of the seven kinds: "none", "naive-state", "responsibility", "constrictive", "naive-path", "selective",
        "contrastive" (the default).
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
        If the question does not fit the model: an unknown action or state, several initial states and none chosen.
    PolicyError
        If the policy says nothing at the state asked about.
    """
    if asked is None:
        asked = question(kind, **details)
    elif kind is not None or details:
        raise QuestionError("Give either a question or its parts, got both.")
    return _Explainer(solution=solution, asked=asked).explanation()


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
class Factors:
    """The factors of a solution under one question, computed on first use and shared."""

    solution: Solution
    asked: Question

    @cached_property
    def measures(self) -> Responsibility:
        """Impact, action values and responsibility of every choice."""
        return responsibility(self.solution, policy_values=self.asked.policy_values)

    @cached_property
    def critical(self) -> Criticality:
        """The critical states."""
        return critical_states(
            self.solution.problem.mdp,
            self.measures,
            self.solution.ended,
            alpha=self.asked.alpha,
            omega=self.asked.omega,
            tolerance=self.asked.tolerance,
        )

    def counts(self, choices: Iterable[int]) -> dict[int, Constrictiveness]:
        """Return how many decisions each of `choices` leaves open."""
        solution = self.solution
        if self.asked.policy_values:
            lower, upper = solution.policy_lower[0], solution.policy_upper[0]
        else:
            lower, upper = solution.lower[0], solution.upper[0]
        toward = nearer_goal(lower, upper, maximise=solution.objectives[0].maximise, tolerance=self.asked.tolerance)
        return constrictiveness(
            self.solution.problem.mdp,
            self.critical,
            self.solution.ended,
            choices,
            search=self.asked.search,
            nearer=toward if self.asked.search.toward_goal else None,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Explainer:
    solution: Solution
    asked: Question

    @cached_property
    def factors(self) -> Factors:
        return Factors(solution=self.solution, asked=self.asked)

    @cached_property
    def judge(self) -> Judge:
        return Judge(solution=self.solution, measures=self.factors.measures, asked=self.asked)

    @cached_property
    def graph(self) -> PolicyGraph:
        return policy_graph(self.solution)

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
        lower, upper = arrival(
            self.solution.problem.mdp, self.solution.policy, self.solution.goal, self.solution.hazard
        )
        low, high = max(0.0, float(lower[start])), min(1.0, float(upper[start]))
        arriving = Interval(value=(low + high) / 2, lower=low, upper=high)
        return self._record(
            start,
            route=route.states,
            route_outcome=route.outcome,
            route_probability=min(1.0, route.probability),
            arrival=None if route.outcome == "open end" else arriving,
            circle=route.circle[:MOST_NAMED],
            circle_size=len(route.circle),
            circle_certain=route.certain,
            in_the_way=self._in_the_way(start) if route.outcome == "no way" else (),
            steps=steps,
            closing=self._closing(route, steps),
        )

    def _steps(self, route: Route) -> tuple[Step, ...]:
        """Return the steps of a route; claims only where a sentence may be said of them."""
        selective = "selectiveness" in self.asked.factors
        steps = []
        for state, choice in zip(route.states, route.choices, strict=False):
            told = not selective or self.factors.critical.of(state) is not False
            share = float(self.solution.policy.weights(self.solution.problem.mdp)[choice]) if self._random else 1.0
            steps.append(self._step(state, choice, share, told=told))
        return tuple(steps)

    @property
    def _random(self) -> bool:
        return self.solution.policy.chance is not None

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
        mdp, factors = self.solution.problem.mdp, self.asked.factors
        selective = "selectiveness" in factors
        claims = []
        foil = None if self.asked.rather_than is None else self._foil(state, choice)
        if foil is not None:
            counts = self.factors.counts([choice, foil]) if "constrictiveness" in factors else None
            claims = self.judge.contrast(choice, foil, counts)
        elif told:
            if "responsibility" in factors:
                claims += self.judge.outcome(state, choice)
            if "constrictiveness" in factors:
                claims += self.judge.flexibility(state, choice, self.factors.counts(mdp.choices_of(state)))
        return Step(
            state=state,
            choice=choice,
            choice_index=choice - mdp.choices_of(state).start,
            action=mdp.action_name(choice),
            share=share,
            critical=self.factors.critical.of(state) if selective else False,
            spread=self.judge.spread(state) if selective else None,
            claims=tuple(claims),
            foil=None if foil is None else mdp.action_name(foil),
        )

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
        equal = all(self.judge.equivalent(state) for state in untold)
        largest = None if not untold else 0.0 if equal else self._largest_difference(untold)
        reachable = self.graph.reachable(route.states[0])
        reachable[list(route.states)] = False
        certain = int((self.factors.critical.certain & reachable).sum())
        return Closing(
            printed=bool(untold) and (equal or (self.asked.alpha > 0 and largest is not None)),
            largest_difference=largest,
            off_route=certain,
            off_route_open=int((self.factors.critical.possible & reachable).sum()) - certain,
        )

    def _largest_difference(self, untold: list[int]) -> float | None:
        spreads = [self.judge.difference(state) for state in untold]
        if not all(number.finite for spread in spreads for number in spread):
            return None
        return max(high.value - low.value for high, low in spreads)

    def _in_the_way(self, start: int) -> tuple[int, ...]:
        """Return the hazards on a shortest path to a goal that passes through hazards, if there is such a path."""
        if not self.solution.hazard.any():
            return ()
        mdp = self.solution.problem.mdp
        before = {start: -1}
        layer = [start]
        while layer:
            following = []
            for state in layer:
                first = mdp.choice_to_branches[mdp.state_to_choices[state]]
                last = mdp.choice_to_branches[mdp.state_to_choices[state + 1]]
                for target in map(int, mdp.branch_to_target[first:last]):
                    if target in before:
                        continue
                    before[target] = state
                    if self.solution.goal[target]:
                        return self._hazards_on(before, target)
                    following.append(target)
            layer = following
        return ()

    def _hazards_on(self, before: dict[int, int], state: int) -> tuple[int, ...]:
        path = []
        while state >= 0:
            path.append(state)
            state = before[state]
        return tuple(s for s in reversed(path) if self.solution.hazard[s])

    def _record(self, start: int, **parts: Any) -> Explanation:
        mdp, problem = self.solution.problem.mdp, self.solution.problem
        steps: tuple[Step, ...] = parts.get("steps", ())
        mentioned = {start, *parts.get("route", ()), *parts.get("circle", ()), *parts.get("in_the_way", ())}
        for step in steps:
            mentioned |= {step.state} | {state for claim in step.claims for state, _, _ in claim.evidence.follows}
        return Explanation(
            source=problem.source,
            property=self.solution.objectives[0].text,
            objective=_objective_record(self.solution.objectives[0]),
            question=self.asked,
            start=start,
            states={state: self._state_record(state) for state in sorted(mentioned)},
            size=(mdp.states, mdp.choices, mdp.branches),
            policy=self._policy_record(mentioned),
            lexicon=problem.lexicon,
            outcome=self.solution.outcome.value,
            **parts,
        )

    def _state_record(self, state: int) -> StateRecord:
        problem = self.solution.problem
        place = None if problem.world is None else problem.world.place(state)
        return StateRecord(name=problem.mdp.names[state], named=problem.mdp.names.named, place=place)

    def _policy_record(self, mentioned: set[int]) -> PolicyRecord:
        seen = np.zeros(self.graph.states, dtype=bool)
        for state in sorted(mentioned):
            if not seen[state]:  # judged by ρ^π, an alternative rests on what the policy does after it
                judged = self.asked.policy_values and self.solution.given
                seen |= reachable_at_all(self.solution, state) if judged else self.graph.reachable(state)
        mdp = self.solution.problem.mdp
        weights = self.solution.policy.weights(mdp)
        state_of_choice = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
        kept = np.flatnonzero((weights > 0) & seen[state_of_choice] & ~self.solution.ended[state_of_choice])
        return PolicyRecord(
            given=self.solution.given,
            choices=tuple((int(state_of_choice[c]), int(c), float(weights[c])) for c in kept),
        )


def _objective_record(objective: Objective) -> ObjectiveRecord:
    if isinstance(objective, ExpectedCost):
        return ObjectiveRecord(kind="cost", reward=objective.reward, maximise=objective.maximise)
    assert isinstance(objective, ReachAvoid)
    if not objective.maximise:
        return ObjectiveRecord(kind="risk", maximise=False)
    return ObjectiveRecord(kind="probability" if objective.through is None else "safety", maximise=True)
