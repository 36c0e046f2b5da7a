"""The ground and how a robot moves enter; branches and their lengths leave, all cells at once.

Cells are entered in 4 or 8 directions; a diagonal is √2 long and cuts no corner: both cells beside it must be open. With *P* the chance to
slip and *Q* the chance to stay, an attempt ends

- in the cell ahead with probability 1 - P - Q,
- in the next direction to the left, and to the right, with probability P/2 each, if that move is possible; else the robot stays,
- in the same cell with the rest.

The distance of an attempt is that of the way it takes, 0 where the robot stays. Its time is the length of the way it means to take divided
by the speed on the cell it starts from, whatever comes of it. Its risk is the distance, times the risk per unit of length of the cell it
comes to.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.errors import QuestionError
from ratherthan.io.grids._kernels import Turns, choices_in, rows_of
from ratherthan.model.compiling import compiled
from ratherthan.model.watch import room_for

__all__ = ["DIRECTIONS", "Motion", "Moves", "moves_on"]

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64] | npt.NDArray[np.int32]
BRANCH_BYTES = 28.0

DIRECTIONS = {
    "north": (-1, 0),
    "east": (0, 1),
    "south": (1, 0),
    "west": (0, -1),
    "northeast": (-1, 1),
    "southeast": (1, 1),
    "southwest": (1, -1),
    "northwest": (-1, -1),
}
"""The directions by name, as steps down and to the right; straight ones are preferred to diagonals."""
CIRCLE = ("north", "northeast", "east", "southeast", "south", "southwest", "west", "northwest")


@dataclass(frozen=True, kw_only=True)
class Motion:
    """How a robot moves.

    Parameters
    ----------
    directions : int
        4 or 8.
    slip : float
        The chance to go astray, half of it to either side.
    stay : float
        The chance that nothing happens.
    """

    directions: int = 8
    slip: float = 0.1
    stay: float = 0.0

    def __post_init__(self) -> None:
        if self.directions not in (4, 8):
            raise QuestionError(f"Directions must be 4 or 8, got {self.directions}.", directions=self.directions)
        for name, chance in (("slip", self.slip), ("stay", self.stay)):
            if not 0.0 <= chance < 1.0:
                raise QuestionError(f"The chance to {name} must be from 0 to below 1, got {chance:g}.", name=name)
        if self.slip + self.stay >= 1.0:
            raise QuestionError(
                f"The chances to slip and to stay must add up to less than 1, got {self.slip:g} and {self.stay:g}."
            )

    @property
    def actions(self) -> tuple[str, ...]:
        """The names of the directions, in the order of preference."""
        return tuple(DIRECTIONS)[: self.directions]


class Moves(NamedTuple):
    """The choices of all open cells, in the words of `MDP`, and what a branch costs."""

    cell_of_state: Ints  # [S]
    state_to_choices: Ints  # [S+1]
    choice_to_branches: Ints  # [C+1]
    branch_to_target: Ints  # [B]
    branch_to_probability: Floats  # [B]
    choice_to_action: Ints  # [C], -1 where a cell has no way out
    choice_length: Floats  # [C], of the way that is meant
    branch_length: Floats  # [B], of the way that is taken


def moves_on(opened: Bools, water: Bools, motion: Motion, side: float) -> Moves:
    """Return the moves on a ground.

    Parameters
    ----------
    opened, water : array of bool, ``[H, W]``
        Where a robot can be, and where it comes only from water.
    motion : Motion
    side : float
        The length of a cell's side.
    """
    ahead = _ahead(opened, water & opened, motion)
    length = _lengths(motion, side)
    names = motion.actions
    circle = [name for name in CIRCLE if name in names]
    left, right = (
        np.array([names.index(circle[(circle.index(name) + turn) % len(circle)]) for name in names], dtype=np.int32)
        for turn in (-1, 1)
    )
    turns = Turns(left=left, right=right, length=length, ahead=1.0 - motion.slip - motion.stay, aside=motion.slip / 2.0)
    work = 4 * ahead.size
    choices, count = compiled(choices_in, work)(ahead, turns)
    if count >= 1 << 31:
        raise QuestionError(
            f"A map must have fewer than {1 << 31} branches, this one has {count}. Give a larger --cell."
        )
    room_for(BRANCH_BYTES * count, f"A map with {count} branches")
    action = np.empty(choices, dtype=np.int32)
    rows = np.empty(len(ahead) + 1, dtype=np.int32), np.empty(choices + 1, dtype=np.int32), action
    branches = np.empty(count, dtype=np.int32), np.empty(count), np.empty(count)
    compiled(rows_of, work)(ahead, turns, rows, branches)
    return Moves(
        cell_of_state=np.flatnonzero(opened),
        state_to_choices=rows[0],
        choice_to_branches=rows[1],
        branch_to_target=branches[0],
        branch_to_probability=branches[1],
        choice_to_action=action,
        choice_length=np.append(length, side)[action],
        branch_length=branches[2],
    )


def _ahead(opened: Bools, wet: Bools, motion: Motion) -> npt.NDArray[np.int32]:
    """Return the state that lies in each direction of each open cell, -1 where there is no way, ``[S, D]``."""
    height, width = opened.shape
    number = np.full((height + 2, width + 2), -1, dtype=np.int32)  # with a rim that is closed
    number[1:-1, 1:-1][opened] = np.arange(int(opened.sum()), dtype=np.int32)
    swims = np.zeros((height + 2, width + 2), dtype=np.bool_)
    swims[1:-1, 1:-1] = wet
    ahead = np.empty((int(opened.sum()), len(motion.actions)), dtype=np.int32)
    for place, (down, right) in enumerate(DIRECTIONS[name] for name in motion.actions):
        rows, columns = slice(1 + down, 1 + down + height), slice(1 + right, 1 + right + width)
        there = number[rows, columns]
        passes = (there >= 0) & (swims[rows, columns] == wet)
        if down and right:
            passes &= (number[rows, 1:-1] >= 0) & (number[1:-1, columns] >= 0)
        ahead[:, place] = np.where(passes, there, -1)[opened]
    return ahead


def _lengths(motion: Motion, side: float) -> Floats:
    return np.array([side * (np.sqrt(2.0) if all(DIRECTIONS[name]) else 1.0) for name in motion.actions])
