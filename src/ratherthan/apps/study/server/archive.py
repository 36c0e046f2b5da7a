"""A design enters, its text for the database leaves, and back: every field by its type, so that what was served stays readable.

Dataclasses become objects, tuples lists, a mapping by pairs a list of [key, value]. Nothing is guessed on the way back: the types say
what stands where.
"""

from __future__ import annotations

import json
import types
import typing
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from ratherthan.apps.study.design.nouns import Design
from ratherthan.errors import InputError

__all__ = ["design_of", "text_of"]


def text_of(design: Design) -> str:
    """Return a design as text.

    Parameters
    ----------
    design : Design
    """
    return json.dumps(_plain(design), ensure_ascii=False)


def design_of(text: str) -> Design:
    """Return the design of a text; its pictures are where they were, or are not.

    Parameters
    ----------
    text : str

    Raises
    ------
    InputError
        Where the database was written by another version, with other designs.
    """
    try:
        return typing.cast(Design, _made(Design, json.loads(text)))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            "The design in the database must be one that this version can read, but it is not. Export it with the version that served it."
        ) from error


def _plain(part: Any) -> Any:
    if is_dataclass(part) and not isinstance(part, type):
        return {one.name: _plain(getattr(part, one.name)) for one in fields(part)}
    if isinstance(part, Mapping):
        return [[_plain(key), _plain(value)] for key, value in part.items()]
    if isinstance(part, tuple | list):
        return [_plain(one) for one in part]
    return str(part) if isinstance(part, Path) else part


def _made(kind: Any, part: Any) -> Any:
    """Return what a part of a document is as a value of a type."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (types.UnionType, typing.Union):
        if part is None:
            return None
        left = [one for one in inner if one is not type(None)]
        return _made(left[0], part) if len(left) == 1 else part
    if is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        known = {one.name for one in fields(kind)}
        made: Any = kind
        return made(**{name: _made(hints[name], value) for name, value in part.items() if name in known})
    if origin is tuple:
        if len(inner) == 2 and inner[1] is Ellipsis:
            return tuple(_made(inner[0], one) for one in part)
        return tuple(_made(one, value) for one, value in zip(inner, part, strict=True))
    if origin is Mapping:
        return {_made(inner[0], key): _made(inner[1], value) for key, value in part}
    return Path(part) if kind is Path else part
