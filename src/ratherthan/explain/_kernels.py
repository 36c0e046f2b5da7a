"""The moves of a policy enter; which states are reached, and the shortest ways, leave: loops that numpy cannot do in one stroke."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats

__all__ = ["Rows", "shortest_to", "spread"]

Numbers = npt.NDArray[np.int64]


class Rows(NamedTuple):
    """The edges that lead to each state."""

    first: Numbers  # [S+1]
    edge: Numbers  # [E]


def spread(first: Numbers, target: Numbers, seen: Bools, queue: Numbers, waiting: int) -> int:
    """Mark in `seen` all that the states ``queue[:waiting]`` lead to; return how many states were marked in all."""
    done = 0
    while done < waiting:
        state = queue[done]
        done += 1
        for edge in range(first[state], first[state + 1]):
            near = target[edge]
            if not seen[near]:
                seen[near] = True
                queue[waiting] = near
                waiting += 1
    return waiting


def shortest_to(origin: Numbers, length: Floats, into: Rows, goals: Bools) -> Floats:
    """Return the least total length from each state to one of `goals`, ∞ where there is none: Dijkstra's algorithm, backwards.

    The edges that lead to state s are ``into.edge[into.first[s]:into.first[s + 1]]``. The heap may hold a state more than once.
    """
    states = len(goals)
    distance = np.full(states, np.inf)
    done = goals & False
    near, waiting = np.empty(len(origin) + states), np.empty(len(origin) + states, np.int64)
    filled = 0
    for state in range(states):
        if goals[state]:
            distance[state] = 0.0
            near[filled], waiting[filled] = 0.0, state
            filled += 1
    while filled > 0:
        so_far, state = near[0], waiting[0]
        filled -= 1
        last, moved, place = near[filled], waiting[filled], 0
        while 2 * place + 1 < filled:
            below = 2 * place + 1
            if below + 1 < filled and near[below + 1] < near[below]:
                below += 1
            if near[below] >= last:
                break
            near[place], waiting[place] = near[below], waiting[below]
            place = below
        near[place], waiting[place] = last, moved
        if done[state]:
            continue
        done[state] = True
        for k in range(into.first[state], into.first[state + 1]):
            edge = into.edge[k]
            before = origin[edge]
            candidate = so_far + length[edge]
            if goals[before] or candidate >= distance[before]:
                continue
            distance[before] = candidate
            place = filled
            filled += 1
            while place > 0 and near[(place - 1) // 2] > candidate:
                near[place], waiting[place] = near[(place - 1) // 2], waiting[(place - 1) // 2]
                place = (place - 1) // 2
            near[place], waiting[place] = candidate, before
    return distance
