"""A task enters, its equations leave: the system of its open states as they are, and with end components collapsed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model.watch import room_for
from ratherthan.solve.chain import nodes_of
from ratherthan.solve.goal import Goal, Task
from ratherthan.solve.system import System, build_system

__all__ = ["systems_of"]

Nodes = npt.NDArray[np.int64]

BYTES = 64
"""What equations take per branch of the model, with what is derived from them."""


def systems_of(task: Task) -> tuple[Nodes, System, System]:
    """Return the node of each state, the system with end components collapsed, and that of the open states as they are."""
    goal = task.goal
    room_for(BYTES * goal.index.work, f"The equations of a model of {goal.index.work} branches")
    single = nodes_of(task.open, task.fixed)
    collapsed = task.open & (task.component >= 0)
    whole = _system(goal, np.flatnonzero(task.allowed), single)
    if not collapsed.any():
        return single, whole, whole
    representative = np.arange(len(single))
    members = np.flatnonzero(collapsed)
    first = np.full(int(task.component.max()) + 1, len(single))
    np.minimum.at(first, task.component[members], members)
    representative[members] = first[task.component[members]]
    kept = task.open & (representative == np.arange(len(single)))
    count = int(np.count_nonzero(kept))
    node = np.where(task.fixed == 1.0, count + 1, count)
    node[kept] = np.arange(count)
    node[members] = node[representative[members]]
    external = np.flatnonzero(task.allowed & ~task.internal)
    return node, _system(goal, external, node), whole


def _system(goal: Goal, rows: Nodes, node: Nodes) -> System:
    """Return the system of some choices of a goal."""
    return build_system(
        goal.index,
        goal.probability,
        goal.cost,
        rows,
        node,
        size=goal.size,
        exact=goal.exact,
        signed=goal.signed,
        discount=goal.discount,
        given=True,
    )
