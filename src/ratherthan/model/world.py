"""Places and zones of a map enter, a World leaves: where states lie, and what kind of ground each cell is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ratherthan.errors import ModelError

__all__ = ["WATER", "Frame", "World"]

WATER = "water"
"""The kind of ground of a robot's map that is entered from, and left to, its own kind only."""
NUDGE = 1e-9
"""So much of a cell lies to the cell on its right and above: a point on the line between two, but for rounding, is in that one."""


@dataclass(frozen=True, kw_only=True)
class Frame:
    """Where a map lies in the world, in metres; the lower left corner of the map is at (x, y).

    Parameters
    ----------
    resolution : float
        Metres along the side of a cell.
    x, y : float
        The lower left corner of the lowest row's first cell, in metres.
    yaw : float
        The angle by which the map is turned about that corner, counterclockwise, in radians.
    """

    resolution: float
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def at(self, column: float, row: float, height: int) -> tuple[float, float]:
        """Return the world's coordinates of a point of the map, columns and rows counted from the upper left corner.

        Examples
        --------
        >>> Frame(resolution=0.5, x=-1.0, y=2.0).at(0.5, 9.5, 10)
        (-0.75, 2.25)
        """
        right, up = column * self.resolution, (height - row) * self.resolution
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + cos * right - sin * up, self.y + sin * right + cos * up

    def cell(self, x: float, y: float, height: int) -> tuple[int, int]:
        """Return (column, row) of the cell that a point of the world lies in; it may lie outside the map.

        Examples
        --------
        >>> Frame(resolution=0.5, x=-1.0, y=2.0).cell(-0.6, 2.1, 10)
        (0, 9)
        """
        right, up = x - self.x, y - self.y
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        column, above = (cos * right + sin * up) / self.resolution, (cos * up - sin * right) / self.resolution
        return math.floor(column + NUDGE), height - 1 - math.floor(above + NUDGE)


@dataclass(frozen=True, kw_only=True, eq=False)
class World:
    """A map of cells: width × height, row by row, row 0 at the top (north), column 0 at the left (west).

    Parameters
    ----------
    width, height : int
        In cells.
    kinds : tuple of str
        The kinds of ground there are, such as ``"building"``, ``"highway"``.
    kind_of_cell : array of uint8, ``[height*width]``
        An index into `kinds` per cell.
    cell_of_state : array of int32, ``[S]``
        The cell that each state lies in (row · width + column), -1 where it lies nowhere.
    zones : mapping of str to array of bool, ``[height*width]``
        Named parts of the map.
    note : str
        Said wherever the map is shown ("reconstruction").
    title : str
        What the map is called.
    frame : Frame, optional
        Where the map lies in the world, if it has a place there.
    """

    width: int
    height: int
    kinds: tuple[str, ...]
    kind_of_cell: npt.NDArray[np.uint8]  # [height*width]
    cell_of_state: npt.NDArray[np.int32]  # [S]
    zones: Mapping[str, npt.NDArray[np.bool_]] = field(default_factory=dict)
    note: str = ""
    title: str = ""
    frame: Frame | None = None

    def __post_init__(self) -> None:
        cells = self.width * self.height
        if self.kind_of_cell.shape != (cells,):
            raise ModelError(
                f"A map of {self.width}×{self.height} cells must have {cells} kinds, got {self.kind_of_cell.shape}."
            )

    def place(self, state: int) -> tuple[int, int] | None:
        """Return (column, row) of a state, None where it lies nowhere."""
        cell = int(self.cell_of_state[state])
        return None if cell < 0 else (cell % self.width, cell // self.width)
