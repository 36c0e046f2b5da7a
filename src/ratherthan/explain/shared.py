"""A Solution enters; what all questions about it share leaves, computed when it is first needed and kept as long as the Solution.

A question about one state needs little of its own: the numbers of some choices, and how many decisions they leave open. What
takes long is the same for every question: impact and action values of all choices, the critical states, the graph that the
policy moves in, the chance to arrive. So the first question on a large model takes its time and the next are answered at once.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from ratherthan.explain.route import PolicyGraph, policy_graph
from ratherthan.factors import Interval
from ratherthan.model.mdp import Bools
from ratherthan.model.objective import ExpectedCost, ExpectedReward
from ratherthan.solve.solution import Solution
from ratherthan.solve.solver import arrival

__all__ = ["arriving", "graph_of", "kept", "reached_from"]

Kept = TypeVar("Kept")

_KEPT: WeakKeyDictionary[Solution, dict[Hashable, Any]] = WeakKeyDictionary()
"""What is kept must not lead back to the Solution, or neither would ever be let go."""

MOST_STARTS = 4
"""So many sets of reached states are kept."""


def kept(solution: Solution, key: Hashable, make: Callable[[], Kept]) -> Kept:
    """Return what was made for a solution under this key, made now where it is new.

    Parameters
    ----------
    solution : Solution
    key : hashable
    make : callable
        What it returns must not hold the solution.
    """
    known = _KEPT.setdefault(solution, {})
    if key not in known:
        known[key] = make()
    found: Kept = known[key]
    return found


def graph_of(solution: Solution) -> PolicyGraph:
    """Return the graph that the solution's policy moves in."""
    return kept(solution, "graph", lambda: policy_graph(solution))


def reached_from(solution: Solution, start: int) -> Bools:
    """Return what the policy reaches from `start`, itself included, ``[S]``, read-only."""
    known: dict[int, Bools] = kept(solution, "reached", dict)
    if start not in known:
        while len(known) >= MOST_STARTS:
            del known[next(iter(known))]
        reached = graph_of(solution).reachable(start)
        reached.flags.writeable = False
        known[start] = reached
    return known[start]


def arriving(solution: Solution, start: int) -> Interval:
    """Return the probability that the policy arrives at the goal from `start`."""
    if _surely(solution, start):
        return Interval(value=1.0, lower=1.0, upper=1.0)
    lower, upper = kept(
        solution,
        "arrival",
        lambda: arrival(solution.problem.mdp, solution.policy, solution.goal, solution.hazard),
    )
    low, high = max(0.0, float(lower[start])), min(1.0, float(upper[start]))
    return Interval(value=(low + high) / 2, lower=low, upper=high)


def _surely(solution: Solution, start: int) -> bool:
    """Return whether the policy is known to arrive: its total is finite, and would not be if it could miss the goal."""
    first = solution.objectives[0]
    demands = isinstance(first, ExpectedReward) or (isinstance(first, ExpectedCost) and not first.maximise)
    bounds = solution.policy_lower[0, start], solution.policy_upper[0, start]
    return demands and bool(np.isfinite(bounds).all())
