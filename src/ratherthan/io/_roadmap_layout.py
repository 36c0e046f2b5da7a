"""A road map's document enters, a checked Layout leaves: cells, kinds, moves, chances, costs, labels and words as arrays.

Directions are numbered 0 north, 1 east, 2 south, 3 west; N is the number of cells, K that of kinds.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

import numpy as np
import numpy.typing as npt

from ratherthan.io import _roadmap_tables as tables
from ratherthan.io._roadmap_drawing import Drawing, drawing_of
from ratherthan.io._roadmap_moves import Directions, Ground, moves_of
from ratherthan.io._roadmap_tables import Legend
from ratherthan.io._roadmap_text import Document
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import Bools, Floats

__all__ = ["Layout", "layout_of"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Layout:
    """What a road map says, checked.

    Parameters
    ----------
    document : Document
        For faults that are found later (properties).
    ground : Ground
        The cells by their kinds.
    moves : array of int8, ``[N, 4]``
        The directions of each cell in order of preference, -1 where there is none.
    start : int
    success, drift : array of float, ``[K]``
        The chance that a move out of a kind of cell goes as meant; and that it slips sideways, half to each side.
    costs : dict of str to array of float, ``[K]``
    labels : dict of str to array of bool, ``[N]``
    lexicon : Lexicon
    """

    document: Document
    ground: Ground
    moves: Directions  # [N, 4]
    start: int
    success: Floats  # [K]
    drift: Floats  # [K]
    costs: dict[str, Floats]  # each [K]
    labels: dict[str, Bools]  # each [N]
    lexicon: Lexicon


def layout_of(document: Document) -> Layout:
    """Check every table and drawing of a road map.

    Raises
    ------
    SourceError
        At the first fault, with line and column.
    """
    tables.check_keys(document, document.tables, tables.TOP_KEYS)
    legend = tables.legend_of(document)
    drawing = drawing_of(document, "map")
    kind_of_cell = _kinds(document, drawing, legend)
    start = _start(document, drawing, legend, kind_of_cell)
    if not legend.mask(kind_of_cell, "destination").any():
        document.fail("A map must have at least one destination (D), got none.", ("map",))
    ground = Ground(drawing.width, legend, kind_of_cell)
    moves = moves_of(document, drawing, ground)
    needed = np.zeros(len(legend.kinds), dtype=bool)
    needed[np.unique(kind_of_cell[(moves >= 0).any(axis=1)])] = True
    success, drift = _chances(document, legend, needed)
    costs = tables.table_of(document, ("costs",)) or {"distance": 1}
    return Layout(
        document=document,
        ground=ground,
        moves=moves,
        start=start,
        success=success,
        drift=drift,
        costs={
            tables.identifier(document, ("costs", name), "cost"): tables.per_kind(
                document, ("costs", name), value, legend, needed
            )
            for name, value in costs.items()
        },
        labels=tables.labels_of(document, legend, kind_of_cell),
        lexicon=tables.words(document, len(kind_of_cell), costs),
    )


def _kinds(document: Document, drawing: Drawing, legend: Legend) -> npt.NDArray[np.uint8]:
    codes, inverse = np.unique(drawing.codes, return_inverse=True)
    index = [legend.index.get(chr(code), -1) for code in codes]
    kind_of_cell = np.array(index)[inverse]
    if (kind_of_cell < 0).any():
        cell = int(np.argmax(kind_of_cell < 0))
        known = ", ".join(f"'{c}' {legend.kinds[i].name}" for c, i in legend.index.items())
        drawing.fail(
            document,
            cell,
            f"A cell must be drawn by a character of the legend ({known}), got '{chr(drawing.codes[cell])}'. "
            "Section [kinds] adds kinds of your own.",
        )
    return kind_of_cell.astype(np.uint8)


def _start(document: Document, drawing: Drawing, legend: Legend, kind_of_cell: npt.NDArray[np.uint8]) -> int:
    """Return the one start: the cell S, or the key `start`."""
    drawn = np.flatnonzero(legend.mask(kind_of_cell, "start"))
    if len(drawn) > 1:
        drawing.fail(document, int(drawn[1]), f"A map must have one start, got cells {drawn[0]} and {drawn[1]}.")
    if "start" not in document.tables:
        if len(drawn) == 0:
            document.fail("A map must have a start: draw a cell S, or give its number, start = … .", ("map",))
        return int(drawn[0])
    start = tables.cell_number(document, ("start",), document.tables["start"], len(kind_of_cell))
    if len(drawn):
        document.fail(f"A map must have one start, got the cell S, {drawn[0]}, and start = {start}.", ("start",))
    kind = legend.kinds[kind_of_cell[start]]
    if not (kind.enter or kind.leave):
        document.fail(f"The start must be a cell where a robot can be, got {start}, {kind.name}.", ("start",))
    return start


def _chances(document: Document, legend: Legend, needed: Bools) -> tuple[Floats, Floats]:
    success, drift = (
        tables.per_kind(document, (key,), document.tables.get(key, default), legend, needed)
        for key, default in (("success", 1), ("drift", 0))
    )
    for i in np.flatnonzero(needed):
        name = legend.kinds[i].name
        keys = ("success", name) if isinstance(document.tables.get("success"), dict) else ("success",)
        if not 0 < success[i] <= 1:
            document.fail(f"'success' must be above 0 and at most 1, got {success[i]:g} for {name}.", keys)
        if Decimal(repr(float(success[i]))) + Decimal(repr(float(drift[i]))) > 1:
            document.fail(
                f"'success' and 'drift' must sum to 1 or less, got {success[i]:g} + {drift[i]:g} for {name}.",
                ("drift",),
            )
    return success, drift
