"""A file of zones enters (TOML, beside the map or named), the parts of the map that a person marked leave.

A table for each zone, called as sentences shall call it::

    ["the crossing"]
    metres = [[1.0, 2.0], [3.5, 4.0]]  # two corners of a rectangle, or three and more corners of a polygon
    risk = 2.0  # of each metre driven there, besides that of obstacles nearby

    ["the wet floor"]
    cells = [[10, 4], [18, 9]]  # the same in columns and rows, the cells of the corners included
    speed = 0.5  # times the speed elsewhere

    ["the stairs"]
    cells = [[30, 2], [31, 5]]
    forbidden = true  # nobody drives there

A cell belongs to a zone if its middle lies in it.
"""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._files import open_source
from ratherthan.io.grids.ground import Ground

__all__ = ["Zone", "read_zones"]

RESERVED = ("goal", "init", "deadlock")
"""Labels that a model may have already."""
KEYS = ("cells", "metres", "risk", "speed", "forbidden")


@dataclass(frozen=True, kw_only=True, eq=False)
class Zone:
    """A named part of a map: its cells ``[H, W]``, its risk a unit of length, its speed, whether it is forbidden."""

    name: str
    inside: npt.NDArray[np.bool_]  # [H, W]
    risk: float = 0.0
    speed: float = 1.0
    forbidden: bool = False


def read_zones(path: str | os.PathLike[str], ground: Ground) -> tuple[Zone, ...]:
    """Return the zones of a file on the ground of a map.

    Raises
    ------
    SourceError
        If the file cannot be read, or a zone is none, with its name.
    """
    source = os.fspath(path)
    with open_source(path) as file:
        data = file.read()
    try:
        tables = tomllib.loads(data.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SourceError(f"{source}: Zones must be written in TOML, but {error}.", source=source) from error
    return tuple(_zone(name, table, ground, source) for name, table in tables.items())


def _zone(name: str, table: object, ground: Ground, source: str) -> Zone:
    """Return one zone."""
    where = f"{source}, zone '{name}'"
    if not isinstance(table, dict):
        raise SourceError(f"{where}: A zone must be a table, got {table!r}.", source=source, zone=name)
    unknown = [key for key in table if key not in KEYS]
    if unknown:
        raise SourceError(f"{where}: It may say {', '.join(KEYS)}; got '{unknown[0]}'.", source=source, zone=name)
    if ("cells" in table) == ("metres" in table):
        raise SourceError(f"{where}: It must say where it is, by either 'cells' or 'metres'.", source=source, zone=name)
    if name in RESERVED:
        raise SourceError(
            f"{where}: A zone must not be called '{name}', which has a meaning of its own.", source=source
        )
    if not name.strip() or not name.isprintable():
        raise SourceError(f"{where}: Its name must be some words on one line.", source=source, zone=name)
    if "metres" in table and ground.frame is None:
        raise SourceError(f"{where}: This map has no place in the world: say 'cells'.", source=source, zone=name)
    points = _points(table.get("cells", table.get("metres")), where, whole="cells" in table)
    forbidden = table.get("forbidden", False)
    if not isinstance(forbidden, bool):
        raise SourceError(f"{where}: 'forbidden' must be true or false, got {forbidden!r}.", source=source, zone=name)
    inside = _inside(points, ground, cells="cells" in table)
    if not inside.any():
        raise SourceError(f"{where}: It must hold the middle of some cell of the map, it holds none.", source=source)
    risk, speed = _number(table, "risk", 0.0, where), _number(table, "speed", 1.0, where)
    if speed == 0.0:
        raise SourceError(
            f"{where}: 'speed' must be above 0; where nobody drives, say forbidden = true.", source=source
        )
    return Zone(name=name, inside=inside, risk=risk, speed=speed, forbidden=forbidden)


def _points(given: object, where: str, *, whole: bool) -> list[tuple[float, float]]:
    """Return the corners of a zone."""
    points = given if isinstance(given, list) else []
    if len(points) < 2 or not all(_is_point(point, whole=whole) for point in points):
        shape = "[column, row] in whole numbers" if whole else "[x, y]"
        raise SourceError(f"{where}: Its place must be a list of two or more corners {shape}, got {given!r}.")
    return [(float(a), float(b)) for a, b in points]


def _is_point(point: object, *, whole: bool) -> bool:
    if not isinstance(point, list) or len(point) != 2 or any(isinstance(part, bool) for part in point):
        return False
    return all(
        isinstance(part, int) or (isinstance(part, float) and not whole and math.isfinite(part)) for part in point
    )


def _number(table: dict[str, Any], key: str, usual: float, where: str) -> float:
    value = table.get(key, usual)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
        raise SourceError(f"{where}: '{key}' must be a number from 0 on, got {value!r}.")
    return float(value)


def _inside(points: Sequence[tuple[float, float]], ground: Ground, *, cells: bool) -> npt.NDArray[np.bool_]:
    """Return which cells lie in a rectangle (two corners) or a polygon, by their middle."""
    height, width = ground.open.shape
    row, column = np.mgrid[0:height, 0:width]
    if cells or ground.frame is None:
        x, y = column.astype(np.float64), row.astype(np.float64)
    else:
        frame = ground.frame
        right, up = (column + 0.5) * frame.resolution, (height - row - 0.5) * frame.resolution
        cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
        x, y = frame.x + cos * right - sin * up, frame.y + sin * right + cos * up
    slack = 1e-9 * ground.size
    if len(points) == 2:
        (a, b), (c, d) = points
        found = (
            (x >= min(a, c) - slack) & (x <= max(a, c) + slack) & (y >= min(b, d) - slack) & (y <= max(b, d) + slack)
        )
        return np.asarray(found)
    odd = np.zeros((height, width), dtype=np.bool_)
    for (a, b), (c, d) in zip(points, [*points[1:], points[0]], strict=True):
        crosses = (b > y) != (d > y)
        with np.errstate(all="ignore"):
            odd ^= crosses & (x < a + (y - b) / (d - b) * (c - a))
    return odd
