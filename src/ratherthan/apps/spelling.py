"""Columns enter, JSON or CSV leaves block by block: all cells of a block are spelled at once, none by itself."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.apps.columns import Column, blocks, state_names
from ratherthan.apps.letters import GAP, Letters, joined, of_floats, of_texts, of_wholes
from ratherthan.model.names import StateNames, spell
from ratherthan.model.watch import look

__all__ = ["csv_parts", "json_parts"]

ROWS = 1 << 14
"""So many rows are spelled at a time."""
ROOM = 1 << 26
"""So many bytes may the texts of a column in one block take; where they are longer, blocks are shorter."""

Part = Letters | bytes
"""What stands in a cell: letters by row, or what is the same in all rows."""


class _TooWideError(Exception):
    """The texts of a block take too much room."""


@dataclass(frozen=True, kw_only=True)
class _Style:
    """How cells are spelled: a text, a piece of one in quotation marks, whether all texts have these, null, the two infinities."""

    text: Callable[[str], str]
    inner: Callable[[str], str]
    quotes: bool
    null: bytes
    infinite: tuple[bytes, bytes]

    def cells(self, column: Column, first: int, last: int) -> list[Part]:
        """Return some cells of a column, each value that is repeated spelled once."""
        values = column.values[first:last]
        if column.words is not None:
            return [self._of_words(column.words, values)]
        if column.names is None and values.dtype == np.bool_:
            return [self._with_null(TRUTH[values.astype(np.int64)], column.null, first, last)]
        same = values.view(np.int64) if values.dtype == np.float64 else values  # 0.0 and -0.0 are not
        begin = np.flatnonzero(np.append(True, same[1:] != same[:-1]))
        times = np.diff(np.append(begin, len(values)))
        kept = values[begin]
        spelled = [self._of_numbers(kept)] if column.names is None else self._of_names(column.names, kept)
        parts = [part if isinstance(part, bytes) else _repeated(part, times) for part in spelled]
        return [part if isinstance(part, bytes) else self._with_null(part, column.null, first, last) for part in parts]

    def _of_words(self, words: Sequence[str], codes: npt.NDArray[Any]) -> Letters:
        """Return words by their numbers."""
        used, at = np.unique(codes, return_inverse=True)
        return _taken(self._of_texts([words[code] for code in used.tolist()]), at)

    def _of_names(self, names: StateNames, states: npt.NDArray[Any]) -> list[Part]:
        """Return the names of states; of those made of variables each value is spelled once."""
        if names.strings is not None:
            return [self._of_texts(state_names(names, states))]
        if not names.variables:
            return [b'"', of_wholes(states), b'"'] if self.quotes else [of_wholes(states)]
        found: list[Part] = []
        alone = len(names.variables) == 1
        for name, column in names.variables.items():
            kept, at = np.unique(np.asarray(column)[states], return_inverse=True)
            pieces = [f"{name}={spell(value)}" for value in kept]
            letters = self._of_texts(pieces) if alone else self._of_texts(pieces, self.inner)
            found += [b", " if found else b"", _taken(letters, at)]
        return found if alone else [b'"', *found, b'"']  # CSV needs the marks for the commas

    def _of_texts(self, texts: Sequence[str], how: Callable[[str], str] | None = None) -> Letters:
        """Return texts, by default as whole cells."""
        # A lone surrogate, which JSON may smuggle into a name, has no bytes in UTF-8: it stays an escape, as in JSON.
        spelled = [text.encode("utf-8", "backslashreplace") for text in map(how or self.text, texts)]
        if len(spelled) > 1 and len(spelled) * max(map(len, spelled)) > ROOM:
            raise _TooWideError
        return of_texts(spelled)

    def _of_numbers(self, kept: npt.NDArray[Any]) -> Letters:
        return of_floats(kept, self._unusual) if kept.dtype.kind == "f" else of_wholes(kept)

    def _unusual(self, number: float) -> bytes:
        """Return a number that is infinite, very large or very small."""
        if number != number:
            raise ValueError("Not a number has no place in a table.")
        if number in (np.inf, -np.inf):
            return self.infinite[0 if number > 0 else 1]
        return repr(number).encode()

    def _with_null(self, letters: Letters, null: npt.NDArray[np.bool_] | None, first: int, last: int) -> Letters:
        gone = None if null is None else null[first:last]
        if gone is None or not gone.any():
            return letters
        width = max(letters.shape[1], len(self.null))
        found = np.full((len(letters), width), GAP, dtype=np.uint8)
        found[:, : letters.shape[1]] = letters
        found[gone] = np.frombuffer(self.null.ljust(width, bytes([GAP])), dtype=np.uint8)
        return found


TRUTH = of_texts((b"false", b"true"))


def _repeated(letters: Letters, times: npt.NDArray[np.int64]) -> Letters:
    """Return each row as often as it stands in the block."""
    return letters if len(times) == int(times.sum()) else np.repeat(letters, times, axis=0)


def _taken(letters: Letters, at: npt.NDArray[np.intp]) -> Letters:
    """Return rows by number, where they do not take too much room."""
    if len(at) > 1 and len(at) * letters.shape[1] > ROOM:
        raise _TooWideError
    found: Letters = letters[at]
    return found


def json_parts(columns: Mapping[str, Column]) -> Iterator[bytes | bytearray]:
    """Yield ``{"rows": [...]}``, a row a line; infinite numbers as "inf" and "-inf"."""
    encode = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode
    style = _Style(
        text=encode,
        inner=lambda text: encode(text)[1:-1],
        quotes=True,
        null=b"null",
        infinite=(b'"inf"', b'"-inf"'),
    )
    between = [f"{', ' if k else ''}{encode(key)}: ".encode() for k, key in enumerate(columns)]
    yield b'{"rows": ['
    before = 1
    for page in _pages(columns, style, (b",\n  {", between, b"}")):
        yield page[before:] if before else page  # no comma before the first row
        before = 0
    yield b"\n]}\n"


def csv_parts(columns: Mapping[str, Column]) -> Iterator[bytes | bytearray]:
    """Yield comma-separated values with a line of names: null is empty, truth is true or false, infinity inf."""
    style = _Style(
        text=_quoted,
        inner=lambda text: text.replace('"', '""'),
        quotes=False,
        null=b"",
        infinite=(b"inf", b"-inf"),
    )
    yield (",".join(map(_quoted, columns)) + "\n").encode()
    yield from _pages(columns, style, (b"", [b"," if k else b"" for k in range(len(columns))], b"\n"))


def _quoted(text: str) -> str:
    """Return a text as a cell of many in a line."""
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\r\n").writerow((text, ""))
    return buffer.getvalue()[:-3]


def _pages(
    columns: Mapping[str, Column], style: _Style, around: tuple[bytes, list[bytes], bytes]
) -> Iterator[bytes | bytearray]:
    """Yield the rows of all columns; `around` is what stands before a row, before each cell, and behind the row."""
    count = max((len(column.values) for column in columns.values()), default=0)
    begin, between, end = around
    waiting = [block for block in blocks(count, ROWS) if block[1] > block[0]][::-1]
    while waiting:
        look()
        first, last = waiting.pop()
        try:
            cells = [style.cells(column, first, last) for column in columns.values()]
        except _TooWideError:
            middle = (first + last) // 2
            waiting += [(middle, last), (first, middle)]
            continue
        parts: list[Part] = [begin]
        for mark, cell in zip(between, cells, strict=True):
            parts += [mark, *cell]
        yield joined([*parts, end], last - first)
