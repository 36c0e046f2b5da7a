"""Cells of a map enter; crosses over them or a line around them are drawn: single shapes, or one image where there are many."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from ratherthan.render.canvas import Canvas, number
from ratherthan.render.ground import View, draw_cells
from ratherthan.render.palette import HAZARD, PAPER, ZONE, rgb

__all__ = ["draw_crosses", "draw_zone"]

Bools = npt.NDArray[np.bool_]

MOST_SHAPES = 1500
"""More shapes than these become an image."""


def draw_crosses(canvas: Canvas, view: View, marked: Bools) -> None:
    """Draw a cross over each marked cell, ``[height*width]``."""
    cells = np.flatnonzero(marked)
    if len(cells) == 0:
        return
    if len(cells) > MOST_SHAPES or view.cell < 5.0:
        _stain(canvas, view, marked.reshape(view.rows, view.columns), HAZARD)
        return
    reach = 0.28 * view.cell
    shapes = []
    for cell in cells.tolist():
        x, y = view.centre(cell % view.columns, cell // view.columns)
        a, b, c, d = (number(part) for part in (x - reach, y - reach, x + reach, y + reach))
        shapes.append(f"M{a} {b}L{c} {d}M{a} {d}L{c} {b}")
    canvas.add("path", d="".join(shapes), stroke=HAZARD, stroke_width=max(1.0, 0.06 * view.cell), fill="none")


def draw_zone(canvas: Canvas, view: View, inside: Bools) -> None:
    """Draw a dotted line around the cells of a zone, ``[height, width]``."""
    padded = np.pad(inside, 1)
    sides = (padded[1:] != padded[:-1], (padded[:, 1:] != padded[:, :-1]).T)  # above each row, left of each column
    if sum(map(_runs, sides)) > MOST_SHAPES:
        inner = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
        _stain(canvas, view, inside & ~inner, ZONE)
        return
    line = "".join(_lines(view, sides[0], across=True)) + "".join(_lines(view, sides[1], across=False))
    if line:
        canvas.add("path", d=line, fill="none", stroke=PAPER, stroke_width=3.5)
        canvas.add("path", d=line, fill="none", stroke=ZONE, stroke_width=1.8, stroke_dasharray="2 3")


def _runs(sides: Bools) -> int:
    """Return how many straight lines the sides make up."""
    return int(np.count_nonzero(sides[:, 1:] & ~sides[:, :-1]))


def _lines(view: View, sides: Bools, *, across: bool) -> Iterator[str]:
    """Yield the lines that sides make up, each as long as it is straight."""
    change = np.diff(sides.astype(np.int8), axis=1)
    line, first = np.nonzero(change == 1)
    last = np.nonzero(change == -1)[1]
    for at, begin, end in zip(line.tolist(), first.tolist(), last.tolist(), strict=True):
        x, y = (begin, at) if across else (at, begin)
        run = number((end - begin) * view.cell)
        yield f"M{number(view.x + x * view.cell)} {number(view.y + y * view.cell)}{'h' if across else 'v'}{run}"


def _stain(canvas: Canvas, view: View, marked: Bools, colour: str) -> None:
    """Draw marked cells as an image that is clear elsewhere."""
    colours = np.array([(0, 0, 0), rgb(colour)], dtype=np.uint8)
    draw_cells(canvas, view, marked.astype(np.uint8), colours, clear=0)
