"""Comments in which Storm tells a state's variables enter; names of states leave, or none where they tell nothing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.model.names import StateNames

__all__ = ["comments_of", "names_of"]

WHOLE = re.compile(r"[+-]?\d{1,20}")
PLAIN = re.compile(r"[^\s&=!\[\]][^\s&=\[\]]*")
Column = npt.NDArray[Any]


def names_of(valuations: Sequence[tuple[int, bytes]], states: int) -> StateNames:
    """Return names out of comments ``x=1 & !done``.

    Storm leaves out the name of a variable that is true; it is the one that it has where it is false. A variable that is
    true in every state then has no name at all, and tells nothing.

    Parameters
    ----------
    valuations : sequence of (int, bytes)
        A state and what is said of it.
    states : int

    Returns
    -------
    StateNames
        Without any name where a state has no comment, or the comments do not agree on their variables.
    """
    nameless = StateNames(count=states)
    if [state for state, _ in valuations] != list(range(states)):
        return nameless
    try:
        rows = [re.split(r"\s*&\s*", text.decode("utf-8").strip()) for _, text in valuations]
    except UnicodeDecodeError:
        return nameless
    if len({len(row) for row in rows}) != 1:
        return nameless
    columns: dict[str, Column] = {}
    for cells in zip(*rows, strict=True):
        found = _column(cells)
        if found is None or found[0] in columns:
            return nameless
        if found[0]:
            columns[found[0]] = found[1]
    return StateNames(count=states, variables=columns) if columns else nameless


def _column(cells: Iterable[str]) -> tuple[str, Column] | None:
    """Return the name and the values of one variable; an empty name where it has none, None where they do not agree."""
    cells = list(cells)
    read = {cell: _cell(cell) for cell in set(cells)}
    names = {name for name, _ in read.values()} - {""}
    values = {cell: value for cell, (_, value) in read.items()}
    kinds = {type(value) for value in values.values()}
    if len(names) > 1 or (len(kinds) > 1 and kinds != {int, float}) or str in kinds:
        return None
    try:
        dtype = {bool: np.bool_, int: np.int64}.get(kinds.pop(), np.float64) if len(kinds) == 1 else np.float64
        column: Column = np.array([values[cell] for cell in cells], dtype=dtype)
    except OverflowError:
        if min(values.values()) < 0 or max(values.values()) >= 2**64:
            return None
        column = np.array([values[cell] for cell in cells], dtype=np.uint64)
    return (names.pop() if names else ""), column


def _cell(cell: str) -> tuple[str, Any]:
    """Return name and value of ``x=1``, ``!done``, ``done`` or nothing; a str as value where it is none of these."""
    name, equals, value = cell.partition("=")
    if not equals:
        return cell.removeprefix("!"), not cell.startswith("!")
    if WHOLE.fullmatch(value):
        return name, int(value)
    try:
        return name, float(value)
    except ValueError:
        return name, value


def comments_of(variables: Mapping[str, Column], states: int) -> list[str] | None:
    """Return such a comment for every state, or None where a variable cannot be told so: text, or a strange name."""
    columns = []
    for name, column in variables.items():
        column = np.asarray(column)
        if not PLAIN.fullmatch(name) or column.dtype.kind not in "biuf":
            return None
        if column.dtype.kind == "f" and not np.isfinite(column).all():
            return None
        if column.dtype.kind == "b":
            columns.append([name if value else f"!{name}" for value in column.tolist()])
        else:
            columns.append([f"{name}={value!r}" for value in column.tolist()])
    if not columns:
        return None
    comments = ["//[" + "\t& ".join(cells) + "]" for cells in zip(*columns, strict=True)]
    return comments if len(comments) == states else None
