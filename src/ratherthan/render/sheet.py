"""A title, a caption, the lines of a legend and the size of a body enter; a canvas leaves on which they stand, with room for the body.

The legend stands beside a body that is small and high enough, else beneath it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ratherthan.render import canvas as canvases
from ratherthan.render.canvas import Canvas, text_width, wrapped
from ratherthan.render.legend import Entry, draw_legend, legend_height, legend_width, sample_of
from ratherthan.render.palette import QUIET

__all__ = ["MARGIN", "Body", "Sheet", "sheet"]

MARGIN = 18.0
TITLE, CAPTION = 17.0, 13.0
LEAST = 460.0
"""No picture is narrower, so that words have room."""
BESIDE = 640.0
"""Up to how wide a body has its legend beside it."""
MOST_LINES = 12


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """The words around a picture.

    Parameters
    ----------
    title, description, caption : str
        What stands above, what a screen reader says, what stands beneath.
    entries : sequence of Entry
        The lines of the legend.
    """

    title: str
    description: str
    caption: str = ""
    entries: Sequence[Entry] = ()


@dataclass(frozen=True, kw_only=True)
class Body:
    """A canvas, and where on it the room for the body begins."""

    canvas: Canvas
    x: float
    y: float


def sheet(words: Sheet, width: float, height: float) -> Body:
    """Return a canvas with all words on it, and room for a body.

    Parameters
    ----------
    words : Sheet
    width, height : float
        Of the body.
    """
    legend = legend_width(words.entries)
    beside = width <= BESIDE and legend_height(words.entries, legend) <= max(height, 220.0) and legend <= 340.0
    total = max(LEAST, width + (legend + 1.5 * MARGIN if beside and words.entries else 0.0))
    title = _lines(words.title, total, TITLE)
    caption = _lines(words.caption, total, CAPTION)
    top = MARGIN + 1.45 * TITLE * len(title) + 4.0
    below = top + height
    legend_top, legend_left, legend_room = below + 0.7 * MARGIN, MARGIN, total
    if beside:
        legend_top, legend_left, legend_room = top, MARGIN + width + 1.5 * MARGIN, legend
        below = max(below, top + legend_height(words.entries, legend))
    elif words.entries:
        below = legend_top + legend_height(words.entries, total)
    end = below + (0.7 * MARGIN + 1.45 * CAPTION * len(caption) if caption else 0.0) + 0.7 * MARGIN
    canvas = Canvas(width=total + 2 * MARGIN, height=end, title=words.title, description=words.description)
    canvas.lines(MARGIN, MARGIN + 0.85 * TITLE, title, size=TITLE, font_weight="bold")
    draw_legend(canvas, words.entries, legend_left, legend_top, legend_room)
    canvas.lines(MARGIN, below + 0.7 * MARGIN + CAPTION, caption, size=CAPTION, fill=QUIET)
    left = MARGIN + (0.0 if beside else (total - width) / 2.0)
    canvas.body = canvases.Body(
        begin=len(canvas.parts),
        box=(left, top, width, height),
        caption=words.caption,
        legend=tuple((sample_of(entry), entry.words) for entry in words.entries),
    )
    return Body(canvas=canvas, x=left, y=top)


def _lines(words: str, width: float, size: float) -> list[str]:
    """Return a text in at most twelve lines; what is longer ends in an ellipsis."""
    lines = wrapped(words, width / (1.08 if size == TITLE else 1.0), size)
    if len(lines) <= MOST_LINES:
        return lines
    kept = lines[:MOST_LINES]
    while kept[-1] and text_width(kept[-1] + " …", size) > width:
        kept[-1] = kept[-1][:-1]
    kept[-1] += " …"
    return kept
