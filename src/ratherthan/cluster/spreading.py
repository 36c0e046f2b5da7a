"""What is known around a block enters; which of its states reach the goal for sure leaves, and how far they are. Runs on workers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.cluster._kernels import seeded_levels
from ratherthan.cluster.block import Block, Extent, States, read_block
from ratherthan.model import graph
from ratherthan.model._kernels import compiled, spread_all
from ratherthan.model.mdp import Bools, Floats

__all__ = ["Alive", "Known", "Surveyed", "block_of", "levels_of", "lose", "reach", "survey", "usable_of"]

Bits = npt.NDArray[np.uint8]

_held: dict[tuple[str, int], Block] = {}


class Surveyed(NamedTuple):
    """What a block tells of itself."""

    needs: States
    least: float
    """The least cost of its rows, ∞ where it has none."""
    costless: int
    """A state of the archive with a choice that costs nothing, -1 where there is none."""
    alive: Bits
    counts: tuple[int, int]
    """Of choices and branches of the states that it owns."""


class Alive(NamedTuple):
    """Which states may still reach the goal for sure."""

    inside: Bits
    """A bit for each state inside."""
    needed: Bools
    """For each state that is needed of others."""


class Known(NamedTuple):
    """All that a block must be told to answer, on whatever worker it is."""

    alive: Alive
    exports: States
    """The states of the block that others need."""
    levels: States
    """The distances of what it needs of others, -1 where unknown."""
    outside: Floats
    """The values of these, NaN where nobody knows yet."""
    exported: Floats
    """The values of the exported states that the others know."""
    least: float
    """The least cost of the model."""
    tolerance: float
    """The residual to come to."""


def block_of(extent: Extent) -> Block:
    """Return a block, read now or before; those of other runs are forgotten."""
    key = (extent.run, extent.number)
    if key not in _held:
        for other in [held for held in _held if held[0] != extent.run]:
            del _held[other]
        _held[key] = read_block(extent)
    return _held[key]


def survey(extent: Extent) -> Surveyed:
    """Return what a block needs of others, and whether its costs are all positive."""
    block = block_of(extent)
    goal, inside = block.goal, block.inside
    index = goal.index
    first, last = index.state_to_choices[block.owned.start], index.state_to_choices[block.owned.stop]
    counted = np.zeros(index.choices, dtype=np.bool_)
    counted[first:last] = ~goal.target[index.choice_to_state[first:last]]
    costless = np.flatnonzero(counted & ~goal.costly)
    return Surveyed(
        needs=block.needs,
        least=float(goal.cost[counted].min(initial=np.inf)),
        costless=-1 if not len(costless) else block.extent.begin + int(index.choice_to_state[costless[0]]),
        alive=np.packbits(np.ones(inside, dtype=np.bool_)),
        counts=(int(last - first), int(index.choice_to_branches[last] - index.choice_to_branches[first])),
    )


def reach(extent: Extent, known: Known) -> tuple[States, int, Bits]:
    """Return the distances of exported states from the goal, how many states inside have one, and which."""
    block = block_of(extent)
    level = levels_of(block, known)
    reached = level[: block.inside] >= 0
    return level[block.local(known.exports)], int(reached.sum()), np.packbits(reached)


def lose(extent: Extent, known: Known, first: bool) -> tuple[Bools, int, Bits]:
    """Return which exported states are still alive, how many inside were lost, and which are alive.

    At `first`, states that have no distance from the goal are lost first; then those with no choice left that stays alive.
    """
    block = block_of(extent)
    mask, usable = usable_of(block, known.alive)
    before = int(mask[: block.inside].sum())
    if first:
        level = levels_of(block, known)
        mask[: block.inside] &= level[: block.inside] >= 0
    mask = _closed(block, mask, usable)
    inside = mask[: block.inside]
    return mask[block.local(known.exports)], before - int(inside.sum()), np.packbits(inside)


def levels_of(block: Block, known: Known) -> States:
    """Return the distance of each local state from the goal, -1 where it has none."""
    mask, usable = usable_of(block, known.alive)
    index = block.goal.index
    level = np.where(mask, -1, -2).astype(np.int64)
    level[np.flatnonzero(block.goal.target[: block.inside])] = 0
    told = block.from_rim & (known.levels >= 0) & mask[block.needed]
    level[block.needed[told]] = known.levels[told]
    seeds = np.flatnonzero(level >= 0)
    seeds = seeds[np.argsort(level[seeds], kind="stable")]
    kernel = compiled(seeded_levels, index.work)
    kernel(index.entering_from, index.entering, index.choice_to_state, usable, level, seeds)
    return np.maximum(level, -1)


def usable_of(block: Block, alive: Alive) -> tuple[Bools, Bools]:
    """Return which local states are alive, and which choices stay among them, of states that have not arrived."""
    mask = np.ones(block.goal.index.states, dtype=np.bool_)
    mask[: block.inside] = np.unpackbits(alive.inside, count=block.inside).view(np.bool_)
    mask[block.needed[block.from_rim]] = alive.needed[block.from_rim]
    running = mask & ~block.goal.target
    running[block.inside :] = False
    usable = running[block.goal.index.choice_to_state] & graph.all_branches_in(block.goal.index, mask)
    return mask, usable


def _closed(block: Block, mask: Bools, usable: Bools) -> Bools:
    """Return `mask` without the states whose every usable choice may leave it, and so on."""
    index, target = block.goal.index, block.goal.target
    remaining = np.bincount(index.choice_to_state[usable], minlength=index.states)
    within = np.zeros(index.states, dtype=np.bool_)
    within[: block.inside] = True
    bare = mask & within & ~target & (remaining == 0)
    start = np.flatnonzero(~mask | bare)
    queue = np.zeros(index.states, dtype=np.int64)
    queue[: len(start)] = start
    remaining[start] = -1
    kernel = compiled(spread_all, index.work)
    filled = kernel(index.entering_from, index.entering, index.choice_to_state, usable, remaining, queue, len(start))
    kept = mask.copy()
    kept[queue[:filled]] = False
    return kept
