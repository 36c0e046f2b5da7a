"""What is to be seen in a picture enters; a legend is drawn that says what each of it means."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ratherthan.render.canvas import Canvas, cut, number, text_width
from ratherthan.render.palette import PAPER, QUIET, Look

__all__ = ["Entry", "draw_legend", "legend_height", "legend_width", "sample_of", "swatch"]

SIZE = 13.0
ROW = 24.0
SWATCH = 34.0
GAP = 22.0
WIDEST = 330.0
"""Longer words are cut."""

Sample = Callable[[Canvas, float, float], None]
"""Draws an example of 30 by 16 units whose middle is at (x, y)."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One line of a legend: an example and its words."""

    words: str
    sample: Sample


def legend_width(entries: Sequence[Entry]) -> float:
    """Return how wide a legend of one column is."""
    return min(WIDEST, max((SWATCH + text_width(entry.words, SIZE) + 4.0 for entry in entries), default=0.0))


def _columns(entries: Sequence[Entry], width: float) -> tuple[int, float]:
    """Return how many entries stand side by side, and how wide each is."""
    widest = min(WIDEST, max((SWATCH + text_width(entry.words, SIZE) + 4.0 for entry in entries), default=width)) + GAP
    columns = max(1, min(len(entries), int((width + GAP) / widest)))
    return columns, (widest if columns > 1 else width)


def legend_height(entries: Sequence[Entry], width: float) -> float:
    """Return how high a legend is."""
    columns, _ = _columns(entries, width)
    return ROW * -(-len(entries) // columns)


def draw_legend(canvas: Canvas, entries: Sequence[Entry], x: float, y: float, width: float) -> None:
    """Draw a legend whose upper left corner is at (x, y)."""
    columns, step = _columns(entries, width)
    for place, entry in enumerate(entries):
        row, column = divmod(place, columns)
        left, middle = x + column * step, y + (row + 0.5) * ROW
        entry.sample(canvas, left + 15.0, middle)
        said = cut(entry.words, min(step, x + width - left) - SWATCH - 2.0, SIZE)
        canvas.text(left + SWATCH + 2.0, middle + 0.36 * SIZE, said, size=SIZE)


def sample_of(entry: Entry) -> str:
    """Return the example of a line of a legend as a picture of its own; the words beside it say what it is."""
    width, height = SWATCH + 2.0, ROW
    canvas = Canvas(width=width, height=height, title="", description="")
    canvas.rect(0.0, 0.0, width, height, fill=PAPER)
    entry.sample(canvas, width / 2.0, height / 2.0)
    size = f'width="{number(width)}" height="{number(height)}" viewBox="0 0 {number(width)} {number(height)}"'
    inside = "".join([*(canvas.definitions[name] for name in sorted(canvas.definitions)), *canvas.parts])
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} aria-hidden="true">{inside}</svg>'


def swatch(look: Look, pattern: Callable[[Canvas, Look], str | None]) -> Sample:
    """Return an example of a ground."""

    def draw(canvas: Canvas, x: float, y: float) -> None:
        canvas.rect(x - 13.0, y - 8.0, 26.0, 16.0, fill=look.fill, stroke=QUIET, stroke_width=0.75)
        name = pattern(canvas, look)
        if name is not None:
            canvas.rect(x - 13.0, y - 8.0, 26.0, 16.0, fill=f"url(#{name})")

    return draw
