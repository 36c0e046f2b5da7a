"""A task of probabilities enters; its optimum leaves, with the policy that attains it and what could be proved of both."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.policy import Policy
from ratherthan.solve.chain import Evaluated, Guess, chain_of, evaluated
from ratherthan.solve.goal import Task
from ratherthan.solve.system import System
from ratherthan.solve.tied import first_tied, tied_choices
from ratherthan.solve.trapped.exact import is_exact
from ratherthan.solve.trapped.proof import TIES, bound_on_plateaus, margin_of_tied
from ratherthan.solve.trapped.traps import Trapped, avoid_traps

__all__ = ["Past", "past_traps"]

Nodes = npt.NDArray[np.int64]
Progress = Callable[[str], None]


class Past(NamedTuple):
    """What was found past traps."""

    values: Floats  # [N], of the open states
    bound: Floats | None  # [N], which no policy beats
    choice: Nodes  # [S]
    tied: Bools  # [C]
    attained: Evaluated
    rounds: int
    residual: float


def past_traps(
    task: Task,
    systems: tuple[System, System],
    node: Nodes,
    finest: int = 0,
    progress: Progress | None = None,
) -> Past | None:
    """Return the optimum of a task of probabilities, None where its equations could not be factored.

    Parameters
    ----------
    task : Task
    systems : tuple of System
        With end components collapsed, and as it is.
    node : array of int, ``[S]``
        The node of each state.
    finest : int
        Not 0: only the solver's own rows are tied.
    progress : callable, optional
    """
    core, whole = systems
    if not is_exact(core) or not is_exact(whole):
        return None
    found = avoid_traps(core, task.goal.maximise, progress=progress)
    if found is None:
        return None
    if progress is not None:
        progress("proving the bounds")
    own = node[task.open]
    bound = bound_on_plateaus(systems, own, found, task.goal.maximise, progress)
    several = np.bincount(own, minlength=core.nodes) > 1
    chosen, margin = margin_of_tied(core, found, several, len(TIES) - 1 if finest > 0 else 0)
    tied = tied_choices(task, core, np.where(chosen, 0.0, 1.0), np.zeros(core.rows), found.rows)
    choice = first_tied(task, tied)
    guess = None if margin is None else _guess(task, found, margin, node)
    attained = evaluated(task.goal, chain_of(task.goal, Policy(choice=choice)), guess)
    values = (found.high + found.low)[own]
    gain = np.maximum.reduceat(found.drift if task.goal.maximise else -found.drift, core.node_to_rows[:-1])
    residual = float(np.abs(gain).max())
    return Past(values, bound, choice, tied, attained, found.rounds, residual)


def _guess(task: Task, found: Trapped, margin: Floats, node: Nodes) -> Guess:
    """Return the values of all states with their margin."""
    guess = Guess(*(np.zeros(len(node)) for _ in range(3)))
    for part, values in zip(guess, (found.high, found.low, margin), strict=True):
        part[task.open] = values[node[task.open]]
    return guess
