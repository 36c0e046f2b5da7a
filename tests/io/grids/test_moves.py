"""Where a robot can go from a cell, how likely it gets there, and how far it is."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from ratherthan.errors import QuestionError
from ratherthan.io.grids.moves import CIRCLE, DIRECTIONS, Motion, moves_on


def passes(opened, water, row, column, name):
    """Return the cell that a direction leads to, None where it cannot be entered."""
    down, right = DIRECTIONS[name]

    def free(r, c):
        return 0 <= r < opened.shape[0] and 0 <= c < opened.shape[1] and opened[r, c]

    r, c = row + down, column + right
    if not free(r, c) or water[r, c] != water[row, column]:
        return None
    if down and right and not (free(row + down, column) and free(row, column + right)):
        return None
    return r, c


def plainly(opened, water, motion):
    """The same, cell by cell: {cell: {action: {cell: (probability, length)}}}."""
    circle = [name for name in CIRCLE if name in motion.actions]
    found = {}
    for row, column in product(*map(range, opened.shape)):
        if not opened[row, column]:
            continue
        own = found[row, column] = {}
        for name in motion.actions:
            if passes(opened, water, row, column, name) is None:
                continue
            at = circle.index(name)
            ways = ((name, 1 - motion.slip - motion.stay),)
            ways += tuple((circle[(at + turn) % len(circle)], motion.slip / 2) for turn in (-1, 1))
            ends, rest = {}, 1.0
            for way, chance in ways:
                there = passes(opened, water, row, column, way)
                if there is not None and chance > 0:
                    ends[there] = (chance, math.sqrt(2) if all(DIRECTIONS[way]) else 1.0)
                    rest -= chance
            if rest > 1e-12:
                ends[row, column] = (rest, 0.0)
            own[name] = ends
    return found


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("directions", [4, 8])
@pytest.mark.parametrize(("slip", "stay"), [(0.0, 0.0), (0.2, 0.0), (0.0, 0.1), (0.3, 0.25)])
def test_moves_are_those_of_the_definition(seed, directions, slip, stay):
    rng = np.random.default_rng(seed)
    opened = rng.random((int(rng.integers(1, 8)), int(rng.integers(1, 8)))) < 0.7
    water = rng.random(opened.shape) < 0.2
    motion = Motion(directions=directions, slip=slip, stay=stay)
    moves = moves_on(opened, water, motion, 1.0)
    wanted = plainly(opened, water & opened, motion)
    cells = [divmod(int(cell), opened.shape[1]) for cell in moves.cell_of_state]
    assert cells == list(wanted)
    for state, cell in enumerate(cells):
        found = {}
        for choice in range(moves.state_to_choices[state], moves.state_to_choices[state + 1]):
            branches = range(moves.choice_to_branches[choice], moves.choice_to_branches[choice + 1])
            ends = {
                cells[moves.branch_to_target[b]]: (moves.branch_to_probability[b], moves.branch_length[b])
                for b in branches
            }
            assert len(ends) == len(branches)
            if moves.choice_to_action[choice] >= 0:
                found[motion.actions[moves.choice_to_action[choice]]] = ends
            else:
                assert not wanted[cell]
                assert ends == {cell: (1.0, 0.0)}
        assert list(found) == [name for name in motion.actions if name in wanted[cell]]
        for name, ends in found.items():
            assert ends.keys() == wanted[cell][name].keys()
            for there, parts in ends.items():
                assert parts == pytest.approx(wanted[cell][name][there])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"directions": 6}, "4 or 8, got 6"),
        ({"slip": -0.1}, "chance to slip"),
        ({"slip": math.nan}, "chance to slip"),
        ({"stay": 1.0}, "chance to stay"),
        ({"slip": 0.6, "stay": 0.5}, "add up to less than 1"),
    ],
)
def test_a_motion_that_cannot_be_is_refused(words, said):
    with pytest.raises(QuestionError, match=said):
        Motion(**words)
