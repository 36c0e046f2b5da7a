"""The steps of a route enter, the same leave with those told that there is room for; and what can be said of those left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ratherthan.explain.explanation import LeftOut, Step
from ratherthan.explain.levels import Judges
from ratherthan.explain.measures import Factors
from ratherthan.explain.ranking import chosen, ranked
from ratherthan.explain.route import Route
from ratherthan.explain.telling import matters, runs
from ratherthan.factors import Comparison, Interval, compare
from ratherthan.model.objective import ExpectedCost, ExpectedReward

__all__ = ["left_out", "selected"]


def selected(factors: Factors, route: Route, steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """Return the steps of a route, told or not so that there are no more sentences than asked for.

    Parameters
    ----------
    factors : Factors
        Under a question with `at_most`.
    route : Route
    steps : tuple of Step
        With their claims.
    """
    asked, world = factors.asked, factors.solution.problem.world
    wanted = [at for at, step in enumerate(steps) if matters(step, asked)]
    groups = runs(steps, wanted, route.states, asked, lambda state: None if world is None else world.place(state))
    if asked.at_most is None or len(groups) <= asked.at_most:
        return steps
    ranks = ranked(factors, route, steps, wanted)
    told = {at for group in chosen(groups, ranks, asked.at_most) for at in group}
    return tuple(
        replace(step, told=at in told or not matters(step, asked), rank=ranks.get(at)) for at, step in enumerate(steps)
    )


def left_out(judges: Judges, steps: Sequence[Step]) -> LeftOut | None:
    """Return what can be said of the steps that are not told though they matter; None where all are told.

    Parameters
    ----------
    judges : Judges
    steps : sequence of Step
    """
    states = [step.state for step in steps if not step.told]
    if not states:
        return None
    kinds = judges.factors.solution.objectives
    unsure = 0
    largest: list[float | None] = []
    for level, kind in enumerate(kinds):
        most: float | None = 0.0
        for state in states:
            if level and judges.factors.ended[level][state]:
                continue
            high, low = judges.difference(state, level)
            if high.infinite != low.infinite and (high.finite or low.finite) and _demanding(kind):
                unsure += level == 0
                most = most if level == 0 else None
            elif most is not None:
                size = _difference(high, low, judges.factors.asked.tolerance)
                most = None if size is None else max(most, size)
        largest.append(most)
    return LeftOut(steps=len(states), unsure=unsure, largest=tuple(largest))


def _demanding(kind: object) -> bool:
    """Return whether an infinite number means that the goal may be missed."""
    return isinstance(kind, ExpectedReward) or (isinstance(kind, ExpectedCost) and not kind.maximise)


def _difference(high: Interval, low: Interval, tolerance: float) -> float | None:
    """Return by how much two numbers differ at most, 0 where they are equal, None where that is open or has no end."""
    if compare(high, low, tolerance) is Comparison.EQUAL:
        return 0.0
    return high.upper - low.lower if high.finite and low.finite else None
