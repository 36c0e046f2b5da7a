"""The tables of a road map enter (kinds, chances, costs, labels, words), checked data leave: everything but drawings."""

from __future__ import annotations

import re
import string
import unicodedata
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ratherthan.errors import PropertyError
from ratherthan.io._roadmap_text import Document, Keys, closest, quoted_list
from ratherthan.model.lexicon import OBJECTIVE_WORDS, Lexicon
from ratherthan.model.mdp import Bools, Floats, Reward
from ratherthan.model.weights import canonical_reward

__all__ = ["ACTIONS", "DIRECTIONS", "STANDARD_KINDS", "Kind", "Legend", "cell_number", "words"]

DIRECTIONS = ("north", "east", "south", "west")
ACTIONS = (*DIRECTIONS, "stay")
STREET_CHARACTERS = "^>v<+-|"
TOP_KEYS = (
    *("title", "note", "success", "drift", "order", "start", "property", "map", "streets"),
    *("kinds", "moves", "costs", "labels", "properties", "words"),
)
MOST = 1e300
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Kind:
    """A kind of ground: whether moves may enter its cells, and leave them."""

    name: str
    enter: bool = True
    leave: bool = True


STANDARD_KINDS = {
    "S": Kind("start"),
    "D": Kind("destination", leave=False),
    "#": Kind("building", enter=False, leave=False),
    "x": Kind("dead end", leave=False),
    ".": Kind("urban road"),
    "=": Kind("highway"),
}


@dataclass(frozen=True)
class Legend:
    """The kinds of a map, and which character draws which: `index[character]` points into `kinds`."""

    kinds: tuple[Kind, ...]
    index: Mapping[str, int]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the kinds."""
        return tuple(kind.name for kind in self.kinds)

    def mask(self, kind_of_cell: np.ndarray[Any, Any], name: str) -> Bools:
        """Return which cells are of the kind with this name."""
        return np.asarray(kind_of_cell == self.names.index(name))


def check_keys(document: Document, table: Mapping[str, Any], known: Collection[str], keys: Keys = ()) -> None:
    """Refuse keys that nobody reads."""
    for key in table:
        if key in known:
            continue
        where = f"[{'.'.join(keys)}]" if keys else "the file"
        hint = closest(key, known)
        if keys and key in TOP_KEYS:
            hint = f" '{key}' belongs above the first [section]."
        document.fail(f"The keys of {where} must be among {quoted_list(known)}, got '{key}'.{hint}", (*keys, key))


def table_of(document: Document, keys: Keys, parent: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a table, an empty one where there is none."""
    value = (document.tables if parent is None else parent).get(keys[-1], {})
    if not isinstance(value, dict):
        document.fail(f"'{keys[-1]}' must be a section, [{'.'.join(keys)}], got {spelled(value)}.", keys)
    return value


def text_of(document: Document, keys: Keys, value: Any) -> str:
    """Return a string that can be printed on one line."""
    if not isinstance(value, str):
        document.fail(f"'{keys[-1]}' must be a text in quotes, got {spelled(value)}.", keys)
    for character in value:
        if unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp"):
            document.fail(
                f"'{keys[-1]}' must be one line without control characters, got U+{ord(character):04X}.", keys
            )
    return value


def spelled(value: Any) -> str:
    """Return a value as an author would recognise it."""
    if isinstance(value, str):
        return f"'{value}'" if len(value) < 40 else f"'{value[:40]}…'"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a section" if len(value) != 1 else f"a section with the key '{next(iter(value))}'"
    shown = str(value) if not isinstance(value, int) or abs(value) < 10**30 else "a very long number"
    return shown if len(shown) < 60 else f"{shown[:60]}…"


