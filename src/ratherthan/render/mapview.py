"""An Explanation on a map enters, a picture of the map leaves: the ground, the route, the decisions that matter and what was not done.

Numbers in the diamonds are those of the sentences: `told_groups` gives both their order. Of several alternatives of a decision at most
three are drawn; of more, the one that comes nearest to what was done, where the explanation has numbers of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ratherthan.explain.explanation import Alternative, Explanation, Measured, Step
from ratherthan.explain.places import WorldRecord
from ratherthan.explain.telling import told_groups
from ratherthan.render.canvas import Canvas, Picture, cut, text_width
from ratherthan.render.cropping import cropped
from ratherthan.render.ground import View, draw_ground, fitted
from ratherthan.render.mapwords import MapWords
from ratherthan.render.marks import Marks, Room, arrow, route_line, stretch_line
from ratherthan.render.overlay import draw_crosses, draw_zone
from ratherthan.render.palette import ROAD, ink_on, looks_of
from ratherthan.render.rulers import draw_rulers, ruler_room
from ratherthan.render.sheet import Sheet, sheet
from ratherthan.render.wording import words

__all__ = ["draw_map"]

ROOM = (900.0, 720.0)
NUMBERED = 26.0
"""From how many units a cell on the cells bear their numbers."""
MOST_GOALS = 12
"""Up to how many cells of the destination each get a flag."""
MOST_NUMBERED = 60
"""Up to how many decisions get a number; of more, the first."""
MOST_FOILS = 3
STRAIGHT = 0.86
"""How many cells an arrow is long that stands for an alternative."""
SHORTEST = 24.0
ZONE_SIZE = 12.0
NARROW = 40.0
"""How much room there is around a map that is not three times as wide or high, so that marks can move aside."""

Point = tuple[float, float]


def draw_map(explanation: Explanation, room: tuple[float, float] = ROOM) -> Picture:
    """Return the picture of an explanation on its map.

    Parameters
    ----------
    explanation : Explanation
        With a world.
    room : (float, float)
        How wide and high the map may be.
    """
    assert explanation.world is not None
    world, corner = cropped(explanation.world)
    if any(
        not (0 <= x - corner[0] < world.width and 0 <= y - corner[1] < world.height) for x, y in _places(explanation)
    ):
        world, corner = explanation.world, (0, 0)
    return _Map(explanation=explanation, world=world, corner=corner, room=room).picture()


def _places(explanation: Explanation) -> list[tuple[int, int]]:
    """Return the cells that are drawn on."""
    states = [record.place for record in explanation.states.values() if record.place is not None]
    return states + [cell.place for cell in explanation.openings]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Map:
    explanation: Explanation
    world: WorldRecord
    corner: tuple[int, int]
    room: tuple[float, float]

    @cached_property
    def said(self) -> dict[str, dict[str, str]]:
        return {name: dict(table) for name, table in words(self.explanation.lexicon.language).items()}

    @cached_property
    def numbers(self) -> dict[int, int]:
        """The number of the sentence for each step that is told and matters: the first of those it tells."""
        numbered = enumerate(told_groups(self.explanation), 1)
        return {group[0]: number for number, group in numbered if self._matters(self.explanation.steps[group[0]])}

    def _matters(self, step: Step) -> bool:
        return step.critical is not False or self.explanation.question.scope == "state"

    @cached_property
    def view(self) -> View:
        """Where the cells lie, from the corner of the body on."""
        left, _ = ruler_room(self.world)
        fit = fitted(self.world, 0.0, 0.0, self.room)
        pad = NARROW if min(fit.width, fit.height) < NARROW * 3 else 0.0
        return View(x=left + pad, y=pad, cell=fit.cell, columns=fit.columns, rows=fit.rows)

    @cached_property
    def extent(self) -> Point:
        """How large the body is."""
        view, (left, below) = self.view, ruler_room(self.world)
        return 2 * view.x - left + view.width, 2 * view.y + view.height + below

    @cached_property
    def marks(self) -> dict[int, Point]:
        """Where the numbers of steps stand, as far as there is room for them."""
        view, (ruled, below) = self.view, ruler_room(self.world)
        room = Room(
            left=view.x - 2.0 if ruled else -10.0,
            top=-10.0,
            right=self.extent[0] + 10.0,
            bottom=view.y + view.height + 2.0 if below > 8.0 else self.extent[1],
        )
        for x, y in self.goals(self.view):
            room.taken.append((x + 3.0, y - 2.0, 9.0))
        start = self.place(self.view, self.explanation.start)
        room.taken += [(*place, 8.0) for place in self.blocks(self.view)[:MOST_GOALS]]
        if start is not None:
            room.taken.append((*start, 6.0))
        for (x, y), said in self.zone_names(self.view):
            half = int(text_width(said, ZONE_SIZE) / 2)
            room.taken += [(x + right, y - 0.35 * ZONE_SIZE, 5.0) for right in range(-half, half + 1, 8)]
        found = {}
        for step in list(self.numbers)[:MOST_NUMBERED]:
            place = self.place(self.view, self.explanation.steps[step].state)
            at = None if place is None else room.find(place)
            if at is not None:
                found[step] = at
        return found

    def goals(self, view: View) -> list[Point]:
        """Return where flags stand."""
        cells = np.flatnonzero(self.world.goals)[:MOST_GOALS].tolist()
        return [view.centre(cell % view.columns, cell // view.columns) for cell in cells]

    def blocks(self, view: View) -> list[Point]:
        """Return what is in the way where there is no route: hazards, or closed cells that would have to open."""
        explanation = self.explanation
        hazards = [self.place(view, state) for state in explanation.in_the_way]
        return [p for p in hazards if p is not None] + [self.centre(view, cell.place) for cell in explanation.openings]

    def picture(self) -> Picture:
        body = sheet(self.words(), *self.extent)
        canvas, fit = body.canvas, self.view
        view = replace(fit, x=body.x + fit.x, y=body.y + fit.y)
        draw_ground(canvas, view, self.world)
        draw_rulers(canvas, view, self.world, self.said["map"]["metre"])
        draw_crosses(canvas, view, self.world.hazards)
        self.roads(canvas, view)
        for inside in self.world.zones.values():
            draw_zone(canvas, view, inside.reshape(view.rows, view.columns))
        self.cell_numbers(canvas, view)
        self.route(canvas, view)
        for place, said in self.zone_names(view):
            Marks(canvas).label(place, said, size=ZONE_SIZE)
        self.numbered(canvas, view, (body.x, body.y))
        return canvas.picture()

    def numbered(self, canvas: Canvas, view: View, corner: Point) -> None:
        """Draw the numbers of the decisions over everything else, and lines to those that had to move aside."""
        drawn = []
        for step, (x, y) in self.marks.items():
            place = self.place(view, self.explanation.steps[step].state)
            assert place is not None
            drawn.append((place, (x + corner[0], y + corner[1]), str(self.numbers[step])))
        for place, at, _ in drawn:
            if math.dist(place, at) > 0.1:
                Marks(canvas).leader(place, at)
        for _, at, label in drawn:
            Marks(canvas).numbered(at, label, class_="step", data_sentence=label)

    def words(self) -> Sheet:
        """Return the words around the map."""
        zones = [name for name, inside in self.world.zones.items() if inside.any()]
        return MapWords(
            explanation=self.explanation,
            world=self.world,
            numbers=list(self.numbers),
            hidden=len(self.hidden),
            stretches=bool(self.stretches),
            foils=any(self.drawn(self.explanation.steps[step]) for step in self.marks),
            too_long=[name for name in zones if self.zone_label(name) != name],
        ).sheet()

    def place(self, view: View, state: int) -> Point | None:
        record = self.explanation.states.get(state)
        return None if record is None or record.place is None else self.centre(view, record.place)

    def centre(self, view: View, place: tuple[int, int]) -> Point:
        """Return the middle of a cell of the whole map."""
        return view.centre(place[0] - self.corner[0], place[1] - self.corner[1])

    def roads(self, canvas: Canvas, view: View) -> None:
        """Draw the ways between cells: a line both ways, an arrow one way."""
        if view.cell < 12.0:
            return
        known = set(self.world.roads)
        for one, other in self.world.roads:
            if (other, one) in known and other < one:
                continue
            a, b = (view.centre(cell % view.columns, cell // view.columns) for cell in (one, other))
            near, far = _between(a, b, 0.16), _between(a, b, 0.84)
            if (other, one) in known:
                canvas.path([near, far], stroke=ROAD, stroke_width=2.0, stroke_linecap="round")
            else:
                arrow(canvas, near, far, colour=ROAD, dash=None, width=1.6)

    def cell_numbers(self, canvas: Canvas, view: View) -> None:
        """Write the number of each state into the corner of its cell."""
        if not self.world.numbered or view.cell < NUMBERED:
            return
        size, looks = min(13.0, 0.3 * view.cell), looks_of(self.world.kinds)
        for cell, kind in enumerate(self.world.ground.tolist()):
            fill = looks[kind].fill
            x, y = view.x + cell % view.columns * view.cell, view.y + cell // view.columns * view.cell
            halo = {"stroke": fill, "stroke_width": 3.0, "paint_order": "stroke", "stroke_linejoin": "round"}
            canvas.text(x + 0.3 * size, y + 1.1 * size, str(cell), size=size, fill=ink_on(fill), **halo)

    def zone_label(self, name: str) -> str:
        """Return as much of the name of a zone as there is room for on the map."""
        return cut(name, self.extent[0] - self.view.x - 8.0, ZONE_SIZE)

    def zone_names(self, view: View) -> list[tuple[Point, str]]:
        """Return where the name of each zone stands: the middle of its base line, and the name."""
        right, found = view.x - self.view.x + self.extent[0], []
        for name, inside in self.world.zones.items():
            rows, columns = np.nonzero(inside.reshape(view.rows, view.columns))
            if len(rows) == 0:
                continue
            said = self.zone_label(name)
            half = text_width(said, ZONE_SIZE) / 2
            x, y = view.centre(float(np.median(columns)), float(rows.min()) - 0.5)
            x = max(min(x, right - half - 2.0), view.x + half + 2.0)
            found.append(((x, max(y - 5.0, view.y + ZONE_SIZE)), said))
        return found

    def route(self, canvas: Canvas, view: View) -> None:
        """Draw the route, start, destination, and the decisions."""
        explanation, marks = self.explanation, Marks(canvas)
        points = [point for state in explanation.route if (point := self.place(view, state)) is not None]
        self.foils(canvas, view)
        for step, group in self.stretches.items():
            along = [self.place(view, state) for state in explanation.route[group[0] : group[-1] + 2]]
            line = [point for point in along if point is not None]
            if len(line) > 1:
                stretch_line(canvas, line, class_="stretch", data_sentence=str(self.numbers[step]))
        route_line(canvas, points, width=4.0 if view.cell >= 4.0 else 2.5)
        for place in self.goals(view):
            marks.goal(place)
        start = self.place(view, explanation.start)
        if start is not None:
            marks.start(start)
        blocks = self.blocks(view)
        for place in blocks[:: max(1, -(-len(blocks) // MOST_GOALS))]:
            marks.opening(place)
        hidden = [self.place(view, explanation.steps[step].state) for step in self.hidden]
        marks.hollows([place for place in hidden if place is not None])

    @property
    def hidden(self) -> list[int]:
        """The steps that matter and bear no number."""
        steps = enumerate(self.explanation.steps)
        shown = {place for step, group in self.stretches.items() for place in group} | set(self.marks)
        return [place for place, step in steps if step.critical is not False and place not in shown]

    @cached_property
    def stretches(self) -> dict[int, tuple[int, ...]]:
        """The steps that are told in one sentence with the one that bears its number, where these are several."""
        groups = told_groups(self.explanation)
        return {group[0]: group for group in groups if len(group) > 1 and group[0] in self.marks}

    def foils(self, canvas: Canvas, view: View) -> None:
        """Draw where the alternatives would have led, dashed."""
        for step in self.marks:
            details = self.explanation.steps[step]
            here = self.place(view, details.state)
            for other in self.drawn(details):
                there = self.place(view, other.towards)
                if here is None or there is None or here == there:
                    continue
                length = math.hypot(there[0] - here[0], there[1] - here[1])
                wanted = max(min(STRAIGHT * view.cell, length), SHORTEST if view.cell < SHORTEST else 0.0)
                end = _between(here, there, wanted / length)
                arrow(
                    canvas,
                    here,
                    end,
                    width=2.5 if view.cell >= 12.0 else 1.8,
                    class_="foil",
                    data_sentence=str(self.numbers[step]),
                )

    def drawn(self, step: Step) -> Sequence[Alternative]:
        """Return the alternatives of a step that are drawn."""
        others = [other for other in step.alternatives if other.towards != step.state]
        if len(others) <= MOST_FOILS:
            return others
        known: dict[str, float] = {}
        for claim in step.claims:
            if claim.level == 0:
                known |= {row.action: row.number.value for row in claim.evidence.others if isinstance(row, Measured)}
        rated = [other for other in others if other.action in known]
        sign = -1.0 if self.explanation.objective.maximise else 1.0
        return sorted(rated, key=lambda other: sign * known[other.action])[:1]


def _between(a: Point, b: Point, share: float) -> Point:
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
