"""The text of an archive's ``index.json`` enters; a checked header with every count, type and name in it leaves.

The header is what all else is measured against: the size of every binary member follows from its counts, so that a
member of another size is refused before a byte of it is read.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

from ratherthan.errors import SourceError

__all__ = ["Annotation", "Header", "Kind", "Valuations", "Variable", "bits_size", "parse_index"]

ENTITIES = ("states", "choices", "branches")
DEFAULT_BITS = {"bool": 1, "int": 64, "uint": 64, "double": 64, "string": 64, "rational": 128}
INTERVALS = {"int-interval": 128, "uint-interval": 128, "double-interval": 128, "rational-interval": 256}
ACRONYMS = {("stochastic", 0): "CTMC", ("stochastic", 1): "CTMDP", ("urgent-stochastic", 1): "Markov automaton"}


@dataclass(frozen=True, kw_only=True)
class Kind:
    """The type of a value: its name and its size in bits."""

    name: str
    bits: int


@dataclass(frozen=True, kw_only=True)
class Annotation:
    """A label or a reward: the folder it lies in, its name, what it applies to, its type."""

    folder: str
    name: str
    applies_to: tuple[str, ...]
    kind: Kind


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A state variable: where its bits lie in a record, and how they are read."""

    name: str
    kind: Kind
    at: int  # the first bit of the value in the record
    optional: bool = False  # then the bit before tells whether there is a value
    offset: int = 0  # added to what is stored


@dataclass(frozen=True, kw_only=True)
class Valuations:
    """The state valuations: for each class its variables and the size of a record in bytes."""

    classes: tuple[tuple[Variable, ...], ...]
    record_bytes: tuple[int, ...]
    strings: int | None  # how many strings there are, None where that is not said


@dataclass(frozen=True, kw_only=True)
class Header:
    """All that ``index.json`` says about a model that can be read."""

    players: int
    states: int
    initial_states: int
    choices: int
    choice_actions: int
    branches: int
    probability: Kind | None
    labels: tuple[Annotation, ...]
    rewards: tuple[Annotation, ...]
    valuations: Valuations | None
    notes: tuple[str, ...]

    def count(self, entity: str) -> int:
        """Return the number of ``"states"``, ``"choices"`` or ``"branches"``."""
        return {"states": self.states, "choices": self.choices, "branches": self.branches}[entity]


