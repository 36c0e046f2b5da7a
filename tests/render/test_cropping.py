from __future__ import annotations

import numpy as np

from ratherthan.explain.places import WorldRecord
from ratherthan.model.world import Frame
from ratherthan.render.cropping import cropped


def room(*, frame: Frame | None) -> WorldRecord:
    """Return a map of 40 by 30 unknown cells with a room of 6 by 5 cells at (10, 12)."""
    ground = np.zeros((30, 40), dtype=np.uint8)
    ground[12:17, 10:16] = 1
    nowhere = np.zeros(1200, dtype=np.bool_)
    return WorldRecord(
        width=40,
        height=30,
        kinds=("unknown", "free"),
        ground=ground.ravel(),
        goals=nowhere,
        hazards=nowhere,
        roads=((12 * 40 + 10, 12 * 40 + 11),),
        frame=frame,
    )


def test_an_even_edge_is_left_out_and_the_rest_stays_where_it_was() -> None:
    for yaw in (0.0, 0.7):
        world = room(frame=Frame(resolution=0.5, x=-3.0, y=2.0, yaw=yaw))
        part, (column, row) = cropped(world)
        assert (part.width, part.height, column, row) == (8, 7, 9, 11)
        assert part.frame is not None
        assert world.frame is not None
        here, there = part.frame.at(1.5, 2.5, part.height), world.frame.at(10.5, 13.5, world.height)
        np.testing.assert_allclose(here, there)
        assert part.ground.reshape(7, 8)[1:6, 1:7].all()
        assert part.ground.sum() == 30
        assert part.roads == ((1 * 8 + 1, 1 * 8 + 2),)


def test_maps_whose_cells_are_counted_keep_all_of_them() -> None:
    world = room(frame=None)
    assert cropped(world) == (world, (0, 0))