def legend_of(document: Document) -> Legend:
    """Return the standard legend, extended by the section [kinds]."""
    kinds = {kind.name: kind for kind in STANDARD_KINDS.values()}
    characters = {character: kind.name for character, kind in STANDARD_KINDS.items()}
    own = table_of(document, ("kinds",))
    for character, value in own.items():
        keys = ("kinds", character)
        if len(character) != 1 or not character.isprintable() or character == " " or character in STREET_CHARACTERS:
            document.fail(
                f"A kind must be drawn by one character, not a blank and none of {STREET_CHARACTERS}, got '{character}'.",
                keys,
            )
        kind = _kind(document, keys, value, kinds)
        kinds[kind.name] = kind
        characters[character] = kind.name
    if len(kinds) > 200:
        document.fail(f"There must be at most 200 kinds of ground, got {len(kinds)}.", ("kinds",))
    place = {name: i for i, name in enumerate(kinds)}
    return Legend(tuple(kinds.values()), {character: place[name] for character, name in characters.items()})


def _kind(document: Document, keys: Keys, value: Any, known: Mapping[str, Kind]) -> Kind:
    """Return the kind that an entry of [kinds] describes: a name, or a table with name, enter and leave."""
    table = value if isinstance(value, dict) else {"name": value}
    check_keys(document, table, ("name", "enter", "leave"), keys)
    name = text_of(document, (*keys, "name"), table.get("name", ""))
    if not name.strip() or name == "other":
        document.fail(f"A kind must have a name (and not 'other', the word for all the rest), got '{name}'.", keys)
    flags = {key: table[key] for key in ("enter", "leave") if key in table}
    for key, flag in flags.items():
        if not isinstance(flag, bool):
            document.fail(f"'{key}' must be true or false, got {spelled(flag)}.", (*keys, key))
    enter = flags.get("enter", True)
    kind = Kind(name, enter=enter, leave=flags.get("leave", enter))
    if name not in known:
        return kind
    if flags and kind != known[name]:
        document.fail(
            f"A kind must be entered and left alike wherever it is named, but '{name}' is known otherwise. "
            "Give this kind a name of its own.",
            keys,
        )
    return known[name]


def per_kind(document: Document, keys: Keys, value: Any, legend: Legend, needed: Bools) -> Floats:
    """Return a number per kind, from one number or a table of kinds and ``other``; 0 where none is needed.

    Parameters
    ----------
    document, keys, value
        Where the value stands, and the value.
    legend : Legend
    needed : array of bool, ``[K]``
        The kinds that must be given a number: those that moves may leave, on this map.
    """
    if not isinstance(value, dict):
        return np.full(len(legend.kinds), number_of(document, keys, value))
    names = legend.names
    check_keys(document, value, (*names, "other"), keys)
    given = {name: number_of(document, (*keys, name), number) for name, number in value.items()}
    missing = [name for name, need in zip(names, needed, strict=True) if need and name not in given]
    if missing and "other" not in given:
        document.fail(
            f"'{keys[-1]}' must have a number for every kind of ground on the map, but '{missing[0]}' has none. "
            "Add it, or add other = … for all the rest.",
            keys,
        )
    return np.array([given.get(name, given.get("other", 0.0)) for name in names], dtype=np.float64)


