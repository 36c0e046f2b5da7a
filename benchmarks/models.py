"""Sizes and seeds enter, generated models leave: the maps and other models that the benchmarks run on."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import Discounted, ExpectedCost, ReachAvoid
from ratherthan.model.problem import Problem

__all__ = [
    "expander",
    "gambles",
    "loops",
    "maze",
    "one_way_city",
    "ring",
    "slippery_map",
    "still_map",
    "trap_map",
    "walk",
]

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

DIRECTIONS = ((-1, 0), (0, 1), (1, 0), (0, -1))
NAMES = ("north", "east", "south", "west")
STEPS = ExpectedCost(goal='"goal"', reward="steps")


@cache
def slippery_map(side: int, *, slip: float = 0.1, walls: float = 0.25, seed: int = 0) -> Problem:
    """Return a map of side × side cells: four directions, unit costs, slips to both sides, walls, a goal in the last corner.

    The way begins in the first cell from which the goal can be reached.
    """
    beside, goal = _cells(side, walls, np.random.default_rng(seed))
    ways = [np.stack([beside[:, k], beside[:, (k + 1) % 4], beside[:, (k - 1) % 4]], 1) for k in range(4)]
    start = _first_with_a_way(beside, int(np.argmax(goal)))
    return _steps(np.stack(ways, 1), np.array([1 - 2 * slip, slip, slip]), goal, start)


@cache
def still_map(side: int, *, stay: float = 0.1, walls: float = 0.25, seed: int = 0) -> Problem:
    """Return a map on which a move may fail, and then nothing happens."""
    beside, goal = _cells(side, walls, np.random.default_rng(seed))
    here = np.arange(len(beside))
    ways = np.stack([np.stack([beside[:, k], here], 1) for k in range(4)], 1)
    return _steps(ways, np.array([1 - stay, stay]), goal, _first_with_a_way(beside, int(np.argmax(goal))))


@cache
def one_way_city(side: int, *, two_way: float = 0.2, seed: int = 0) -> Problem:
    """Return a city of streets and avenues of one direction each, alternating, of which some blocks can be driven both ways.

    A move fails with probability 0.1. The goal is the last corner.
    """
    rng = np.random.default_rng(seed)
    row, column = np.divmod(np.arange(side * side), side)
    beside, open_ = _neighbours(np.ones((side, side), dtype=np.bool_))
    open_ &= beside != np.arange(side * side)[:, None]
    both = rng.random((side, side, 2)) < two_way
    east, south = row % 2 == 0, column % 2 == 1
    east[row == side - 1], south[column == side - 1] = True, True  # so that the last corner can be reached
    # a street between two crossings belongs to the western or northern one
    east_to, west_to = both[row, column, 0], both[row, np.maximum(column - 1, 0), 0]
    south_to, north_to = both[row, column, 1], both[np.maximum(row - 1, 0), column, 1]
    permitted = np.stack([~south | north_to, east | east_to, south | south_to, ~east | west_to], 1) & open_
    permitted[~permitted.any(axis=1)] = open_[~permitted.any(axis=1)]
    here, action = np.nonzero(permitted)
    targets = np.stack([beside[here, action], here], 1)
    goal = np.arange(side * side) == side * side - 1
    offsets = np.concatenate([[0], np.cumsum(permitted.sum(axis=1))])
    return _problem(offsets, targets, np.array([0.9, 0.1]), action, goal)


@cache
def maze(side: int, *, links: float = 0.02, seed: int = 0) -> Problem:
    """Return a maze of side × side cells, a random spanning tree with some more links; a move fails with probability 0.1."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree

    rng = np.random.default_rng(seed)
    number = np.arange(side * side).reshape(side, side)
    one = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
    other = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
    tree = minimum_spanning_tree(coo_array((1 + rng.random(len(one)), (one, other)), shape=(side**2, side**2)).tocsr())
    kept = rng.random(len(one)) < links
    own, there = tree.nonzero()
    own, there = np.concatenate([own, one[kept]]), np.concatenate([there, other[kept]])
    pairs = np.unique(np.stack([np.concatenate([own, there]), np.concatenate([there, own])], 1), axis=0)
    here, there = pairs.T
    step = there - here
    action = np.select([step == -side, step == 1, step == side], [0, 1, 2], 3)
    offsets = np.concatenate([[0], np.cumsum(np.bincount(here, minlength=side * side))])
    goal = np.arange(side * side) == side * side - 1
    return _problem(offsets, np.stack([there, here], 1), np.array([0.9, 0.1]), action, goal)


