"""A drawing in a road map's document enters, its characters as an array leave: one per cell, with their places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

import numpy as np
import numpy.typing as npt

from ratherthan.io._roadmap_tables import spelled
from ratherthan.io._roadmap_text import Document

__all__ = ["Drawing", "drawing_of"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawing:
    """One character per cell; `rows` are the numbers of its lines in the string."""

    key: str
    codes: npt.NDArray[np.uint32]  # [N]
    width: int
    rows: list[int]
    lines: list[str]

    def fail(self, document: Document, cell: int, message: str) -> NoReturn:
        """Raise SourceError at the character of `cell`."""
        row, column = divmod(cell, self.width)
        line = self.lines[self.rows[row]]
        solid = [i for i, character in enumerate(line) if not character.isspace()]
        document.fail_in_drawing(message, (self.key,), self.rows[row], solid[column], cell=cell)


def drawing_of(document: Document, key: str) -> Drawing:
    """Read a drawing: lines of equal length, blanks ignored, empty lines only above and below."""
    value = document.tables.get(key)
    if not isinstance(value, str):
        came = "none" if value is None else spelled(value)
        holder = next((t for t, inner in document.tables.items() if isinstance(inner, dict) and key in inner), None)
        hint = f" '{key}' stands below [{holder}] and belongs above the first [section]." if holder else ""
        document.fail(f"A road map must have a drawing, {key} = ''' … ''', got {came}.{hint}", (key,))
    lines = value.split("\n")
    packed = ["".join(line.split()) for line in lines]
    rows = [i for i, line in enumerate(packed) if line]
    if not rows:
        document.fail(f"The drawing '{key}' must have at least one row of cells, got an empty one.", (key,))
    rows = list(range(rows[0], rows[-1] + 1))
    width = len(packed[rows[0]])
    for number, row in enumerate(rows):
        if len(packed[row]) != width:
            document.fail_in_drawing(
                f"All rows of the drawing '{key}' must have the same number of cells, "
                f"got {len(packed[row])} in row {number} and {width} in row 0.",
                (key,),
                row,
            )
    together = "".join(packed[rows[0] : rows[-1] + 1])
    codes = np.frombuffer(together.encode("utf-32-le", "surrogatepass"), dtype=np.uint32)
    return Drawing(key=key, codes=codes, width=width, rows=rows, lines=lines)
