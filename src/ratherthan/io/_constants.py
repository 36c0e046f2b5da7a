"""The constants that a model declares and the texts given for them enter; a value for each undefined one leaves.

A constant that only properties mention need not be given: whoever uses such a property is told then.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from ratherthan.errors import PropertyError, SourceError
from ratherthan.model.formula import constant
from ratherthan.model.syntax import Term, parse_formula, text_of

__all__ = ["Constant", "Given", "Value", "chosen_values", "given_texts", "reachable_names", "text_of_value"]

Value = bool | int | float
Given = str | Mapping[str, str | Value] | None
_EXAMPLES: Mapping[str, str] = {"int": "3", "bool": "true", "double": "0.5"}
_WANTED: Mapping[str, str] = {"int": "a whole number", "bool": "true or false", "double": "a number"}
_WORD = re.compile(r"[^\W\d]\w*")
_COMMA = re.compile(r",(?![^(]*\))")  # none inside brackets, as in K=max(1,2)


@dataclass(frozen=True, kw_only=True)
class Constant:
    """A constant that a model declares; its kind is ``int``, ``bool`` or ``double``."""

    name: str
    kind: str
    defined: bool


def chosen_values(
    declared: Sequence[Constant], constants: Given, *, needed: Collection[str], shown: str
) -> dict[str, Value]:
    """Return the values of the undefined constants that were given, by name.

    Parameters
    ----------
    declared : sequence of Constant
    constants : str or mapping, optional
        ``"N=5,K=2"``, or values by name: numbers, truth values, or texts with expressions of numbers such as ``2*3``.
    needed : collection of str
        The names that the model itself depends on.
    shown : str
        How the source is called in errors.

    Raises
    ------
    SourceError
        If a needed constant is missing, or one was given that is unknown, already defined, or of another type.
    """
    given = given_texts(constants)
    by_name = {item.name: item for item in declared}
    values: dict[str, Value] = {}
    for name, text in given.items():
        item = by_name.get(name)
        if item is None:
            there = ", ".join(f"{other.name} ({other.kind})" for other in declared if not other.defined)
            raise SourceError(
                f"A constant must be one that '{shown}' leaves open: {there or 'it leaves none open'}; got '{name}'.",
                path=shown,
                constant=name,
            )
        if item.defined:
            raise SourceError(
                f"A constant must be one that '{shown}' leaves open, but '{name}' is defined there. Change it in the model.",
                path=shown,
                constant=name,
            )
        values[name] = _value(item, text, shown)
    missing = [item for item in declared if not item.defined and item.name in needed and item.name not in values]
    if missing:
        listed = ", ".join(f"{item.name} ({item.kind})" for item in missing)
        example = ",".join(
            f"{item.name}={given.get(item.name, _EXAMPLES[item.kind])}"
            for item in declared
            if item in missing or item.name in values
        )
        raise SourceError(
            f"Every constant of '{shown}' must have a value, but these have none: {listed}. "
            f"Give them, for example --constants {example}.",
            path=shown,
            constants=tuple(item.name for item in missing),
        )
    return values


def given_texts(constants: Given) -> dict[str, str]:
    """Return the constants that were given as texts by name; SourceError for what is not like ``N=5,K=2``."""
    if constants is None:
        return {}
    if not isinstance(constants, str):
        return {
            str(name): text_of_value(value) if isinstance(value, Value) else str(value)
            for name, value in constants.items()
        }
    texts: dict[str, str] = {}
    for part in _COMMA.split(constants):
        name, equals, text = (piece.strip() for piece in part.partition("="))
        if not equals or not _WORD.fullmatch(name) or not text:
            raise SourceError(f"Constants must be given as N=5,K=2, got '{constants}'.", constants=constants)
        if name in texts:
            raise SourceError(
                f"A constant must be given once, but '{name}' stands twice in '{constants}'.", constant=name
            )
        texts[name] = text
    return texts


def _value(item: Constant, text: str, shown: str) -> Value:
    """Read the value of one constant."""
    try:
        term = parse_formula(text.strip(), f"value of constant '{item.name}'")
        value: Value = bool(term.value) if term.op == "truth" else constant(term)
    except PropertyError:
        value = float("nan")
    fits = {
        "bool": isinstance(value, bool),
        "int": not isinstance(value, bool) and abs(value) < 2**53 and float(value).is_integer(),
        "double": not isinstance(value, bool) and abs(value) < float("inf"),
    }
    if not fits[item.kind]:
        raise SourceError(
            f"The constant '{item.name}' of '{shown}' must be {_WANTED[item.kind]}, got '{text}'. "
            f"Give it, for example --constants {item.name}={_EXAMPLES[item.kind]}.",
            path=shown,
            constant=item.name,
        )
    return int(value) if item.kind == "int" else value


def text_of_value(value: Value) -> str:
    """Return a value as a PRISM expression."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not abs(value) < float("inf"):
        return str(value)
    number = Term("number", value=abs(value))
    return text_of(number if value >= 0 else Term("neg", (number,)))


def reachable_names(roots: Iterable[str], definitions: Mapping[str, str]) -> set[str]:
    """Return the names that the texts `roots` mention, also through `definitions`."""
    found: set[str] = set()
    texts = list(roots)
    while texts:
        for name in _WORD.findall(texts.pop()):
            if name not in found:
                found.add(name)
                if name in definitions:
                    texts.append(definitions[name])
    return found
