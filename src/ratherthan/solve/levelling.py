"""A Task with end components where gains and losses cancel enters; the same task leaves with that taken out, or nothing.

For any potential h with h = 0 where the value is known, x solves the equations of r̄ if and only if x - h solves those of
r̄ + P h - h; a policy that arrives is worth h less in every state. So a cycle that gives +1 there and takes 1 back can be *levelled*:
with the right h its choices pay exactly nothing, and like all end components of such choices it is collapsed (`gathering`).

"Exactly" must be exact. It is looked for where choices are tied, go to one state for sure, and their rewards were not
rounded: h is added up along such choices from one state of each of their end components. A choice is level if h(s) - h(t)
equals its reward without rounding. Other choices get their share of h with a rounding error, which is allowed for.

Where gains and losses cancel by chance this does not help. Then the states that cannot come to such a component are a task of
their own, which can be proved (`without_cancelling`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model.index import Index
from ratherthan.model.mdp import Bools, Floats
from ratherthan.solve.goal import Goal, Task
from ratherthan.solve.system import ROUNDING, two_sum

__all__ = ["levelled", "raised", "without_cancelling"]

Choices = npt.NDArray[np.int64]


def levelled(task: Task, tied: Bools) -> tuple[Goal, Floats] | None:
    """Return the goal of a task with cycles of gains and losses taken out, and the potential h; None where there are none.

    Parameters
    ----------
    task : Task
    tied : array of bool, ``[C]``
        The choices that cannot be told from the best.

    Returns
    -------
    Goal
    h : array of float, ``[S]``
        0 where the task is not open.
    """
    goal = task.goal
    index = goal.index
    target = index.branch_to_target[index.choice_to_branches[:-1]]
    certain = ~graph.any_branch_in_rows(index, index.branch_to_target != target[index.branch_to_choice])
    component, internal = graph.end_components(index, task.open, task.allowed & tied & certain & goal.exact)
    if not (internal & goal.costly).any():
        return None
    height = _heights(goal, component, internal)
    step, lost = two_sum(height[index.choice_to_state], -height[target])
    level = internal & (step == goal.cost) & (lost == 0.0)
    if not (level & goal.costly).any() or not np.isfinite(height).all():
        return None
    return _tilted(goal, height, level), height


def without_cancelling(task: Task, tied: Bools) -> Task | None:
    """Return the task of the states that cannot come to end components where tied choices pay; None if that is all or none.

    Parameters
    ----------
    task : Task
    tied : array of bool, ``[C]``
    """
    goal = task.goal
    index = goal.index
    component, internal = graph.end_components(index, task.open, task.allowed & tied)
    paying = np.zeros(int(component.max(initial=-1)) + 2, dtype=np.bool_)  # the last one is for no component
    paying[component[index.choice_to_state[internal & goal.costly]]] = True
    near = graph.can_reach(index, paying[component] & task.open, task.open, task.allowed)
    rest = task.open & ~near
    if not rest.any() or not near.any():
        return None
    own = rest[index.choice_to_state]
    return replace(
        task,
        open=rest,
        allowed=task.allowed & own,
        component=np.where(rest, task.component, -1),
        internal=task.internal & own,
        arriving=task.arriving & ~near,
    )


def _heights(goal: Goal, component: Choices, internal: Bools) -> Floats:
    """Return h: 0 at the first state of each component, and added up along internal choices from there."""
    index = goal.index
    first = np.zeros(index.states, dtype=np.bool_)
    members = np.flatnonzero(component >= 0)
    first[members[np.unique(component[members], return_index=True)[1]]] = True
    distance = graph.levels_to(index, first, component >= 0, internal)
    down = graph.first_downhill(index, distance, internal)
    height = np.zeros(index.states)
    order = members[np.argsort(distance[members], kind="stable")]
    for layer in np.split(order, np.flatnonzero(np.diff(distance[order])) + 1)[1:]:
        target = index.branch_to_target[index.choice_to_branches[down[layer]]]
        height[layer] = goal.cost[down[layer]] + height[target]
    return height


def _tilted(goal: Goal, height: Floats, level: Bools) -> Goal:
    """Return the goal with r̄ + P h - h in the place of r̄, exactly 0 at the choices that are level."""
    index: Index = goal.index
    begin = index.choice_to_branches[:-1]
    step = height[index.branch_to_target] - height[index.choice_to_state[index.branch_to_choice]]
    moved = graph.any_branch_in_rows(index, step != 0.0)
    cost = goal.cost + np.add.reduceat(goal.probability * step, begin)
    # Twice: it is rounded here, and again where drifts are computed.
    size = 2.0 * (goal.size + np.add.reduceat(goal.probability * np.abs(step), begin))
    error = (np.diff(index.choice_to_branches) + 8) * ROUNDING * size
    return replace(
        goal,
        cost=np.where(level, 0.0, np.where(moved, cost, goal.cost)),
        size=np.where(level, 0.0, np.where(moved, size, goal.size)),
        costly=(goal.costly | moved) & ~level,
        gaining=level | np.where(moved, cost >= error, goal.gaining),
        losing=level | np.where(moved, cost <= -error, goal.losing),
        exact=level | ~moved & goal.exact,
    )


def raised(values: Floats, height: Floats, direction: float) -> Floats:
    """Return values + h, rounded towards `direction`; where nothing is lost it is exact."""
    total, lost = two_sum(values, height)
    with np.errstate(invalid="ignore"):
        exact = (lost == 0.0) | (height == 0.0) | ~np.isfinite(values)
    return np.where(height == 0.0, values, np.where(exact, total, np.nextafter(total, direction)))
