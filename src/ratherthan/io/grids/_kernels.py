"""What lies ahead of each cell in each direction enters; choices and branches in compressed rows leave."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = ["Turns", "choices_in", "rows_of"]

Numbers = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]


class Turns(NamedTuple):
    """The directions: the next one to the left and to the right of each, how long a step is, and the chances of an attempt."""

    left: Numbers  # [D]
    right: Numbers  # [D]
    length: Floats  # [D]
    ahead: float
    aside: float


def choices_in(ahead: Numbers, turns: Turns) -> tuple[int, int]:
    """Return how many choices and branches there are; `ahead` ``[S, D]`` is -1 where there is no way."""
    choices, branches = 0, 0
    for state in range(ahead.shape[0]):
        before = choices
        for way in range(ahead.shape[1]):
            if ahead[state, way] < 0:
                continue
            choices += 1
            branches += 1
            total = turns.ahead
            if turns.aside > 0.0:
                for side in (turns.left[way], turns.right[way]):
                    if ahead[state, side] >= 0:
                        branches += 1
                        total += turns.aside
            if 1.0 - total >= 1e-15:
                branches += 1
        if choices == before:
            choices += 1
            branches += 1
    return choices, branches


def rows_of(
    ahead: Numbers, turns: Turns, rows: tuple[Numbers, Numbers, Numbers], branches: tuple[Numbers, Floats, Floats]
) -> None:
    """Fill in `rows` (state to choices, choice to branches, the action or -1) and `branches` (target, chance, length).

    A choice's branches are ahead, left, right, and staying; a state without a way out has the
    one choice to stay.
    """
    first_choice, first_branch, action = rows
    target, chance, length = branches
    choice, branch = 0, 0
    for state in range(ahead.shape[0]):
        first_choice[state] = choice
        for way in range(ahead.shape[1]):
            if ahead[state, way] < 0:
                continue
            first_branch[choice], action[choice] = branch, way
            choice += 1
            target[branch], chance[branch], length[branch] = ahead[state, way], turns.ahead, turns.length[way]
            branch += 1
            total = turns.ahead
            if turns.aside > 0.0:
                for side in (turns.left[way], turns.right[way]):
                    if ahead[state, side] >= 0:
                        target[branch], chance[branch] = ahead[state, side], turns.aside
                        length[branch] = turns.length[side]
                        branch += 1
                        total += turns.aside
            if 1.0 - total >= 1e-15:
                target[branch], chance[branch], length[branch] = state, 1.0 - total, 0.0
                branch += 1
        if choice == first_choice[state]:
            first_branch[choice], action[choice] = branch, -1
            choice += 1
            target[branch], chance[branch], length[branch] = state, 1.0, 0.0
            branch += 1
    first_choice[ahead.shape[0]] = choice
    first_branch[choice] = branch
