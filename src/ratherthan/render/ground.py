"""A map and a place on the canvas enter; its ground is drawn there: rectangles where cells are large, an image where they are small."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.explain.places import WorldRecord
from ratherthan.render.canvas import Canvas, element, number
from ratherthan.render.palette import PAPER, QUIET, Look, looks_of, rgb

__all__ = ["View", "draw_cells", "draw_frame", "draw_ground", "draw_pattern", "fitted", "pattern_of"]

SMALLEST = 6.0
"""From how many units a cell on its rectangles are drawn one by one."""
MOST_RECTS = 6000
LINED = 14.0
"""From how many units a cell on they are ruled."""


@dataclass(frozen=True, kw_only=True)
class View:
    """Where the cells of a map lie on a canvas: cell (0, 0) at (x, y), and how large one is."""

    x: float
    y: float
    cell: float
    columns: int
    rows: int

    @property
    def width(self) -> float:
        """Of the whole map."""
        return self.cell * self.columns

    @property
    def height(self) -> float:
        """Of the whole map."""
        return self.cell * self.rows

    def centre(self, column: float, row: float) -> tuple[float, float]:
        """Return the middle of a cell."""
        return self.x + (column + 0.5) * self.cell, self.y + (row + 0.5) * self.cell


def fitted(world: WorldRecord, x: float, y: float, room: tuple[float, float]) -> View:
    """Return the view of a map that fills the room it has, with cells neither huge nor of odd size."""
    cell = min(room[0] / world.width, room[1] / world.height, 72.0)
    if cell >= 4.0:
        cell = float(int(cell))
    return View(x=x, y=y, cell=cell, columns=world.width, rows=world.height)


def draw_ground(canvas: Canvas, view: View, world: WorldRecord) -> None:
    """Draw the ground of a map, its zones, and a frame around it."""
    looks = looks_of(world.kinds)
    ground = world.ground.reshape(world.height, world.width)
    runs = int(np.count_nonzero(np.diff(ground, axis=1))) + world.height
    if view.cell >= SMALLEST and runs <= MOST_RECTS:
        _rectangles(canvas, view, ground, looks)
    else:
        colours = np.array([rgb(look.fill) for look in looks], dtype=np.uint8)
        draw_cells(canvas, view, ground, colours)
    if view.cell >= LINED:
        _ruled(canvas, view)
    draw_frame(canvas, view)


def draw_frame(canvas: Canvas, view: View) -> None:
    """Draw a line around a map."""
    canvas.rect(view.x, view.y, view.width, view.height, fill="none", stroke=QUIET, stroke_width=1.0)


def draw_cells(
    canvas: Canvas,
    view: View,
    cells: npt.NDArray[np.uint8],
    colours: npt.NDArray[np.uint8],
    *,
    clear: int | None = None,
) -> None:
    """Draw cells as one image.

    Parameters
    ----------
    canvas : Canvas
    view : View
    cells : array of uint8, ``[H, W]``
        An index into `colours` per cell.
    colours : array of uint8, ``[n, 3]``
    clear : int, optional
        A colour that is not drawn.
    """
    from PIL import Image

    image = Image.frombuffer("P", (view.columns, view.rows), np.ascontiguousarray(cells), "raw", "P", 0, 1)
    image.putpalette(colours.ravel().tolist())
    kept = io.BytesIO()
    bits = 1 if len(colours) <= 2 else 2 if len(colours) <= 4 else 4 if len(colours) <= 16 else 8
    image.save(
        kept,
        format="PNG",
        bits=bits,
        optimize=False,
        compress_level=9,
        **({} if clear is None else {"transparency": clear}),
    )
    data = base64.b64encode(kept.getvalue()).decode("ascii")
    canvas.add(
        "image",
        x=view.x,
        y=view.y,
        width=view.width,
        height=view.height,
        preserveAspectRatio="none",
        style="image-rendering:pixelated" if view.cell >= 1.0 else None,
        href=f"data:image/png;base64,{data}",
    )


def pattern_of(canvas: Canvas, look: Look, size: float = 8.0) -> str | None:
    """Return the name of the pattern of a look, defined on the canvas; None where it has none."""
    if not look.pattern:
        return None
    half = size / 2.0
    line = {"stroke": look.ink, "stroke_width": 1.0, "fill": "none"}
    shapes = {
        "stripes": [element("path", d=f"M0 {number(size)}L{number(size)} 0", **line)],
        "dots": [element("circle", cx=half, cy=half, r=1.1, fill=look.ink)],
        "cross": [
            element(
                "path",
                d=f"M2 2L{number(size - 2)} {number(size - 2)}M2 {number(size - 2)}L{number(size - 2)} 2",
                **line,
            )
        ],
        "brick": [
            element(
                "path",
                d=f"M0 0H{number(size)}M0 {number(half)}H{number(size)}M0 0V{number(half)}M{number(half)} {number(half)}V{number(size)}",
                **line,
            )
        ],
        "lane": [element("path", d=f"M0 {number(half)}H{number(half)}", **line)],
        "waves": [
            element(
                "path",
                d=f"M0 {number(half)}Q{number(size / 4)} {number(half - 2)} {number(half)} {number(half)}T{number(size)} {number(half)}",
                **line,
            )
        ],
    }
    name = f"{look.pattern}-{look.ink.lstrip('#')}"
    inside = "".join(shapes[look.pattern])
    measure = number(size)
    return canvas.define(
        name,
        f'<pattern id="{name}" width="{measure}" height="{measure}" patternUnits="userSpaceOnUse">{inside}</pattern>',
    )


def _rectangles(canvas: Canvas, view: View, ground: npt.NDArray[np.uint8], looks: list[Look]) -> None:
    """Draw every kind of ground but white as one path of rectangles, and its pattern over it."""
    for kind, look in enumerate(looks):
        if look.fill == PAPER:
            continue
        shapes = _shapes(view, ground == kind)
        if shapes:
            canvas.add("path", d=shapes, fill=look.fill)
            draw_pattern(canvas, view, ground == kind, look)


def draw_pattern(canvas: Canvas, view: View, marked: npt.NDArray[np.bool_], look: Look) -> None:
    """Draw the pattern of a look over marked cells, ``[height, width]``."""
    shapes, pattern = _shapes(view, marked), pattern_of(canvas, look)
    if shapes and pattern is not None:
        canvas.add("path", d=shapes, fill=f"url(#{pattern})")


def _shapes(view: View, marked: npt.NDArray[np.bool_]) -> str:
    """Return the runs of marked cells as a path of rectangles."""
    return "".join(
        f"M{number(view.x + start * view.cell)} {number(view.y + row * view.cell)}"
        f"h{number((end - start) * view.cell)}v{number(view.cell)}h{number((start - end) * view.cell)}z"
        for row, start, end in _runs(marked)
    )


def _runs(marked: npt.NDArray[np.bool_]) -> Iterator[tuple[int, int, int]]:
    """Return (row, first column, column after the last) of the runs of marked cells."""
    padded = np.pad(marked, ((0, 0), (1, 1)))
    change = np.diff(padded.astype(np.int8), axis=1)
    rows, starts = np.nonzero(change == 1)
    ends = np.nonzero(change == -1)[1]
    yield from zip(rows.tolist(), starts.tolist(), ends.tolist(), strict=True)


def _ruled(canvas: Canvas, view: View) -> None:
    """Draw thin lines between cells."""
    across = "".join(
        f"M{number(view.x)} {number(view.y + row * view.cell)}h{number(view.width)}" for row in range(1, view.rows)
    )
    down = "".join(
        f"M{number(view.x + column * view.cell)} {number(view.y)}v{number(view.height)}"
        for column in range(1, view.columns)
    )
    if across or down:
        canvas.add("path", d=across + down, stroke="#d0d0d0", stroke_width=0.75, fill="none")
