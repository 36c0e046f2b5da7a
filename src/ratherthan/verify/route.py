"""The route of an explanation and the moves of its policy enter, checks leave: path, outcome, probabilities, circle, hazards."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ratherthan.explain.explanation import Explanation
from ratherthan.model.mdp import Bools
from ratherthan.model.problem import Problem
from ratherthan.verify.frame import Frame
from ratherthan.verify.measure import GROSS, ROUNDED
from ratherthan.verify.openings import wrong_openings
from ratherthan.verify.paths import TIE, Moves
from ratherthan.verify.values import Band
from ratherthan.verify.verdict import Check, Verdict

__all__ = ["RouteCheck"]

MOST_STEPS = 1000
MOST_NAMED = 20
VAGUE = 1e-6
"""By which share of a number the bounds known here may reach beyond those of the explanation and still confirm it."""
NEAR = 1e-9
"""How far the probability of a route may be from its product: a thousand factors, rounded one by one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RouteCheck:
    """Re-derives the route.

    Parameters
    ----------
    problem : Problem
    frame : Frame
    moves : Moves
        Of the policy.
    explanation : Explanation
    arrival : Band, optional
        Bounds of the probability that the policy arrives.
    slack : float
        By which share the bounds of a certified number may be wider than what is known here.
    """

    problem: Problem
    frame: Frame
    moves: Moves
    explanation: Explanation
    arrival: Band | None
    slack: float

    def checks(self) -> list[Check]:
        """Return the checks of route, route_outcome, route_probability, arrival, circle and in_the_way."""
        told = self.explanation
        problem = shape = self._shape()
        if shape is None:
            problem = {
                "there": self._already,
                "ended": self._already,
                "no way": self._no_way,
                "arrives": self._arrives,
                "circles": self._circles,
                "open end": self._open_end,
            }[told.route_outcome]()
        found = [self._check("route", problem)]
        if shape is None:
            found.append(self._check("route_probability", self._probability()))
        found.append(self._arrival())
        return found

    def _check(self, what: str, problem: str | None) -> Check:
        name = self.frame.mdp.names[self.explanation.start]
        if problem is None:
            return Check(what=what, where=name, state=self.explanation.start, verdict=Verdict.HOLDS)
        return Check(what=what, where=name, state=self.explanation.start, verdict=Verdict.FAILS, reason=problem)

    def _shape(self) -> str | None:
        """Return what is wrong with the list of states and steps, before any probability is looked at."""
        told = self.explanation
        steps = [step.state for step in told.steps]
        if not told.route or told.route[0] != told.start:
            return f"it must begin at state {told.start}, got {list(told.route[:1])}"
        if steps != list(told.route[:-1]):
            return f"its states must be those of its steps and the last one, got steps at {steps[:MOST_NAMED]}"
        for step, target in zip(told.steps, told.route[1:], strict=True):
            if not self.frame.running[step.state]:
                return f"it goes on from state {step.state}, where the objective has ended"
            if step.state == target and not self.moves.of(target):
                continue  # it stays there for ever; that it takes this choice is checked with the step
            if self.moves.move(step.state, step.choice, target) == 0.0:
                return f"'{step.action}' at state {step.state} does not lead to state {target} under the policy"
        expected = self._outcome()
        if expected != told.route_outcome:
            return f"its outcome is '{expected}', got '{told.route_outcome}'"
        if told.route_outcome not in ("circles", "no way") and (told.circle or told.circle_size):
            return "it goes round nowhere, but a circle is given"
        if told.route_outcome != "circles" and not told.circle_certain:
            return "it goes round nowhere, but a circle is called uncertain"
        if told.route_outcome != "no way" and told.in_the_way:
            return "nothing is in the way, but hazards are given"
        if told.route_outcome != "no way" and told.openings:
            return "nothing is in the way, but cells are given that would have to open"
        return None

    def _outcome(self) -> str:
        """Return how the route ends."""
        frame, start = self.frame, self.explanation.start
        if not frame.running[start]:
            return "there" if frame.goal[start] and not frame.aimless else "ended"
        if frame.aimless:
            return "open end"
        if not frame.can_arrive[start]:
            return "no way"
        return "arrives" if (self.moves.reached(start) & frame.goal).any() else "circles"

    def _chances(self) -> list[float]:
        told = self.explanation
        return [
            1.0 if step.state == target else self.moves.move(step.state, step.choice, target)
            for step, target in zip(told.steps, told.route[1:], strict=True)
        ]

    def _probability(self) -> str | None:
        told = self.explanation
        chances = self._chances()
        if told.route_outcome == "circles":
            chances = chances[: self._entry()]
        product = min(1.0, math.prod(chances))
        if told.route_probability is None or abs(told.route_probability - product) > NEAR * product + 1e-300:
            return f"it is {product:.10g}, got {told.route_probability}"
        return None

    def _already(self) -> str | None:
        return None if len(self.explanation.route) == 1 else "nothing is left to do at its start, but it goes on"

    def _arrives(self) -> str | None:
        route, goal = self.explanation.route, self.frame.goal
        if not goal[route[-1]]:
            return f"it must end at a goal, got state {route[-1]}"
        return self._most_probable(len(route) - 1, goal)

    def _most_probable(self, count: int, ends: Bools) -> str | None:
        """Return what is wrong with the first `count` moves as the most probable way to `ends`, the first listed of several."""
        distance = self.moves.distances(ends)
        told = self.explanation
        slack = TIE + 1e-15 * count
        for step, target in zip(told.steps[:count], told.route[1 : count + 1], strict=True):
            here = step.state
            if ends[here]:
                return f"it has ended at state {here} but goes on"
            edges = self.moves.of(here)
            excess = [-math.log(min(e.chance, 1.0)) + distance[e.target] - distance[here] for e in edges]
            taken = [i for i, e in enumerate(edges) if (e.choice, e.target) == (step.choice, target)]
            own = min(taken, key=lambda i: (excess[i] > TIE, i))
            if not excess[own] <= TIE + slack:
                return f"from state {here} there is a more probable way than to state {target}"
            nearer = [i for i, e in enumerate(edges[:own]) if distance[e.target] < distance[here]]
            if any(excess[i] <= TIE - slack / 2 for i in nearer):
                return f"at state {here} an equally probable way is listed before that to state {target}"
        return None

    def _entry(self) -> int:
        """Return after how many moves the route is in a set of states that the policy never leaves."""
        _, closed = self.moves.closed(self.explanation.start)
        return next((i for i, state in enumerate(self.explanation.route) if closed[state]), len(self.explanation.steps))

    def _circles(self) -> str | None:
        told = self.explanation
        part, closed = self.moves.closed(told.start)
        entry = self._entry()
        if not closed[told.route[entry]]:
            return "it must lead to where the policy goes round for ever"
        problem = self._most_probable(entry, closed) or self._round(entry)
        if problem:
            return problem
        circle = np.flatnonzero((part == part[told.route[entry]]) & closed)
        if list(told.circle) != circle[:MOST_NAMED].tolist() or told.circle_size != len(circle):
            return f"it goes round in {circle[:MOST_NAMED].tolist()}, {len(circle)} in all"
        certain = bool((part[closed] == part[told.route[entry]]).all())
        if told.circle_certain != certain:
            return f"that it ends there is {'certain' if certain else 'not certain'}"
        return None

    def _round(self, begin: int) -> str | None:
        """Return what is wrong with the most probable way round, from the move `begin` on until a state repeats."""
        told = self.explanation
        seen = {told.route[begin]}
        for i in range(begin, len(told.steps)):
            target = told.route[i + 1]
            stays = target == told.steps[i].state and not self.moves.of(target)
            problem = None if stays else self._likeliest(i)
            if problem:
                return problem
            if target in seen and i + 1 < len(told.steps):
                return f"it must stop where state {target} repeats"
            seen.add(target)
        last = told.route[-1]
        alone = len(self.frame.mdp.choices_of(last)) == 1
        unsaid = not (told.policy.rows.state == last).any()
        silent = not self.moves.of(last) and (alone or unsaid or not self.frame.running[last])
        complete = last in told.route[begin:-1] or silent or len(told.steps) - begin >= MOST_STEPS
        return None if complete else f"it must go on from state {last} until a state repeats"

    def _open_end(self) -> str | None:
        return self._round(0)

    def _likeliest(self, i: int) -> str | None:
        """Return what is wrong with move number i as the most probable one of its state."""
        step, target = self.explanation.steps[i], self.explanation.route[i + 1]
        edges = self.moves.of(step.state)
        if not edges:
            return f"from state {step.state} nothing leads to state {target}"
        best = max(e.chance for e in edges)
        taken = next(
            (
                k
                for k, e in enumerate(edges)
                if (e.choice, e.target) == (step.choice, target) and e.chance >= best * (1 - 2 * TIE)
            ),
            None,
        )
        if taken is None:
            return f"from state {step.state} there is a more probable move than to state {target}"
        if any(e.part >= max(edge.part for edge in edges) for e in edges[:taken]):
            return f"at state {step.state} an equally probable move is listed before that to state {target}"
        return None

    def _no_way(self) -> str | None:
        told, frame = self.explanation, self.frame
        if len(told.route) != 1:
            return "no policy arrives, but it goes on"
        reached = frame.explored(told.start)
        states = np.flatnonzero(reached)
        if list(told.circle) != states[:MOST_NAMED].tolist() or told.circle_size != len(states):
            return f"what can be reached is {states[:MOST_NAMED].tolist()}, {len(states)} in all"
        return _hazards_in_the_way(frame, told.start, told.in_the_way) or wrong_openings(told, self.problem, frame)

    def _arrival(self) -> Check:
        told = self.explanation
        if told.arrival is None or self.arrival is None:
            agree = (told.arrival is None) == (self.arrival is None)
            return self._check("arrival_probability", None if agree else "it is given exactly where there is a goal")
        own, claimed = self.arrival[told.start], told.arrival
        if not claimed.lower <= claimed.value <= claimed.upper:
            return self._check("arrival_probability", "it must lie between its bounds")
        if (claimed.lower, claimed.upper) == (0.0, 1.0):  # it is said that nothing is known
            return self._check("arrival_probability", None)
        if own.lower == -math.inf:
            flaw = "it is not known: the policy that is listed says nothing of a state it comes to"
            return self._check("arrival_probability", flaw)
        if not (own.meets(claimed) and own.covers(claimed, max(self.slack, GROSS), ROUNDED / GROSS)):
            truth = f"it lies between {own.lower:.10g} and {own.upper:.10g}"
            flaw = f"{truth}, got {claimed.lower:.10g} to {claimed.upper:.10g}"
            return self._check("arrival_probability", flaw)
        found = self._check("arrival_probability", None)
        unsure = own.vague(claimed, VAGUE) or not own.covers(claimed, self.slack)
        return replace(found, verdict=Verdict.UNDECIDED) if unsure else found


