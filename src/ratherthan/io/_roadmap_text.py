"""A road map's text enters, its tables and the means to point at a place in it leave.

A road map is a TOML file (docs/roadmap-format.md). `tomllib` says what stands in a file but not where; here a key is
found again in the text, so that every fault is told with its line and column. Nothing is searched unless a fault is told.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NoReturn

from ratherthan.errors import SourceError

__all__ = ["Document", "closest", "quoted_list"]

Keys = tuple[str, ...]

_KEY = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|'[^']*')"""
_DOTTED = re.compile(rf"\s*({_KEY}(?:\s*\.\s*{_KEY})*)\s*=\s*")
_HEADER = re.compile(rf"\s*\[\s*({_KEY}(?:\s*\.\s*{_KEY})*)\s*\]")
_TOML_PLACE = re.compile(r"\s*\(at line (\d+), column (\d+)\)$")


def closest(word: str, known: Iterable[str]) -> str:
    """Return ``" Did you mean 'x'?"`` where a known word is near, else nothing."""
    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return f" Did you mean '{near[0]}'?" if near else ""


def quoted_list(words: Iterable[str]) -> str:
    """Return ``'a', 'b', 'c'``."""
    return ", ".join(f"'{word}'" for word in words)


@dataclass(frozen=True)
class Document:
    r"""A TOML text, its name, and its content.

    Parameters
    ----------
    source : str
        The file as the user named it.
    text : str
        Line ends are ``\\n``.
    tables : dict
        What `tomllib` read.
    """

    source: str
    text: str
    tables: dict[str, Any]

    @classmethod
    def read(cls, text: str, source: str) -> Document:
        """Read a TOML text.

        Raises
        ------
        SourceError
            Where the text is empty or no TOML, with line and column.
        """
        text = text.removeprefix("\ufeff").replace("\r\n", "\n")
        bare = cls(source, text, {})
        if not text.strip():
            bare.fail("The file is empty: a road map must have a drawing, map = ''' … '''.", line=1)
        try:
            return cls(source, text, tomllib.loads(text))
        except RecursionError:
            bare.fail("The file must be TOML with few levels, got lists nested too deeply.")
        except ValueError as error:  # tomllib's own error, or a number with thousands of digits
            bare._fail_toml(str(error))

    def _fail_toml(self, message: str) -> NoReturn:
        place = _TOML_PLACE.search(message)
        at = (int(place[1]), int(place[2])) if place else (None, None)
        if message.endswith("(at end of document)"):
            at = (len(self.lines), len(self.lines[-1]) + 1)
        what = re.sub(r"\s*\(at [^()]*\)$", "", message)
        hint = (
            " Is a closing ''' missing?" if "end of document" in message or "expected \"'''" in message.lower() else ""
        )
        if what.startswith(("Cannot overwrite", "Cannot declare")):
            hint = " A key, such as the number of a cell, may be given once only."
        self.fail(f"The file must be TOML, but: {what}.{hint}", line=at[0], column=at[1])

    @cached_property
    def lines(self) -> list[str]:
        """The lines of the text."""
        return self.text.split("\n")

    @cached_property
    def _places(self) -> dict[Keys, int]:
        """The line, from 1, of every key that begins a line, and of every table's header."""
        return dict(reversed(list(self._keys())))  # the first of equals stays

    def _keys(self) -> Iterator[tuple[Keys, int]]:
        table: Keys = ()
        until = ""  # the delimiter that ends the multi-line string we are in
        for number, line in enumerate(self.lines, start=1):
            if until:
                if until in line:
                    until = ""
                continue
            if header := _HEADER.match(line):
                table = _split(header[1])
                yield table, number
            elif key := _DOTTED.match(line):
                yield table + _split(key[1]), number
                opened = line[key.end() : key.end() + 3]
                if opened in ("'''", '"""') and opened not in line[key.end() + 3 :]:
                    until = opened

    def line_of(self, keys: Keys) -> int | None:
        """Return the line of a key, or of the nearest table or key that holds it."""
        for length in range(len(keys), 0, -1):
            if keys[:length] in self._places:
                return self._places[keys[:length]]
        return None

    def fail(self, message: str, keys: Keys = (), **at: Any) -> NoReturn:
        """Raise SourceError: the place, then `message`. `at` may give `line` and `column`, and is kept as attributes."""
        line = at.pop("line", None) or (self.line_of(keys) if keys else None)
        column = at.pop("column", None)
        if line is not None and column is None and keys:
            column = _column(self.lines[line - 1], keys[-1])
        where = self.source
        if line is not None:
            where += f", line {line}" + (f", column {column}" if column is not None else "")
        raise SourceError(f"{where}: {message}", source=self.source, line=line, column=column, **at)

    def fail_in_drawing(self, message: str, keys: Keys, row: int, column: int | None = None, **at: Any) -> NoReturn:
        """Raise SourceError at a character of a drawing: `row` of its lines as in the string, `column` in that line.

        Strings written with escapes cannot be found again in the file; then the place is told within the drawing.
        """
        line = self.line_of(keys)
        if line is not None:
            opening = _DOTTED.match(self.lines[line - 1])
            rest = self.lines[line - 1][opening.end() :] if opening else ""
            trimmed = rest in ("'''", '"""')  # the line end after the opening quotes does not belong to the string
            first = line + 1 if trimmed else line
            quotes = 3 if rest.startswith(("'''", '"""')) else 1
            shift = 0 if trimmed or row > 0 or opening is None else opening.end() + quotes
            wanted = str(self._value(keys)).split("\n")[row]
            if first + row <= len(self.lines) and wanted == self.lines[first + row - 1][shift : shift + len(wanted)]:
                self.fail(message, line=first + row, column=1 + shift + (column or 0), **at)
        within = f"row {row + 1} of the drawing" + (f", character {column + 1}" if column is not None else "")
        self.fail(f"{message} ({within})", keys, **at)

    def _value(self, keys: Keys) -> Any:
        value: Any = self.tables
        for key in keys:
            value = value[key]
        return value


def _split(dotted: str) -> Keys:
    """Split ``words."cells".12`` into its keys, quotes removed."""
    return tuple(key.strip("\"'") for key in re.findall(_KEY, dotted))


def _column(line: str, key: str) -> int | None:
    found = re.search(rf"(?<![\w-])[\"']?{re.escape(key)}[\"']?(?=\s*[=.\]])", line)
    return found.start() + 1 if found else None
