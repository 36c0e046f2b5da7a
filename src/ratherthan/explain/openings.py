"""A Solution and a start without a way to the goal enter; the closed cells of the map that would have to open leave.

Definition
----------
A map of cells has a cell for each state, and closed cells where no state lies: obstacles, ground that is too narrow for the robot,
what a person forbids. A way on the map goes from cell to neighbouring cell, up, down or to a side: to a closed cell at the price of 1,
and to an open cell for nothing. (A diagonal that cuts no corner needs the straight moves beside it, so nothing more is reached by
diagonals.) Between two open cells there must be a move of the model; hazards are not entered; and to and from water no opened cell
leads, as it is open ground. The cells paid for on a cheapest way to a goal are a smallest set that would have to open; among
those, the way with the fewest cells is taken.

Method: Dijkstra's algorithm backwards from the goals, with price · N + 1 for each cell, N being more than any way has cells. It ends when
each cell was looked at once, and the numbers are whole and below 2^53, so the least is exact.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.explain._kernels import Rows, shortest_to
from ratherthan.explain.explanation import Opening
from ratherthan.model._kernels import compiled, sorted_by
from ratherthan.model.mdp import Bools
from ratherthan.model.names import Placing
from ratherthan.model.problem import Problem
from ratherthan.model.watch import look
from ratherthan.model.world import WATER, World
from ratherthan.solve.solution import Solution

__all__ = ["openings"]

Cells = npt.NDArray[np.int64]


def openings(solution: Solution, start: int) -> tuple[Opening, ...]:
    """Return a smallest set of closed cells that would have to open for a way from `start` to a goal, in the order of the way.

    Parameters
    ----------
    solution : Solution
    start : int

    Returns
    -------
    tuple of Opening
        Empty where the problem has no map with closed cells, or no opening of cells would help.
    """
    problem = solution.problem
    world = problem.world
    if world is None or problem.unfolding is not None:
        return ()
    cell = world.cell_of_state
    opened = np.zeros(world.width * world.height, dtype=np.bool_)
    opened[cell[cell >= 0]] = True
    if opened.all() or cell[start] < 0:
        return ()
    goals, barred = (np.zeros_like(opened) for _ in range(2))
    goals[cell[solution.goal & (cell >= 0)]] = True
    barred[cell[solution.hazard & (cell >= 0)]] = True
    barred &= ~goals
    way = _cheapest(*_edges(problem, world, opened, barred), opened=opened, start=int(cell[start]), goals=goals)
    return tuple(_opening(problem, world, int(here)) for here in way if not opened[here])


def _edges(problem: Problem, world: World, opened: Bools, barred: Bools) -> tuple[Cells, Cells]:
    """Return from which cell to which neighbour a way may go, if closed cells could open."""
    mdp, width = problem.mdp, world.width
    grid = np.arange(len(opened)).reshape(world.height, width)
    pairs = [(grid[:, :-1], grid[:, 1:]), (grid[:-1], grid[1:])]
    one = np.concatenate([part.ravel() for a, b in pairs for part in (a, b)])
    other = np.concatenate([part.ravel() for a, b in pairs for part in (b, a)])
    wet = np.zeros(len(opened), dtype=np.bool_)
    if WATER in world.kinds:
        wet = opened & (world.kind_of_cell == world.kinds.index(WATER))
    may = ~barred[other] & ~(wet[one] | wet[other])
    both = opened[one] & opened[other]
    look("looking for what is in the way")
    origin = np.repeat(np.repeat(world.cell_of_state, np.diff(mdp.state_to_choices)), np.diff(mdp.choice_to_branches))
    target = world.cell_of_state[mdp.branch_to_target]
    moves = (origin >= 0) & (target >= 0)
    step = target.astype(np.int64) - origin
    known = np.zeros((4, len(opened)), dtype=np.bool_)  # from each cell by one of four steps
    for place, far in enumerate((1, -1, width, -width)):
        known[place, origin[moves & (step == far)]] = True
    delta = other - one
    places = np.select([delta == 1, delta == -1, delta == width], [0, 1, 2], 3)
    may = np.where(both, known[places, one] & ~barred[other], may)
    return one[may], other[may]


def _cheapest(one: Cells, other: Cells, *, opened: Bools, start: int, goals: Bools) -> list[int]:
    """Return the cells of a way with the fewest closed cells, and of these the shortest; none where there is none."""
    cells, count = len(opened), len(one)
    price = np.where(opened[other], 1.0, cells + 2.0)
    first, edge = compiled(sorted_by, count)(other, np.arange(count), cells)
    left = compiled(shortest_to, count)(one, price, Rows(first, edge.astype(np.int64)), goals)
    if not np.isfinite(left[start]):
        return []
    first, edge = compiled(sorted_by, count)(one, np.arange(count), cells)
    here, way = start, [start]
    while not goals[here]:
        ways = edge[first[here] : first[here + 1]]
        here = int(other[ways[np.argmin(price[ways] + left[other[ways]])]])
        way.append(here)
    return way


def _opening(problem: Problem, world: World, cell: int) -> Opening:
    row, column = divmod(cell, world.width)
    names = problem.mdp.names.strings
    name = names.of_cell(cell) if isinstance(names, Placing) else f"cell ({column}, {row})"
    return Opening(place=(column, row), name=name, kind=world.kinds[int(world.kind_of_cell[cell])])