@cache
def trap_map(side: int, *, walls: float = 0.1, traps: float = 0.15, slip: float = 0.1, seed: int = 1) -> Problem:
    """Return a slippery map with absorbing traps: the largest probability to come to the goal without falling into one."""
    rng = np.random.default_rng(seed)
    beside, goal = _cells(side, walls, rng)
    trap = rng.random(len(beside)) < traps
    close = goal
    for _ in range(4):  # the goal is not shut in
        close = close | close[beside].any(axis=1)
    trap &= ~close
    start = _first_with_a_way(np.where(trap[:, None], np.arange(len(beside))[:, None], beside), int(np.argmax(goal)))
    trap[start] = False
    ways = [np.stack([beside[:, k], beside[:, (k + 1) % 4], beside[:, (k - 1) % 4]], 1) for k in range(4)]
    problem = _steps(np.stack(ways, 1), np.array([1 - 2 * slip, slip, slip]), goal, start, trap=trap)
    return Problem(mdp=problem.mdp, objective=ReachAvoid(goal='"goal"', through='!"trap"'))


@cache
def expander(states: int, *, actions: int = 5, branches: int = 4, goals: int = 1, seed: int = 0) -> Problem:
    """Return a model whose branches lead anywhere: it mixes fast, and has no small separators."""
    rng = np.random.default_rng(seed)
    targets = rng.integers(0, states, (states * actions, branches))
    chances = rng.dirichlet(np.ones(branches), states * actions)
    goal = np.arange(states) >= states - goals
    return _regular(states, actions, targets, chances, goal)


