"""The streets and lists of a road map enter, the moves of every cell in order of preference leave.

Directions are numbered 0 north, 1 east, 2 south, 3 west; N is the number of cells.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.io._roadmap_drawing import Drawing, drawing_of
from ratherthan.io._roadmap_tables import ACTIONS, DIRECTIONS, STREET_CHARACTERS, Legend, cell_number, table_of, text_of
from ratherthan.io._roadmap_text import Document, closest, quoted_list
from ratherthan.model.mdp import Bools

__all__ = ["Cells", "Directions", "Ground", "drawn_moves", "moves_of", "neighbours"]

Cells = npt.NDArray[np.int64]
Directions = npt.NDArray[np.int8]
_TOWARDS = {"^": (0,), ">": (1,), "v": (2,), "<": (3,), "+": (0, 1, 2, 3), "-": (1, 3), "|": (0, 2)}


@dataclass(frozen=True, eq=False)
class Ground:
    """The cells of a map by their kinds: what can be entered, what can be left, and what lies beside what."""

    width: int
    legend: Legend
    kind_of_cell: npt.NDArray[np.uint8]  # [N]

    @cached_property
    def enter(self) -> Bools:
        """Whether moves may enter each cell, ``[N]``."""
        return np.array([kind.enter for kind in self.legend.kinds])[self.kind_of_cell]

    @cached_property
    def leave(self) -> Bools:
        """Whether moves may leave each cell, ``[N]``."""
        return np.array([kind.leave for kind in self.legend.kinds])[self.kind_of_cell]

    @cached_property
    def around(self) -> Cells:
        """The cell in each direction of each cell, ``[4, N]``."""
        return neighbours(self.width, len(self.kind_of_cell))

    def kind(self, cell: int) -> str:
        """Return the name of a cell's kind."""
        return self.legend.kinds[int(self.kind_of_cell[cell])].name

    def fault(self, cell: int, direction: int) -> str:
        """Return why a move is impossible, nothing where it is possible."""
        ahead = int(self.around[direction, cell])
        move = f"{DIRECTIONS[direction]} at cell {cell}"
        if not self.leave[cell]:
            return f"No move may leave a cell of the kind '{self.kind(cell)}', got {move}."
        if ahead < 0:
            return f"A move must stay on the map, got {move}, which is at the edge."
        if not self.enter[ahead]:
            return (
                f"A move must lead to a cell that can be entered, got {move}, "
                f"where cell {ahead} is of the kind '{self.kind(ahead)}'."
            )
        return ""


def moves_of(document: Document, drawing: Drawing, ground: Ground) -> Directions:
    """Return the directions of each cell in order of preference, ``[N, 4]``, -1 where there is none.

    Raises
    ------
    SourceError
        Where a move is impossible, or the drawing of the streets or a list breaks a rule of the format.
    """
    towards, arrow = _streets(document, drawing, ground)
    listed = _listed(document, len(arrow))
    for cell, directions in listed.items():
        arrow[cell] = directions[0] if len(directions) == 1 else -1
    moves = drawn_moves(towards, arrow, ground.enter, ground.around, _order(document))
    for cell, directions in listed.items():
        moves[cell] = -1
        moves[cell, : len(directions)] = directions
        for direction in directions:
            if fault := ground.fault(cell, direction):
                document.fail(fault, ("moves", str(cell)), cell=cell, action=DIRECTIONS[direction])
    _check_arrows(document, ground, arrow, listed)
    return moves


def _check_arrows(document: Document, ground: Ground, arrow: Directions, listed: Mapping[int, list[int]]) -> None:
    """Refuse an arrow that points off the map or at a cell that cannot be entered."""
    one_way = np.flatnonzero(arrow >= 0)
    ahead = ground.around[arrow[one_way], one_way]
    for cell in one_way[(ahead < 0) | ~ground.enter[ahead]].tolist():
        if cell not in listed:
            fault = ground.fault(cell, int(arrow[cell]))
            drawing_of(document, "streets").fail(document, cell, fault)


def neighbours(width: int, cells: int) -> Cells:
    """Return the cell in each direction of each cell, ``[4, N]``; -1 off the map."""
    cell = np.arange(cells)
    column = cell % width
    return np.stack(
        [
            np.where(cell >= width, cell - width, -1),
            np.where(column < width - 1, cell + 1, -1),
            np.where(cell < cells - width, cell + width, -1),
            np.where(column > 0, cell - 1, -1),
        ]
    )


