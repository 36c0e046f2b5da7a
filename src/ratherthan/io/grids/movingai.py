"""A map or a scenario file of the MovingAI benchmarks enters; the ground, or starts and goals with published lengths, leave.

The format (Sturtevant 2012): four lines ``type octile``, ``height H``, ``width W``, ``map``, in any order but the last; then H rows of W
letters, the first at the top. A scenario file has a line ``version 1`` and a line for each way: bucket, map, width, height, start column,
start row, goal column, goal row, length of the shortest way with eight directions where diagonals cost √2 and cut no corners.

======== ==================================================================================
letter   ground
======== ==================================================================================
``. G``  open
``S``    swamp: open
``W``    water: open, but entered from water only
``T``    trees
``@ O``  out of bounds
======== ==================================================================================

References
----------
N. R. Sturtevant, Benchmarks for Grid-Based Pathfinding, IEEE Trans. Comput. Intell. AI Games 4(2), 2012.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ratherthan.errors import SourceError
from ratherthan.io._files import open_source
from ratherthan.io.grids.ground import Ground
from ratherthan.model.world import WATER

__all__ = ["MAP_LINES", "Way", "is_movingai", "parse_map", "read_map", "read_way"]

KINDS = ("open ground", "wall", "swamp", WATER, "trees")
LETTERS = {".": 0, "G": 0, "@": 1, "O": 1, "S": 2, "W": 3, "T": 4}
OPEN = np.array([True, False, True, True, False])
MOST_CELLS = 400_000_000
HEADER = re.compile(r"(?P<key>type|height|width)\s+(?P<value>\S+)\s*$")


@dataclass(frozen=True, kw_only=True)
class Way:
    """A row of a scenario file: cells as (column, row), and the published length of the shortest way."""

    map: str
    width: int
    height: int
    start: tuple[int, int]
    goal: tuple[int, int]
    length: float


MAP_LINES = re.compile(rb"\A\s*(?:(?:type|height|width)[ \t]+\S+[ \t]*[\r\n]+){1,3}map[ \t]*[\r\n]")


def is_movingai(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is a map of this kind: by its suffix, else by how it begins."""
    if os.fspath(path).lower().endswith(".map"):
        return True
    if os.fspath(path).lower().endswith((".yaml", ".yml")):
        return False
    with open_source(path) as file:
        return MAP_LINES.match(file.read(1 << 10)) is not None


def read_map(path: str | os.PathLike[str]) -> Ground:
    """Return the ground of a map file.

    Raises
    ------
    SourceError
        If it cannot be read or is no such map, with the line.
    """
    with open_source(path) as file:
        text = file.read().decode("latin-1")
    return parse_map(text, os.fspath(path))


def parse_map(text: str, source: str = "a map") -> Ground:
    r"""Return the ground of a map from its text.

    Parameters
    ----------
    text : str
    source : str
        What to call it in messages.

    Raises
    ------
    SourceError
        If it is no such map, with the line.

    Examples
    --------
    >>> ground = parse_map("type octile\nheight 2\nwidth 3\nmap\n..@\n.T.\n")
    >>> ground.open.astype(int).tolist()
    [[1, 1, 0], [1, 0, 1]]
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    found: dict[str, str] = {}
    for number, line in enumerate(lines):
        if line.strip() == "map":
            break
        header = HEADER.match(line.strip())
        if header is None and line.strip():
            raise _fault(source, number, "A line before 'map' must be 'type …', 'height …' or 'width …'", line)
        if header is not None:
            found[header["key"]] = header["value"]
    else:
        raise SourceError(f"{source}: A map must have a line 'map' before its rows, got none.", source=source)
    height, width = (_count(found, key, source) for key in ("height", "width"))
    if height * width > MOST_CELLS:
        raise SourceError(
            f"{source}: A map must have at most {MOST_CELLS} cells, its header says {width} × {height}.", source=source
        )
    rows = [line.rstrip(" \t") for line in lines[number + 1 :]]
    while rows and not rows[-1]:
        rows.pop()
    if len(rows) != height:
        raise SourceError(
            f"{source}: The map must have the {height} rows that its header says, got {len(rows)}. "
            "Mend the header or the rows.",
            source=source,
        )
    for below, row in enumerate(rows):
        if len(row) != width:
            raise _fault(
                source, number + 1 + below, f"A row must have the {width} letters that the header says", f"{len(row)}"
            )
    letters = np.frombuffer("".join(rows).encode("latin-1"), dtype=np.uint8)
    table = np.full(256, 255, dtype=np.uint8)
    for letter, code in LETTERS.items():
        table[ord(letter)] = code
    kind = table[letters].reshape(height, width)
    if (kind == 255).any():
        below, column = (int(i) for i in np.argwhere(kind == 255)[0])
        raise SourceError(
            f"{source}, line {number + 2 + below}, column {column + 1}: A cell must be one of {' '.join(LETTERS)}, "
            f"got '{rows[below][column]}'.",
            source=source,
            line=number + 2 + below,
            column=column + 1,
        )
    return Ground(
        kinds=KINDS,
        kind=kind,
        open=OPEN[kind],
        water=kind == LETTERS["W"],
        doubt=np.zeros((height, width)),
        title=Path(source).stem,
    )


def read_way(path: str | os.PathLike[str], row: int) -> Way:
    """Return a row of a scenario file.

    Parameters
    ----------
    path : path
    row : int
        From 0, the line of the header not counted.

    Raises
    ------
    SourceError
        If it cannot be read, is no such file, or has no such row.
    """
    source = os.fspath(path)
    with open_source(path) as file:
        lines = file.read().decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if not lines[0].strip().startswith("version"):
        raise _fault(source, 0, "A scenario file must begin with 'version 1'", lines[0])
    ways = [(number, line) for number, line in enumerate(lines[1:], 1) if line.strip()]
    if not 0 <= row < len(ways):
        raise SourceError(
            f"{source}: There must be such a row: it has the rows 0 to {len(ways) - 1}, got {row}.", source=source
        )
    number, line = ways[row]
    words = line.split("\t") if "\t" in line else line.split()
    try:
        _, name, *counts, length = (word.strip() for word in words)
        width, height, *cells = (int(count) for count in counts)
        (a, b, c, d), far = cells, float(length)
    except ValueError:
        raise _fault(source, number, "A row must be: bucket, map, width, height, two cells, length", line) from None
    return Way(map=name, width=width, height=height, start=(a, b), goal=(c, d), length=far)


def _count(found: dict[str, str], key: str, source: str) -> int:
    value = found.get(key, "")
    if not value.isdecimal() or int(value) < 1:
        raise SourceError(
            f"{source}: The header must say the map's {key}, a whole number from 1 on, got '{value}'.", source=source
        )
    return int(value)


def _fault(source: str, number: int, must: str, got: str) -> SourceError:
    return SourceError(f"{source}, line {number + 1}: {must}, got '{got[:60]}'.", source=source, line=number + 1)
