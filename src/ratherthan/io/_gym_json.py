"""A file with an environment's table in JSON enters, its table and what it says of the environment leave.

The file is an object, packed by gzip or not::

    {"env_id": "FrozenLake-v1", "kwargs": {"map_name": "4x4"},           what it is: may be left out
     "nS": 16, "nA": 4, "P": [[[[1.0, 4, 0.0, false]], …], …],           the table, by state and action
     "initial_state_distribution": {"0": 1.0},                           or "initial": 0; without both, any state
     "actions": ["left", …], "states": [{"row": 0, "col": 0}, …]}        names: may be left out
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from ratherthan.errors import SourceError
from ratherthan.io._files import Limits, open_source
from ratherthan.io._gym_entries import Numbers, Table, table_from
from ratherthan.io._unpacking import CHUNK, UnpackedStream, packing_of

__all__ = ["Stored", "is_table", "read_stored"]

KEYS = re.compile(rb'"(nS|P)"\s*:')


def is_table(head: bytes) -> bool:
    """Tell from the first bytes of a file, packed by gzip or not, whether it is an environment's table."""
    import zlib

    if packing_of(head) == "gzip":
        try:
            head = zlib.decompressobj(wbits=31).decompress(head, CHUNK)
        except zlib.error:
            return False
    return (
        head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")
        and b'"jani-version"' not in head
        and KEYS.search(head) is not None
    )


@dataclass(frozen=True, kw_only=True)
class Stored:
    """What a file says: a table, and what environment it is of.

    Parameters
    ----------
    table : Table
    initial : array of int, optional
        None where the file names no initial state.
    name : str
        The environment's name, empty where it is not said.
    facts : mapping
        Its arguments.
    actions : tuple of str
        Empty where they are not named.
    states : tuple of mapping
        What each state is, empty where it is not said.
    """

    table: Table
    initial: Numbers | None
    name: str
    facts: Mapping[str, Any]
    actions: tuple[str, ...]
    states: tuple[Mapping[str, Any], ...]


def read_stored(path: str | os.PathLike[str], limits: Limits | None = None) -> Stored:
    """Read a table from a file.

    Raises
    ------
    SourceError
        Where the file is missing or damaged, is no JSON, or is not of the form above.
    """
    shown = os.fspath(path)
    document = _document(path, limits or Limits(), shown)
    states, actions = (_count(document, key, shown) for key in ("nS", "nA"))
    if "P" not in document:
        _fail(shown, "a table at 'P'", "none")
    table = table_from(document["P"], shown, states=states, actions=actions)
    kwargs, name = document.get("kwargs") or {}, document.get("env_id") or ""
    if not isinstance(kwargs, dict):
        _fail(shown, "an object at 'kwargs'", kwargs)
    if not isinstance(name, str):
        _fail(shown, "a string at 'env_id'", name)
    names = document.get("actions") or []
    if (
        not isinstance(names, list)
        or not all(isinstance(item, str) for item in names)
        or len(names) not in (0, actions)
    ):
        _fail(shown, f"{actions} names at 'actions'", names)
    called = document.get("states") or []
    if (
        not isinstance(called, list)
        or not all(isinstance(item, dict) for item in called)
        or len(called) not in (0, states)
    ):
        _fail(shown, f"{states} objects at 'states'", called)
    return Stored(
        table=table,
        initial=_initial(document, states, shown),
        name=name,
        facts=kwargs,
        actions=tuple(names),
        states=tuple(called),
    )


def _document(path: str | os.PathLike[str], limits: Limits, shown: str) -> dict[str, Any]:
    """Return the object in the file."""
    data = bytearray()
    with open_source(path) as file:
        stream = UnpackedStream(file, limits, shown)
        while part := stream.read(CHUNK):
            data += part
            limits.check_bytes(len(data), shown)
    try:
        document = json.loads(data.decode("utf-8-sig"), parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise SourceError(
            f"A table must be JSON in UTF-8, but '{shown}' is not: {error}. Write the file anew.", path=shown
        ) from error
    if not isinstance(document, dict):
        _fail(shown, "an object with nS, nA and P", document)
    return document


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"numbers must be finite, got {name}")


def _count(document: Mapping[str, Any], key: str, shown: str) -> int:
    value = document.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 < value < 2**31:
        _fail(shown, f"a whole number above 0 at '{key}'", value)
    return value


def _initial(document: Mapping[str, Any], states: int, shown: str) -> Numbers | None:
    """Return the initial states: those of positive probability, or those listed."""
    given = document.get("initial_state_distribution", document.get("initial"))
    if given is None:
        return None
    if "initial_state_distribution" in document:
        if isinstance(given, list) and len(given) == states:
            given = dict(enumerate(given))
        if not isinstance(given, dict) or not all(_chance(value) for value in given.values()):
            _fail(shown, "probabilities by state at 'initial_state_distribution'", given)
        try:
            listed = [int(key) for key, value in given.items() if value > 0]
        except ValueError:
            _fail(shown, "numbers of states at 'initial_state_distribution'", list(given))
    else:
        listed = given if isinstance(given, list) else [given]
    if not listed or not all(
        isinstance(state, int) and not isinstance(state, bool) and 0 <= state < states for state in listed
    ):
        _fail(shown, f"initial states in 0 … {states - 1}", listed)
    return np.array(sorted(set(listed)), dtype=np.int64)


def _chance(value: Any) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float) and 0 <= value <= 1


def _fail(shown: str, must: str, came: Any) -> NoReturn:
    text = repr(came)
    text = text if len(text) <= 60 else text[:57] + "…"
    raise SourceError(f"A table of an environment must have {must}, but '{shown}' has {text}.", path=shown)
