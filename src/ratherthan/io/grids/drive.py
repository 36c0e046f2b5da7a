"""What a person asks of a robot on a map enters, as options or keywords; a `Drive` leaves, checked."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ratherthan.errors import QuestionError
from ratherthan.io.grids.moves import Motion

__all__ = ["KEYS", "ROBOT", "SAFE", "SPEED", "Drive", "drive_of"]

ROBOT = 0.2
"""The radius in metres of a robot of which nothing is said, where a map has metres."""
SAFE = 0.5
"""From how many metres on an obstacle is no risk, where nothing is said."""
SPEED = 0.5
"""Metres a second, where nothing is said; on a map without metres one cell a second."""
KEYS = ("goal", "scen", "row", "slip", "directions", "stay", "radius", "cell", "speed", "safe", "zones", "unknown")
"""What can be asked of a map of cells, and of no other source."""
UNKNOWN = ("closed", "free")


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What a robot is to do on a map, and what it is like.

    Parameters
    ----------
    start, goal : str, optional
        Cells as ``column,row``, or in metres as ``1.2m,3.4m``.
    scenario : str, optional
        A MovingAI scenario file, of which `row` gives start and goal, and whether the map is the right one.
    row : int
    motion : Motion
    speed : float, optional
        Metres a second on every ground of which nothing else is said, or cells a second where the map has no metres; by
        default 0.5 and 1.
    speeds : mapping of str to float
        The same on single kinds of ground.
    radius : float, optional
        Of the robot: metres where the map has metres, else cells. By default 0.2 m, or 0 cells.
    cell : float, optional
        The side of a cell of the model, in the same unit; a multiple of the map's.
    safe : float, optional
        From how far on an obstacle is no risk. By default 0.5 m, or 1 cell.
    zones : str, optional
        A file of zones; by default the one beside the map that is called like it, ``NAME.zones.toml``, if there is one.
    unknown : str
        Whether unknown ground is "closed" or "free"; free, it may be occupied with a chance of one half.

    Raises
    ------
    QuestionError
        If a length, a speed or a choice is none, or start and goal are given twice.
    """

    start: str | None = None
    goal: str | None = None
    scenario: str | None = None
    row: int = 0
    motion: Motion = field(default_factory=Motion)
    speed: float | None = None
    speeds: Mapping[str, float] = field(default_factory=dict)
    radius: float | None = None
    cell: float | None = None
    safe: float | None = None
    zones: str | None = None
    unknown: str = "closed"

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        for name, value in (("radius", self.radius), ("cell", self.cell), ("safe", self.safe)):
            if value is not None and not (0.0 <= value < math.inf and (value > 0.0 or name != "cell")):
                raise QuestionError(
                    f"The {name} must be a length {'above 0' if name == 'cell' else 'from 0 on'}, got {value:g}."
                )
        given = ({} if self.speed is None else {"": self.speed}) | dict(self.speeds)
        for kind, speed in given.items():
            if not 0.0 < speed < math.inf:
                raise QuestionError(
                    f"The speed{' on ' if kind else ''}{kind} must be a number above 0, got {speed:g}.", speed=speed
                )
        if self.scenario is not None and (self.start is not None or self.goal is not None):
            raise QuestionError(
                "Start and goal must be given once: by a row of a scenario file (--scen), or by --start and --goal."
            )
        if self.unknown not in UNKNOWN:
            raise QuestionError(f"Unknown ground must be {' or '.join(UNKNOWN)}, got {self.unknown!r}.")


def drive_of(given: Mapping[str, Any]) -> Drive:
    """Return what is asked of a robot, from keywords as `ratherthan.read` takes them; None stands for the default.

    Parameters
    ----------
    given : mapping
        Of `KEYS` and ``start``.

    Raises
    ------
    QuestionError
        If one of them is unknown, or nothing that can be asked.
    """
    asked = {name: value for name, value in given.items() if value is not None}
    strange = [name for name in asked if name not in (*KEYS, "start")]
    if strange:
        raise QuestionError(f"Of a map of cells may be asked start, {', '.join(KEYS)}; got '{strange[0]}'.")
    if "row" in asked and "scen" not in asked:
        raise QuestionError("A row must be one of a scenario file: give the file, too (--scen FILE --row N).")
    motion = Motion(
        directions=_whole(asked, "directions", 8), slip=_number(asked, "slip", 0.1), stay=_number(asked, "stay", 0.0)
    )
    speed, speeds = _speeds(asked.get("speed"))
    return Drive(
        start=_place(asked, "start"),
        goal=_place(asked, "goal"),
        scenario=None if "scen" not in asked else os.fspath(asked["scen"]),
        row=_whole(asked, "row", 0),
        motion=motion,
        speed=speed,
        speeds=speeds,
        radius=None if "radius" not in asked else _number(asked, "radius", 0.0),
        cell=None if "cell" not in asked else _number(asked, "cell", 0.0),
        safe=None if "safe" not in asked else _number(asked, "safe", 0.0),
        zones=None if "zones" not in asked else os.fspath(asked["zones"]),
        unknown=str(asked.get("unknown", "closed")),
    )


def _whole(asked: Mapping[str, Any], name: str, usual: int) -> int:
    value = asked.get(name, usual)
    try:
        number = int(value)
    except (TypeError, ValueError, OverflowError):
        number = None
    if number is None or isinstance(value, bool) or (not isinstance(value, str) and number != value):
        raise QuestionError(f"'{name}' must be a whole number, got {value!r}.", name=name)
    return number


def _number(asked: Mapping[str, Any], name: str, usual: float) -> float:
    value = asked.get(name, usual)
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if math.isnan(number) or isinstance(value, bool):
        raise QuestionError(f"'{name}' must be a number, got {value!r}.", name=name)
    return number


def _place(asked: Mapping[str, Any], name: str) -> str | None:
    """Return a place as text; (3, 14) in Python means a cell."""
    value = asked.get(name)
    if value is None or isinstance(value, str):
        return value
    parts = list(value) if isinstance(value, tuple | list) else [value]
    if len(parts) == 2 and all(isinstance(part, int) and not isinstance(part, bool) for part in parts):
        return f"{parts[0]},{parts[1]}"
    if name == "start" and len(parts) == 1 and hasattr(value, "__index__") and not isinstance(value, bool):
        return f"{int(value)}"
    raise QuestionError(
        f"The {name} must be a cell, (3, 14) or '3,14', or a point in metres, '1.2m,3.4m'; got {value!r}.", state=value
    )


def _speeds(given: object) -> tuple[float | None, dict[str, float]]:
    """Return the speed, and those on single kinds of ground: of 0.8, "0.8,swamp=0.2" or {"swamp": 0.2}."""
    if given is None:
        return None, {}
    if isinstance(given, Mapping):
        return None, {str(kind): _number({"speed": value}, "speed", 1.0) for kind, value in given.items()}
    if not isinstance(given, str):
        return _number({"speed": given}, "speed", 1.0), {}
    plain: float | None = None
    speeds = {}
    for part in given.split(","):
        kind, equals, value = part.rpartition("=")
        try:
            speed = float(value)
        except ValueError:
            speed = math.nan
        if math.isnan(speed) or (equals and not kind.strip()) or (not equals and plain is not None):
            raise QuestionError(
                f"A speed must be a number, or several as 0.8,swamp=0.2 for kinds of ground; got '{given}'.",
                speed=given,
            )
        if equals:
            speeds[kind.strip()] = speed
        else:
            plain = speed
    return plain, speeds
