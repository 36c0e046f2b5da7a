"""A policy and two states enter, the probability that the second is ever reached from the first leaves: by one system of equations."""

from __future__ import annotations

import numpy as np

from ratherthan.model.mdp import Floats
from ratherthan.verify.frame import Frame

__all__ = ["chance_to_visit"]

MOST, MOST_BRANCHES = 400, 200_000
"""So many unknowns are solved for at most, in a model of so many branches."""


def chance_to_visit(frame: Frame, weight: Floats, start: int, state: int) -> float | None:
    """Return the probability, None where that would take too much.

    Parameters
    ----------
    frame : Frame
    weight : array of float, ``[C]``
        How often the policy takes each choice of its state.
    start, state : int
    """
    if start == state:
        return 1.0
    if frame.mdp.branches > MOST_BRANCHES:
        return None
    there = np.zeros(frame.mdp.states, dtype=np.bool_)
    there[state] = True
    taken = weight > 0.0
    inside = frame.reach(there, frame.running & ~there, taken) & ~there
    if not inside[start]:
        return 0.0
    states = np.flatnonzero(inside)
    if len(states) > MOST:
        return None
    node = np.full(frame.mdp.states, -1, dtype=np.int64)
    node[states] = np.arange(len(states))
    origin, target = frame.row_state[frame.entry_row], frame.mdp.branch_to_target
    share = weight[frame.entry_row] * frame.share
    entry = np.flatnonzero(inside[origin] & (share > 0.0))
    within = entry[inside[target[entry]]]
    matrix = np.eye(len(states))
    np.subtract.at(matrix, (node[origin[within]], node[target[within]]), share[within])
    arriving = entry[target[entry] == state]
    right = np.bincount(node[origin[arriving]], weights=share[arriving], minlength=len(states))
    return float(np.clip(np.linalg.solve(matrix, right)[node[start]], 0.0, 1.0))
