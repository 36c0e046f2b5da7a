"""What is drawn on a map enters, the words around it leave: title, caption, description, and a legend of what is to be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ratherthan.explain.explanation import Explanation
from ratherthan.explain.places import WorldRecord
from ratherthan.render.canvas import Canvas
from ratherthan.render.ground import View, pattern_of
from ratherthan.render.legend import Entry, swatch
from ratherthan.render.marks import FEW, Marks, arrow, route_line, stretch_line
from ratherthan.render.overlay import draw_crosses, draw_zone
from ratherthan.render.palette import PAPER, ROAD, ROUTE, looks_of
from ratherthan.render.sheet import Sheet
from ratherthan.render.wording import place_of, words

__all__ = ["MapWords"]

MOST_NAMED = 9
"""How many places the description names at most."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MapWords:
    """The words around a map.

    Parameters
    ----------
    explanation : Explanation
    world : WorldRecord
        What is drawn of the map.
    numbers : sequence of int
        The steps that are told and matter.
    hidden : int
        How many decisions matter and bear no number.
    stretches : bool
        Whether several steps are told in one sentence.
    foils : bool
        Whether alternatives are drawn.
    too_long : sequence of str
        The names of zones for which there is no room on the map.
    """

    explanation: Explanation
    world: WorldRecord
    numbers: Sequence[int]
    hidden: int
    stretches: bool
    foils: bool
    too_long: Sequence[str]

    @property
    def said(self) -> dict[str, dict[str, str]]:
        """The tables of words."""
        return {name: dict(table) for name, table in words(self.explanation.lexicon.language).items()}

    def sheet(self) -> Sheet:
        """Return the words around the map."""
        table, name = self.said["map"], self.world.title or self.explanation.source or self.said["map"]["untitled"]
        note, world = f" ({self.world.note})" if self.world.note else "", self.explanation.world or self.world
        return Sheet(
            title=table["title"].format(name=name) + note,
            description=f"{table['size'].format(width=world.width, height=world.height)} {self._spoken()}",
            caption=self._caption(),
            entries=self._entries(),
        )

    def _caption(self) -> str:
        """Return what the picture shows."""
        explanation, table = self.explanation, self.said["map"]
        outcome, steps = explanation.route_outcome, max(0, len(explanation.route) - 1)
        if explanation.question.scope == "none":
            counts = (f"{count:,}" for count in explanation.size)
            return table["model"].format(**dict(zip(("states", "choices", "branches"), counts, strict=True)))
        key = {"arrives": "route", "there": "there", "ended": "ended", "no way": "no_route", "none": "alone"}.get(
            outcome, "open"
        )
        if key == "route" and steps == 1:
            key = "route_one"
        last = explanation.route[-1] if explanation.route else explanation.start
        said = [
            table[key].format(
                start=place_of(explanation, explanation.start), goal=place_of(explanation, last), steps=steps
            )
        ]
        if explanation.openings:
            count = len(explanation.openings)
            said.append(table["openings" if count > 1 else "openings_one"].format(count=count))
        if self.numbers and explanation.question.scope == "route":
            said.append(table["numbered"])
        hidden = self.hidden
        if explanation.question.scope == "route" and hidden > 0:
            said.append(table["untold_one" if hidden == 1 else "untold"].format(count=hidden))
        return " ".join(said)

    def _spoken(self) -> str:
        """Return the caption with the places of the decisions, for those who do not see them."""
        table = self.said["map"]
        if self.explanation.question.scope == "none":
            return self._caption()
        named = [place_of(self.explanation, self.explanation.steps[step].state) for step in self.numbers]
        key = "no_marks" if not named else "one_mark" if len(named) == 1 else "marks"
        more = "; …" if len(named) > MOST_NAMED else ""
        marks = table[key].format(count=len(named), places="; ".join(named[:MOST_NAMED]) + more)
        return f"{self._caption()} {marks}"

    def _entries(self) -> list[Entry]:
        """Return the lines of the legend: what is to be seen, and nothing else."""
        table, explanation = self.said["legend"], self.explanation
        first = "asked_state" if explanation.question.scope == "state" else "start"
        found = []
        if explanation.start in explanation.states:
            found.append(Entry(words=table[first], sample=lambda c, x, y: Marks(c).start((x, y), radius=5.0)))
        if self.world.goals.any():
            found.append(
                Entry(words=table["goal"], sample=lambda c, x, y: Marks(c).goal((x - 3.0, y + 1.0), radius=6.5))
            )
        if len(explanation.route) > 1:
            found.append(Entry(words=table["route"], sample=lambda c, x, y: route_line(c, [(x - 12, y), (x + 12, y)])))
        if self.numbers:
            key = "critical" if explanation.question.scope == "route" else "asked"
            found.append(Entry(words=table[key], sample=lambda c, x, y: Marks(c).numbered((x, y), "1", radius=8.0)))
        if self.stretches:
            found.append(Entry(words=table["stretch"], sample=_stretch))
        if self.hidden:
            sample = _pearls if self.hidden > FEW else _hollow
            found.append(Entry(words=table["untold"], sample=sample))
        if self.foils:
            found.append(Entry(words=table["foil"], sample=lambda c, x, y: arrow(c, (x - 14, y), (x + 14, y))))
        if explanation.in_the_way or explanation.openings:
            found.append(Entry(words=table["opening"], sample=lambda c, x, y: Marks(c).opening((x, y))))
        return found + self._grounds()

    def _grounds(self) -> list[Entry]:
        """Return the lines of the legend for what lies on the map."""
        known, table = set(self.world.roads), self.said["legend"]
        found = []
        if self.world.hazards.any():
            found.append(Entry(words=table["hazard"], sample=_cross))
        if any((b, a) in known for a, b in known):
            found.append(Entry(words=table["roads"], sample=_road))
        if any((b, a) not in known for a, b in known):
            one_way = Entry(
                words=table["road"],
                sample=lambda c, x, y: arrow(c, (x - 14, y), (x + 14, y), colour=ROAD, dash=None, width=1.6),
            )
            found.append(one_way)
        if any(name not in self.too_long and inside.any() for name, inside in self.world.zones.items()):
            found.append(Entry(words=table["zone"], sample=_zone))
        found += [Entry(words=name, sample=_zone) for name in self.too_long]
        for place in np.unique(self.world.ground).tolist():
            look = looks_of(self.world.kinds)[place]
            if look.fill != PAPER:
                found.append(Entry(words=self.world.kinds[place], sample=swatch(look, pattern_of)))
        return found


