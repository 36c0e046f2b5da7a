"""A map and its view enter; what tells how large it is is drawn around it: an axis of cells or metres, a bar of some metres."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ratherthan.explain.places import WorldRecord
from ratherthan.render.canvas import Canvas, number, text_width
from ratherthan.render.ground import View
from ratherthan.render.palette import INK, QUIET

__all__ = ["draw_rulers", "ruler_room", "steps_of"]

SIZE = 11.0
TICK = 5.0
APART = 56.0
"""How many units lie at least between two ticks."""
LONGEST = 0.35
"""The largest share of a map's width that its bar of metres takes."""


def ruler_room(world: WorldRecord) -> tuple[float, float]:
    """Return how much room rulers need to the left of a map, and beneath it."""
    if world.frame is None and world.numbered:
        return 0.0, 6.0
    if world.frame is None:
        return TICK + 6.0 + text_width(str(world.height - 1), SIZE), 24.0
    if world.frame.yaw != 0.0:
        return 0.0, 30.0
    ends = (world.frame.at(0, 0, world.height)[1], world.frame.at(0, world.height, world.height)[1])
    return TICK + 8.0 + max(text_width(f"{end:.1f}", SIZE) for end in ends), 46.0


def draw_rulers(canvas: Canvas, view: View, world: WorldRecord, unit: str) -> None:
    """Draw an axis of cells; where the map lies in the world, one of metres and a bar of some metres.

    Parameters
    ----------
    canvas : Canvas
    view : View
    world : WorldRecord
    unit : str
        The sign of a metre.
    """
    frame = world.frame
    if frame is None:
        if not world.numbered:
            _axis(canvas, view, _cells(world.width, view.cell), across=True)
            _axis(canvas, view, _cells(world.height, view.cell), across=False)
        return
    if frame.yaw == 0.0:
        side = frame.resolution
        _axis(canvas, view, _metres(frame.x, side, world.width, view.cell), across=True)
        up = _metres(frame.y, side, world.height, view.cell)
        _axis(canvas, view, ((world.height - place, said) for place, said in up), across=False)
    _bar(canvas, view, frame.resolution, unit)


def steps_of(span: float, least: float) -> float:
    """Return the smallest of …, 0.1, 0.2, 0.5, 1, 2, 5, 10, … that is at least `least`, for a span that is not empty.

    Examples
    --------
    >>> steps_of(10.0, 0.3), steps_of(10.0, 1.0), steps_of(1000.0, 61.0)
    (0.5, 1.0, 100.0)
    """
    if not 0.0 < least < math.inf:
        return span
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1 - 1e-9))


def _cells(count: int, cell: float) -> Iterator[tuple[float, str]]:
    """Yield the middle of each cell that is named on an axis, and its number."""
    apart = max(20.0, text_width(str(count - 1), SIZE) + 8.0)
    step = max(1, int(steps_of(count, apart / cell)))
    for place in range(0, count, step):
        yield place + 0.5, str(place)


def _metres(origin: float, side: float, count: int, cell: float) -> Iterator[tuple[float, str]]:
    """Yield where each round number of metres lies on an axis, in cells, and the number."""
    step = steps_of(count * side, APART * side / cell)
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    first, last = math.ceil(origin / step - 1e-9), math.floor((origin + count * side) / step + 1e-9)
    for k in range(first, last + 1):
        said = f"{k * step:.{digits}f}".replace("-", "−")
        yield (k * step - origin) / side, said


def _axis(canvas: Canvas, view: View, ticks: Iterator[tuple[float, str]] | object, *, across: bool) -> None:
    """Draw the ticks of one axis: beneath the map, or to its left."""
    line, below = [], view.y + view.height
    assert isinstance(ticks, Iterator)
    for place, said in ticks:
        if across:
            x = view.x + place * view.cell
            line.append(f"M{number(x)} {number(below)}v{number(TICK)}")
            half = text_width(said, SIZE) / 2
            canvas.text(
                min(max(x, half), canvas.width - half),
                below + TICK + SIZE,
                said,
                size=SIZE,
                fill=QUIET,
                text_anchor="middle",
            )
        else:
            y = view.y + place * view.cell
            line.append(f"M{number(view.x)} {number(y)}h{number(-TICK)}")
            canvas.text(view.x - TICK - 3.0, y + 0.36 * SIZE, said, size=SIZE, fill=QUIET, text_anchor="end")
    if line:
        canvas.add("path", d="".join(line), stroke=QUIET, stroke_width=1.0, fill="none")


def _bar(canvas: Canvas, view: View, resolution: float, unit: str) -> None:
    """Draw a bar of a round number of metres beneath a map, at its right."""
    most = max(24.0, LONGEST * view.width) / view.cell * resolution
    length = steps_of(most, most / 2.5)
    units = length / resolution * view.cell
    said = f"{length:g} {unit}"
    y = view.y + view.height + 34.0
    x = view.x + view.width - units
    canvas.add(
        "path",
        d=f"M{number(x)} {number(y - 4)}v8M{number(x)} {number(y)}h{number(units)}M{number(x + units)} {number(y - 4)}v8",
        stroke=INK,
        stroke_width=1.5,
        fill="none",
    )
    canvas.text(x - 6.0, y + 0.36 * SIZE, said, size=SIZE, text_anchor="end")
