"""A Problem or an MDP enters, a picture of it leaves: its map, or a small graph of the states around the start.

The graph has a column for the initial states, one for those that one step leads to, and so on. A state is a box with its actions in it;
lines lead from an action to the states of the next column, thicker where they are likelier. What leads to the same column or back is
written beside the action. At most so many states are drawn as fit; the caption says how many more there are.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ratherthan.errors import PropertyError
from ratherthan.explain.explanation import Explanation, ObjectiveRecord, StateRecord
from ratherthan.explain.places import WorldRecord, world_of
from ratherthan.explain.question import question
from ratherthan.model.mdp import MDP, Bools
from ratherthan.model.objective import Mission, Threshold, levels_of
from ratherthan.model.problem import Problem
from ratherthan.render.canvas import Canvas, Picture, cut, number, text_width
from ratherthan.render.legend import Entry
from ratherthan.render.palette import GOAL, INK, PAPER, QUIET, START
from ratherthan.render.sheet import Sheet, sheet
from ratherthan.render.wording import state_words, words

__all__ = ["draw_model"]

SIZE, SMALL = 12.0, 11.0
ROW, HEAD = 17.0, 22.0
WIDEST, GAP, APART = 190.0, 64.0, 14.0
MOST_STATES, MOST_COLUMNS, MOST_IN_COLUMN, MOST_ACTIONS = 24, 6, 8, 5
THIN, THICK = 0.8, 3.0


def draw_model(problem: Problem | MDP) -> Picture:
    """Return the picture of a model alone.

    Parameters
    ----------
    problem : Problem or MDP
    """
    whole = problem if isinstance(problem, Problem) else Problem(mdp=problem, source="")
    ends = _ends(whole)
    world = world_of(whole, *ends)
    if world is None:
        return _Graph(problem=whole, goal=ends[0]).picture()
    from ratherthan.render.mapview import draw_map

    return draw_map(_unasked(whole, world))


def _ends(problem: Problem) -> tuple[Bools, Bools]:
    """Return where the objective that the model makes plain ends well, and badly; nowhere without one."""
    from ratherthan.model.property import choose_objective
    from ratherthan.solve.goal import goal_of

    nowhere = np.zeros(problem.mdp.states, dtype=np.bool_)
    try:
        wish = problem.objective or choose_objective(problem)
    except PropertyError:
        return nowhere, nowhere
    first = levels_of(wish.objective if isinstance(wish, Threshold) else wish)[0]
    if isinstance(first, Mission):
        return nowhere, nowhere
    goal = goal_of(problem, first)
    return goal.target, ~goal.through & ~goal.target


def _unasked(problem: Problem, world: WorldRecord) -> Explanation:
    """Return an explanation of nothing, which carries the map."""
    mdp = problem.mdp
    start = int(mdp.initial[0]) if len(mdp.initial) == 1 else -1
    place = None if problem.world is None or start < 0 else problem.world.place(start)
    record = {start: StateRecord(name=mdp.names[start], named=mdp.names.named, place=place)} if start >= 0 else {}
    return Explanation(
        source=problem.source,
        property="",
        objective=ObjectiveRecord(kind="cost"),
        question=question("none"),
        start=start,
        states=record,
        size=(mdp.states, mdp.choices, mdp.branches),
        lexicon=problem.lexicon,
        world=world,
    )


@dataclass(frozen=True, kw_only=True)
class _Action:
    """An action in a box: its words, what stands beside it, and the states of the next column with their probabilities."""

    name: str
    beside: str
    towards: tuple[tuple[int, float], ...]


@dataclass(frozen=True, kw_only=True)
class _Box:
    """A state on the canvas."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _Graph:
    problem: Problem
    goal: Bools

    @cached_property
    def said(self) -> dict[str, dict[str, str]]:
        return {name: dict(table) for name, table in words(self.problem.lexicon.language).items()}

    @cached_property
    def columns(self) -> list[list[int]]:
        """The states that are drawn, by how many steps lead to them."""
        mdp = self.problem.mdp
        depth = {int(state): 0 for state in mdp.initial[:MOST_IN_COLUMN]}
        columns: list[list[int]] = [list(depth)]
        queue = deque(depth)
        while queue and len(depth) < MOST_STATES:
            here = queue.popleft()
            below = depth[here] + 1
            if below >= MOST_COLUMNS:
                break
            for choice in mdp.choices_of(here)[:MOST_ACTIONS]:
                for target in map(int, mdp.branch_to_target[mdp.branches_of(choice)][:MOST_IN_COLUMN]):
                    if target in depth or len(depth) >= MOST_STATES:
                        continue
                    if len(columns) == below:
                        columns.append([])
                    if len(columns[below]) < MOST_IN_COLUMN:
                        columns[below].append(target)
                        depth[target] = below
                        queue.append(target)
        return columns

    @cached_property
    def depth(self) -> dict[int, int]:
        return {state: place for place, column in enumerate(self.columns) for state in column}

    @cached_property
    def actions(self) -> dict[int, list[_Action]]:
        """What can be done in each state that is drawn; of many actions the first."""
        mdp, found = self.problem.mdp, {}
        for state in self.depth:
            own = mdp.choices_of(state)
            found[state] = [self.action(state, choice) for choice in own[:MOST_ACTIONS]]
            if len(own) > MOST_ACTIONS:
                more = self.said["graph"]["others"].format(count=len(own) - MOST_ACTIONS)
                found[state].append(_Action(name=more, beside="", towards=()))
        return found

    def action(self, state: int, choice: int) -> _Action:
        mdp = self.problem.mdp
        branches = mdp.branches_of(choice)
        targets = list(map(int, mdp.branch_to_target[branches]))
        chances = list(map(float, mdp.branch_to_probability[branches]))
        towards = [
            (target, chance)
            for target, chance in zip(targets, chances, strict=True)
            if self.depth.get(target) == self.depth[state] + 1
        ]
        elsewhere = [target for target in targets if target not in dict(towards)]
        beside = "" if not elsewhere else "↺" if set(elsewhere) == {state} else "→ " + self.listed(elsewhere, state)
        return _Action(name=mdp.action_name(choice), beside=beside, towards=tuple(towards))

    def listed(self, states: list[int], own: int) -> str:
        """Return some states that are not in the next column, in words."""
        others = [state for state in states if state != own]
        named = self.name(others[0])
        return named if len(others) == 1 else f"{named}, …"

    def name(self, state: int) -> str:
        names = self.problem.mdp.names
        return state_words(self.problem.lexicon, state, names[state], named=names.named)

    def words_in(self, action: _Action) -> str:
        return f"{action.name} {action.beside}" if action.beside else action.name

    @cached_property
    def boxes(self) -> dict[int, _Box]:
        """Where the states stand."""
        found, x = {}, 0.0
        heights = [sum(self.height(state) + APART for state in column) - APART for column in self.columns]
        for column, height in zip(self.columns, heights, strict=True):
            width = max(self.width(state) for state in column)
            y = (max(heights) - height) / 2.0
            for state in column:
                found[state] = _Box(x=x, y=y, width=width, height=self.height(state))
                y += self.height(state) + APART
            x += width + GAP
        return found

    def height(self, state: int) -> float:
        return HEAD + ROW * len(self.actions[state]) + 6.0

    def width(self, state: int) -> float:
        rows = [text_width(self.words_in(action), SMALL) for action in self.actions[state]]
        return min(WIDEST, max([text_width(self.name(state), SIZE) * 1.08, *rows])) + 20.0

    def picture(self) -> Picture:
        mdp, table = self.problem.mdp, self.said["map"]
        counts = {"states": f"{mdp.states:,}", "choices": f"{mdp.choices:,}", "branches": f"{mdp.branches:,}"}
        caption = table["model"].format(**counts)
        more = mdp.states - len(self.depth)
        if more > 0:
            graph = self.said["graph"]
            caption += " " + graph["not_drawn_one" if more == 1 else "not_drawn"].format(count=f"{more:,}")
        text = Sheet(
            title=self.problem.source or table["unnamed"],
            description=f"{self.said['graph']['model']} {caption}",
            caption=caption,
            entries=self.entries(),
        )
        boxes = self.boxes.values()
        body = sheet(text, max(box.x + box.width for box in boxes), max(box.y + box.height for box in boxes))
        for state, box in self.boxes.items():
            self.lines(body.canvas, (body.x, body.y), state, box)
        for state, box in self.boxes.items():
            self.state(body.canvas, (body.x + box.x, body.y + box.y), state, box)
        return body.canvas.picture()

    def lines(self, canvas: Canvas, corner: tuple[float, float], state: int, box: _Box) -> None:
        """Draw lines from the actions of a state to the next column."""
        left, top = corner
        for row, action in enumerate(self.actions[state]):
            x, y = left + box.x + box.width, top + box.y + HEAD + (row + 0.5) * ROW
            for target, chance in action.towards:
                other = self.boxes[target]
                end, level = left + other.x - 1.0, top + other.y + HEAD / 2.0
                bend = 0.5 * (end - x)
                line = f"M{number(x)} {number(y)}C{number(x + bend)} {number(y)} {number(end - bend)} {number(level)} {number(end - 6.0)} {number(level)}"
                canvas.add("path", d=line, fill="none", stroke=QUIET, stroke_width=THIN + (THICK - THIN) * chance)
                head = [(end - 8.0, level - 4.0), (end, level), (end - 8.0, level + 4.0)]
                canvas.path(head, closed=True, fill=QUIET)

    def state(self, canvas: Canvas, corner: tuple[float, float], state: int, box: _Box) -> None:
        """Draw a state with its actions."""
        x, y = corner
        first = state in self.columns[0]
        colour = GOAL if self.goal[state] else START if first else INK
        thick = 3.0 if first or self.goal[state] else 1.2
        canvas.rect(x, y, box.width, box.height, rx=6.0, fill=PAPER, stroke=colour, stroke_width=thick)
        said = cut(self.name(state), (box.width - 18.0) / 1.08, SIZE)
        canvas.text(x + 10.0, y + 0.72 * HEAD, said, size=SIZE, font_weight="bold")
        for row, action in enumerate(self.actions[state]):
            words_in = cut(self.words_in(action), box.width - 18.0, SMALL)
            canvas.text(x + 10.0, y + HEAD + (row + 0.72) * ROW, words_in, size=SMALL)

    def entries(self) -> list[Entry]:
        """Return the lines of the legend."""
        table = self.said["legend"]
        found = [Entry(words=table["start"], sample=lambda c, x, y: _ring(c, x, y, START))]
        if any(self.goal[state] for state in self.depth):
            found.append(Entry(words=table["goal"], sample=lambda c, x, y: _ring(c, x, y, GOAL)))
        if any(action.towards for rows in self.actions.values() for action in rows):
            found.append(Entry(words=table["likely"], sample=_thick))
        if any("↺" in action.beside for rows in self.actions.values() for action in rows):
            found.append(Entry(words=table["loop"], sample=_loop))
        return found


def _ring(canvas: Canvas, x: float, y: float, colour: str) -> None:
    canvas.rect(x - 13.0, y - 8.0, 26.0, 16.0, rx=6.0, fill=PAPER, stroke=colour, stroke_width=3.0)


def _thick(canvas: Canvas, x: float, y: float) -> None:
    canvas.path([(x - 14.0, y - 4.0), (x + 14.0, y - 4.0)], stroke=QUIET, stroke_width=THICK)
    canvas.path([(x - 14.0, y + 4.0), (x + 14.0, y + 4.0)], stroke=QUIET, stroke_width=THIN)


def _loop(canvas: Canvas, x: float, y: float) -> None:
    canvas.text(x, y + 4.0, "↺", size=SIZE, text_anchor="middle")
