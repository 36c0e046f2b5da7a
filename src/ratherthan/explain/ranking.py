"""The steps of a route that matter enter, what each is ranked by leaves, and which groups of them are told where there are to be few.

Rankings
--------
* ``detour``: how much worse the best alternative is without turning back (`ratherthan.explain.detour`)
* ``spread``: λmax - λmin
* ``expected``: the same, times the probability that the plan ever comes there (`ratherthan.explain.visits`)
* ``place``: in the order of the route

With several levels the first at which a step differs counts, and earlier levels outweigh later ones. Infinite comes first; equal sizes
in the order of the route, and sizes are equal where their first six digits are. A group, told in one sentence, ranks as its highest
step. The order of the groups does not depend on how many are told: those that are told where there may be N sentences are among those
where there may be one more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ratherthan.explain.detour import detours_of
from ratherthan.explain.explanation import Rank, Step
from ratherthan.explain.measures import Factors
from ratherthan.explain.route import Route
from ratherthan.explain.shared import graph_of
from ratherthan.explain.visits import chances_to_visit
from ratherthan.factors import Comparison, Interval, compare

__all__ = ["chosen", "ranked"]

Groups = Sequence[tuple[int, ...]]
DIGITS = 6


def ranked(factors: Factors, route: Route, steps: Sequence[Step], wanted: Sequence[int]) -> dict[int, Rank]:
    """Return what steps are ranked by; nothing where they are told in the order of the route.

    Parameters
    ----------
    factors : Factors
    route : Route
    steps : sequence of Step
        All steps of the route.
    wanted : sequence of int
        The indices of those that may be told.
    """
    ranking = factors.asked.ranking
    if ranking == "place":
        return {}
    if ranking == "detour":
        return _by_detour(factors, route, wanted)
    found = {at: _spread(factors, steps[at]) for at in wanted}
    if ranking == "expected":
        chances = chances_to_visit(graph_of(factors.solution), route.states[0], [steps[at].state for at in wanted])
        for at, chance in zip(wanted, chances, strict=True):
            known = found[at]
            found[at] = Rank(level=known.level, size=known.size * chance if chance > 0 else 0.0, settled=known.settled)
    return found


def chosen(groups: Groups, ranks: dict[int, Rank], at_most: int) -> list[tuple[int, ...]]:
    """Return the groups that are told, in the order of the route.

    Parameters
    ----------
    groups : sequence of tuple of int
        Of indices of steps, in the order of the route.
    ranks : dict of Rank
        Of each step; none where the first are told.
    at_most : int
    """
    order = sorted(range(len(groups)), key=lambda g: (min(map(_key, (ranks.get(at) for at in groups[g]))), g))
    return [groups[g] for g in sorted(order[:at_most])]


def _key(rank: Rank | None) -> tuple[int, float]:
    """Return by what ranks are sorted, the first first: the level, then the size."""
    if rank is None:
        return 0, 0.0
    return rank.level, -float(f"{abs(rank.size):.{DIGITS}g}")


def _by_detour(factors: Factors, route: Route, wanted: Sequence[int]) -> dict[int, Rank]:
    """Return the detour of each step at the first level at which its alternatives differ."""
    solution, found = factors.solution, dict[int, Rank]()
    left = [at for at in wanted if len(solution.problem.mdp.choices_of(route.states[at])) > 1]
    last = len(factors.levels) - 1
    for level, numbers in enumerate(factors.levels):
        here = [at for at in left if level == 0 or not factors.ended[level][route.states[at]]]
        detours = detours_of(
            solution,
            level,
            numbers,
            (route.states[: len(route.choices)], route.choices),
            here,
            compared=factors.compared[level] if level else None,
        )
        left = []
        for at, detour in detours.items():
            size = float(numbers.action_value[route.choices[at]])
            nothing = abs(detour.loss) <= factors.asked.tolerance * abs(size) and detour.settled
            if not nothing and (level == 0 or detour.loss != np.inf or not _alone(factors, level, route, at)):
                found[at] = Rank(level=level, size=detour.loss, settled=detour.settled)
            if nothing and level < last:
                left.append(at)
    rest = Rank(level=last, size=0.0)
    return {at: found.get(at, rest) for at in wanted}


def _alone(factors: Factors, level: int, route: Route, at: int) -> bool:
    """Return whether a level has no alternative to compare."""
    own = factors.solution.problem.mdp.choices_of(route.states[at])
    return int(factors.compared[level].possible[own.start : own.stop].sum()) < 2


def _spread(factors: Factors, step: Step) -> Rank:
    """Return λmax - λmin of a step at the first level at which its alternatives differ."""
    own = factors.solution.problem.mdp.choices_of(step.state)
    first = _extremes(factors, 0, list(own)) if step.spread is None else step.spread
    levels = (first, *(step.further_spreads or factors.further_spreads(step.state)))
    for level, spread in enumerate(levels):
        if spread is not None and (size := _difference(*spread, factors.asked.tolerance)) > 0.0:
            return Rank(level=level, size=size, settled=all(end.finite or end.infinite for end in spread))
    return Rank(level=len(levels) - 1, size=0.0, settled=None not in levels)


def _extremes(factors: Factors, level: int, choices: list[int]) -> tuple[Interval, Interval]:
    from ratherthan.explain.measures import spread_of

    return spread_of(factors.levels[level], choices, omega=factors.asked.omega)


def _difference(high: Interval, low: Interval, tolerance: float) -> float:
    """Return the difference of two numbers, 0 where they are equal."""
    if compare(high, low, tolerance) is Comparison.EQUAL:
        return 0.0
    return 0.0 if high.value == low.value else high.value - low.value
