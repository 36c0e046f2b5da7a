"""Columns enter, a table for people, JSON, CSV or Parquet leaves in parts."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ratherthan.apps.columns import Column, blocks
from ratherthan.apps.door import one_line
from ratherthan.errors import MissingExtraError

__all__ = ["aligned", "csv_parts", "json_parts", "need_parquet", "parquet_parts", "parts_of", "shown", "table_parts"]

EXACT = ("choice_index", "lower", "upper")
"""Columns that the table for people leaves out: they say more than six digits do."""


def parts_of(form: str, columns: Mapping[str, Column]) -> Iterator[str] | Iterator[bytes]:
    """Return the parts of a table as ``"table"``, ``"json"``, ``"csv"`` or ``"parquet"``."""
    if form == "parquet":
        return parquet_parts(columns)
    return {"table": table_parts, "json": json_parts, "csv": csv_parts}[form](columns)


def table_parts(columns: Mapping[str, Column]) -> Iterator[str]:
    """Yield a table for people, block by block; a column is as wide as its first block needs."""
    keys = [
        key
        for key in columns
        if re.sub(r"_\d+$", "", key) not in EXACT and not (key == "state_name" and not _named(columns[key]))
    ]
    widths: list[int] = []
    for first, last in blocks(_count(columns)):
        cells = [[shown(value, key) for value in columns[key].rows(first, last)] for key in keys]
        if first == 0:
            widths = [max(map(len, [key, *column])) for key, column in zip(keys, cells, strict=True)]
            yield aligned(keys, widths)
        yield from (aligned(row, widths) for row in zip(*cells, strict=True))


def aligned(cells: Sequence[str], widths: Sequence[int]) -> str:
    """Return the cells of one line under each other, without blanks at the end."""
    padded = [f"{cell:<{width}}" for cell, width in zip(cells, widths, strict=True)]
    return "  ".join(padded).rstrip() + "\n"


def shown(value: object, key: str = "") -> str:
    """Return a value as the table for people shows it: six digits, yes and no, nothing for null but in `critical`."""
    if value is None:
        return "open" if key == "critical" or key.startswith("compared") else ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else one_line(str(value))


def json_parts(columns: Mapping[str, Column]) -> Iterator[str]:
    """Yield ``{"rows": [...]}``, a row a line; infinite numbers as "inf" and "-inf"."""
    yield '{"rows": ['
    encode = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode
    before = "\n  "
    for first, last in blocks(_count(columns)):
        parts = [list(map(_json_value, column.rows(first, last))) for column in columns.values()]
        rows = [encode(dict(zip(columns, row, strict=True))) for row in zip(*parts, strict=True)]
        if rows:
            yield before + ",\n  ".join(rows)
            before = ",\n  "
    yield "\n]}\n"


def _json_value(value: object) -> object:
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


def csv_parts(columns: Mapping[str, Column]) -> Iterator[str]:
    """Yield comma-separated values with a line of names: null is empty, truth is true or false, infinity inf."""
    for first, last in blocks(_count(columns)):
        buffer = io.StringIO()
        writer = csv.writer(buffer, lineterminator="\n")
        if first == 0:
            writer.writerow(columns)
        parts = [list(map(_csv_value, column.rows(first, last))) for column in columns.values()]
        writer.writerows(zip(*parts, strict=True))
        yield buffer.getvalue()


def _csv_value(value: object) -> object:
    if isinstance(value, bool):
        return "true" if value else "false"
    return value


def need_parquet() -> None:
    """Raise MissingExtraError where the library that writes Parquet is not installed."""
    try:
        import pyarrow as _  # noqa: F401, ICN001 - only whether it is there
    except ImportError as error:
        raise MissingExtraError(
            "Parquet must be written by pyarrow, which is not installed. Install it with: pip install 'ratherthan[parquet]'.",
            library="pyarrow",
        ) from error


def parquet_parts(columns: Mapping[str, Column]) -> Iterator[bytes]:
    """Yield a Parquet file with the same columns; it needs pyarrow."""
    need_parquet()
    import pyarrow as pa
    from pyarrow import parquet

    count = _count(columns)
    buffer = pa.BufferOutputStream()
    schema = pa.schema([(key, _parquet_type(key, pa)) for key in columns])
    with parquet.ParquetWriter(buffer, schema) as writer:
        for first, last in blocks(count, 1 << 17):
            arrays = [_parquet_array(columns[key], schema.field(key).type, first, last, pa) for key in columns]
            writer.write_table(pa.table(arrays, schema=schema))
    yield buffer.getvalue().to_pybytes()


def _parquet_type(key: str, pa: Any) -> Any:
    if key in ("state", "choice", "choice_index", "constrictiveness"):
        return pa.int64()
    if key in ("state_name", "action"):
        return pa.string()
    return pa.bool_() if key in ("critical", "taken") or key.startswith("compared") else pa.float64()


def _parquet_array(column: Column, kind: Any, first: int, last: int, pa: Any) -> Any:
    if column.names is not None or column.values.dtype == object:
        texts = [text.encode("utf-8", "backslashreplace").decode() for text in column.rows(first, last)]
        return pa.array(texts, type=kind)
    null = None if column.null is None else column.null[first:last]
    return pa.array(column.values[first:last], type=kind, mask=null)


def _count(columns: Mapping[str, Column]) -> int:
    return len(columns["state"].values)


def _named(column: Column) -> bool:
    return column.names is not None and column.names.named
