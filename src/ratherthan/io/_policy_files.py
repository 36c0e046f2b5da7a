"""A policy's file enters (JSON, CSV or .npy); an array, a mapping or rows of state, action and probability leave."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ratherthan.errors import PolicyError
from ratherthan.io._files import open_source
from ratherthan.io._npy import array_from

__all__ = ["SUM_TOLERANCE", "Row", "Rows", "mapping_rows", "read_policy_file"]

SUM_TOLERANCE = 1e-6
"""How far the probabilities of a state may be from 1 in a file; what is nearer is rescaled to 1."""

Row = tuple[Any, Any, float]
"""A state, an action, and its probability: NaN where it is certain."""


class Rows(list[Row]):
    """What a policy says, row by row."""


def read_policy_file(path: str | os.PathLike[str], what: str) -> Any:
    """Return an array, a mapping or a table from a file: told by its suffix, else by its contents."""
    suffix = Path(path).suffix.lower()
    with open_source(path, "a policy") as file:
        if file.read(6) == b"\x93NUMPY":
            file.seek(0)
            try:
                return array_from(file, os.fstat(file.fileno()).st_size, os.fspath(path))
            except (ValueError, EOFError, OverflowError) as error:
                raise PolicyError(f"{what} must be a whole .npy file, but it is not: {error}. Save it anew.") from error
        file.seek(0)
        data = file.read()
    if suffix in (".npy", ".npz"):
        raise PolicyError(f"{what} must be a NumPy file of one array (.npy), but it is none. Save it with numpy.save.")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PolicyError(f"{what} must be text in UTF-8 or a .npy file, but it is neither.") from error
    if "\x00" in text:
        raise PolicyError(f"{what} must be text in UTF-8 or a .npy file, but it is binary.")
    if suffix == ".json" or (suffix != ".csv" and text.lstrip().startswith(("{", "["))):
        return _json(text, what)
    return _csv_rows(text, what)


def _json(text: str, what: str) -> Any:
    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        table = dict(pairs)
        if len(table) < len(pairs):
            seen: set[str] = set()
            twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
            raise PolicyError(f"{what} must say each thing once, but '{twice}' is there twice. Remove one.")
        return table

    try:
        return json.loads(text, object_pairs_hook=once)
    except (ValueError, RecursionError) as error:
        raise PolicyError(f'{what} must be JSON like {{"10": "east"}}, but it cannot be read: {error}.') from error


def mapping_rows(source: Mapping[Any, Any], what: str) -> Rows:
    """Return state, action and probability out of a mapping."""
    rows = Rows()
    for state, said in source.items():
        if isinstance(said, Mapping):
            if not said:
                raise PolicyError(f"{what} must give an action at state {state!r}, got none. Leave the state out.")
            rows += [(state, action, _probability(chance, state, what)) for action, chance in said.items()]
        else:
            rows.append((state, said, np.nan))
    return rows


def _probability(given: Any, state: Any, what: str) -> float:
    number = isinstance(given, int | float | np.integer | np.floating) and not isinstance(given, bool)
    if not number or not 0 <= given <= 1 + SUM_TOLERANCE:
        raise PolicyError(f"{what} must give probabilities between 0 and 1, got {given!r} at state {state!r}.")
    return float(given)


def _csv_rows(text: str, what: str) -> Rows:
    """Return state, action and probability out of a CSV file; NaN where no probability is given."""
    reader = csv.reader(io.StringIO(text), strict=True, skipinitialspace=True)
    rows = Rows()
    columns: dict[str, int] | None = None
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if not any(cells):
                continue
            where = f"{what}, line {reader.line_num}:"
            if columns is None:
                columns = _columns(cells, where)
                if columns["header"]:
                    continue
            rows.append(_csv_row(cells, columns, where))
    except csv.Error as error:
        raise PolicyError(f"{what}, line {reader.line_num}: a CSV row cannot be read: {error}.") from error
    if not rows:
        raise PolicyError(f"{what} must list states and their actions, but it lists none.")
    return rows


def _columns(cells: list[str], where: str) -> dict[str, int]:
    """Return which column is which, from the first row: a header, or two or three cells in the usual order."""
    known = ["state", "action", "probability"]
    lower = [cell.lower() for cell in cells]
    header = {"state", "action"} <= set(lower)
    if header and (len(set(lower)) < len(lower) or not set(lower) <= set(known)):
        raise PolicyError(
            f"{where} the columns must be {', '.join(known)} (the last may be missing), got {', '.join(cells)}."
        )
    order = lower if header else known[: len(cells)]
    if not header and not 2 <= len(cells) <= 3:
        raise PolicyError(
            f"{where} a row must have a state and an action, and may have a probability; got {len(cells)} cells."
        )
    return {name: order.index(name) for name in order} | {"header": int(header), "count": len(cells)}


def _csv_row(cells: list[str], columns: dict[str, int], where: str) -> Row:
    if len(cells) != columns["count"]:
        raise PolicyError(
            f"{where} a row must have {columns['count']} cells like the first, got {len(cells)}. "
            "Put names with commas in double quotes."
        )
    state, action = cells[columns["state"]], cells[columns["action"]]
    if "probability" not in columns:
        return state, action, np.nan
    try:
        chance = float(cells[columns["probability"]])
    except ValueError:
        raise PolicyError(f"{where} a probability must be a number, got '{cells[columns['probability']]}'.") from None
    return state, action, _probability(chance, state, where)
