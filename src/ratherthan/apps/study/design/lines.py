"""A TOML text enters, the line of each of its keys and sections leaves: so that a fault can be told with its place.

`tomllib` says what stands in a file, not where. Keys within inline tables and multi-line lists have the line of what holds them.
"""

from __future__ import annotations

import re
from collections import Counter

__all__ = ["Keys", "lines_of"]

Keys = tuple[str | int, ...]

_PART = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|'[^']*')"""
_DOTTED = rf"{_PART}(?:\s*\.\s*{_PART})*"
_KEY = re.compile(rf"\s*({_DOTTED})\s*=\s*(.*)", re.DOTALL)
_TABLE = re.compile(rf"\s*\[\s*({_DOTTED})\s*\]")
_ROW = re.compile(rf"\s*\[\[\s*({_DOTTED})\s*\]\]")
_LONG = re.compile(r"'''|\"\"\"")


def lines_of(text: str) -> dict[Keys, int]:
    r"""Return the line, from 1, of every key that begins a line and of every header; entries of ``[[lists]]`` count from 1.

    Parameters
    ----------
    text : str

    Examples
    --------
    >>> lines_of("a = 1\n[[b]]\nc = 2\n[[b]]\nc = 3")
    {('a',): 1, ('b', 1): 2, ('b', 1, 'c'): 3, ('b', 2): 4, ('b', 2, 'c'): 5}
    """
    found: dict[Keys, int] = {}
    counts: Counter[Keys] = Counter()
    table: Keys = ()
    until = ""
    for number, line in enumerate(text.split("\n"), 1):
        if until:
            until = "" if until in line else until
            continue
        if line.lstrip().startswith("#"):
            continue
        if row := _ROW.match(line):
            outer = _inside(_parts(row[1]), counts)
            counts[outer] += 1
            table = (*outer, counts[outer])
            found.setdefault(table, number)
        elif header := _TABLE.match(line):
            table = _inside(_parts(header[1]), counts)
            found.setdefault(table, number)
        elif key := _KEY.match(line):
            found.setdefault((*table, *_parts(key[1])), number)
            until = _opened(key[2])
        else:
            until = _opened(line)
    return found


def _opened(rest: str) -> str:
    """Return the mark that ends a long text which is begun in the rest of a line, nothing where none is."""
    marks = _LONG.findall(rest)
    return marks[0] if len(marks) == 1 else ""


def _parts(dotted: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(_PART, dotted)]


def _inside(parts: list[str], counts: Counter[Keys]) -> Keys:
    """Return the keys of a header: within a list it belongs to the last entry so far."""
    keys: Keys = ()
    for place, part in enumerate(parts):
        keys = (*keys, part)
        if counts[keys] and place < len(parts) - 1:
            keys = (*keys, counts[keys])
    return keys
