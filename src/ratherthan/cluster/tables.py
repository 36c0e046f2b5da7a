"""A file with a table enters, its rows leave; rows of results enter, a whole file leaves: CSV, JSON lines or Parquet."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from ratherthan.errors import MissingExtraError, SourceError
from ratherthan.io._files import open_source, write_atomically

__all__ = ["FORMS", "form_of", "need", "read_rows", "write_rows"]

FORMS = ("csv", "jsonl", "parquet")
Row = Mapping[str, Any]
LONGEST_CELL = 1 << 24
EXAMPLE = "example:missions"
"""The table that comes with the program."""


def form_of(path: str | os.PathLike[str]) -> str:
    """Return how a table is written, by the suffix of its file.

    Raises
    ------
    SourceError
        Where the suffix is none of the three.
    """
    suffix = Path(path).suffix.lower().removeprefix(".")
    suffix = "jsonl" if suffix == "ndjson" else suffix
    if suffix not in FORMS:
        raise SourceError(
            f"A table must be a file .csv, .jsonl or .parquet, got '{os.fspath(path)}'. Give it one of these suffixes.",
            path=os.fspath(path),
        )
    return suffix


def need(form: str) -> None:
    """Raise MissingExtraError where a table cannot be read or written for want of a library."""
    if form != "parquet":
        return
    try:
        import pyarrow as _  # noqa: F401, ICN001 - only whether it is there
    except ImportError as error:
        raise MissingExtraError(
            "Parquet must be read and written by pyarrow, which is not installed. "
            "Install it with: pip install 'ratherthan[parquet]'.",
            library="pyarrow",
        ) from error


def read_rows(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Return the rows of a table.

    Raises
    ------
    SourceError
        Where the file is missing or no such table.
    MissingExtraError
        For Parquet without pyarrow.
    """
    if os.fspath(path) == EXAMPLE:
        return _csv_rows(
            (files("ratherthan.cluster") / "examples" / "missions.csv").read_text(encoding="utf-8"), EXAMPLE
        )
    form, shown = form_of(path), os.fspath(path)
    need(form)
    with open_source(path, "a table of missions") as file:
        if form == "parquet":
            return _parquet_rows(file, shown)
        try:
            text = file.read().decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise SourceError(
                f"A table must be text in UTF-8, but '{shown}' is not, at byte {error.start}. Save it as UTF-8.",
                path=shown,
            ) from error
    return _csv_rows(text, shown) if form == "csv" else _json_rows(text, shown)


def _csv_rows(text: str, shown: str) -> list[dict[str, Any]]:
    csv.field_size_limit(LONGEST_CELL)
    lines = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows: list[dict[str, Any]] = []
    head: list[str] = []
    try:
        for cells in lines:
            if not any(cell.strip() for cell in cells):
                continue
            if not head:
                head = _heads(cells, shown)
                continue
            if len(cells) > len(head):
                raise SourceError(
                    f"A row must have a cell per column ({len(head)}), but line {lines.line_num} of '{shown}' has "
                    f"{len(cells)}. Put texts with commas in quotes.",
                    path=shown,
                )
            rows.append(dict(zip(head, cells, strict=False)))
    except csv.Error as error:
        raise SourceError(
            f"A table must be comma-separated values, but line {lines.line_num} of '{shown}' is not: {error}.",
            path=shown,
        ) from error
    return rows


def _heads(cells: Sequence[str], shown: str) -> list[str]:
    head = [cell.strip() for cell in cells]
    twice = next((name for k, name in enumerate(head) if name in head[:k]), None)
    if twice is not None:
        raise SourceError(f"Every column must have a name of its own, but '{shown}' has '{twice}' twice.", path=shown)
    return head


def _json_rows(text: str, shown: str) -> list[dict[str, Any]]:
    rows = []
    for number, line in enumerate(text.split("\n"), 1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except (json.JSONDecodeError, RecursionError) as error:
            raise SourceError(
                f"Line {number} of '{shown}' must be a JSON object, but it is not: {error}.", path=shown
            ) from error
        if not isinstance(row, dict):
            raise SourceError(f"Line {number} of '{shown}' must be a JSON object, got {str(row)[:40]!r}.", path=shown)
        rows.append(row)
    return rows


def _parquet_rows(file: io.BufferedIOBase | Any, shown: str) -> list[dict[str, Any]]:
    import pyarrow as pa
    from pyarrow import parquet

    try:
        rows: list[dict[str, Any]] = parquet.read_table(file).to_pylist()
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
        raise SourceError(
            f"A Parquet file must be whole, but '{shown}' cannot be read: {reason}", path=shown
        ) from error
    return rows


def write_rows(rows: Sequence[Row], columns: Mapping[str, type], path: str | os.PathLike[str]) -> None:
    """Write rows as a table, whole or not at all.

    Parameters
    ----------
    rows : sequence of mappings
        With every column; None where there is nothing.
    columns : mapping from str to int, float or str
        What each column holds, in their order.
    path : path
    """
    form = form_of(path)
    need(form)
    with write_atomically(path) as file:
        if form == "parquet":
            file.write(_parquet(rows, columns))
        else:
            file.writelines(part.encode("utf-8", "backslashreplace") for part in _lines(rows, columns, form))


def _lines(rows: Sequence[Row], columns: Mapping[str, type], form: str) -> Iterator[str]:
    if form == "jsonl":
        for row in rows:
            line = {column: _finite(row[column]) for column in columns}
            yield json.dumps(line, ensure_ascii=False, allow_nan=False) + "\n"
        return
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow([row[column] for column in columns])
    yield buffer.getvalue()


def _finite(value: object) -> object:
    """Return infinite numbers as JSON has them here."""
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


def _parquet(rows: Sequence[Row], columns: Mapping[str, type]) -> bytes:
    import pyarrow as pa
    from pyarrow import parquet

    kinds = {int: pa.int64(), float: pa.float64(), str: pa.string()}
    arrays = []
    for column, kind in columns.items():
        cells = [row[column] for row in rows]
        if kind is str:
            cells = [None if cell is None else str(cell).encode("utf-8", "backslashreplace").decode() for cell in cells]
        arrays.append(pa.array(cells, type=kinds[kind]))
    sink = pa.BufferOutputStream()
    parquet.write_table(pa.table(arrays, names=list(columns)), sink)
    whole: bytes = sink.getvalue().to_pybytes()
    return whole
