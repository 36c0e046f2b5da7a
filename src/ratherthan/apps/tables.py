"""Columns enter, a table for people, JSON, CSV or Parquet leaves in parts."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ratherthan.apps.columns import Column, blocks, state_names
from ratherthan.apps.door import one_line
from ratherthan.apps.spelling import csv_parts, json_parts
from ratherthan.errors import MissingExtraError
from ratherthan.model.watch import look

__all__ = ["aligned", "csv_parts", "json_parts", "need_parquet", "parquet_parts", "parts_of", "shown", "table_parts"]

EXACT = ("choice_index", "lower", "upper")
"""Columns that the table for people leaves out: they say more than six digits do."""


def parts_of(form: str, columns: Mapping[str, Column]) -> Iterator[str] | Iterator[bytes | bytearray]:
    """Return the parts of a table as ``"table"``, ``"json"``, ``"csv"`` or ``"parquet"``."""
    if form == "parquet":
        return parquet_parts(columns)
    if form == "table":
        return table_parts(columns)
    return json_parts(columns) if form == "json" else csv_parts(columns)


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


def need_parquet() -> None:
    """Raise MissingExtraError where the library that writes Parquet is not installed."""
    try:
        import pyarrow as _  # noqa: F401, ICN001 - only whether it is there
    except ImportError as error:
        raise MissingExtraError(
            "Parquet must be written by pyarrow, which is not installed. Install it with: pip install 'ratherthan[parquet]'.",
            library="pyarrow",
        ) from error


def parquet_parts(columns: Mapping[str, Column]) -> Iterator[bytes | bytearray]:
    """Yield a Parquet file with the same columns, as it is made; it needs pyarrow."""
    need_parquet()
    import pyarrow as pa
    from pyarrow import parquet

    schema = pa.schema([(key, _parquet_type(key, pa)) for key in columns])
    made = _Made()
    repeating = [key for key, column in columns.items() if column.names is not None or column.words is not None]
    with parquet.ParquetWriter(pa.PythonFile(made, mode="w"), schema, use_dictionary=repeating) as writer:
        for first, last in blocks(_count(columns), 1 << 17):
            look()
            arrays = [_parquet_array(columns[key], schema.field(key).type, first, last, pa) for key in columns]
            writer.write_table(pa.table(arrays, schema=schema))
            yield made.taken()
    yield made.taken()


class _Made(io.RawIOBase):
    """What a writer has made and nobody has taken yet."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def writable(self) -> bool:
        """Whether it can be written to."""
        return True

    def write(self, data: Any) -> int:
        """Keep some bytes."""
        self._parts.append(bytes(data))
        return len(self._parts[-1])

    def taken(self) -> bytes:
        """Return what was made, and forget it."""
        made = b"".join(self._parts)
        self._parts.clear()
        return made


def _parquet_type(key: str, pa: Any) -> Any:
    if key in ("state", "choice", "choice_index", "constrictiveness"):
        return pa.int64()
    if key in ("state_name", "action"):
        return pa.string()
    return pa.bool_() if key in ("critical", "taken") or key.startswith("compared") else pa.float64()


def _parquet_array(column: Column, kind: Any, first: int, last: int, pa: Any) -> Any:
    values = column.values[first:last]
    if column.names is not None or column.words is not None:
        return _parquet_texts(column, values, kind, pa)
    null = None if column.null is None else column.null[first:last]
    return pa.array(values, type=kind, mask=null)


def _parquet_texts(column: Column, values: Any, kind: Any, pa: Any) -> Any:
    """Return names or words, each that follows itself made once."""
    if column.words is not None:
        used, at = np.unique(values, return_inverse=True)
        texts = [column.words[code] for code in used.tolist()]
    else:
        begins = np.append(True, values[1:] != values[:-1])[: len(values)]
        at = np.cumsum(begins) - 1
        texts = state_names(column.names, values[begins]) if column.names is not None else []
    return (
        pa.array([text.encode("utf-8", "backslashreplace") for text in texts], type=pa.binary())
        .cast(kind)
        .take(pa.array(at))
    )


def _count(columns: Mapping[str, Column]) -> int:
    return len(columns["state"].values)


def _named(column: Column) -> bool:
    return column.names is not None and column.names.named
