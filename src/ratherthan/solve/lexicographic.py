"""Levels of an objective enter; the optimum of each among the choices that the levels before leave, and one policy, leave.

**Meaning.** Level 1 is optimised over all policies. Its *tied* choices are those that cannot be told from its best by the
solver, up to a tolerance far below that with which values are compared. Level 2 is optimised over the policies that take
tied choices only, its own tied choices are those among them, and so on. Where a level has ended its choices are all tied.

**Where a run ends.** Where level 1 has ended. If level 1 asks for the largest probability to arrive, also where that is 0:
what it costs to lose more is nobody's concern (Lacerda, Faruque, Parker, Hawes 2019). A further level ends besides at its own
goal. So the second level "least cost" after "largest probability" is the expected cost until the run arrives or is lost; and
it is over the policies that get there with probability 1, hence over those that attain level 1, not only take its best
choices for ever.

**The policy.** Of the choices tied at all levels, in every state the first listed with which it arrives (`tied`). Small losses
may add up, and what is best for the last level may go round for ever for the first: where a later level has ended before the
first one, say, and comes by again. So the policy is evaluated for every level. If it loses something, one that gets on for the
levels before is tried, and then a finer tolerance; if that does not help the policy attains as many levels as it can, the first
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

from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.objective import Level
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve.chain import Evaluated, chain_of, evaluated
from ratherthan.solve.goal import Goal, goal_of, restricted
from ratherthan.solve.levels import wants_arrival
from ratherthan.solve.optimum import LOSS, TIES, Method, Optimum, optimum
from ratherthan.solve.task import task_of
from ratherthan.solve.tied import first_tied

__all__ = ["Ordered", "ordered", "over_after"]

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
    permitted = np.ones(problem.mdp.choices, dtype=np.bool_)
    for number, level in enumerate(levels, 1):
        if progress is not None and len(levels) > 1:
            progress(f"objective {number} of {len(levels)}")
        goal = goal_of(problem, level, over)
        narrowed, kept = restricted(goal, permitted)
        best = optimum(task_of(narrowed), method, progress, finest=finest)
        choice = kept[best.choice]
        if found:  # where this level has ended, or is lost, the levels before decide
            choice = np.where(goal.running & (best.values != goal.unreached), choice, found[-1].choice)
        tied = np.zeros(goal.index.choices, dtype=np.bool_)
        tied[kept[best.tied]] = True
        tied[choice] = True
        goals.append(goal)
        found.append(best._replace(choice=choice, tied=tied))
        if over is None:
            over = over_after(level, goal, best.task.can_arrive)
        permitted = permitted & tied
    return tuple(goals), tuple(found)


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
        yield level, best[level].choice


def _attains(goal: Goal, best: Optimum, attained: Evaluated) -> bool:
    """Return whether a policy provably attains a level, up to a small loss, wherever that is a number."""
    finite = np.isfinite(best.values)
    wanted, lower, upper = best.values[finite], attained.lower[finite], attained.upper[finite]
    width = upper - lower if goal.signed else np.zeros(len(wanted))
    lost: Floats = np.abs((lower if goal.maximise else upper) - wanted)
    return bool((lost <= LOSS * np.abs(wanted) + np.where(np.isfinite(width), width, 0.0)).all())
