"""Rows of numbers enter, figures as SVG leave: points with their intervals, or answers as parts of a bar.

The same numbers give the same bytes. Meaning never hangs on colour alone: points carry their numbers, parts of a bar run from light
to dark, and published values are open diamonds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ratherthan.render.canvas import Canvas, Picture, cut, text_width, wrapped
from ratherthan.render.palette import BLUES, INK, QUIET, ink_on, shade

__all__ = ["Axis", "Row", "axis_of", "likert_chart", "points_chart"]

WIDTH, LEFT, LEFTMOST, RIGHT, STEP, SIZE = 640.0, 186.0, 300.0, 62.0, 34.0, 14.0
MARKS = (
    (1, 1.1, 1.2, 1.3, 1.4, 1.6, 1.8, 2, 2.5, 3, 4, 5, 6, 7, 8, 9),
    (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 7),
    (1, 1.5, 2, 3, 5, 7),
    (1, 2, 5),
    (1,),
)
"""Ticks of a log axis within a power of ten, from many to few: the first that are few enough are taken."""
LINE, FOUND, PUBLISHED = "#c9c9c9", "#0b3560", "#a84300"


@dataclass(frozen=True, kw_only=True)
class Row:
    """One row of a chart: a value, its interval, how the value is written, and the value published elsewhere."""

    label: str
    value: float
    low: float | None = None
    high: float | None = None
    text: str = ""
    published: float | None = None


@dataclass(frozen=True, kw_only=True)
class Axis:
    """The axis of a chart."""

    least: float
    most: float
    ticks: tuple[tuple[float, str], ...]
    title: str
    log: bool = False
    line: float | None = None  # where a line stands out: no difference

    def place(self, value: float) -> float:
        """Return where a value lies, from 0 to 1; what lies beyond the ends lies at them."""
        a, b, x = (math.log(v) if self.log else v for v in (self.least, self.most, max(value, self.least)))
        return min(1.0, max(0.0, (x - a) / (b - a)))


def axis_of(
    values: Sequence[float],
    title: str,
    *,
    log: bool = False,
    line: float | None = None,
    ends: tuple[float, float] | None = None,
    percent: bool = False,
) -> Axis:
    """Return an axis on which all values lie, with ticks at round numbers.

    Parameters
    ----------
    values : sequence of float
        At least one; positive where `log`.
    title : str
    log : bool
    line : float, optional
    ends : tuple of float, optional
        The ends of the axis, where they are given.
    percent : bool
        Whether values are shares.
    """
    shown = [*values, *(() if line is None else (line,))]
    least, most = (min(shown), max(shown)) if ends is None else ends
    if log:
        low, high = least / 1.05, most * 1.05
        ticks = next(ticks for marks in MARKS if len(ticks := _log_ticks(low, high, marks)) <= 7 or marks == MARKS[-1])
        return Axis(least=low, most=high, ticks=tuple((t, f"{t:.3g}") for t in ticks), title=title, log=True, line=line)
    room = (most - least) or max(abs(most), 1.0)
    step = 10.0 ** math.floor(math.log10(room / 4))
    step *= next(m for m in (1, 2, 2.5, 5, 10) if room / (m * step) <= 6)
    if ends is None:
        least, most = math.floor(least / step + 1e-9) * step, math.ceil(most / step - 1e-9) * step
        most = most if most > least else least + step
    first = math.ceil(least / step - 1e-9)
    ticks = [k * step for k in range(first, math.floor(most / step + 1e-9) + 1)]
    digits = max(0, -math.floor(math.log10(step) + 1e-9)) + (1 if f"{step:.1e}".startswith("2.5") else 0)
    texts = [f"{100 * t:.0f} %" if percent else f"{t:.{digits}f}".replace("-", "−") for t in ticks]
    return Axis(least=least, most=most, ticks=tuple(zip(ticks, texts, strict=True)), title=title, line=line)


def _log_ticks(low: float, high: float, marks: tuple[float, ...]) -> list[float]:
    """Return the marks of each power of ten that lie on an axis."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    every = 1 + (last - first) // 7
    return [m * 10.0**e for e in range(first, last + 1, every) for m in marks if low <= m * 10.0**e <= high]


