"""An Explanation of a model that is no map enters, a small graph leaves: its route from left to right, and what else could be done.

Lines are broken where they are full. Of a long route the start, the end and the decisions that are told are drawn, with the state after
each; what lies between is a gap that says how many steps it has.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ratherthan.explain.explanation import Explanation
from ratherthan.explain.telling import told_groups
from ratherthan.render.canvas import Canvas, Picture, cut, text_width
from ratherthan.render.legend import Entry
from ratherthan.render.marks import Marks, arrow
from ratherthan.render.palette import GOAL, INK, PAPER, QUIET, ROUTE, START
from ratherthan.render.sheet import Sheet, sheet
from ratherthan.render.wording import place_of, words

__all__ = ["draw_graph"]

WIDEST, NODE, SIZE, SMALL = 200.0, 26.0, 12.0, 11.0
EDGE, GAP = 96.0, 92.0
ACROSS = 940.0
SHORT = 12
"""Up to how many states a route is drawn whole."""
MOST_SHOWN = 24
"""How many decisions are drawn at most."""
MOST_FOILS = 3
ABOVE, BELOW = 36.0, 44.0
STUB = 18.0
"""How long the arrow is that leaves a line; the name of its action stands after it."""


@dataclass(frozen=True, kw_only=True)
class _Place:
    """A state of the route on the canvas: its place along the route, x of its middle, how wide it is, and its line."""

    at: int
    x: float
    width: float
    line: int


def draw_graph(explanation: Explanation, across: float = ACROSS) -> Picture:
    """Return the picture of an explanation as a graph of its route.

    Parameters
    ----------
    explanation : Explanation
    across : float
        How wide a line of states may be.
    """
    return _Graph(explanation=explanation, across=across).picture()


@dataclass(frozen=True, kw_only=True, eq=False)
class _Graph:
    explanation: Explanation
    across: float

    @cached_property
    def said(self) -> dict[str, dict[str, str]]:
        return {name: dict(table) for name, table in words(self.explanation.lexicon.language).items()}

    @cached_property
    def route(self) -> tuple[int, ...]:
        return self.explanation.route or (self.explanation.start,)

    @cached_property
    def numbers(self) -> dict[int, int]:
        """The number of the sentence for each step that is told and matters."""
        alone = self.explanation.question.scope == "state"
        found = {
            group[0]: number
            for number, group in enumerate(told_groups(self.explanation), 1)
            if alone or self.explanation.steps[group[0]].critical is not False
        }
        return dict(list(found.items())[:MOST_SHOWN])

    @property
    def groups(self) -> list[tuple[int, ...]]:
        """The steps of each sentence that has a number here."""
        return [group for group in told_groups(self.explanation) if group[0] in self.numbers]

    @cached_property
    def kept(self) -> list[int]:
        """The places along the route that are drawn."""
        last = len(self.route) - 1
        if last < SHORT:
            return list(range(last + 1))
        near = {0, 1, last - 1, last} | {at for group in self.groups for at in (group[0], group[0] + 1, group[-1] + 1)}
        return sorted(at for at in near if at <= last)

    @cached_property
    def places(self) -> list[_Place]:
        """Where the states stand: one after the other, in lines."""
        found: list[_Place] = []
        x, line, before = 0.0, 0, -1
        for at in self.kept:
            width = self.width(self.route[at])
            space = 0.0 if before < 0 else self.space(before) if at == before + 1 else GAP
            if x + space + width > self.across and found:
                x, line, space = (0.0 if at == before + 1 else GAP), line + 1, 0.0
            found.append(_Place(at=at, x=x + space + width / 2, width=width, line=line))
            x, before = x + space + width, at
        return found

    def width(self, state: int) -> float:
        return min(WIDEST, text_width(place_of(self.explanation, state), SIZE)) + 20.0

    def space(self, at: int) -> float:
        """Return how long the arrow after a state is, with the name of its action over it."""
        steps = self.explanation.steps
        return max(EDGE, min(WIDEST, text_width(steps[at].action, SMALL)) + 36.0) if at < len(steps) else EDGE

    @cached_property
    def heights(self) -> list[float]:
        """How high each line is: room for the alternatives beneath."""
        lines = [0] * (self.places[-1].line + 1)
        for place in self.places:
            lines[place.line] = max(lines[place.line], len(self.foils(place.at)))
        return [ABOVE + NODE + 12.0 + BELOW * count for count in lines]

    def foils(self, at: int) -> list[tuple[str, str]]:
        """Return what else could be done at a place of the route: actions, and where they lead."""
        if at not in self.numbers:
            return []
        others = self.explanation.steps[at].alternatives
        found = [(other.action, place_of(self.explanation, other.towards)) for other in others[:MOST_FOILS]]
        if len(others) > MOST_FOILS:
            found[-1:] = [(self.said["graph"]["others"].format(count=len(others) - MOST_FOILS + 1), "…")]
        return found

    def picture(self) -> Picture:
        table, steps = self.said["map"], len(self.route) - 1
        explanation = self.explanation
        outcome = explanation.route_outcome
        key = {"arrives": "route_one" if steps == 1 else "route", "there": "there", "ended": "ended"}.get(
            outcome, "open"
        )
        key = {"no way": "no_route", "none": "alone"}.get(outcome, key)
        caption = table[key].format(
            start=place_of(explanation, explanation.start), goal=place_of(explanation, self.route[-1]), steps=steps
        )
        if self.numbers and explanation.question.scope == "route":
            caption += " " + table["numbered"]
        told = {at for group in self.groups for at in group}
        hidden = sum(step.critical is not False and at not in told for at, step in enumerate(explanation.steps))
        if explanation.question.scope == "route" and hidden > 0:
            caption += " " + table["untold_one" if hidden == 1 else "untold"].format(count=hidden)
        spoken = f"{self.said['graph']['description'].format(steps=steps)} {caption}"
        text = Sheet(
            title=explanation.source or self.said["map"]["untitled"],
            description=spoken,
            caption=caption,
            entries=self.entries(),
        )
        width = max(place.x + place.width / 2 for place in self.places)
        alone = explanation.question.scope == "state" and bool(explanation.steps)
        across = max([width + alone * (WIDEST + 30.0), *(self.reach(place) for place in self.places)]) + 12.0
        body = sheet(text, across, sum(self.heights))
        tops = [body.y + ABOVE + sum(self.heights[:line]) + NODE / 2 for line in range(len(self.heights))]
        self.edges(body.canvas, body.x, tops)
        if alone:
            self.taken(body.canvas, (body.x + width, tops[0]))
        for place in self.places:
            self.state(body.canvas, (body.x + place.x, tops[place.line]), place)
        return body.canvas.picture()

    def reach(self, place: _Place) -> float:
        """Return how far right the words at a place go: of its alternatives, and of the action with which a line ends."""
        said = [cut(f"{action} → {there}", 2 * WIDEST, SMALL) for action, there in self.foils(place.at)]
        foils = place.x + 14.0 + max((text_width(one, SMALL) for one in said), default=0.0)
        if not any(other.at == place.at + 1 and other.line > place.line for other in self.places):
            return foils
        action = cut(self.explanation.steps[place.at].action, WIDEST, SMALL)
        return max(foils, place.x + place.width / 2 + STUB + 5.0 + text_width(action, SMALL))

    def edges(self, canvas: Canvas, left: float, tops: list[float]) -> None:
        """Draw the arrows of the route, and its gaps."""
        table = self.said["graph"]
        for one, other in zip(self.places, self.places[1:], strict=False):
            begin = (left + one.x + one.width / 2, tops[one.line])
            end = (left + other.x - other.width / 2, tops[other.line])
            if one.line != other.line:
                begin = (end[0] - (16.0 if other.at == one.at + 1 else GAP - 4.0), end[1])
            if other.at == one.at + 1:
                arrow(canvas, begin, end, colour=ROUTE, dash=None, width=2.5)
                if one.line == other.line:
                    said = cut(self.explanation.steps[one.at].action, end[0] - begin[0] - 12.0, SMALL)
                    canvas.text((begin[0] + end[0]) / 2, begin[1] - 7.0, said, size=SMALL, text_anchor="middle")
                else:
                    y = tops[one.line]
                    right = left + one.x + one.width / 2
                    arrow(canvas, (right, y), (right + STUB, y), colour=ROUTE, dash=None, width=2.5)
                    said = cut(self.explanation.steps[one.at].action, WIDEST, SMALL)
                    canvas.text(right + STUB + 5.0, y + 0.36 * SMALL, said, size=SMALL)
                continue
            skipped = other.at - one.at
            said = table["gap_one" if skipped == 1 else "gap"].format(count=skipped)
            canvas.path([begin, end], stroke=ROUTE, stroke_width=2.5, stroke_dasharray="1 6", stroke_linecap="round")
            canvas.text((begin[0] + end[0]) / 2, begin[1] - 8.0, said, size=SMALL, text_anchor="middle", fill=QUIET)

    def taken(self, canvas: Canvas, begin: tuple[float, float]) -> None:
        """Draw the action taken at the one state that was asked about."""
        said = cut(self.explanation.steps[0].action, WIDEST, SMALL)
        length = max(EDGE, text_width(said, SMALL) + 30.0)
        arrow(canvas, begin, (begin[0] + length, begin[1]), colour=ROUTE, dash=None, width=2.5)
        canvas.text(begin[0] + length / 2, begin[1] - 7.0, said, size=SMALL, text_anchor="middle")

    def state(self, canvas: Canvas, middle: tuple[float, float], place: _Place) -> None:
        """Draw a state with its number and its alternatives."""
        (x, y), state = middle, self.route[place.at]
        last = place.at == len(self.route) - 1 and self.explanation.route_outcome in ("arrives", "there")
        colour = GOAL if last else START if place.at == 0 else INK
        thick = 3.0 if last or place.at == 0 else 1.2
        canvas.rect(
            x - place.width / 2,
            y - NODE / 2,
            place.width,
            NODE,
            rx=NODE / 2,
            fill=PAPER,
            stroke=colour,
            stroke_width=thick,
        )
        said = cut(place_of(self.explanation, state), place.width - 14.0, SIZE)
        canvas.text(x, y + 0.36 * SIZE, said, size=SIZE, text_anchor="middle")
        if place.at in self.numbers:
            label = str(self.numbers[place.at])
            Marks(canvas).numbered((x, y - NODE / 2 - 15.0), label, radius=9.5, class_="step", data_sentence=label)
        begin = y + NODE / 2
        for row, (action, there) in reversed(list(enumerate(self.foils(place.at)))):
            end = begin + BELOW * (row + 1) - 14.0
            arrow(canvas, (x, begin), (x, end), width=2.0, class_="foil", data_sentence=str(self.numbers[place.at]))
            words_there = cut(f"{action} → {there}", 2 * WIDEST, SMALL)
            canvas.text(x + 10.0, end - 4.0, words_there, size=SMALL)

    @property
    def first(self) -> str:
        """Which words of the legend are said of the first state."""
        return "asked_state" if self.explanation.question.scope == "state" else "start"

    def entries(self) -> list[Entry]:
        """Return the lines of the legend."""
        table = self.said["legend"]
        found = [
            Entry(words=table[self.first], sample=lambda c, x, y: _ring(c, x, y, START)),
        ]
        if self.explanation.route_outcome in ("arrives", "there"):
            found.append(Entry(words=table["goal"], sample=lambda c, x, y: _ring(c, x, y, GOAL)))
        if len(self.route) > 1:
            found.append(
                Entry(
                    words=table["route"],
                    sample=lambda c, x, y: arrow(c, (x - 14, y), (x + 14, y), colour=ROUTE, dash=None, width=2.5),
                )
            )
        if self.numbers:
            key = "critical" if self.explanation.question.scope == "route" else "asked"
            found.append(Entry(words=table[key], sample=lambda c, x, y: Marks(c).numbered((x, y), "1", radius=8.0)))
        if any(self.foils(at) for at in self.numbers):
            found.append(
                Entry(words=table["foil"], sample=lambda c, x, y: arrow(c, (x - 14, y), (x + 14, y), width=2.0))
            )
        return found


def _ring(canvas: Canvas, x: float, y: float, colour: str) -> None:
    canvas.rect(x - 13.0, y - 8.0, 26.0, 16.0, rx=8.0, fill=PAPER, stroke=colour, stroke_width=3.0)
