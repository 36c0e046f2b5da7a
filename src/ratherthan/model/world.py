"""Places and zones of a map enter, a World leaves: where states lie, and what kind of ground each cell is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ratherthan.errors import ModelError

__all__ = ["World"]


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
    """

    width: int
    height: int
    kinds: tuple[str, ...]
    kind_of_cell: npt.NDArray[np.uint8]  # [height*width]
    cell_of_state: npt.NDArray[np.int32]  # [S]
    zones: Mapping[str, npt.NDArray[np.bool_]] = field(default_factory=dict)
    note: str = ""
    title: str = ""

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
