"""A table's file enters, its columns as text leave: CSV with commas, semicolons or tabs, or Parquet."""

from __future__ import annotations

import csv
import io
import math
import re
from pathlib import Path

from ratherthan.apps.study.cells import bare_cell
from ratherthan.errors import MissingExtraError, SourceError

__all__ = ["Table", "number_in", "read_table"]

Table = dict[str, list[str]]
"""Columns by name, all equally long; a cell without anything is ""."""
MOST_BYTES = 2_000_000_000
FARTHEST = 1e30
"""Beyond this nothing is taken for a measurement; its fourth power, summed over millions of answers, is still a number."""
NOTHING = frozenset(("", "na", "n/a", "nan", "null", "nil", "none", ".", "-", "–", "?"))
"""How tables write that a number is missing, in small letters."""
_COMMA = re.compile(r"[+-]?\d+,\d+")


def read_table(path: Path) -> Table:
    """Return the columns of a table.

    Raises
    ------
    SourceError
        If the file cannot be read as a table: the message says where.
    MissingExtraError
        If it is Parquet and pyarrow is not installed.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise SourceError(
                f"A table must be smaller than 2 GB, and '{path}' is larger. Take it in parts.", path=path
            )
        if path.suffix.lower() in (".parquet", ".pq"):
            return _parquet(path)
        if path.suffix.lower() in (".xlsx", ".xls", ".ods", ".sav"):
            raise SourceError(
                f"A table must be CSV or Parquet, and '{path.name}' is of another program. Save it as CSV there.",
                path=path,
            )
        raw = path.read_bytes()
    except OSError as error:
        raise SourceError(
            f"The table must be readable, but '{path}' is not: {error.strerror or error}.", path=path
        ) from error
    return _csv(_decoded(raw, path), path)


def _decoded(raw: bytes, path: Path) -> str:
    for mark, encoding in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"", "utf-8-sig")):
        if raw.startswith(mark):
            try:
                text = raw.decode(encoding)
            except UnicodeDecodeError as error:
                raise SourceError(
                    f"A table must be text in UTF-8, and '{path.name}' is not: byte {error.start} has no meaning there. "
                    "Save it anew as 'CSV UTF-8'.",
                    path=path,
                ) from error
            if "\x00" in text:
                raise SourceError(f"A table must be text, and '{path.name}' holds NUL characters.", path=path)
            return text
    raise AssertionError("every text starts with nothing")


def _csv(text: str, path: Path) -> Table:
    """Return the columns of a CSV."""
    lines = [line for line in text.splitlines()[:1] if line.strip()]
    if not lines:
        raise SourceError(f"A table must begin with a line of column names, and '{path.name}' does not.", path=path)
    delimiter = max(",;\t", key=lines[0].count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=False)
    try:
        head = [name.strip() for name in next(reader)]
        rows = []
        for row in reader:
            if not any(cell.strip() for cell in row):
                continue
            if len(row) > len(head):
                raise SourceError(
                    f"Every line of a table must have as many cells as the first, {len(head)}; line {reader.line_num} of "
                    f"'{path.name}' has {len(row)}. Put quotes around cells that hold '{delimiter}'.",
                    path=path,
                )
            rows.append(row + [""] * (len(head) - len(row)))
    except csv.Error as error:
        raise SourceError(
            f"Line {reader.line_num} of '{path.name}' cannot be read as CSV: {error}.", path=path
        ) from error
    _check_names(head, path)
    columns = list(zip(*rows, strict=True)) if rows else [() for _ in head]
    return {name: [bare_cell(cell.strip()) for cell in column] for name, column in zip(head, columns, strict=True)}


def _check_names(head: list[str], path: Path) -> None:
    """Refuse a table in which two columns have one name."""
    named = [name for name in head if name]
    twice = sorted({name for name in named if named.count(name) > 1})
    if twice or head.count("") > 1:
        what = f"'{twice[0]}' stands there twice" if twice else "several have none"
        raise SourceError(f"Every column of a table must have a name of its own; in '{path.name}' {what}.", path=path)


def _parquet(path: Path) -> Table:
    try:
        import pyarrow as pa
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise MissingExtraError("Tables in Parquet need the extra [study]: pip install 'ratherthan[study]'.") from error
    try:
        table = parquet.read_table(path)
    except (pa.ArrowException, ValueError) as error:
        first = str(error).splitlines()[0][:200]
        raise SourceError(
            f"'{path.name}' must be a table in Parquet, but cannot be read as one: {first}.", path=path
        ) from error
    _check_names(list(table.column_names), path)
    return {name: [_cell(value) for value in table[name].to_pylist()] for name in table.column_names}


def _cell(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return str(value).strip()


def number_in(cell: str) -> float | None:
    """Return the number in a cell, None where the cell is without one, NaN where it holds something else.

    Examples
    --------
    >>> number_in("4"), number_in("3,5"), number_in("n/a"), number_in("often")
    (4.0, 3.5, None, nan)
    """
    if cell.lower() in NOTHING:
        return None
    if _COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    if "_" in cell or not cell.isascii():
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        return math.nan
    return value if abs(value) <= FARTHEST else math.nan
