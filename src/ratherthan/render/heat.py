"""A Solution on a map enters, a heat map of its values or of how much its decisions matter leaves, or its policy as arrows.

A cell on which several states lie shows the best of their values, the largest of their spreads, and the policy of the first of them.
What is infinite has a pattern of its own, outside the scale; the scale goes from the least to the largest finite number there is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ratherthan.errors import QuestionError
from ratherthan.explain.measures import Factors
from ratherthan.explain.objectives import objective_record
from ratherthan.explain.places import WorldRecord, world_of
from ratherthan.explain.question import question
from ratherthan.model.mdp import Floats
from ratherthan.render.canvas import Canvas, Picture, number, text_width
from ratherthan.render.cropping import cropped
from ratherthan.render.ground import View, draw_cells, draw_frame, draw_pattern, fitted, pattern_of
from ratherthan.render.legend import Entry, swatch
from ratherthan.render.marks import Marks
from ratherthan.render.palette import BLACK, INK, NEVER, PAPER, WITHOUT, ink_on, rgb, shade
from ratherthan.render.rulers import draw_rulers, ruler_room
from ratherthan.render.sheet import Body, Sheet, sheet
from ratherthan.render.wording import amount, words
from ratherthan.solve.solution import Solution

__all__ = ["draw_heat"]

ROOM = (900.0, 700.0)
LEVELS = 64
NUMBERED = 34.0
"""From how many units a cell on it bears its number."""
PATTERNED = 8.0
"""From how many units a cell on what is infinite is hatched; where cells are smaller they alternate between two colours."""
SPACED = 15.0
"""How many units lie at least between two arrows of a policy."""
MOST_MARKS = 12
SCALE = 46.0
"""How high the scale of colours is, with its numbers."""


def draw_heat(solution: Solution, what: str) -> Picture:
    """Return the picture of a solution on its map.

    Parameters
    ----------
    solution : Solution
    what : str
        "value" (ρ), "spread" (λmax - λmin) or "policy" (arrows over the values).

    Raises
    ------
    QuestionError
        If the model lies on no map.
    """
    world = world_of(solution.problem, solution.goal, solution.hazard)
    if world is None:
        raise QuestionError(
            "Values are drawn on a map, but this model lies on none. Draw an explanation of it instead."
        )
    part, corner = cropped(world)
    return _Heat(solution=solution, what=what, world=part, corner=corner, whole=world.width).picture()


@dataclass(frozen=True, kw_only=True, eq=False)
class _Heat:
    solution: Solution
    what: str
    world: WorldRecord
    corner: tuple[int, int]
    whole: int

    @property
    def said(self) -> dict[str, str]:
        return dict(words(self.solution.problem.lexicon.language)["heat"])

    @cached_property
    def fit(self) -> View:
        """How large the map is drawn."""
        return fitted(self.world, 0.0, 0.0, ROOM)

    @cached_property
    def cell_of_state(self) -> npt.NDArray[np.int64]:
        """The cell of each state, ``[S]``, -1 where it lies nowhere."""
        world = self.solution.problem.world
        assert world is not None
        cell = world.cell_of_state.astype(np.int64)
        column, row = cell % self.whole - self.corner[0], cell // self.whole - self.corner[1]
        inside = (cell >= 0) & (column >= 0) & (column < self.world.width) & (row >= 0) & (row < self.world.height)
        return np.where(inside, row * self.world.width + column, -1)

    @cached_property
    def numbers(self) -> Floats:
        """The number of each cell, ``[height*width]``; NaN where no state lies."""
        solution = self.solution
        maximise = solution.objectives[0].maximise
        if self.what == "spread":
            measures = Factors(solution=solution, asked=question("selective")).levels[0]
            with np.errstate(invalid="ignore"):
                values = np.where(
                    measures.lambda_max == measures.lambda_min, 0.0, measures.lambda_max - measures.lambda_min
                )
            values[solution.ended] = 0.0
            maximise = True
        else:
            values = solution.policy_values[0] if solution.given else solution.values[0]
        found = np.full(self.world.width * self.world.height, -np.inf if maximise else np.inf)
        inside = self.cell_of_state >= 0
        better = np.maximum if maximise else np.minimum
        better.at(found, self.cell_of_state[inside], values[inside])
        empty = np.ones(len(found), dtype=np.bool_)
        empty[self.cell_of_state[inside]] = False
        found[empty] = np.nan
        return found

    @cached_property
    def ends(self) -> tuple[float, float]:
        """The least and the largest finite number."""
        finite = self.numbers[np.isfinite(self.numbers)]
        return (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)

    @cached_property
    def places(self) -> npt.NDArray[np.uint8]:
        """The colour of each cell, an index into `colours`, ``[height, width]``."""
        low, high = self.ends
        share = np.zeros_like(self.numbers) if high <= low else (self.numbers - low) / (high - low)
        finite = np.isfinite(self.numbers)
        places = np.full(len(self.numbers), LEVELS, dtype=np.uint8)
        places[finite] = np.clip(np.round(share[finite] * (LEVELS - 1)), 0, LEVELS - 1).astype(np.uint8)
        rows, columns = np.divmod(np.arange(len(self.numbers)), self.world.width)
        infinite = np.isinf(self.numbers)
        odd = (rows + columns) % 2 * (self.fit.cell < PATTERNED)
        places[infinite] = (LEVELS + 1 + odd)[infinite].astype(np.uint8)
        return places.reshape(self.world.height, self.world.width)

    @property
    def colours(self) -> npt.NDArray[np.uint8]:
        """The levels of the scale, the colour of cells without a state, and the two of what is infinite."""
        shades = [rgb(shade(level / (LEVELS - 1))) for level in range(LEVELS)]
        return np.array([*shades, rgb(WITHOUT.fill), rgb(NEVER.fill), rgb(NEVER.ink)], dtype=np.uint8)

    def picture(self) -> Picture:
        (left, below), fit = ruler_room(self.world), self.fit
        body = sheet(self.sheet(fit.cell), left + fit.width, fit.height + below + SCALE)
        view = View(x=body.x + left, y=body.y, cell=fit.cell, columns=fit.columns, rows=fit.rows)
        canvas = body.canvas
        draw_cells(canvas, view, self.places, self.colours)
        if view.cell >= PATTERNED:
            draw_pattern(canvas, view, np.isinf(self.numbers).reshape(view.rows, view.columns), NEVER)
        draw_frame(canvas, view)
        draw_rulers(canvas, view, self.world, words(self.solution.problem.lexicon.language)["map"]["metre"])
        if self.what == "policy":
            self.arrows(canvas, view)
        elif view.cell >= NUMBERED:
            self.figures(canvas, view)
        marks = Marks(canvas)
        for cell in np.flatnonzero(self.world.goals)[:MOST_MARKS].tolist():
            x, y = view.centre(cell % view.columns, cell // view.columns)
            marks.goal((x, y) if view.cell < NUMBERED else (x + 0.3 * view.cell, y - 0.1 * view.cell), radius=7.0)
        self.scale(body, view, body.y + fit.height + below)
        return canvas.picture()

    def sheet(self, cell: float) -> Sheet:
        """Return the words around the map."""
        said, solution = self.said, self.solution
        record = objective_record(solution.objectives[0])
        noun = record.reward or (
            "steps" if record.kind == "cost" else said["chance"] if record.chance else said["total"]
        )
        entries = []
        if np.isinf(self.numbers).any():
            key = "never" if record.kind in ("cost", "reward") and self.what != "spread" else "endless"
            entries.append(Entry(words=said[key], sample=swatch(NEVER, pattern_of)))
        if np.isnan(self.numbers).any():
            entries.append(Entry(words=said["without"], sample=swatch(WITHOUT, pattern_of)))
        if self.world.goals.any():
            goal = words(solution.problem.lexicon.language)["legend"]["goal"]
            entries.append(Entry(words=goal, sample=lambda c, x, y: Marks(c).goal((x - 3.0, y + 1.0), radius=6.5)))
        caption = said[f"{self.what}_caption"].format(noun=noun)
        every = self.every(cell)
        if self.what == "policy" and every > 1:
            caption += " " + said["every"].format(count=every)
        low, high = self.ends
        table = words(solution.problem.lexicon.language)["map"]
        size = table["size"].format(width=self.world.width, height=self.world.height)
        spoken = f"{size} {caption} " + said["description"].format(low=amount(low), high=amount(high))
        name = self.world.title or solution.problem.source or table["untitled"]
        name += f" ({self.world.note})" if self.world.note else ""
        return Sheet(title=said["title"].format(name=name), description=spoken, caption=caption, entries=entries)

    def figures(self, canvas: Canvas, view: View) -> None:
        """Write the number of each cell into it."""
        colours = [f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue in self.colours.tolist()]
        places = self.places.ravel()
        for cell, value in enumerate(self.numbers.tolist()):
            if math.isnan(value):
                continue
            x, y = view.centre(cell % view.columns, cell // view.columns)
            said = amount(value)
            fill = colours[places[cell]]
            size = min(14.0, 0.3 * view.cell, 0.9 * view.cell / max(text_width(said, 1.0), 1.0))
            halo = {"stroke": fill, "stroke_width": 3.0, "paint_order": "stroke", "stroke_linejoin": "round"}
            canvas.text(x, y + 0.36 * size, said, size=size, fill=ink_on(fill), text_anchor="middle", **halo)

    def every(self, cell: float) -> int:
        """Return in which cells arrows are drawn: every first, second, ..."""
        return max(1, math.ceil(SPACED / cell))

    def arrows(self, canvas: Canvas, view: View) -> None:
        """Draw where the policy most likely leads."""
        mdp, policy, every = self.solution.problem.mdp, self.solution.policy, self.every(view.cell)
        cells = self.cell_of_state
        states = np.flatnonzero((cells >= 0) & ~self.solution.ended)
        columns, rows = cells[states] % view.columns, cells[states] // view.columns
        states = states[(columns % every == every // 2) & (rows % every == every // 2)] if every > 1 else states
        _, first = np.unique(cells[states], return_index=True)
        reach = min(0.38 * view.cell * every, 16.0)
        shapes: dict[str, list[str]] = {BLACK: [], PAPER: []}
        colours = self.colours
        for state in states[first].tolist():
            own = mdp.choices_of(state)
            weights = policy.weights(mdp)[own.start : own.stop] if policy.chance is not None else None
            choice = int(policy.choice[state]) if weights is None else own.start + int(np.argmax(weights))
            if choice < 0:
                continue
            branches = mdp.branches_of(choice)
            towards = int(mdp.branch_to_target[branches][int(np.argmax(mdp.branch_to_probability[branches]))])
            here, there = int(cells[state]), int(cells[towards])
            x, y = view.centre(here % view.columns, here // view.columns)
            red, green, blue = colours[self.places.ravel()[here]].tolist()
            ink = ink_on(f"#{red:02x}{green:02x}{blue:02x}")
            if there in (here, -1):
                shapes[ink].append(f"M{number(x - 1.5)} {number(y)}h3")
                continue
            angle = math.atan2(there // view.columns - here // view.columns, there % view.columns - here % view.columns)
            shapes[ink].append(_arrow(x, y, angle, reach))
        for ink, lines in shapes.items():
            if lines:
                canvas.add("path", d="".join(lines), fill="none", stroke=ink, stroke_width=1.4, stroke_linecap="round")

    def scale(self, body: Body, view: View, top: float) -> None:
        """Draw the scale of colours with its numbers."""
        low, high = self.ends
        canvas, width = body.canvas, min(view.width, 420.0) if view.width >= 160.0 else 160.0
        left = min(view.x, canvas.width - width - 8.0)
        steps = 7 if high > low else 1
        for step in range(steps):
            canvas.rect(
                left + step * width / steps, top + 6.0, width / steps, 14.0, fill=shade(step / max(1, steps - 1))
            )
        canvas.rect(left, top + 6.0, width, 14.0, fill="none", stroke=INK, stroke_width=0.75)
        for share in (0.0, 0.5, 1.0) if high > low else (0.5,):
            anchor = {0.0: "start", 0.5: "middle", 1.0: "end"}[share]
            said = amount(low + share * (high - low))
            canvas.text(left + share * width, top + 34.0, said, size=11.0, text_anchor=anchor)


def _arrow(x: float, y: float, angle: float, reach: float) -> str:
    """Return an arrow through (x, y) as a path."""
    cos, sin = math.cos(angle), math.sin(angle)
    tip = (x + reach * cos, y + reach * sin)
    line = f"M{number(x - reach * cos)} {number(y - reach * sin)}L{number(tip[0])} {number(tip[1])}"
    for turn in (0.55, -0.55):
        back = (tip[0] - 0.8 * reach * math.cos(angle + turn), tip[1] - 0.8 * reach * math.sin(angle + turn))
        line += f"M{number(back[0])} {number(back[1])}L{number(tip[0])} {number(tip[1])}"
    return line