def drawn_moves(towards: Bools, arrow: Directions, enter: Bools, around: Cells, order: tuple[int, ...]) -> Directions:
    """Return the moves ``[N, 4]`` that a drawing gives, in the stated order of preference.

    A cell with an arrow has this one move. Another has every direction it may go (`towards` ``[N, 4]``) whose neighbour
    can be entered (`enter` ``[N]``) and is not a one-way street that points back.
    """
    moves = np.full((len(arrow), 4), -1, dtype=np.int8)
    for slot, direction in enumerate(order):
        ahead = around[direction]
        open_ = towards[:, direction] & (ahead >= 0) & enter[ahead] & (arrow[ahead] != (direction + 2) % 4)
        moves[open_, slot] = direction
    one_way = arrow >= 0
    moves[one_way] = -1
    moves[one_way, 0] = arrow[one_way]
    return moves


def _streets(document: Document, drawing: Drawing, ground: Ground) -> tuple[Bools, Directions]:
    """Return where each cell may go ``[N, 4]``, and the arrow drawn in it ``[N]``, -1 for none."""
    leave, cells = ground.leave, len(ground.leave)
    towards = np.repeat(leave[:, None], 4, axis=1)
    arrow = np.full(cells, -1, dtype=np.int8)
    if "streets" not in document.tables:
        return towards, arrow
    streets = drawing_of(document, "streets")
    if (streets.width, len(streets.codes)) != (drawing.width, cells):
        height, came = cells // drawing.width, len(streets.codes) // streets.width
        document.fail(
            f"The drawing 'streets' must have the size of the map, {drawing.width} × {height} cells, "
            f"got {streets.width} × {came}.",
            ("streets",),
        )
    own = streets.codes == drawing.codes
    for character, directions in _TOWARDS.items():
        here = streets.codes == ord(character)
        own |= here
        if (here & ~leave).any():
            cell = int(np.argmax(here & ~leave))
            streets.fail(
                document,
                cell,
                f"No move may leave a cell of the kind '{ground.kind(cell)}', got '{character}' at cell {cell}.",
            )
        towards[here] = np.isin(np.arange(4), directions)
        if len(directions) == 1:
            arrow[here] = directions[0]
    if not own.all():
        cell = int(np.argmin(own))
        streets.fail(
            document,
            cell,
            f"A cell of the drawing 'streets' must be one of {' '.join(STREET_CHARACTERS)} or the character that the map "
            f"has there ('{chr(drawing.codes[cell])}'), got '{chr(streets.codes[cell])}'.",
        )
    return towards, arrow


def _listed(document: Document, cells: int) -> dict[int, list[int]]:
    """Return the directions of the cells that section [moves] lists."""
    listed: dict[int, list[int]] = {}
    for key, value in table_of(document, ("moves",)).items():
        keys = ("moves", key)
        cell = cell_number(document, keys, key, cells)
        if cell in listed:
            document.fail(f"A cell's moves must be listed once, got a second list for cell {cell}.", keys)
        names = _action_words(document, keys, value)
        if "stay" in names and len(names) > 1:
            document.fail(
                f"'stay' must stand alone: a robot stays where there is no move, got {quoted_list(names)}.", keys
            )
        listed[cell] = [DIRECTIONS.index(name) for name in names if name != "stay"]
    return listed


def _action_words(document: Document, keys: tuple[str, ...], value: Any) -> list[str]:
    parts = value if isinstance(value, list) else [value]
    names = [word for part in parts for word in re.split(r"[\s,]+", text_of(document, keys, part)) if word]
    for i, name in enumerate(names):
        if name not in ACTIONS:
            document.fail(f"A move must be one of {quoted_list(ACTIONS)}, got '{name}'.{closest(name, ACTIONS)}", keys)
        if name in names[:i]:
            document.fail(f"A move must be listed once, got '{name}' twice.", keys)
    if not names:
        document.fail("The moves of a cell must be listed ('stay' where there is none), got none.", keys)
    return names


def _order(document: Document) -> tuple[int, ...]:
    """Return the directions in the stated order of preference."""
    names = _action_words(document, ("order",), document.tables.get("order", " ".join(DIRECTIONS)))
    if sorted(names) != sorted(DIRECTIONS):
        document.fail(f"'order' must name the four directions once each, got {quoted_list(names)}.", ("order",))
    return tuple(DIRECTIONS.index(name) for name in names)
