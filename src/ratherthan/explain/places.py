"""The world of a problem enters, a record of it leaves that an Explanation carries: enough to draw it without the model.

As JSON the ground is one text: a byte for each cell, deflated, in base 64; a zone is the same with a bit for each cell. So a map of a
million cells takes some hundred thousand letters.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import ExplanationError
from ratherthan.model.mdp import MDP, Bools
from ratherthan.model.problem import Problem
from ratherthan.model.world import Frame

__all__ = ["MOST_CELLS", "WorldRecord", "world_from_json", "world_of", "world_to_json"]

Cells = npt.NDArray[np.uint8]

MOST_CELLS = 100_000_000
"""No map in a document may have more cells."""
MOST_ROADS = 20_000
"""Up to how many cells the ways between cells are recorded one by one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WorldRecord:
    """A map: `width` × `height` cells, row by row from the top left.

    Parameters
    ----------
    width, height : int
    kinds : tuple of str
        The kinds of ground there are.
    ground : array of uint8, ``[height*width]``
        An index into `kinds` per cell.
    zones : mapping of str to array of bool, ``[height*width]``
    goals, hazards : array of bool, ``[height*width]``
        Cells where the objective ends well, and badly.
    roads : tuple of pairs of int
        From which cell to which one can go, on a small map whose cells are not simply joined to all their neighbours.
    numbered : bool
        Whether the states are the cells, in their order, and are called by their numbers.
    frame : Frame, optional
    title, note : str
    """

    width: int
    height: int
    kinds: tuple[str, ...]
    ground: Cells  # [height*width]
    zones: Mapping[str, Bools] = field(default_factory=dict)
    goals: Bools
    hazards: Bools
    roads: tuple[tuple[int, int], ...] = ()
    numbered: bool = False
    frame: Frame | None = None
    title: str = ""
    note: str = ""

    def __eq__(self, other: object) -> bool:
        """Return whether the other is the same map, cell by cell."""
        return isinstance(other, WorldRecord) and world_to_json(self) == world_to_json(other)

    __hash__ = None  # type: ignore[assignment]


def world_of(problem: Problem, goal: Bools, hazard: Bools) -> WorldRecord | None:
    """Return the record of a problem's world, None where it has none.

    Parameters
    ----------
    problem : Problem
    goal, hazard : array of bool, ``[S]``
    """
    world = problem.world
    if world is None:
        return None
    cell = world.cell_of_state
    cells = world.width * world.height
    marks = []
    for where in (goal, hazard):
        mark = np.zeros(cells, dtype=np.bool_)
        there = cell[where]
        mark[there[there >= 0]] = True
        marks.append(mark)
    return WorldRecord(
        width=world.width,
        height=world.height,
        kinds=world.kinds,
        ground=world.kind_of_cell,
        zones=world.zones,
        goals=marks[0],
        hazards=marks[1],
        roads=_roads(problem.mdp, cell, world.width) if cells <= MOST_ROADS else (),
        numbered=not problem.mdp.names.named and np.array_equal(cell, np.arange(cells)),
        frame=world.frame,
        title=world.title,
        note=world.note,
    )


def _roads(mdp: MDP, cell: npt.NDArray[np.integer[Any]], width: int) -> tuple[tuple[int, int], ...]:
    """Return from which cell to which a choice means to go: where its likeliest branch out of its cell leads.

    Nothing where all cells that are used are joined to all their straight neighbours both ways: then a line between them says
    nothing.
    """
    begin = mdp.choice_to_branches
    choice = np.repeat(np.arange(mdp.choices), np.diff(begin))
    own = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
    one, other = cell[own[choice]], cell[mdp.branch_to_target]
    moves = (one != other) & (one >= 0) & (other >= 0)
    if not moves.any():
        return ()
    order = np.lexsort((np.arange(len(choice)), -mdp.branch_to_probability, choice))
    order = order[moves[order]]
    first = order[np.unique(choice[order], return_index=True)[1]]
    pairs = np.unique(np.stack([one[first], other[first]], axis=1), axis=0)
    known = {(int(a), int(b)) for a, b in pairs}
    used = {a for a, _ in known} | {b for _, b in known}
    plain = all(
        (a, b) in known
        for a in used
        for b in (a - width, a + width, *([a - 1] if a % width else []), *([a + 1] if (a + 1) % width else []))
        if b in used
    )
    return () if plain else tuple(sorted(known))


def world_to_json(world: WorldRecord) -> dict[str, Any]:
    """Return the record as JSON holds it."""
    frame = world.frame
    return {
        "width": world.width,
        "height": world.height,
        "kinds": list(world.kinds),
        "ground": _packed(world.ground.tobytes()),
        "zones": {name: _packed(np.packbits(inside).tobytes()) for name, inside in world.zones.items()},
        "goals": _packed(np.packbits(world.goals).tobytes()),
        "hazards": _packed(np.packbits(world.hazards).tobytes()),
        "roads": [list(pair) for pair in world.roads],
        "numbered": world.numbered,
        "frame": None
        if frame is None
        else {"resolution": frame.resolution, "x": frame.x, "y": frame.y, "yaw": frame.yaw},
        "title": world.title,
        "note": world.note,
    }


def world_from_json(given: Mapping[str, Any]) -> WorldRecord:
    """Return the record that a document holds, its shape checked by the schema already.

    Raises
    ------
    ExplanationError
        If its parts do not fit one another.
    """
    width, height = int(given["width"]), int(given["height"])
    cells = width * height
    if not 0 < cells <= MOST_CELLS:
        raise ExplanationError(f"A map must have from 1 to {MOST_CELLS} cells, got {width} × {height}.")
    ground = np.frombuffer(_unpacked(given["ground"], cells), dtype=np.uint8)
    kinds = tuple(given["kinds"])
    if int(ground.max()) >= len(kinds):
        raise ExplanationError(f"The ground of a map must be of its {len(kinds)} kinds, got kind {int(ground.max())}.")
    roads = tuple((int(a), int(b)) for a, b in given["roads"])
    if any(not 0 <= end < cells for road in roads for end in road):
        raise ExplanationError(f"The roads of a map must join its cells 0 to {cells - 1}.")
    frame = given["frame"]
    return WorldRecord(
        width=width,
        height=height,
        kinds=kinds,
        ground=ground,
        zones={name: _bits(text, cells) for name, text in given["zones"].items()},
        goals=_bits(given["goals"], cells),
        hazards=_bits(given["hazards"], cells),
        roads=roads,
        numbered=given["numbered"],
        frame=None if frame is None else Frame(**frame),
        title=given["title"],
        note=given["note"],
    )


def _packed(data: bytes) -> str:
    return base64.b64encode(zlib.compress(data, 6)).decode("ascii")


def _unpacked(text: str, size: int) -> bytes:
    """Return exactly `size` bytes; no more are unpacked, whatever the text holds."""
    try:
        engine = zlib.decompressobj()
        data = engine.decompress(base64.b64decode(text, validate=True), size + 1)
    except (ValueError, zlib.error) as error:
        raise ExplanationError("The ground of a map must be deflated bytes in base 64, got something else.") from error
    if len(data) != size:
        raise ExplanationError(
            f"The ground of a map must have {size} bytes, got {'more' if len(data) > size else len(data)}."
        )
    return data


def _bits(text: str, cells: int) -> Bools:
    data = np.frombuffer(_unpacked(text, -(-cells // 8)), dtype=np.uint8)
    return np.unpackbits(data, count=cells).astype(np.bool_)