def number_of(document: Document, keys: Keys, value: Any) -> float:
    """Return a finite number ≥ 0."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        document.fail(f"'{keys[-1]}' must be a number, got {spelled(value)}.", keys)
    if not 0 <= value <= MOST:  # NaN is refused, too
        document.fail(f"'{keys[-1]}' must be a finite number, 0 or more, got {spelled(value)}.", keys)
    return abs(float(value))  # no negative zero


def identifier(document: Document, keys: Keys, what: str) -> str:
    """Return the last key, which properties must be able to name."""
    name = keys[-1]
    if not _IDENTIFIER.fullmatch(name) or name in ("init", "deadlock"):
        document.fail(
            f"The name of a {what} must be made of letters, digits and _, begin with a letter, and not be init or deadlock, "
            f"got '{name}'.",
            keys,
        )
    return name


def cell_number(document: Document, keys: Keys, value: Any, cells: int) -> int:
    """Return the number of a cell, from a key or a value."""
    plain = isinstance(value, int) and not isinstance(value, bool)
    if isinstance(value, str) and value.isascii() and value.isdigit() and len(value) < 18:
        value, plain = int(value), True
    if not plain or not 0 <= value < cells:
        document.fail(
            f"A cell must be a number from 0 to {cells - 1} (row by row from the top left), got {spelled(value)}.", keys
        )
    return int(value)


def labels_of(document: Document, legend: Legend, kind_of_cell: np.ndarray[Any, Any]) -> dict[str, Bools]:
    """Return the labels: ``destination``, and those of the section [labels] as lists of kinds and cells."""
    labels = {"destination": legend.mask(kind_of_cell, "destination")}
    for name, value in table_of(document, ("labels",)).items():
        keys = ("labels", name)
        if identifier(document, keys, "label") == "destination":
            document.fail(
                "The label 'destination' is given by the map (its cells D) and must not be given again.", keys
            )
        mask = np.zeros(len(kind_of_cell), dtype=bool)
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, str) and not part.isdigit():
                if part not in legend.names:
                    document.fail(
                        f"A label must list kinds of ground ({quoted_list(legend.names)}) and numbers of cells, "
                        f"got '{part}'.{closest(part, legend.names)}",
                        keys,
                    )
                mask |= legend.mask(kind_of_cell, part)
            else:
                mask[cell_number(document, keys, part, len(mask))] = True
        labels[name] = mask
    return labels


def words(document: Document, cells: int, costs: Collection[str]) -> Lexicon:
    """Return the lexicon: the section [words] over the words for moves on a grid."""
    table = table_of(document, ("words",))
    check_keys(document, table, ("language", "state", "actions", "gerunds", "cells", "objectives"), ("words",))
    phrases = {
        key: {
            inner: text_of(document, ("words", key, inner), phrase)
            for inner, phrase in table_of(document, ("words", key), table).items()
        }
        for key in ("actions", "gerunds", "cells")
    }
    for key in ("actions", "gerunds"):
        check_keys(document, phrases[key], ACTIONS, ("words", key))
    named: dict[str, str] = {}
    for cell, phrase in phrases["cells"].items():
        keys = ("words", "cells", cell)
        number = str(cell_number(document, keys, cell, cells))
        if number in named:
            document.fail(f"A cell must have one name, got a second one for cell {number}.", keys)
        named[number] = phrase
    state = text_of(document, ("words", "state"), table.get("state", "grid {number}"))
    _check_state_phrase(document, state)
    return Lexicon(
        language=text_of(document, ("words", "language"), table.get("language", "en")),
        actions={**{d: f"move {d}" for d in DIRECTIONS}, "stay": "stay", **phrases["actions"]},
        gerunds=phrases["gerunds"],
        state=state,
        states=named,
        objectives=_objectives(document, table, costs),
    )


def _objectives(document: Document, table: dict[str, Any], costs: Collection[str]) -> dict[str, dict[str, str]]:
    """Return the words of the objectives, those of weighted sums of rewards under the sum in its one spelling."""
    section = table_of(document, ("words", "objectives"), table)
    single = (*costs, "steps", "probability", "safety", "risk")
    known = {name: name for name in single if name in section}
    for name in [name for name in section if name not in known]:
        try:
            known[name] = canonical_reward(name, dict.fromkeys(costs, Reward())) or ""
        except PropertyError as error:
            document.fail(error.message, ("words", "objectives", name))
        if not known[name]:
            check_keys(document, {name: None}, single, ("words", "objectives"))
        if list(known.values()).count(known[name]) > 1:
            document.fail(
                f"An objective must have its words once, got '{known[name]}' twice.", ("words", "objectives", name)
            )
    return {known[name]: _objective_words(document, name, section) for name in section}


def _objective_words(document: Document, name: str, objectives: dict[str, Any]) -> dict[str, str]:
    keys = ("words", "objectives", name)
    table = table_of(document, keys, objectives)
    check_keys(document, table, OBJECTIVE_WORDS, keys)
    return {key: text_of(document, (*keys, key), value) for key, value in table.items()}


def _check_state_phrase(document: Document, phrase: str) -> None:
    try:
        fields = [part[1:] for part in string.Formatter().parse(phrase) if part[1] is not None]
    except ValueError:
        fields = [("{", "", None)]
    if any(name not in ("number", "name") or spec or conversion for name, spec, conversion in fields):
        document.fail(
            f"'state' must be a phrase with {{number}} or {{name}} in it and no other braces, got '{phrase}'.",
            ("words", "state"),
        )