def bits_size(count: int) -> int:
    """Return the bytes that a set over `count` entities takes: one bit each, in words of 64."""
    return -(-count // 64) * 8


def parse_index(text: bytes, path: str) -> Header:
    """Return the header of an archive.

    Parameters
    ----------
    text : bytes
        The contents of ``index.json``.
    path : str
        How the archive is called in errors.

    Raises
    ------
    SourceError
        Where the index breaks the format, or describes a model that is no MDP or DTMC.
    """
    try:
        index = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise SourceError(
            f"index.json must be JSON in UTF-8, but that of '{path}' is not: {error}. Write the archive anew.",
            path=path,
        ) from error
    return _Reader(path).header(index)


class _Reader:
    """Takes an index apart; every fault names the archive and the place in the index."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.notes: list[str] = []

    def fail(self, must: str, came: object, remedy: str = "Write the archive anew.") -> NoReturn:
        shown = came if isinstance(came, str) and came else json.dumps(came, default=str)
        shown = shown if len(shown) <= 80 else shown[:77] + "…"
        raise SourceError(f"index.json of '{self.path}' must have {must}, got {shown}. {remedy}", path=self.path)

    def table(self, value: Any, where: str) -> Mapping[str, Any]:
        if not isinstance(value, dict):
            self.fail(f"an object at {where}", value)
        return value

    def items(self, value: Any, where: str) -> list[Any]:
        if not isinstance(value, list):
            self.fail(f"a list at {where}", value)
        return value

    def text(self, value: Any, where: str) -> str:
        if not isinstance(value, str):
            self.fail(f"a string at {where}", value)
        return value

    def whole(
        self, table: Mapping[str, Any], key: str, least: int = 0, *, most: int = 2**64 - 1, default: int | None = None
    ) -> int:
        value = table.get(key, default)
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            self.fail(f"a whole number from {least} to {most} at '{key}'", value if key in table else "nothing")
        return value

    def kind(self, value: Any, where: str) -> Kind:
        """Return a type, written ``{"type": …, "size": …}``; intervals are refused."""
        table = self.table(value, where)
        name = self.text(table.get("type"), f"{where}.type")
        name = "string" if name == "String" else name  # as Storm 2.0 spells it
        if name in INTERVALS:
            raise SourceError(
                f"Numbers must be single numbers, but '{self.path}' has intervals ({name}) at {where}. "
                "Give the model exact probabilities and rewards.",
                path=self.path,
            )
        if name not in DEFAULT_BITS:
            self.fail(f"one of the types {', '.join(DEFAULT_BITS)} at {where}", name)
        bits = self.whole(table, "size", 1, most=2**32 - 1, default=DEFAULT_BITS[name])
        if (name in ("double", "string") and bits != 64) or (name == "rational" and bits % 2):
            self.fail(f"a size that fits the type {name} at {where}", bits)
        return Kind(name=name, bits=bits)

    def number_kind(self, value: Any, where: str) -> Kind:
        """Return a type that annotations and probabilities may have: of its default size, or a wide rational."""
        kind = self.kind(value, where)
        fits = kind.bits % 128 == 0 if kind.name == "rational" else kind.bits == DEFAULT_BITS[kind.name]
        if not fits or kind.name == "string":
            self.fail(f"a number of its type's usual size at {where}", f"{kind.name} of {kind.bits} bits")
        return kind

    def header(self, index: Any) -> Header:
        index = self.table(index, "its top")
        version = self.whole(index, "format-version", most=2**32 - 1)
        if version != 1:
            self.fail("format-version 1", version, "Convert the archive to format 1, which Storm 2.0 writes.")
        system = self.table(index.get("transition-system"), "'transition-system'")
        players = self.kind_of_model(system)
        probability = system.get("branch-probability-type")
        if probability is not None:
            probability = self.number_kind(probability, "'branch-probability-type'")
            if probability.name not in ("double", "rational"):
                self.fail("double or rational as 'branch-probability-type'", probability.name)
        annotations = self.table(index.get("annotations", {}), "'annotations'")
        others = sorted(set(annotations) - {"aps", "rewards"})
        if others:
            self.notes.append(f"Annotations of other kinds were not read: {', '.join(others[:10])}.")
        valuations = self.table(index.get("valuations", {}), "'valuations'").get("states")
        described = self.valuations(valuations) if valuations is not None else None
        if self.whole(system, "#branch-actions", default=0):
            self.notes.append("Actions on branches were not read.")
        return Header(
            players=players,
            states=self.whole(system, "#states", 1),
            initial_states=self.whole(system, "#initial-states"),
            choices=self.whole(system, "#choices"),
            choice_actions=self.whole(system, "#choice-actions", most=2**32 - 1),
            branches=self.whole(system, "#branches"),
            probability=probability,
            labels=self.annotations(annotations, "aps"),
            rewards=self.annotations(annotations, "rewards"),
            valuations=described,
            notes=tuple(self.notes),
        )

    def kind_of_model(self, system: Mapping[str, Any]) -> int:
        """Return the number of players, 0 (DTMC) or 1 (MDP), and refuse all other kinds of model."""
        time = self.text(system.get("time"), "'time'")
        players = self.whole(system, "#players", most=2**32 - 1)
        if time not in ("discrete", "stochastic", "urgent-stochastic"):
            self.fail("'time' as discrete, stochastic or urgent-stochastic", time)
        reason = ""
        if time != "discrete":
            called = ACRONYMS.get((time, players), "model with continuous time")
            reason = f"a {called} (time '{time}'): its exit rates have no meaning in an MDP"
        elif players > 1:
            reason = f"a game of {players} players: a plan here is one player's"
        elif self.whole(system, "#observations", default=0):
            reason = "partially observable (a POMDP): a plan here sees the whole state"
        if reason:
            raise SourceError(
                f"A model must be an MDP or a DTMC, but '{self.path}' holds {reason}. Convert it to an MDP first.",
                path=self.path,
            )
        return players

    def annotations(self, groups: Mapping[str, Any], group: str) -> tuple[Annotation, ...]:
        """Return the labels (``aps``) or the rewards, by their alias where they have one."""
        found: dict[str, Annotation] = {}
        for key, value in self.table(groups.get(group, {}), f"'{group}'").items():
            where = f"'{group}'.'{key}'"
            table = self.table(value, where)
            if not key or "/" in key or key in (".", ".."):
                self.fail(f"plain identifiers in '{group}'", key)
            kind = self.number_kind(table.get("type"), where)
            if (group == "aps") != (kind.name == "bool"):
                self.fail(f"{'bool' if group == 'aps' else 'a number'} as the type of {where}", kind.name)
            applies = tuple(
                self.text(item, where) for item in self.items(table.get("applies-to"), f"{where}.'applies-to'")
            )
            allowed = ENTITIES if group == "rewards" else ENTITIES[:1]
            if not applies or not set(applies) <= set(allowed):
                self.fail(f"'applies-to' among {', '.join(allowed)} at {where}", list(applies))
            if "probability-type" in table:
                self.fail(f"one value per entity at {where}", "a distribution over values")
            name = self.text(table.get("alias", key), f"{where}.'alias'")
            if name in found:
                self.fail(f"each name once in '{group}'", name)
            found[name] = Annotation(folder=f"annotations/{group}/{key}", name=name, applies_to=applies, kind=kind)
        return tuple(found.values())

    def valuations(self, value: Any) -> Valuations:
        """Return where the bits of every state variable lie."""
        table = self.table(value, "'valuations'.'states'")
        classes, sizes = [], []
        for number, described in enumerate(self.items(table.get("classes"), "'valuations'.'states'.'classes'")):
            where = f"valuation class {number}"
            entries = self.items(self.table(described, where).get("variables"), where)
            variables, bits = self.variables(entries, where)
            if bits % 8:
                self.fail(f"records of whole bytes in {where}", f"{bits} bits")
            classes.append(variables)
            sizes.append(bits // 8)
        if not classes:
            self.fail("at least one valuation class", "none")
        strings = self.whole(table, "#strings", most=2**32 - 1) if "#strings" in table else None
        return Valuations(classes=tuple(classes), record_bytes=tuple(sizes), strings=strings)

    def variables(self, entries: list[Any], where: str) -> tuple[tuple[Variable, ...], int]:
        """Return the variables of one valuation class, and the size of its records in bits."""
        found: dict[str, Variable] = {}
        bits = 0
        for entry in entries:
            entry = self.table(entry, where)
            if "padding" in entry:
                bits += self.whole(entry, "padding", 1)
                continue
            name = self.text(entry.get("name"), f"'name' in {where}")
            if name in found:
                self.fail(f"each variable once in {where}", name)
            described = entry if isinstance(entry.get("type"), str) else entry.get("type")
            kind = self.kind(described, f"variable '{name}'")
            optional = entry.get("is-optional", False)
            if not isinstance(optional, bool):
                self.fail(f"true or false as 'is-optional' of variable '{name}'", optional)
            bits += optional
            offset = self.whole(entry, "offset", -(2**63), most=2**63 - 1, default=0)
            if kind.name in ("int", "uint") and kind.bits > 64:
                self.notes.append(f"The state variable '{name}' of {kind.bits} bits was not read: at most 64 are.")
            else:
                found[name] = Variable(name=name, kind=kind, at=bits, optional=optional, offset=offset)
            bits += kind.bits
        return tuple(found.values()), bits
