"""Every way to change one place of a JSON document: numbers, texts, flags, and items left out, doubled or swapped."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any, NamedTuple

from ratherthan.explain.record import digest, from_document
from ratherthan.narrate import narrate

Path = tuple[str | int, ...]


class Mutant(NamedTuple):
    """A changed document: where, how, and what came of it."""

    path: Path
    how: str
    document: dict[str, Any]

    @property
    def place(self) -> str:
        """The path without numbers of items and states: ``steps.*.claims.*.evidence.taken.value``."""
        return ".".join("*" if isinstance(part, int) or part.isdigit() else part for part in self.path)


def mutants(document: dict[str, Any]) -> Iterator[Mutant]:
    """Yield every mutant of a document; its digest and its text are left as they are."""
    for path, value in _places(document, ()):
        for how, changed in _changes(value):
            mutant = copy.deepcopy(document)
            _put(mutant, path, changed)
            yield Mutant(path, how, mutant)


def sealed(mutant: Mutant) -> Mutant:
    """Return the mutant with a digest that fits."""
    document = dict(mutant.document)
    document["digest"] = digest(document)
    return mutant._replace(document=document)


def retold(mutant: Mutant) -> Mutant | None:
    """Return the mutant with a text and a digest that fit; None where it cannot be told."""
    try:
        explanation, _ = from_document(mutant.document)
        document = dict(mutant.document) | {"text": narrate(explanation)}
    except Exception:  # noqa: BLE001 - a forger tries anything
        return None
    return sealed(mutant._replace(document=document))


def _places(value: Any, path: Path) -> Iterator[tuple[Path, Any]]:
    if path:
        yield path, value
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        if path or key not in ("digest", "text"):
            yield from _places(inner, (*path, key))


def _changes(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield other values for one place."""
    if isinstance(value, bool):
        yield "flipped", not value
        yield "open", None
    elif isinstance(value, int | float):
        yield "more", value + 1
        yield "less", value - 1
        if isinstance(value, float) and abs(value) > 1e-6:  # less may be rounding
            yield "a little more", value * 1.01
            yield "a little less", value * 0.99
        if isinstance(value, float) and value:
            yield "infinite", "inf"
    elif isinstance(value, str):
        yield "renamed", value + " indeed"
        yield "empty", ""
        if value == "inf":
            yield "finite", 7.0
    elif value is None:
        yield "zero", 0
        yield "true", True
    elif isinstance(value, list):
        if value:
            yield "last left out", value[:-1]
            yield "first left out", value[1:]
            yield "last doubled", [*value, value[-1]]
        if len(value) > 1 and value[0] != value[1]:
            yield "swapped", [value[1], value[0], *value[2:]]
    elif isinstance(value, dict):
        yield "nothing", {}
        for key in value:
            yield f"without {key}", {k: v for k, v in value.items() if k != key}


def _put(document: Any, path: Path, value: Any) -> None:
    for part in path[:-1]:
        document = document[part]
    document[path[-1]] = value
