"""A ground enters, the names of its cells leave: made when they are asked for, and found by what a person writes.

A cell is called ``cell (24, 6)``, column from the left and row from the top of the picture, or where the map lies in the world by
the middle of the cell in metres, ``(12.4 m, 3.1 m)``; inside a named zone by its name besides, ``the crossing, (12.4 m, 3.1 m)``.
Columns and rows are those of the map as its file has it. A larger cell, which holds several of them, is called
``cells (24, 6) to (25, 7)``, and found by each.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import overload

import numpy as np
import numpy.typing as npt

from ratherthan.errors import QuestionError
from ratherthan.model.world import Frame

__all__ = ["CellNames", "cell_of"]

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
METRES = re.compile(rf"\(?\s*({NUMBER})\s*m\s*,\s*({NUMBER})\s*m\s*\)?")
CELL = re.compile(r"(?:cell\s*)?\(?\s*([0-9]{1,9})\s*,\s*([0-9]{1,9})\s*\)?")
RANGE = re.compile(r"cells (\([0-9]{1,9}, [0-9]{1,9}\)) to \([0-9]{1,9}, [0-9]{1,9}\)")


def cell_of(text: str, width: int, height: int, frame: Frame | None) -> tuple[int, int] | None:
    """Return (column, row) of the cell that a text means, None where it means none.

    Parameters
    ----------
    text : str
        ``3,14`` or ``1.2m,3.4m``, with or without brackets and the word "cell".
    width, height : int
    frame : Frame, optional

    Raises
    ------
    QuestionError
        If it means a place that the map has not.

    Examples
    --------
    >>> cell_of("3, 14", 20, 20, None), cell_of("cell (3, 14)", 20, 20, None), cell_of("south", 20, 20, None)
    ((3, 14), (3, 14), None)
    """
    text = text.strip()
    metres, plain = METRES.fullmatch(text), CELL.fullmatch(text)
    if metres is not None:
        if frame is None:
            raise QuestionError(
                f"This map has no place in the world, so a cell must be given as column,row; got '{text}'.", state=text
            )
        x, y = float(metres[1]), float(metres[2])
        column, row = frame.cell(x, y, height) if math.isfinite(x) and math.isfinite(y) else (-1, -1)
    elif plain is not None:
        column, row = int(plain[1]), int(plain[2])
    else:
        return None
    if 0 <= column < width and 0 <= row < height:
        return column, row
    corners = [] if frame is None else [frame.at(a * width, b * height, height) for a in (0, 1) for b in (0, 1)]
    within = f"columns 0 to {width - 1} and rows 0 to {height - 1}"
    if corners and metres is not None:
        low, high = (tuple(f(c[i] for c in corners) for i in (0, 1)) for f in (min, max))
        within = f"x from {low[0]:g} to {high[0]:g} m and y from {low[1]:g} to {high[1]:g} m"
    raise QuestionError(f"A cell must lie on the map, which has {within}; got '{text}'.", state=text)


class CellNames(Sequence[str]):
    """The names of the open cells of a map.

    Parameters
    ----------
    cell_of_state : array of int, ``[S]``
        The cell of each state, row · width + column, ascending.
    width, height : int
    frame : Frame, optional
    zones : mapping of str to array of bool, ``[height*width]``
        Of those whose names are to be said, the first that holds a cell names it.
    scale : int
        How many cells of the file lie along the side of a cell.
    drawn : tuple of int, optional
        Width and height of the map in its file.
    """

    def __init__(
        self,
        cell_of_state: npt.NDArray[np.integer],
        width: int,
        height: int,
        frame: Frame | None = None,
        zones: Mapping[str, npt.NDArray[np.bool_]] | None = None,
        *,
        scale: int = 1,
        drawn: tuple[int, int] | None = None,
    ) -> None:
        self.cell_of_state, self.width, self.height, self.frame = cell_of_state, width, height, frame
        self.zones, self.scale = dict(zones or {}), scale
        self.drawn = drawn if drawn is not None else (width * scale, height * scale)
        self.rise = (
            height * scale - self.drawn[1]
        )  # so many rows lie above the map: larger cells are counted from below
        self.digits = 0 if frame is None else max(0, min(6, math.ceil(-math.log10(frame.resolution / 2.0))))

    def __len__(self) -> int:
        return len(self.cell_of_state)

    @overload
    def __getitem__(self, state: int) -> str: ...
    @overload
    def __getitem__(self, state: slice) -> list[str]: ...
    def __getitem__(self, state: int | slice) -> str | list[str]:
        """Return the name of one cell, or of several."""
        if isinstance(state, slice):
            return [self[i] for i in range(*state.indices(len(self)))]
        return self.of_cell(int(self.cell_of_state[state]))

    def of_cell(self, cell: int) -> str:
        """Return the name of a cell (row · width + column), whether a robot can be there or not."""
        row, column = divmod(cell, self.width)
        if self.frame is not None:
            x, y = self.frame.at(column + 0.5, row + 0.5, self.height)
            place = f"({_metres(x, self.digits)} m, {_metres(y, self.digits)} m)"
        elif self.scale == 1:
            place = f"cell ({column}, {row})"
        else:
            (left, top), last = self._corner(column, row), self.scale - 1
            right, bottom = (
                min(left + last, self.drawn[0] - 1),
                min(row * self.scale - self.rise + last, self.drawn[1] - 1),
            )
            place = f"cells ({left}, {top}) to ({right}, {bottom})"
        zone = next((name for name, inside in self.zones.items() if inside[cell]), None)
        return place if zone is None else f"{zone}, {place}"

    def _corner(self, column: int, row: int) -> tuple[int, int]:
        """Return (column, row) in the map's file of the upper left corner of a cell."""
        return column * self.scale, max(row * self.scale - self.rise, 0)

    def called(self, name: str) -> npt.NDArray[np.int64]:
        """Return the state of the cell that is called so: by column and row, by metres, or by its name."""
        for zone in self.zones:
            if name.startswith(f"{zone}, "):
                name = name.removeprefix(f"{zone}, ")
                break
        ranged = RANGE.fullmatch(name.strip())
        found = cell_of(name if ranged is None else ranged[1], *self.drawn, self._frame_drawn())
        if found is None:
            return np.empty(0, dtype=np.int64)
        column, row = found[0] // self.scale, (found[1] + self.rise) // self.scale
        cell = row * self.width + column
        state = int(np.searchsorted(self.cell_of_state, cell))
        if state < len(self) and int(self.cell_of_state[state]) == cell:
            return np.array([state])
        near = self.of_cell(int(self.cell_of_state[self.nearest(column, row)]))
        raise QuestionError(
            f"A robot must be able to stand there, but at {self.of_cell(cell)} is an obstacle, or one is too near. "
            f"The nearest place where it can stand: {near}.",
            state=name,
        )

    def _frame_drawn(self) -> Frame | None:
        """Return the frame of the map in its file."""
        return None if self.frame is None else replace(self.frame, resolution=self.frame.resolution / self.scale)

    def nearest(self, column: int, row: int) -> int:
        """Return the state whose cell is nearest to a cell."""
        rows, columns = np.divmod(self.cell_of_state.astype(np.int64), self.width)
        return int(np.argmin((rows - row) ** 2 + (columns - column) ** 2))


def _metres(value: float, digits: int) -> str:
    """Return a coordinate, halves rounded up so that neighbours keep their distance, without a sign where it is 0."""
    unit = 10.0**digits
    text = f"{math.floor(value * unit + 0.5 + 1e-6) / unit:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text