def _cross(canvas: Canvas, x: float, y: float) -> None:
    draw_crosses(canvas, View(x=x - 9.0, y=y - 9.0, cell=18.0, columns=1, rows=1), np.ones(1, dtype=np.bool_))


def _zone(canvas: Canvas, x: float, y: float) -> None:
    draw_zone(canvas, View(x=x - 13.0, y=y - 8.0, cell=16.0, columns=1, rows=1), np.ones((1, 1), dtype=np.bool_))


def _hollow(canvas: Canvas, x: float, y: float) -> None:
    Marks(canvas).hollow((x, y))


def _stretch(canvas: Canvas, x: float, y: float) -> None:
    stretch_line(canvas, [(x - 11, y), (x + 11, y)])
    canvas.path([(x - 14, y), (x + 14, y)], stroke=ROUTE, stroke_width=4.0, stroke_linecap="round")


def _pearls(canvas: Canvas, x: float, y: float) -> None:
    canvas.path([(x - 14, y), (x + 14, y)], stroke=ROUTE, stroke_width=4.0, stroke_linecap="round")
    for right in (-7.0, 7.0):
        Marks(canvas).pearl((x + right, y))


def _road(canvas: Canvas, x: float, y: float) -> None:
    canvas.path([(x - 14, y), (x + 14, y)], stroke=ROAD, stroke_width=2.0, stroke_linecap="round")
