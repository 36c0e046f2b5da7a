"""The cells of a map as it was drawn enter; the ground a robot can drive on leaves: obstacles grown by its radius, cells made coarser."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ratherthan.errors import QuestionError
from ratherthan.model.world import Frame

__all__ = ["CLEAR", "FORBIDDEN", "NARROW", "WALL", "Ground", "clearance", "closed_as", "coarser", "grown"]

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

CLEAR, WALL = 0, 1
"""The kinds of ground that every map has, in this order."""
NARROW, FORBIDDEN = "too narrow", "forbidden"
"""How ground is called that is open by itself, but closed to this robot: for its size, or because a person says so."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ground:
    """What lies in each cell of a map, row 0 at the top.

    Parameters
    ----------
    kinds : tuple of str
        The kinds of ground; the first is open, the second an obstacle.
    kind : array of uint8, ``[H, W]``
        An index into `kinds`.
    open : array of bool, ``[H, W]``
        Where a robot can be.
    water : array of bool, ``[H, W]``
        Where one comes only from such a cell.
    doubt : array of float, ``[H, W]``
        The chance that a cell is occupied after all, from 0 to 1.
    frame : Frame, optional
        Where the map lies in the world.
    title : str
    scale : int
        How many cells of the file lie along the side of a cell.
    """

    kinds: tuple[str, ...]
    kind: npt.NDArray[np.uint8]  # [H, W]
    open: Bools  # [H, W]
    water: Bools  # [H, W]
    doubt: Floats  # [H, W]
    frame: Frame | None = None
    title: str = ""
    scale: int = 1

    @property
    def size(self) -> float:
        """The length of a cell's side: metres where the map has a frame, else cells of the file."""
        return float(self.scale) if self.frame is None else self.frame.resolution


def closed_as(ground: Ground, closed: Bools, kind: str) -> Ground:
    """Return the ground with some open cells closed, and called by what closes them.

    Parameters
    ----------
    ground : Ground
    closed : array of bool, ``[H, W]``
    kind : str
    """
    fresh = ground.open & closed
    if not fresh.any():
        return ground
    kinds = ground.kinds if kind in ground.kinds else (*ground.kinds, kind)
    marked = np.where(fresh, np.uint8(kinds.index(kind)), ground.kind).astype(np.uint8)
    return replace(ground, kinds=kinds, kind=marked, open=ground.open & ~closed)


def clearance(ground: Ground) -> Floats:
    """Return how far the middle of each cell is from the nearest point of what is not open, or of the map's edge, ``[H, W]``.

    In the unit of `Ground.size`; 0 in cells that are not open. The middle of one cell and the nearest point of another lie on a
    lattice of half a cell's side, so that one exact distance transform on that lattice gives it.
    """
    from scipy.ndimage import distance_transform_edt

    height, width = ground.open.shape
    fine = np.zeros((2 * height + 5, 2 * width + 5), dtype=np.bool_)  # cell (r, c) has its middle at (2 r + 3, 2 c + 3)
    fine[3 : 2 * height + 2, 3 : 2 * width + 2] = True
    free = np.zeros((height + 2, width + 2), dtype=np.bool_)
    free[1:-1, 1:-1] = ground.open
    for down in (0, 1, 2):
        for right in (0, 1, 2):
            fine[down : down + 2 * height + 3 : 2, right : right + 2 * width + 3 : 2] &= free
    distance = distance_transform_edt(fine)[3:-2:2, 3:-2:2]
    found: Floats = np.where(ground.open, distance * ground.size / 2.0, 0.0)
    return found


def grown(ground: Ground, radius: float, clear: Floats | None = None) -> Ground:
    """Return the ground on which a robot of a radius can stand in the middle of a cell without touching anything.

    Parameters
    ----------
    ground : Ground
    radius : float
        In the unit of `Ground.size`.
    clear : array of float, ``[H, W]``, optional
        The ground's clearance, where it is known.
    """
    if radius <= 0.0:
        return ground
    return closed_as(ground, (clearance(ground) if clear is None else clear) < radius * (1.0 - 1e-12), NARROW)


def coarser(ground: Ground, cell: float) -> Ground:
    """Return the ground in larger cells, each open only if the robot can be in all of the smaller ones.

    Parameters
    ----------
    ground : Ground
        Grown by the robot's radius already.
    cell : float
        The side of the larger cells, a multiple of the side of the smaller ones.

    Raises
    ------
    QuestionError
        If it is none.
    """
    ratio = cell / ground.size
    step = max(round(ratio), 1)
    if not abs(ratio - step) <= 1e-6 * step:
        below = max(int(ratio), 1) * ground.size
        raise QuestionError(
            f"The side of a cell must be a multiple of the map's own, {ground.size:g}; got {cell:g}. "
            f"Take {below:g} or {below + ground.size:g}.",
            cell=cell,
        )
    if step == 1:
        return ground
    height, width = ground.open.shape
    rows, columns = -(-height // step), -(-width // step)
    room = ((rows * step - height, 0), (0, columns * step - width))  # the frame's corner, lower left, stays where it is

    def blocks(cells: npt.NDArray[np.generic], beyond: object) -> npt.NDArray[np.generic]:
        padded = np.pad(cells, room, constant_values=beyond)  # type: ignore[call-overload]
        return np.asarray(padded).reshape(rows, step, columns, step).swapaxes(1, 2).reshape(rows, columns, -1)

    opened: Bools = np.asarray(blocks(ground.open, beyond=False).all(axis=2))
    kind = blocks(ground.kind, beyond=WALL)
    closes: Bools = np.asarray(~blocks(ground.open, beyond=False).astype(np.bool_) | opened[:, :, None])
    counts = np.stack([((kind == number) & closes).sum(axis=2) for number in range(len(ground.kinds))])
    if (
        NARROW in ground.kinds
    ):  # what is closed is called by what closes it, by the robot's size only if nothing else does
        narrow = ground.kinds.index(NARROW)
        alone = np.delete(counts, narrow, axis=0).sum(axis=0) == 0
        counts[narrow] = np.where(alone, counts[narrow], 0)
    frame = None if ground.frame is None else replace(ground.frame, resolution=ground.frame.resolution * step)
    return replace(
        ground,
        open=opened,
        kind=counts.argmax(axis=0).astype(np.uint8),
        water=np.asarray(blocks(ground.water, beyond=False).any(axis=2)),
        doubt=blocks(ground.doubt, beyond=1.0).max(axis=2).astype(np.float64),
        frame=frame,
        scale=ground.scale * step,
    )
