"""Sizes and seeds enter, generated models leave: the maps that the benchmarks run on."""

from __future__ import annotations

from functools import cache

import numpy as np

from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.problem import Problem

__all__ = ["slippery_map"]


@cache
def slippery_map(side: int, *, slip: float = 0.1, walls: float = 0.25, seed: int = 0) -> Problem:
    """Return a map of side × side cells: four directions, unit costs, slips to both sides, walls, a goal in the last corner.

    The way begins in the first cell from which the goal can be reached.
    """
    rng = np.random.default_rng(seed)
    free = rng.random((side, side)) >= walls
    free[0, 0] = free[-1, -1] = True
    number = np.full((side, side), -1)
    number[free] = np.arange(free.sum())
    states = int(free.sum())
    row, column = np.nonzero(free)
    beside = np.empty((states, 4), dtype=np.int64)
    for k, (down, right) in enumerate([(-1, 0), (0, 1), (1, 0), (0, -1)]):
        there = number[np.clip(row + down, 0, side - 1), np.clip(column + right, 0, side - 1)]
        beside[:, k] = np.where(there < 0, np.arange(states), there)
    ways = [[beside[:, k], beside[:, (k + 1) % 4], beside[:, (k - 1) % 4]] for k in range(4)]
    goal = np.zeros(states, dtype=np.bool_)
    goal[-1] = True
    mdp = MDP(
        state_to_choices=np.arange(0, 4 * states + 1, 4),
        choice_to_branches=np.arange(0, 12 * states + 1, 3),
        branch_to_target=np.stack([np.stack(way, 1) for way in ways], 1).reshape(-1),
        branch_to_probability=np.tile([1 - 2 * slip, slip, slip], 4 * states),
        choice_to_action=np.tile(np.arange(4), states),
        actions=("north", "east", "south", "west"),
        initial=np.array([_first_with_a_way(beside, states - 1)]),
        labels={"goal": goal},
        rewards={"steps": Reward(choice=np.ones(4 * states))},
    )
    return Problem(mdp=mdp, objective=ExpectedCost(goal='"goal"', reward="steps"))


def _first_with_a_way(beside: np.ndarray, goal: int) -> int:
    reached = np.zeros(len(beside), dtype=np.bool_)
    reached[goal] = True
    while True:
        more = reached | reached[beside].any(axis=1)
        if (more == reached).all():
            return int(np.argmax(reached))
        reached = more
