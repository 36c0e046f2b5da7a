"""Probabilities to reach a goal past traps: a task and its system enter, nearly its optimum and proved bounds of it leave."""

from __future__ import annotations

from ratherthan.model._kernels import is_compiled
from ratherthan.solve.goal import Kind, Task
from ratherthan.solve.system import System

__all__ = ["ENGINE", "suits_traps"]

ENGINE = "policy iteration past traps"
FEWEST = 3000
"""From how many nodes on it is worth while: below, equations are solved at once."""


def suits_traps(task: Task, core: System) -> bool:
    """Return whether probabilities are wanted, of many states."""
    return task.goal.kind is Kind.PROBABILITY and core.nodes >= FEWEST and is_compiled(len(core.target))
