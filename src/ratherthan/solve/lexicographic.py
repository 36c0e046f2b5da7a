"""Levels of an objective enter; the optimum of each among the choices that the levels before leave, and one policy, leave.

**Meaning.** Level 1 is optimised over all policies. Its *tied* choices are those that cannot be told from its best by the
solver, up to a tolerance far below that with which values are compared. Level 2 is optimised over the policies that take
tied choices only and attain level 1, its own tied choices are those among them, and so on. Where a level has ended its choices
are all tied.

**What it takes to attain a level.** Best choices are not enough where a run could stay for ever among them: for a largest
probability, and for sums until a goal, the run must come to an end (`must_end`). A later level has then no use of what never
ends. A least cost demands an end anyway. A least probability is taken over the policies that end (`task`). For a largest probability
the end makes no difference: whoever stays can as well leave later. A largest cost has its value until an end that must
be reached (`gathering`). A discounted sum that is best for ever comes as close to its best value as one likes and then
leaves, but no policy attains that; it is refused.

An infinite value cannot be attained choice by choice: that of a largest cost rests on never arriving, that of a largest reward on
going round long enough. No level can follow it, and it is refused.

**Where a run ends.** Where level 1 has ended. If level 1 asks for the largest probability to arrive, also where that is 0:
what it costs to lose more is nobody's concern (Lacerda, Faruque, Parker, Hawes 2019). A further level ends besides at its own
goal. So the second level "least cost" after "largest probability" is the expected cost until the run arrives or is lost; and
it is over the policies that get there with probability 1, hence over those that attain level 1, not only take its best
choices for ever.

**The policy.** Of the choices tied at all levels, in every state the first listed with which it arrives (`tied`). Small losses
may add up, and what is best for the last level may go round for ever for the first: where a later level has ended before the
first one, say, and comes by again. So the policy is evaluated for every level. If it loses something, one that gets on for the
levels before is tried, at last only near the end of the run, and then a finer tolerance; if that does not help the policy attains as many levels as it can, the first
ones first, and its values say so.

References
----------
B. Lacerda, F. Faruque, D. Parker, N. Hawes, Probabilistic planning with formal performance guarantees for mobile service
robots, Int. J. Robotics Research 38(9), 2019.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.errors import PropertyError
from ratherthan.model import graph
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.objective import Level
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.model.watch import keep
from ratherthan.solve.chain import Evaluated, chain_of, evaluated
from ratherthan.solve.goal import Goal, Kind, Task, goal_of, restricted
from ratherthan.solve.levels import wants_arrival
from ratherthan.solve.optimum import LOSS, TIES, Method, Optimum, optimum
from ratherthan.solve.policy_iteration import PolicyIteration
from ratherthan.solve.task import task_of
from ratherthan.solve.tied import first_tied

__all__ = ["Ordered", "ordered", "over_after"]

DOUBT = 1e-7
"""Up to which relative width bounds that sweeps have proved count as narrow."""

ROUGHLY = ("sweeps", "rough")
"""What the names of methods contain that tell values, and so ties, as narrowly as their bounds are."""
NOISE = 1e-14

Progress = Callable[[str], None]
Choices = npt.NDArray[np.int64]


class Ordered(NamedTuple):
    """The goals of all levels, their optima one after the other, a policy, and what it attains of each."""

    goals: tuple[Goal, ...]
    best: tuple[Optimum, ...]
    choice: Choices  # [S]
    attained: tuple[Evaluated, ...]
    level: int  # the last that the policy attains, with all before it


def over_after(level: Level, goal: Goal, can_arrive: Bools) -> Bools:
    """Return where a run ends for the levels after the first, ``[S]``.

    Parameters
    ----------
    level : Level
        The first.
    goal : Goal
        What it wants.
    can_arrive : array of bool, ``[S]``
        Where its largest probability is above 0, if it asks for that.
    """
    return ~goal.running | ~can_arrive if wants_arrival(level) else ~goal.running


def ordered(
    problem: Problem, levels: Sequence[Level], method: Method | None, progress: Progress | None = None
) -> Ordered:
    """Return the optimum of several levels, the first first.

    Parameters
    ----------
    problem : Problem
    levels : sequence of objectives
        One or more.
    method : PolicyIteration or Sweeps, optional
    progress : callable, optional
    """
    for finest in range(len(TIES)):
        if finest > 0 and method is None:  # ties that rough values tell are too many, or the wrong ones
            method = PolicyIteration()
        goals, best = _one_after_the_other(problem, levels, method, progress, finest)
        if len(levels) == 1:
            return Ordered(goals, best, best[0].choice, (best[0].attained,), 0)
        found = _attaining(goals, best)
        if found.level == len(levels) - 1:
            break
    return found


def _one_after_the_other(
    problem: Problem, levels: Sequence[Level], method: Method | None, progress: Progress | None, finest: int
) -> tuple[tuple[Goal, ...], tuple[Optimum, ...]]:
    """Return the goals of the levels and the optimum of each among the choices that the levels before leave."""
    goals: list[Goal] = []
    found: list[Optimum] = []
    over: Bools | None = None
    must_end = np.zeros(problem.mdp.states, dtype=np.bool_)
    permitted = np.ones(problem.mdp.choices, dtype=np.bool_)
    for number, level in enumerate(levels, 1):
        if progress is not None and len(levels) > 1:
            progress(f"objective {number} of {len(levels)}")
        goal = goal_of(problem, level, over)
        keep(found=tuple(zip(goals, found, strict=True)), goal=goal if number == 1 else None, task=None)
        narrowed, kept = restricted(goal, permitted)
        must_end = must_end & goal.running
        task = _task(narrowed, level, must_end)
        best = optimum(task, method, progress, finest=finest)
        if number < len(levels) and narrowed.counts_cost and any(way in best.engine for way in ROUGHLY):
            best = best._replace(tied=best.tied | _undecided(narrowed, best))
        if number < len(levels):
            _refuse_endless(goal, best, level)
        choice = best.choice if kept is None else kept[best.choice]
        if found:  # where this level has ended, or is lost, the levels before decide
            choice = np.where(goal.running & (best.values != goal.unreached), choice, found[-1].choice)
        tied = np.zeros(goal.index.choices, dtype=np.bool_)
        tied[best.tied if kept is None else kept[best.tied]] = True
        tied[choice] = True
        goals.append(goal)
        found.append(best._replace(choice=choice, tied=tied))
        if over is None:
            over = over_after(level, goal, best.task.can_arrive)
            if _demands_an_end(goal):
                must_end = ~over & (best.values != goal.unreached)
        permitted = permitted & tied
        if goal.kind is Kind.DISCOUNTED and (must_end & ~_ending(goal, over, permitted)).any():
            raise _not_attained(level, "A discounted sum")
    return tuple(goals), tuple(found)


def _undecided(goal: Goal, best: Optimum) -> Bools:
    """Return the choices that the bounds of a level leave open whether they are best, ``[C]``."""
    index, sign = goal.index, -1.0 if goal.maximise else 1.0
    low, high = (best.upper, best.lower) if goal.maximise else (best.lower, best.upper)
    with np.errstate(invalid="ignore", over="ignore"):
        mean = np.add.reduceat(goal.probability * low[index.branch_to_target], index.choice_to_branches[:-1])
        least, most = goal.cost + goal.discount * mean, high[index.choice_to_state]
        found: Bools = best.task.allowed & np.isfinite(most) & (sign * (least - most) <= NOISE * np.abs(most))
    return found


def _demands_an_end(goal: Goal) -> bool:
    """Return whether best choices attain a level only if the run ends."""
    if goal.kind is Kind.PROBABILITY:
        return goal.maximise
    return goal.kind is Kind.REWARD or (goal.kind is Kind.COST and not goal.maximise)


def _ending(goal: Goal, over: Bools, permitted: Bools) -> Bools:
    """Return from where permitted choices lead to where the run is over, for sure, ``[S]``."""
    return graph.surely_reach(goal.index, over, ~over, permitted)


def _task(goal: Goal, level: Level, must_end: Bools) -> Task:
    """Return the task of a level over the policies with which the run ends for sure where it must."""
    ended = ~goal.running
    if not must_end.any() or not goal.index.choices:
        return task_of(goal)
    if goal.kind is Kind.PROBABILITY and not goal.maximise:
        if (must_end & ~graph.surely_reach(goal.index, ended, must_end)).any():
            raise _not_attained(level, "What is best for the objectives before it")
        return task_of(goal, must_end)
    if goal.kind is Kind.COST and goal.maximise:
        task = task_of(goal)
        if not (must_end & np.isinf(task.fixed)).any():
            return task
        task = task_of(replace(goal, kind=Kind.REWARD)) if (must_end | ended).all() else task
        if (must_end & np.isinf(task.fixed)).any():
            raise _not_attained(level, "A largest cost")
        return task
    return task_of(goal)


def _refuse_endless(goal: Goal, best: Optimum, level: Level) -> None:
    """Raise PropertyError where a level has an infinite value that no choice by itself attains."""
    if goal.kind is Kind.PROBABILITY or not (goal.kind is Kind.REWARD or goal.maximise):
        return
    endless = goal.running & (best.values == np.inf)
    if endless.any():
        state = int(np.argmax(endless))
        called = f"{state} ('{goal.mdp.names[state]}')" if goal.mdp.names.named else str(state)
        raise PropertyError(
            f"Of several objectives only the last may be without a finite value, but '{level.text}' has none in state {called}. "
            "Ask for it last or by itself, or for a discounted sum.",
            text=level.text,
            state=state,
        )


def _not_attained(level: Level, what: str) -> PropertyError:
    return PropertyError(
        f"Each of several objectives must have a plan that is best for it and for those before it, but there is none for "
        f"'{level.text}'. {what} can be better the later the run ends, and the objectives before demand that it ends. Put it "
        'first, or ask for an expected total until the goal in its place, such as R{"…"}min=? [F …].',
        text=level.text,
    )


def _attaining(goals: tuple[Goal, ...], best: tuple[Optimum, ...]) -> Ordered:
    """Return the policy that attains the most levels, the first ones first, of those that are best up to some level."""
    for last, choice in _candidates(goals, best):
        chains = [chain_of(goal, Policy(choice=choice)) for goal in goals]
        with np.errstate(all="ignore"):
            attained = tuple(evaluated(goal, chain) for goal, chain in zip(goals, chains, strict=True))
        if last == 0 or all(map(_attains, goals[: last + 1], best, attained)):
            break
    return Ordered(goals, best, choice, attained, last)


def _candidates(goals: tuple[Goal, ...], best: tuple[Optimum, ...]) -> Iterator[tuple[int, Choices]]:
    """Yield policies with the last level that they may attain, with all before it: the last ones first."""
    last = len(best) - 1
    yield last, best[last].choice
    # Where the last level is indifferent, the ones before may have to get on: out of all that is tied, they do.
    tied = np.logical_and.reduce([found.tied for found in best])
    arriving = np.logical_or.reduce([found.task.arriving for found in best])
    nowhere = np.zeros(len(arriving), dtype=np.bool_)
    task = replace(best[0].task, goal=goals[0], open=nowhere, arriving=arriving, elsewhere=best[last].choice)
    choice = first_tied(task, tied)
    yield last, np.where(choice < 0, best[last].choice, choice)
    for level in reversed(range(last)):
        yield from ((level, mixed) for mixed in _near_the_end(goals[0], best[last].choice, best[level].choice))
        yield level, best[level].choice


def _near_the_end(goal: Goal, wanted: Choices, arriving: Choices) -> Iterator[Choices]:
    """Yield the first of the policies that end, of those that keep to `wanted` but near the end of the run, nearer ones first."""
    index, ended = goal.index, ~goal.running
    taken = np.zeros(index.choices, dtype=np.bool_)
    taken[arriving] = True
    steps = graph.levels_to(index, ended, goal.running, taken)
    near = 1
    while near <= steps.max():
        mixed = np.where((steps >= 0) & (steps <= near), arriving, wanted)
        taken[:] = False
        taken[mixed] = True
        if (graph.levels_to(index, ended, goal.running, taken) >= 0)[steps >= 0].all():
            yield mixed
            return
        near *= 2


def _attains(goal: Goal, best: Optimum, attained: Evaluated) -> bool:
    """Return whether a policy provably attains a level, up to a small loss and what its bounds leave open, wherever that is a number."""
    finite = np.isfinite(best.values)
    wanted, lower, upper = best.values[finite], attained.lower[finite], attained.upper[finite]
    bounded = np.isfinite(lower) & np.isfinite(upper)
    width = np.subtract(upper, lower, out=np.zeros(len(wanted)), where=bounded)
    if not goal.signed:
        width = np.minimum(width, DOUBT * np.abs(wanted))
    lost: Floats = np.abs((lower if goal.maximise else upper) - wanted)
    return bool((lost <= LOSS * np.abs(wanted) + width).all())
