"""Obstacles grow by the robot's radius, cells become coarser, and neither lets a robot in where it does not fit."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from ratherthan.errors import QuestionError
from ratherthan.io.grids.ground import Ground, clearance, coarser, grown
from ratherthan.model.world import Frame


def ground_of(opened: np.ndarray, resolution: float | None = None) -> Ground:
    return Ground(
        kinds=("open ground", "wall"),
        kind=np.where(opened, 0, 1).astype(np.uint8),
        open=opened,
        water=np.zeros(opened.shape, dtype=bool),
        doubt=np.zeros(opened.shape),
        frame=None if resolution is None else Frame(resolution=resolution, x=-1.0, y=2.0, yaw=0.3),
    )


def far_from_closed(opened: np.ndarray, row: int, column: int) -> float:
    """The distance from the middle of a cell to the nearest point of a closed cell; all around the map is closed."""
    height, width = opened.shape
    closed = [
        (r, c)
        for r, c in product(range(-1, height + 1), range(-1, width + 1))
        if not (0 <= r < height and 0 <= c < width) or not opened[r, c]
    ]
    return min(math.hypot(max(abs(r - row) - 0.5, 0.0), max(abs(c - column) - 0.5, 0.0)) for r, c in closed)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("resolution", [None, 0.05])
def test_clearance_is_the_distance_to_the_nearest_point_that_is_closed(seed, resolution):
    rng = np.random.default_rng(seed)
    opened = rng.random((int(rng.integers(1, 12)), int(rng.integers(1, 12)))) < 0.85
    found = clearance(ground_of(opened, resolution)) / (resolution or 1.0)
    for row, column in product(*map(range, opened.shape)):
        wanted = far_from_closed(opened, row, column) if opened[row, column] else 0.0
        assert found[row, column] == pytest.approx(wanted)


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.500001, 0.7, 1.0, 1.5, 1.6, 100.0])
def test_a_robot_stands_where_nothing_is_nearer_than_its_radius(radius):
    opened = np.random.default_rng(3).random((11, 9)) < 0.9
    found = grown(ground_of(opened), radius).open
    for row, column in product(*map(range, opened.shape)):
        assert found[row, column] == (opened[row, column] and far_from_closed(opened, row, column) >= radius)


@pytest.mark.parametrize("step", [1, 2, 3, 5])
def test_a_coarse_cell_is_open_only_if_all_of_its_cells_are(step):
    opened = np.random.default_rng(4).random((11, 13)) < 0.95
    coarse = coarser(ground_of(opened, 0.1), 0.1 * step)
    rows, columns = coarse.open.shape
    assert (rows, columns) == (-(-11 // step), -(-13 // step))
    for row, column in product(range(rows), range(columns)):
        up = range(11 - (rows - row) * step, 11 - (rows - row - 1) * step)  # counted from the lower edge
        across = range(column * step, (column + 1) * step)
        inside = [(r, c) for r, c in product(up, across)]
        whole = all(0 <= r < 11 and 0 <= c < 13 and opened[r, c] for r, c in inside)
        assert coarse.open[row, column] == whole


def test_coarse_cells_keep_the_place_of_the_map():
    opened = np.ones((10, 10), dtype=bool)
    fine = ground_of(opened, 0.1)
    coarse = coarser(fine, 0.3)
    assert coarse.frame is not None
    assert fine.frame is not None
    for column, row in ((0, 9), (4, 3)):
        x, y = fine.frame.at(column + 0.5, row + 0.5, 10)
        there = coarse.frame.cell(x, y, coarse.open.shape[0])
        assert there == (column // 3, coarse.open.shape[0] - 1 - (9 - row) // 3)


@pytest.mark.parametrize("cell", [0.15, 0.04, 0.1000011])
def test_a_cell_that_is_no_multiple_is_refused_with_the_nearest(cell):
    with pytest.raises(QuestionError, match=r"multiple of the map's own, 0\.1; got .*Take 0\.1 or 0\.2"):
        coarser(ground_of(np.ones((4, 4), dtype=bool), 0.1), cell)