@cache
def ring(states: int, *, reach: int = 50, actions: int = 5, branches: int = 4, seed: int = 0) -> Problem:
    """Return a ring whose branches lead to one of the next `reach` states on either side; one goal."""
    rng = np.random.default_rng(seed)
    own = np.repeat(np.arange(states), actions)[:, None]
    targets = (own + rng.integers(-reach, reach + 1, (states * actions, branches))) % states
    chances = rng.dirichlet(np.ones(branches), states * actions)
    return _regular(states, actions, targets, chances, np.arange(states) == states - 1, start=states // 2)


@cache
def walk(counter: int = 60, processes: int = 6) -> Problem:
    """Return a consensus-like walk: processes take turns at tossing coins that move a shared counter to one of its two ends.

    Each process is about to toss, about to move the counter by what it tossed, or to look whether an end is reached; which
    process goes next is the choice. The cost is a step.
    """
    phases = 3**processes
    states = (2 * counter + 1) * phases
    own = np.arange(states)
    place, phase = np.divmod(own, phases)
    done = (place == 0) | (place == 2 * counter)
    targets = np.empty((states, processes, 2), dtype=np.int64)
    for number in range(processes):
        weight = 3**number
        toss = phase // weight % 3
        up, down = own + weight, own + 2 * weight  # from 0, about to toss, to 1, up, or 2, down
        moved = own + np.where(toss == 1, phases, -phases) - toss * weight
        targets[:, number, 0] = np.where(done, own, np.where(toss == 0, up, moved))
        targets[:, number, 1] = np.where(done, own, np.where(toss == 0, down, moved))
    names = tuple(f"process {number + 1}" for number in range(processes))
    start = counter * phases
    chances = np.full((states * processes, 2), 0.5)
    return _regular(states, processes, targets.reshape(-1, 2), chances, done, start=start, names=names)


@cache
def loops(states: int, *, size: int = 20, leak: float = 1e-6, seed: int = 0) -> Problem:
    """Return end components, and near ones that are left with a small probability only: the largest probability to arrive.

    States stand in groups of `size`, in which one can come from any state to any other. The first state of a group has a choice
    to leave it for a later group, or with some probability for a dead end; of every second group only with probability `leak` a step.
    """
    rng = np.random.default_rng(seed)
    own = np.arange(states)
    first = own - own % size
    inside = np.minimum(first[:, None] + rng.integers(0, size, (states, 4)), states - 1)
    inside[:, 0] = np.minimum(np.where((own + 1) % size == 0, first, own + 1), states - 1)
    ahead = np.minimum(first + rng.integers(size, 12 * size, states), states - 1)
    risk = rng.random(states) * min(0.1, 10 * size / states)
    leaves, near = own % size == 0, own // size % 2 == 1
    stays = np.where(leaves & near, 1 - leak, np.where(leaves, 0.0, 1.0))
    chances = np.zeros((states, 3, 4))
    chances[:, :2, :2] = 0.5
    chances[:, 2] = np.stack([stays, np.zeros(states), (1 - stays) * (1 - risk), (1 - stays) * risk], 1)
    out = np.stack([inside[:, 2], inside[:, 3], ahead, np.full(states, states - 2)], 1)
    targets = np.stack([inside[:, [0, 1, 0, 1]], inside[:, [2, 3, 2, 3]], out], 1)
    targets[states - 2 :] = own[states - 2 :, None, None]
    problem = _regular(states, 3, targets.reshape(-1, 4), chances.reshape(-1, 4), own == states - 1)
    return Problem(mdp=_without_zeros(problem.mdp), objective=ReachAvoid(goal='"goal"', through=None))


@cache
def gambles(states: int, *, discount: float = 0.99, seed: int = 0) -> Problem:
    """Return a model with gains and losses, of which the largest discounted sum is wanted."""
    rng = np.random.default_rng(seed)
    base = ring(states, seed=seed).mdp
    gains = rng.normal(0.0, 1.0, base.choices)
    mdp = replace(base, rewards={"gain": Reward(choice=gains)})
    return Problem(mdp=mdp, objective=Discounted(reward="gain", discount=discount))


def _cells(side: int, walls: float, rng: np.random.Generator) -> tuple[Ints, Bools]:
    """Return the neighbours of the free cells of a map, each itself where there is a wall, and which is the goal."""
    free = rng.random((side, side)) >= walls
    free[0, 0] = free[-1, -1] = True
    beside, _ = _neighbours(free)
    return beside, np.arange(len(beside)) == len(beside) - 1


def _neighbours(free: Bools) -> tuple[Ints, Bools]:
    """Return the neighbours of the free cells in all directions, each itself where there is none, and where there is one."""
    side = len(free)
    number = np.full(free.shape, -1)
    number[free] = np.arange(free.sum())
    row, column = np.nonzero(free)
    beside = np.empty((len(row), 4), dtype=np.int64)
    for k, (down, right) in enumerate(DIRECTIONS):
        there = number[np.clip(row + down, 0, side - 1), np.clip(column + right, 0, side - 1)]
        beside[:, k] = np.where(there < 0, np.arange(len(row)), there)
    return beside, beside != np.arange(len(row))[:, None]


def _steps(ways: Ints, chances: npt.NDArray[np.float64], goal: Bools, start: int, trap: Bools | None = None) -> Problem:
    """Return the problem of ways ``[S, A, n]`` with the same chances everywhere."""
    states, actions, _ = ways.shape
    offsets = np.arange(0, actions * states + 1, actions)
    action = np.tile(np.arange(actions), states)
    return _problem(offsets, ways.reshape(states * actions, -1), chances, action, goal, start=start, trap=trap)


def _regular(
    states: int,
    actions: int,
    targets: Ints,
    chances: npt.NDArray[np.float64],
    goal: Bools,
    *,
    start: int = 0,
    names: tuple[str, ...] | None = None,
) -> Problem:
    """Return the problem in which every state has the same number of choices."""
    offsets = np.arange(0, actions * states + 1, actions)
    named = names or tuple(f"action {number + 1}" for number in range(actions))
    return _problem(offsets, targets, chances, np.tile(np.arange(actions), states), goal, start=start, names=named)


def _problem(
    offsets: Ints,
    targets: Ints,
    chances: npt.NDArray[np.float64],
    action: Ints,
    goal: Bools,
    *,
    start: int = 0,
    names: tuple[str, ...] = NAMES,
    trap: Bools | None = None,
) -> Problem:
    """Return the problem of the fewest steps to the goal, of choices with equally many branches each."""
    choices, branches = targets.shape
    mdp = MDP(
        state_to_choices=offsets,
        choice_to_branches=np.arange(0, choices * branches + 1, branches),
        branch_to_target=targets.reshape(-1),
        branch_to_probability=np.broadcast_to(chances, targets.shape).reshape(-1).copy(),
        choice_to_action=action,
        actions=names,
        initial=np.array([start]),
        labels={"goal": goal} | ({} if trap is None else {"trap": trap}),
        rewards={"steps": Reward(choice=np.ones(choices))},
    )
    return Problem(mdp=mdp, objective=STEPS)


def _first_with_a_way(beside: Ints, goal: int) -> int:
    """Return the first cell from which the goal can be reached."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    cells, ways = beside.shape
    here = np.repeat(np.arange(cells), ways)
    backwards = csr_array((np.ones(cells * ways), (beside.reshape(-1), here)), shape=(cells, cells))
    return int(breadth_first_order(backwards, goal, return_predecessors=False).min())


def _without_zeros(mdp: MDP) -> MDP:
    """Return the model without its branches of probability 0."""
    kept = mdp.branch_to_probability > 0.0
    return replace(
        mdp,
        choice_to_branches=np.concatenate([[0], np.cumsum(kept)])[mdp.choice_to_branches],
        branch_to_target=mdp.branch_to_target[kept],
        branch_to_probability=mdp.branch_to_probability[kept],
    )
