"""A MiniGrid environment enters; what a person would call its states, and its map, leave.

Nothing is imported for it: an environment is one of MiniGrid's if it stands on its grid of objects.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ratherthan.model.world import World

__all__ = ["COUNTERS", "constants", "copy_grid", "facts", "is_minigrid", "without_clock", "world_of"]

COUNTERS = ("step_count",)
PAYS = "_reward"
SEES = "gen_obs"
FACING = ("right", "down", "left", "up")
FIXED = ("wall", "floor", "goal", "lava")


def is_minigrid(environment: Any) -> bool:
    """Tell whether an environment is one of MiniGrid's."""
    return any(kind.__module__ == "minigrid.minigrid_env" for kind in type(environment).__mro__)


def without_clock(environment: Any) -> tuple[str, ...]:
    """Take out of an environment what hangs on the time, and say what that is.

    MiniGrid pays 1 - 0.9 * steps / max_steps on success, which is no reward of a state; it is set to 1.
    """
    notes: tuple[str, ...] = ()
    limit = getattr(environment, "max_steps", None)
    if limit is not None:
        notes += (f"The time limit of {limit} steps is no part of the model: plans may take longer.",)
    asked = getattr(getattr(type(environment), PAYS), "__code__", None)
    if asked is not None and COUNTERS[0] in asked.co_names:
        setattr(environment, PAYS, _one)
        notes += ("Success is paid less the later it comes, which no model of states can say; here it earns 1.",)
    setattr(environment, SEES, _nothing)  # what the agent sees plays no part, and takes most of a step's time
    return notes


def _one() -> float:
    return 1.0


def _nothing() -> Mapping[str, Any]:
    return {}


def constants(environment: Any) -> Sequence[Any]:
    """Return the objects of the grid that never change."""
    module = "minigrid.core.world_object"
    return [item for _, item in _objects(environment) if item.type in FIXED and type(item).__module__ == module]


def copy_grid(environment: Any, memo: dict[int, Any]) -> None:
    """Put a copy of the long list of the grid's objects into the memo of a deep copy."""
    objects = environment.grid.grid
    memo[id(objects)] = [
        item if item is None else memo[id(item)] if id(item) in memo else copy.deepcopy(item, memo) for item in objects
    ]


def facts(environment: Any) -> Mapping[str, Any]:
    """Return where the agent is and faces, and where and how the things are that can change."""
    x, y = (int(number) for number in environment.agent_pos)
    told: dict[str, Any] = {"x": x, "y": y, "facing": FACING[int(environment.agent_dir) % 4]}
    places: dict[str, list[str]] = {}
    for cell, item in _objects(environment):
        column, row = cell % environment.grid.width, cell // environment.grid.width
        if item.type == "door":
            told[f"door_{column}_{row}"] = "open" if item.is_open else "locked" if item.is_locked else "closed"
        elif item.type not in FIXED:
            places.setdefault(f"{item.color}_{item.type}", []).append(f"({column} {row})")
    if environment.carrying is not None:
        places.setdefault(f"{environment.carrying.color}_{environment.carrying.type}", []).append("carried")
    return told | {name: " ".join(found) for name, found in sorted(places.items())}


def world_of(environment: Any, facts_of_states: Sequence[Mapping[str, Any]]) -> World:
    """Return the map: the ground as it lies at the start, and the cell where each state has the agent."""
    width, height = int(environment.grid.width), int(environment.grid.height)
    kinds = ["open"]
    kind_of_cell = np.zeros(width * height, dtype=np.uint8)
    for cell, item in _objects(environment):
        if item.type not in kinds:
            kinds.append(item.type)
        kind_of_cell[cell] = kinds.index(item.type)
    return World(
        width=width,
        height=height,
        kinds=tuple(kinds),
        kind_of_cell=kind_of_cell,
        cell_of_state=np.array([told["y"] * width + told["x"] for told in facts_of_states], dtype=np.int32),
        title=str(getattr(environment, "mission", "")),
    )


def _objects(environment: Any) -> Iterator[tuple[int, Any]]:
    return ((cell, item) for cell, item in enumerate(environment.grid.grid) if item is not None)
