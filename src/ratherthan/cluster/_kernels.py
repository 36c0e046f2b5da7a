"""The rows of a graph and states with known distances enter; the distances of all states leave."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Ints

__all__ = ["seeded_levels"]

Ints64 = npt.NDArray[np.int64]


def seeded_levels(
    entering_from: Ints, entering: Ints, choice_state: Ints, allowed: Bools, level: Ints64, seeds: Ints64
) -> None:
    """Breadth-first search backwards from states whose distances differ.

    `seeds` are sorted by their `level`; it is -1 where a state may be reached and -2 where it may not, and leaves with the
    distance of every reached state, those of seeds as far as they are less than given.
    """
    states = len(level)
    queue = np.zeros(states, np.int64)
    done = np.zeros(states, np.bool_)
    head, filled, begun = 0, 0, 0
    while head < filled or begun < len(seeds):
        if begun >= len(seeds) or (head < filled and level[queue[head]] <= level[seeds[begun]]):
            state = queue[head]
            head += 1
        else:
            state = seeds[begun]
            begun += 1
        if done[state]:
            continue
        done[state] = True
        for i in range(entering_from[state], entering_from[state + 1]):
            choice = entering[i]
            if allowed[choice]:
                before = choice_state[choice]
                if not done[before] and (level[before] == -1 or level[before] > level[state] + 1):
                    level[before] = level[state] + 1
                    if filled < states:
                        queue[filled] = before
                        filled += 1
