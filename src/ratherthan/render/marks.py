"""Places and numbers enter; marks, arrows and labels are drawn on a canvas, so that none hides another."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from ratherthan.render.canvas import Canvas, number, text_width
from ratherthan.render.palette import FOIL, GOAL, INK, MARK, OPENING, PAPER, ROUTE, START

__all__ = ["FEW", "Marks", "Room", "arrow", "route_line", "stretch_line"]

Point = tuple[float, float]
TURN = math.pi / 4
RADIUS = 11.0
"""Of a numbered mark."""
FEW, PEARLS = 16, 13.0
"""Up to how many decisions that are not told get a mark of their own, and how far apart they are where there are more."""


def route_line(canvas: Canvas, points: Sequence[Point], *, width: float = 4.0) -> None:
    """Draw a route as a line with a white edge, chevrons along it and an arrow at its end."""
    if len(points) < 2:
        return
    points = _straightened(points)
    canvas.path(points, stroke=PAPER, stroke_width=width + 3.0, stroke_linejoin="round", stroke_linecap="round")
    canvas.path(points, stroke=ROUTE, stroke_width=width, stroke_linejoin="round", stroke_linecap="round")
    for middle, angle in _along(points, 64.0):
        canvas.path(
            _chevron(middle, angle, width * 0.75), stroke=PAPER, stroke_width=width * 0.4, stroke_linecap="round"
        )
    (x0, y0), (x1, y1) = points[-2:]
    canvas.path(
        _head((x1, y1), math.atan2(y1 - y0, x1 - x0), width * 2.4),
        closed=True,
        fill=ROUTE,
        stroke=PAPER,
        stroke_width=1.0,
    )


def stretch_line(canvas: Canvas, points: Sequence[Point], **attributes: object) -> None:
    """Draw a dark edge on both sides of a part of the route that one sentence tells, to be drawn beneath the route."""
    points = _straightened(points)
    canvas.open(**attributes)
    canvas.path(points, stroke=PAPER, stroke_width=14.0, stroke_linejoin="round", stroke_linecap="round")
    canvas.path(points, stroke=MARK, stroke_width=11.0, stroke_linejoin="round", stroke_linecap="round")
    canvas.close()


def arrow(
    canvas: Canvas,
    start: Point,
    end: Point,
    *,
    colour: str = FOIL,
    dash: str | None = "5 4",
    width: float = 2.5,
    **attributes: object,
) -> None:
    """Draw an arrow, dashed as for a way that is not taken."""
    angle = math.atan2(end[1] - start[1], end[0] - start[0])
    head = max(3.2 * width, 7.0)
    neck = (end[0] - 0.8 * head * math.cos(angle), end[1] - 0.8 * head * math.sin(angle))
    canvas.open(**attributes)
    canvas.path([start, neck], stroke=PAPER, stroke_width=width + 2.5)
    canvas.path([start, neck], stroke=colour, stroke_width=width, stroke_dasharray=dash)
    canvas.path(_head(end, angle, head), closed=True, fill=colour, stroke=PAPER, stroke_width=0.75)
    canvas.close()


class Marks:
    """Draws marks on a canvas."""

    def __init__(self, canvas: Canvas) -> None:
        self.canvas = canvas
        self.pearls: list[Point] = []

    def leader(self, place: Point, at: Point) -> None:
        """Draw a line from a place to its number, which stands elsewhere."""
        self.canvas.path([place, at], stroke=PAPER, stroke_width=3.0)
        self.canvas.path([place, at], stroke=MARK, stroke_width=1.25)
        self.canvas.add("circle", cx=place[0], cy=place[1], r=2.5, fill=MARK)

    def numbered(self, place: Point, label: str, *, radius: float = RADIUS, **attributes: object) -> None:
        """Draw a diamond with a number in it."""
        x, y = place
        self.canvas.open(**attributes)
        tip = radius * 1.25
        diamond = [(x, y - tip), (x + tip, y), (x, y + tip), (x - tip, y)]
        self.canvas.path(diamond, closed=True, fill=MARK, stroke=PAPER, stroke_width=1.5)
        size = min(13.0, 1.95 * radius * 12.0 / max(12.0, text_width(label, 12.0) * 1.35))
        self.canvas.text(x, y + 0.36 * size, label, size=size, fill=PAPER, text_anchor="middle", font_weight="bold")
        self.canvas.close()

    def hollow(self, place: Point, *, radius: float = 4.5) -> None:
        """Draw a small empty diamond: a decision that matters and is not told."""
        x, y = place
        diamond = [(x, y - radius), (x + radius, y), (x, y + radius), (x - radius, y)]
        self.canvas.path(diamond, closed=True, fill=PAPER, stroke=MARK, stroke_width=1.5)

    def hollows(self, places: Sequence[Point]) -> None:
        """Draw small empty diamonds; where there are many, pearls on the line of the route, no two of them too near."""
        for x, y in places:
            if len(places) <= FEW:
                self.hollow((x, y))
            elif all(math.hypot(x - a, y - b) >= PEARLS for a, b in self.pearls[-1:]):
                self.pearl((x, y))
                self.pearls.append((x, y))

    def pearl(self, place: Point) -> None:
        """Draw a small dot on a line."""
        self.canvas.add("circle", cx=place[0], cy=place[1], r=2.3, fill=PAPER, stroke=ROUTE, stroke_width=1.2)

    def opening(self, place: Point, *, radius: float = 8.0) -> None:
        """Draw what would have to open: a square with a gap, crossed by an arrow's line."""
        x, y = place
        r = radius
        for width, colour in ((5.0, PAPER), (2.5, OPENING)):
            line = f"M{number(x - r)} {number(y - r / 3)}v{number(-2 * r / 3)}h{number(2 * r)}v{number(2 * r / 3)}"
            line += f"M{number(x - r)} {number(y + r / 3)}v{number(2 * r / 3)}h{number(2 * r)}v{number(-2 * r / 3)}"
            self.canvas.add("path", d=line, fill="none", stroke=colour, stroke_width=width)

    def start(self, place: Point, *, radius: float = 7.0) -> None:
        """Draw where the route begins: a ring."""
        self.canvas.add("circle", cx=place[0], cy=place[1], r=radius, fill=PAPER, stroke=START, stroke_width=4.0)
        self.canvas.add("circle", cx=place[0], cy=place[1], r=radius + 3.0, fill="none", stroke=PAPER, stroke_width=1.5)

    def goal(self, place: Point, *, radius: float = 9.0) -> None:
        """Draw where it is to end: a flag."""
        x, y = place
        self.canvas.path(
            [(x, y + radius), (x, y - 1.4 * radius)], stroke=PAPER, stroke_width=5.0, stroke_linecap="round"
        )
        self.canvas.path(
            [(x, y + radius), (x, y - 1.4 * radius)], stroke=GOAL, stroke_width=2.5, stroke_linecap="round"
        )
        flag = [(x, y - 1.4 * radius), (x + 1.4 * radius, y - 0.8 * radius), (x, y - 0.2 * radius)]
        self.canvas.path(flag, closed=True, fill=GOAL, stroke=PAPER, stroke_width=1.0)
        self.canvas.add("circle", cx=x, cy=y + radius, r=3.0, fill=GOAL, stroke=PAPER, stroke_width=1.0)

    def label(self, place: Point, words: str, *, size: float = 12.0, fill: str = INK) -> None:
        """Draw words with a white edge around their letters."""
        self.canvas.text(
            place[0],
            place[1],
            words,
            size=size,
            fill=fill,
            text_anchor="middle",
            stroke=PAPER,
            stroke_width=3.0,
            paint_order="stroke",
        )