def points_chart(rows: Sequence[Row], axis: Axis, *, title: str, description: str, mark: str = "") -> Picture:
    """Return a chart with a row for each value.

    Parameters
    ----------
    rows : sequence of Row
    axis : Axis
    title, description : str
        What a screen reader says.
    mark : str
        Words set over the chart in a strong line, where the numbers are simulated.
    """
    left = min(LEFTMOST, max(LEFT, *(text_width(row.label, SIZE) for row in rows)) + 14.0) if rows else LEFT
    top = 44.0 if mark else 14.0
    bottom = top + STEP * len(rows)
    titles = wrapped(axis.title, WIDTH - 20.0, 13.0)[:2]
    canvas = Canvas(width=WIDTH, height=bottom + 38.0 + 18.0 * len(titles), title=title, description=description)
    _marked(canvas, mark)

    def x(value: float) -> float:
        return left + axis.place(value) * (WIDTH - left - RIGHT)

    for value, text in axis.ticks:
        canvas.path([(x(value), top), (x(value), bottom)], stroke=LINE, stroke_width=1.0)
        canvas.text(x(value), bottom + 18.0, text, size=13.0, text_anchor="middle")
    if axis.line is not None:
        canvas.path([(x(axis.line), top), (x(axis.line), bottom)], stroke=INK, stroke_width=1.5, stroke_dasharray="5 4")
    for i, line in enumerate(titles):
        canvas.text(WIDTH / 2, bottom + 42.0 + 18.0 * i, line, size=13.0, text_anchor="middle", fill=QUIET)
    for i, row in enumerate(rows):
        y = top + STEP * (i + 0.5)
        _labelled(canvas, row.label, left, y)
        if row.low is not None and row.high is not None:
            a, b = x(row.low), x(row.high)
            canvas.path([(a, y), (b, y)], stroke=FOUND, stroke_width=2.5)
            for end in (a, b):
                canvas.path([(end, y - 6.0), (end, y + 6.0)], stroke=FOUND, stroke_width=2.0)
        canvas.add("circle", cx=x(row.value), cy=y, r=5.0, fill=FOUND)
        if row.published is not None:
            c = x(row.published)
            canvas.path(
                [(c, y - 8.0), (c + 8.0, y), (c, y + 8.0), (c - 8.0, y)],
                closed=True,
                stroke=PUBLISHED,
                stroke_width=2.0,
            )
        canvas.text(WIDTH - RIGHT + 10.0, y + 5.0, row.text, size=SIZE)
    return canvas.picture()


def _marked(canvas: Canvas, mark: str) -> None:
    """Set a strong line of words over a chart."""
    if mark:
        style = {"text_anchor": "middle", "font_weight": "bold", "fill": PUBLISHED}
        canvas.text(WIDTH / 2, 22.0, cut(mark, WIDTH - 20, SIZE), size=SIZE, **style)


def _labelled(canvas: Canvas, label: str, left: float, y: float) -> None:
    """Write the label of a row about the height `y`: in one line, or in two smaller ones."""
    if text_width(label, SIZE) <= left - 16.0:
        canvas.text(left - 12.0, y + 5.0, label, size=SIZE, text_anchor="end")
        return
    lines = wrapped(label, left - 16.0, 12.0)
    kept = [lines[0], cut(" ".join(lines[1:]), left - 16.0, 12.0)] if len(lines) > 1 else lines
    for i, line in enumerate(kept):
        canvas.text(left - 12.0, y - 3.0 + 15.0 * i, line, size=12.0, text_anchor="end")


def likert_chart(
    rows: Sequence[tuple[str, Sequence[int]]], names: Sequence[str], *, title: str, description: str, mark: str = ""
) -> Picture:
    """Return bars of equal length, parted as the answers are.

    Parameters
    ----------
    rows : sequence of (label, counts of each value)
    names : sequence of str
        What the values are called, from the lowest.
    title, description, mark : str
        As of `points_chart`.
    """
    top = 74.0 if mark else 44.0
    bottom = top + STEP * len(rows)
    left = min(LEFTMOST, max(LEFT, *(text_width(label, SIZE) for label, _ in rows)) + 14.0) if rows else LEFT
    canvas = Canvas(width=WIDTH, height=bottom + 16.0, title=title, description=description)
    _marked(canvas, mark)
    room = WIDTH - left - 14.0
    fills = [shade(i / max(1, len(names) - 1)) for i in range(len(names))] if len(names) != len(BLUES) else list(BLUES)
    each = room / max(1, len(names))
    for i, (name, fill) in enumerate(zip(names, fills, strict=True)):
        x = left + i * each
        canvas.rect(x, top - 34.0, 14.0, 14.0, fill=fill, stroke=INK, stroke_width=0.8)
        canvas.text(x + 19.0, top - 22.0, cut(name, each - 22.0, 12.0), size=12.0)
    for i, (label, counts) in enumerate(rows):
        y = top + STEP * i
        _labelled(canvas, label, left, y + 15.0)
        total, x = sum(counts), left
        for count, fill in zip(counts, fills, strict=True):
            width = room * count / total if total else 0.0
            if count:
                canvas.rect(x, y + 4.0, width, STEP - 10.0, fill=fill, stroke=INK, stroke_width=0.6)
            words = f"{100 * count / total:.0f} %" if total else ""
            if width > text_width(words, 12.0) + 4.0:
                canvas.text(x + width / 2, y + 20.0, words, size=12.0, text_anchor="middle", fill=ink_on(fill))
            x += width
    return canvas.picture()
