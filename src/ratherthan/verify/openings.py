"""A problem, a frame and the closed cells that are told to be in the way enter; what is wrong with them leaves.

They must be closed cells of the map, each called as it is; with them open there must be a way to a goal; and no smaller number may do.
The least number is found anew: breadth-first floods over the cells, each of which goes as far as open cells lead and then one closed
cell further. How cells are joined is told in `ratherthan.explain.openings`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.explain.explanation import Explanation, Opening
from ratherthan.model.mdp import Bools
from ratherthan.model.names import Placing
from ratherthan.model.problem import Problem
from ratherthan.model.world import WATER, World
from ratherthan.verify.frame import Frame

__all__ = ["wrong_openings"]

STEPS = ((0, 1), (0, -1), (1, 0), (-1, 0))


def wrong_openings(told: Explanation, problem: Problem, frame: Frame) -> str | None:
    """Return what is wrong with the closed cells that would have to open, None where nothing is."""
    world, listed = problem.world, told.openings
    hazards = bool(told.in_the_way)
    if world is None or problem.unfolding is not None or hazards:
        return "no closed cells can be told of here" if listed else None
    opened = np.zeros((world.height, world.width), dtype=np.bool_)
    placed = world.cell_of_state >= 0
    opened.ravel()[world.cell_of_state[placed]] = True
    start = int(world.cell_of_state[told.start])
    if start < 0 or opened.all():
        return "no cell of the map is closed" if listed else None
    flaw = next((found for cell in listed if (found := _wrong_cell(cell, problem, world, opened))), None)
    if flaw is not None or len({cell.place for cell in listed}) < len(listed):
        return flaw or "a cell is listed twice"
    goals = _marked(world, frame.goal)
    joined = _joined(problem, world, opened, _marked(world, frame.hazard) & ~goals)
    begin = np.zeros_like(opened)
    begin.ravel()[start] = True
    least = _least(begin, goals, opened, joined)
    if least is None or not listed:
        return None if (least is None or least == 0) and not listed else "other cells would have to open"
    if least != len(listed):
        return f"at least {least} cells would have to open, got {len(listed)}"
    for cell in listed:
        opened[cell.place[1], cell.place[0]] = True
    return None if _least(begin, goals, opened, joined) == 0 else "with these cells open there is no way yet"


def _wrong_cell(cell: Opening, problem: Problem, world: World, opened: Bools) -> str | None:
    column, row = cell.place
    if not (0 <= column < world.width and 0 <= row < world.height) or opened[row, column]:
        return f"{cell.place} is no closed cell of the map"
    place, names = row * world.width + column, problem.mdp.names.strings
    name = names.of_cell(place) if isinstance(names, Placing) else f"cell ({column}, {row})"
    kind = world.kinds[int(world.kind_of_cell[place])]
    if (cell.name, cell.kind) != (name, kind):
        return f"the cell {cell.place} is '{name}', {kind}; got '{cell.name}', {cell.kind}"
    return None


def _marked(world: World, states: Bools) -> Bools:
    """Return the cells of some states, ``[H, W]``."""
    marks = np.zeros(world.height * world.width, dtype=np.bool_)
    cells = world.cell_of_state[states]
    marks[cells[cells >= 0]] = True
    return marks.reshape(world.height, world.width)


def _joined(problem: Problem, world: World, opened: Bools, barred: Bools) -> list[Bools]:
    """Return for each of the four steps where it may end, ``[H, W]``: over the model's moves, or if closed cells open."""
    mdp, height, width = problem.mdp, world.height, world.width
    wet = np.zeros_like(opened)
    if WATER in world.kinds:
        wet = opened & (world.kind_of_cell.reshape(height, width) == world.kinds.index(WATER))
    own = np.repeat(world.cell_of_state, np.diff(mdp.state_to_choices))
    origin = np.repeat(own, np.diff(mdp.choice_to_branches)).astype(np.int64)
    target = world.cell_of_state[mdp.branch_to_target].astype(np.int64)
    here = (origin >= 0) & (target >= 0)
    origin, target = origin[here], target[here]
    found = []
    for down, right in STEPS:
        moves = np.zeros_like(opened)
        fits = (target // width - origin // width == down) & (target % width - origin % width == right)
        moves.ravel()[target[fits]] = True
        from_open, from_wet = (_shifted(mask, down, right) for mask in (opened, wet))
        within = _shifted(np.ones_like(opened), down, right)
        found.append(within & ~barred & np.where(opened & from_open, moves, ~wet & ~from_wet))
    return found


def _shifted(mask: Bools, down: int, right: int) -> Bools:
    """Return a set moved by one step; what comes from beyond the edge is not in it."""
    moved = np.zeros_like(mask)
    height, width = mask.shape
    rows = slice(max(down, 0), height + min(down, 0)), slice(max(-down, 0), height + min(-down, 0))
    columns = slice(max(right, 0), width + min(right, 0)), slice(max(-right, 0), width + min(-right, 0))
    moved[rows[0], columns[0]] = mask[rows[1], columns[1]]
    return moved


def _least(begin: Bools, goals: Bools, opened: Bools, joined: list[Bools]) -> int | None:
    """Return how many closed cells must be passed at least on the way to a goal; None where none can be reached."""
    height, width = opened.shape
    reached, price = begin.copy(), 0
    edge: npt.NDArray[np.int64] = np.flatnonzero(begin)
    while len(edge):
        waiting = []
        while len(edge):  # as far as open cells lead, a layer at a time
            fresh = []
            for (down, right), may in zip(STEPS, joined, strict=True):
                row, column = edge // width + down, edge % width + right
                inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
                there = (row * width + column)[inside]
                there = there[may.ravel()[there] & ~reached.ravel()[there]]
                fresh.append(there[opened.ravel()[there]])
                waiting.append(there[~opened.ravel()[there]])
            edge = np.unique(np.concatenate(fresh))
            reached.ravel()[edge] = True
        if (reached & goals).any():
            return price
        edge = np.unique(np.concatenate(waiting))
        edge = edge[~reached.ravel()[edge]]
        reached.ravel()[edge] = True
        price += 1
    return None