def _hazards_in_the_way(frame: Frame, start: int, told: tuple[int, ...]) -> str | None:
    """Return what is wrong with the hazards in the way: they must be those on a shortest path to a goal through hazards.

    Shortest paths form layers; the sequences of hazards on the way to each state are carried along, as far as they agree
    with what was told.
    """
    if not frame.hazard.any():
        return None if not told else "there are no hazards"
    layer: dict[int, set[int]] = {start: {0}}  # state → how many of the told hazards were met on agreeing paths
    seen = np.zeros(frame.mdp.states, dtype=np.bool_)
    seen[start] = True
    while layer:
        ends = [state for state in layer if frame.goal[state]]
        if ends:
            agrees = any(len(told) in layer[state] for state in ends)
            return None if agrees else "no shortest way to a goal passes these hazards"
        origin, target = frame.branches_from(np.array(sorted(layer), dtype=np.int64))
        fresh = ~seen[target]
        following: dict[int, set[int]] = {}
        for before, after in set(zip(origin[fresh].tolist(), target[fresh].tolist(), strict=True)):
            met = following.setdefault(after, set())
            if not frame.hazard[after]:
                met |= layer[before]
            else:
                met |= {count + 1 for count in layer[before] if count < len(told) and told[count] == after}
        seen[list(following)] = True
        layer = following
    return None if not told else "no way to a goal passes any hazard"
