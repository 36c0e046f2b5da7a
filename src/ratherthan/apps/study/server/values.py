"""What a browser sent enters, values that a screen can record leave; everything else is refused by place and kind.

Nothing that came is ever repeated in the refusal: it may be no text at all, or too long, or somebody's name.
"""

from __future__ import annotations

import json
import math
import unicodedata
from collections.abc import Mapping
from typing import Any

from ratherthan.apps.study.design.nouns import Record, Screen
from ratherthan.apps.study.server.refusals import RefusedError

__all__ = ["LONGEST_TEXT", "all_correct", "body_of", "checked_values", "clean_text", "whole_number"]

Value = str | int | float | bool
LONGEST_TEXT = 4000
"""Characters of a free text whose record names no length."""
DEEPEST = 20
NAMES = ("attempt", "code", "erase", "hidden_ms", "platform", "screen", "time_ms", "token", "values")
"""Places that a refusal may name: others come from whoever sent them."""
LARGEST = 2**53


def body_of(raw: bytes) -> dict[str, Any]:
    """Return the object in a body of JSON.

    Parameters
    ----------
    raw : bytes

    Raises
    ------
    RefusedError
        Where it is none, or holds numbers that are none (NaN, 1e999), a key twice, control characters or half characters.
    """
    try:
        document = json.loads(
            raw.decode("utf-8"),
            parse_constant=_no_number,
            parse_float=_number,
            parse_int=_integer,
            object_pairs_hook=_once,
        )
    except RefusedError:
        raise
    except (ValueError, RecursionError):
        raise RefusedError(422, "body", "json", "The body must be a JSON object in UTF-8.") from None
    if not isinstance(document, dict):
        raise RefusedError(422, "body", "json", "The body must be a JSON object.")
    _look_through(document, "body", 0)
    return document


def clean_text(text: Any, place: str, *, longest: int, lines: bool = False) -> str:
    """Return a text that can be stored anywhere and shown anywhere.

    Parameters
    ----------
    text : object
    place : str
    longest : int
        Characters.
    lines : bool
        Whether it may have several lines.

    Raises
    ------
    RefusedError
        Where it is no text, too long, or holds control characters or half characters.
    """
    if not isinstance(text, str):
        raise RefusedError(422, place, "type", "This must be a text.")
    if len(text) > longest:
        raise RefusedError(422, place, "length", f"This must have at most {longest} characters.")
    _look_through(text, place, 0)
    if not lines and any(mark in text for mark in "\n\r\t"):
        raise RefusedError(422, place, "control-characters", "This must be one line without control characters.")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def whole_number(number: Any, place: str, *, least: int, most: int) -> int:
    """Return a whole number within bounds.

    Raises
    ------
    RefusedError
        Where it is none.
    """
    if isinstance(number, float) and number.is_integer():
        number = int(number)
    if not isinstance(number, int) or isinstance(number, bool):
        raise RefusedError(422, place, "type", "This must be a whole number.")
    if not least <= number <= most:
        raise RefusedError(422, place, "value", f"This must be from {least} to {most}.")
    return number


def checked_values(screen: Screen, values: Any) -> dict[str, Value]:
    """Return what a screen records of the values that came, in the order of its records.

    Parameters
    ----------
    screen : Screen
    values : object
        Names of records to values; a record that need not be answered may be missing, or None.

    Raises
    ------
    RefusedError
        Where a name is unknown, a required one is missing, or a value is not allowed.
    """
    if not isinstance(values, Mapping):
        raise RefusedError(422, "values", "type", "The values must be an object: a value for each name.")
    names = [record.name for record in screen.records]
    if set(values) - set(names):
        listed = ", ".join(names) or "nothing"
        raise RefusedError(422, "values", "unknown", f"This screen records {listed}, and nothing else.")
    kept: dict[str, Value] = {}
    for record in screen.records:
        value, place = values.get(record.name), f"values.{record.name}"
        if value is None or (record.type == "text" and isinstance(value, str) and not value.strip()):
            if record.required:
                raise RefusedError(422, place, "missing", "This must be answered.")
            continue
        kept[record.name] = _checked(record, value, place)
    return kept


def all_correct(screen: Screen, values: Mapping[str, Value]) -> bool:
    """Whether every record of a screen that has a right answer got it."""
    return all(values.get(record.name) == record.correct for record in screen.records if record.correct is not None)


def _checked(record: Record, value: Any, place: str) -> Value:
    """Return one value, refused where its record does not allow it."""
    if record.options:
        for option in record.options:
            if type(value) is type(option.value) and value == option.value:
                return option.value
        raise RefusedError(422, place, "value", "This must be one of the answers that the screen offers.")
    if record.type == "flag":
        if not isinstance(value, bool):
            raise RefusedError(422, place, "type", "This must be true or false.")
        if record.required and not value:
            raise RefusedError(422, place, "missing", "This must be ticked.")
        return value
    if record.type == "number":
        return _within(record, value, place)
    return clean_text(value, place, longest=record.longest or LONGEST_TEXT, lines=True)


def _within(record: Record, value: Any, place: str) -> int | float:
    """Return a number within the bounds of its record."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise RefusedError(422, place, "type", "This must be a number.")
    if record.least is not None and value < record.least:
        raise RefusedError(422, place, "value", f"This must be at least {record.least:g}.")
    if record.most is not None and value > record.most:
        raise RefusedError(422, place, "value", f"This must be at most {record.most:g}.")
    if abs(value) > LARGEST:
        raise RefusedError(422, place, "value", "This number is too large to be kept exactly.")
    return value


def _look_through(part: Any, place: str, depth: int) -> None:
    """Refuse what no text may hold, anywhere in a document."""
    if depth > DEEPEST:
        raise RefusedError(422, place, "json", "The body must not be nested so deeply.")
    if isinstance(part, str):
        if not part.isprintable() and any(_bad(mark) for mark in part):
            raise RefusedError(
                422, place, "control-characters", "Texts must hold no control characters and whole characters only."
            )
    elif isinstance(part, dict):
        for key, value in part.items():
            _look_through(key, place, depth + 1)
            _look_through(value, key if depth == 0 and key in NAMES else place, depth + 1)
    elif isinstance(part, list):
        for value in part:
            _look_through(value, place, depth + 1)


def _bad(mark: str) -> bool:
    """Whether a character controls something or is half of one; ends of lines and tabulators are looked at elsewhere."""
    return unicodedata.category(mark) in ("Cc", "Cs") and mark not in "\n\r\t"


def _no_number(_name: str) -> float:
    raise RefusedError(422, "body", "value", "Numbers must be finite.")


def _number(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise RefusedError(422, "body", "value", "Numbers must not be so large.")
    return number


def _integer(text: str) -> int:
    if len(text) > 20:
        raise RefusedError(422, "body", "value", "Numbers must not be so large.")
    return int(text)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise RefusedError(422, "body", "json", "The body must not hold the same name twice.")
    return found