@dataclass(kw_only=True)
class Room:
    """Where marks can still stand.

    Parameters
    ----------
    left, top, right, bottom : float
        Marks that move aside stay within.
    taken : list of (x, y, radius)
        What must not be hidden.
    """

    left: float
    top: float
    right: float
    bottom: float
    taken: list[tuple[float, float, float]] = field(default_factory=list)

    def find(self, place: Point, radius: float = RADIUS) -> Point | None:
        """Return the place itself, else the nearest one around it where nothing is in the way, and take it; None if there is none."""
        for x, y in self._tried(place, radius):
            edge = 1.2 * radius
            inside = self.left + edge <= x <= self.right - edge and self.top + edge <= y <= self.bottom - edge
            inside = inside or (x, y) == place
            free = all(math.hypot(x - a, y - b) >= 1.12 * (radius + r) for a, b, r in self.taken)
            if inside and free:
                self.taken.append((x, y, radius))
                return x, y
        return None

    def _tried(self, place: Point, radius: float) -> Iterator[Point]:
        yield place
        for distance in (2.4, 3.4, 4.6, 6.0, 8.0):
            for k in (7, 1, 5, 3, 6, 2, 0, 4):
                yield (
                    place[0] + distance * radius * math.cos(k * TURN),
                    place[1] + distance * radius * math.sin(k * TURN),
                )


def _straightened(points: Sequence[Point]) -> list[Point]:
    """Return the points where a line turns, and its ends."""
    kept = [points[0]]
    for before, here, after in zip(points, points[1:], points[2:], strict=False):
        cross = (here[0] - before[0]) * (after[1] - here[1]) - (here[1] - before[1]) * (after[0] - here[0])
        dot = (here[0] - before[0]) * (after[0] - here[0]) + (here[1] - before[1]) * (after[1] - here[1])
        if here != before and (abs(cross) > 1e-9 or dot < 0):
            kept.append(here)
    return [*kept, points[-1]]


def _along(points: Sequence[Point], every: float) -> list[tuple[Point, float]]:
    """Return places along a line and its direction there: the middle of each long stretch, and more on very long ones."""
    found = []
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        length = math.hypot(x1 - x0, y1 - y0)
        count = int(length / every) if length >= every else (1 if length >= 0.4 * every else 0)
        angle = math.atan2(y1 - y0, x1 - x0)
        for k in range(count):
            share = (k + 0.5) / count
            found.append(((x0 + share * (x1 - x0), y0 + share * (y1 - y0)), angle))
    return found


def _chevron(middle: Point, angle: float, size: float) -> list[Point]:
    x, y = middle
    ends = [(x - size * math.cos(angle + turn), y - size * math.sin(angle + turn)) for turn in (TURN, -TURN)]
    return [ends[0], (x, y), ends[1]]


def _head(tip: Point, angle: float, size: float) -> list[Point]:
    x, y = tip
    back = [(x - size * math.cos(angle + turn), y - size * math.sin(angle + turn)) for turn in (0.45, -0.45)]
    return [(x, y), *back]
