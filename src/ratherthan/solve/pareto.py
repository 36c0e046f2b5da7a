"""A problem and several objectives enter; the plans between which there is a real choice leave, and what each step costs.

A plan is *Pareto optimal* if no other is as good in every objective and better in one. Of these, the plans here are those that are
best for some weighting of the objectives (`front`): all others are mixtures of them, or dominated by mixtures. With two
objectives it is all of them, or as many as are wanted; with more, those between the first objective and each of the others.

*A bound.* "The least distance with a risk of at most b" is attained by a mixture of two neighbouring plans that toss a coin at
one state (`bounded`; Feinberg and Shwartz 1996). For every W ≥ 0 no plan within the bound pays less than
min (f₁ + W f₂) - W b: that is the lower bound given for it, with the W of the chord.

Values are those of `evaluate`, with proved bounds.

References
----------
E. A. Feinberg, A. Shwartz, Constrained Discounted Dynamic Programming, Math. Oper. Res. 21(4), 1996.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ratherthan.errors import QuestionError
from ratherthan.model.further import further_objective
from ratherthan.model.mdp import Floats
from ratherthan.model.objective import Level, Objective, Threshold, levels_of
from ratherthan.model.problem import Problem
from ratherthan.model.property import choose_objective
from ratherthan.solve.bounded import Bounded, within
from ratherthan.solve.front import Front, Point
from ratherthan.solve.plan import Plan, partings
from ratherthan.solve.weighing import Weighing, called, weighing_of

__all__ = ["Bounded", "Plan", "Trade", "Tradeoffs", "tradeoffs"]

MOST = 20


@dataclass(frozen=True, kw_only=True)
class Trade:
    """One step from a plan to its neighbour, away from the first objective.

    Parameters
    ----------
    objective : int
        Which objective gets better.
    origin, target : int
        From which plan to which, by their places in `Tradeoffs.plans`.
    gain, price : float
        By how much that objective gets better, and the first one worse; both above 0.
    complete : bool
        Whether it is proved (up to a millionth) that no plan lies below the line between the two.
    partings : tuple of int
        The states where the two part: to which they come by the same choices, and where they choose differently.
    """

    objective: int
    origin: int
    target: int
    gain: float
    price: float
    complete: bool
    partings: tuple[int, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Tradeoffs:
    """The plans between which there is a choice.

    Parameters
    ----------
    problem : Problem
    objectives : tuple of objectives, ``[K]``
    start : int
        Where the plans begin.
    plans : tuple of Plan
        Best for the first objective first; none where no policy is sure to arrive.
    trades : tuple of Trade
        The steps between neighbours.
    complete : bool
        Whether these are all; else `most` was reached.
    bounded : Bounded, optional
        The best plan within a bound, where one was given.
    """

    problem: Problem
    objectives: tuple[Level, ...]
    start: int
    plans: tuple[Plan, ...]
    trades: tuple[Trade, ...] = ()
    complete: bool = True
    bounded: Bounded | None = None


def tradeoffs(
    problem: Problem,
    objectives: Sequence[Objective | str],
    *,
    bound: Mapping[str, float] | None = None,
    most: int = MOST,
    progress: Callable[[str], None] | None = None,
) -> Tradeoffs:
    """Return the plans between which there is a choice, with what each step from one to the next costs.

    Parameters
    ----------
    problem : Problem
        With one initial state.
    objectives : sequence of objectives
        Two or more expected totals of different rewards until the same goal (or discounted alike); or their texts, their names
        in the source, or after the first one names of rewards, which mean the least of each until the same goal.
    bound : mapping of str to float, optional
        The name of one reward and the most it may be (the least, where it is gathered): also return the best
        plan for the first of the other objectives within the bound. Steps are called "steps".
    most : int
        How many plans to find at most, between the first objective and each of the others.
    progress : callable, optional
        Called with a short text now and then.

    Returns
    -------
    Tradeoffs

    Raises
    ------
    QuestionError
        For fewer than two objectives, two about one reward, what is no objective, several initial states, or a bound that is
        on none of them or no number.
    NotExplainableError
        For objectives that are no totals until one goal.
    PropertyError
        For objectives that do not fit the model, or have no best value.

    Examples
    --------
    >>> import ratherthan as rt
    >>> problem = rt.read("example:pedestrians")
    >>> wishes = [problem.properties["shortest"], problem.properties["safest"]]
    >>> [plan.values.round(2).tolist() for plan in tradeoffs(problem, wishes).plans]
    [[8.75, 2.0], [13.75, 0.2], [16.25, 0.0]]
    """
    if not isinstance(most, int | np.integer) or most < 2:
        raise QuestionError(f"At least two plans must be wanted, got {most!r}.")
    weighing = weighing_of(problem, _read(problem, objectives), progress)
    limited = _bound(weighing, bound)
    found = _Gathered(weighing=weighing)
    for other in range(1, len(weighing.objectives)):
        front = Front.begun(weighing, (0, other))
        if front is None:
            break
        while front.open and len(front.points) < most:
            front.refine(front.open[0])
        found.add(front)
    return Tradeoffs(
        problem=problem,
        objectives=weighing.objectives,
        start=weighing.start,
        plans=tuple(found.plans),
        trades=tuple(found.trades),
        complete=all(not front.open for front in found.fronts) and all(trade.complete for trade in found.trades),
        bounded=found.within(*limited) if limited is not None and found.plans else None,
    )


def _read(problem: Problem, wishes: Sequence[Objective | str]) -> list[Objective]:
    """Return the objectives, read where they are texts."""
    if isinstance(wishes, str) or not isinstance(wishes, Iterable):
        raise QuestionError(f"A trade-off must be between several objectives or their texts, got {wishes!r}.")
    found: list[Objective] = []
    for text in wishes:
        wish: object = text
        if isinstance(text, str):
            wish = further_objective(problem, text, levels_of(found[0])) if found else choose_objective(problem, text)
        if isinstance(wish, Threshold):
            raise QuestionError(f"A trade-off must be between best values (=?), got '{wish.text}'.", text=wish.text)
        if not isinstance(wish, Objective):
            raise QuestionError(f"A trade-off must be between objectives or their texts, got {wish!r}.")
        found.append(wish)
    return found


def _bound(weighing: Weighing, bound: Mapping[str, float] | None) -> tuple[tuple[int, int], float] | None:
    """Return the pair of objectives, the second one bounded, and the bound."""
    if bound is None:
        return None
    names = [called(objective) for objective in weighing.objectives]
    if not isinstance(bound, Mapping):
        raise QuestionError(
            f"A bound must be the name of a reward with a number, such as {{'{names[-1]}': 1}}, got {bound!r}."
        )
    if len(bound) != 1:
        raise QuestionError(f"One objective can be bounded at a time, got {len(bound)}. Weigh the others.")
    name, value = next(iter(bound.items()))
    if name not in names:
        raise QuestionError(
            f"A bound must be on one of the objectives, {', '.join(names)}, got '{name}'.", objective=name
        )
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool | np.complexfloating)
    if not number or not abs(value) <= sys.float_info.max:
        raise QuestionError(f"A bound must be a finite number, got {value!r} for '{name}'.", objective=name)
    which = names.index(name)
    return (0 if which else 1, which), float(value)


@dataclass(kw_only=True, eq=False)
class _Gathered:
    """The plans of several fronts, each plan once."""

    weighing: Weighing
    fronts: list[Front] = field(default_factory=list)
    plans: list[Plan] = field(default_factory=list)
    trades: list[Trade] = field(default_factory=list)

    def add(self, front: Front) -> None:
        """Add the plans of a front, and the steps between them."""
        self.fronts.append(front)
        border, other = front.border(), front.pair[1]
        places = [self._place(point, other) for point in border]
        for left, right, origin, target in zip(border, border[1:], places, places[1:], strict=False):
            worse = (self.plans[target].values - self.plans[origin].values) * self.weighing.signs
            self.trades.append(
                Trade(
                    objective=other,
                    origin=origin,
                    target=target,
                    gain=float(-worse[other]),
                    price=float(worse[0]),
                    complete=front.closed(left, right),
                    partings=self._partings(origin, target),
                )
            )

    def _partings(self, origin: int, target: int) -> tuple[int, ...]:
        policies = self.plans[origin].policy, self.plans[target].policy
        return partings(self.weighing.problem.mdp, policies, self.weighing.start, self.weighing.ended)

    def within(self, pair: tuple[int, int], bound: float) -> Bounded:
        """Return the best plan within a bound on the second of two objectives."""
        front = next((front for front in self.fronts if front.pair == pair), None)
        begun = front or Front.begun(self.weighing, pair)
        assert begun is not None  # where there are plans, they arrive
        return within(begun, bound)

    def _place(self, point: Point, other: int) -> int:
        """Return the place of a plan among those there are, adding it where it is new."""
        made = point.found.plan
        weights = (point.low, point.high) if point.low <= point.high else None
        for place, plan in enumerate(self.plans):
            if _alike(plan.values, made.values):
                self.plans[place] = plan.best_for(other, weights)
                return place
        self.plans.append(made.best_for(other, weights))
        return len(self.plans) - 1


def _alike(one: Floats, other: Floats) -> bool:
    return bool((np.abs(one - other) <= 1e-6 * np.maximum(np.abs(one), np.abs(other))).all())
