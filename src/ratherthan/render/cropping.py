"""A map enters, the part of it that is worth a picture leaves: without the wide even edge that maps of robots often have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ratherthan.explain.places import WorldRecord

__all__ = ["cropped"]

LEAST = 0.7
"""A map is cropped if what is left is at most this share of it."""
MARGIN = 0.04
"""Which share of its longer side stays around it."""


def cropped(world: WorldRecord) -> tuple[WorldRecord, tuple[int, int]]:
    """Return the part of a map within its even edge, and the column and row where the part begins.

    Only maps that lie in the world are cropped, as their places are told in metres; others keep all cells.

    Parameters
    ----------
    world : WorldRecord
    """
    whole = world, (0, 0)
    if world.frame is None or world.numbered:
        return whole
    shape = world.height, world.width
    ground = world.ground.reshape(shape)
    differs = ground != ground[0, 0]
    for marked in (world.goals, world.hazards, *world.zones.values()):
        differs |= marked.reshape(shape)
    rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if len(rows) == 0:
        return whole
    height, width = int(rows[-1] - rows[0] + 1), int(columns[-1] - columns[0] + 1)
    pad = max(1, round(MARGIN * max(height, width)))
    top, bottom = max(0, int(rows[0]) - pad), min(world.height, int(rows[-1]) + 1 + pad)
    left, right = max(0, int(columns[0]) - pad), min(world.width, int(columns[-1]) + 1 + pad)
    if (bottom - top) * (right - left) > LEAST * world.height * world.width:
        return whole
    x, y = world.frame.at(left, bottom, world.height)

    def part(cells: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(cells.reshape(shape)[top:bottom, left:right]).ravel()

    small = replace(
        world,
        width=right - left,
        height=bottom - top,
        ground=part(world.ground),
        zones={name: part(inside) for name, inside in world.zones.items()},
        goals=part(world.goals),
        hazards=part(world.hazards),
        roads=tuple(_moved(world, (a, b), (left, top), right - left) for a, b in world.roads),
        frame=replace(world.frame, x=x, y=y),
    )
    return small, (left, top)


def _moved(world: WorldRecord, road: tuple[int, int], corner: tuple[int, int], width: int) -> tuple[int, int]:
    """Return a road between the same cells of the part."""
    one, other = ((cell // world.width - corner[1]) * width + cell % world.width - corner[0] for cell in road)
    return one, other
