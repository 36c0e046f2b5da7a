"""A Solution and the number of a level enter; where that level has ended leaves.

The run of a lexicographic objective ends where its first level has ended, or where the largest probability to arrive, which the
first level asked for, has become 0: there is nothing left to lose. A further level has ended there, too, and besides at the
ends of its own.
"""

from __future__ import annotations

from ratherthan.model.formula import states_where
from ratherthan.model.mdp import Bools
from ratherthan.model.objective import Discounted, Level, Mission, ReachAvoid
from ratherthan.solve.goal import mission_sets
from ratherthan.solve.solution import Solution

__all__ = ["ended_at", "wants_arrival"]


def wants_arrival(level: Level) -> bool:
    """Return whether a level asks for the largest probability of something: where that is 0 nothing can be gained any more."""
    return isinstance(level, ReachAvoid | Mission) and level.maximise


def ended_at(solution: Solution, k: int) -> Bools:
    """Return where level `k` has ended, ``[S]``: no comparison there concerns it.

    Parameters
    ----------
    solution : Solution
    k : int
        Which objective, from 0.
    """
    if k == 0:
        return solution.ended
    level, problem = solution.objectives[k], solution.problem
    ended = solution.ended | (~solution.can_arrive if wants_arrival(solution.objectives[0]) else False)
    if isinstance(level, Discounted | Mission):
        return ended if isinstance(level, Discounted) else ended | _mission_ended(solution, level)
    ended = ended | states_where(problem.mdp, level.goal, problem.definitions)
    if isinstance(level, ReachAvoid) and level.through is not None:
        ended = ended | ~states_where(problem.mdp, level.through, problem.definitions)
    return ended


def _mission_ended(solution: Solution, mission: Mission) -> Bools:
    satisfied, violated = mission_sets(solution.problem, mission)
    return satisfied | violated
