"""The value of an object enters, bytes leave that are equal exactly where the values are: what two states are compared by.

Objects are followed through their attributes; an object met again is a reference, so cycles end. What has no value that
can be compared (an open file, a drawing surface) is refused, and sources of chance are handed out, to be watched.
"""

from __future__ import annotations

import enum
import functools
import marshal
import random
import types
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["UnknowableError", "chance_of", "value_bytes"]

PLAIN = frozenset((bool, int, float, str, bytes, type(None), complex))
SMALL = 64
DEEPEST = 200


class UnknowableError(Exception):
    """Something has no value that can be compared; it is the message."""


@dataclass
class _Walk:
    """What was met on the way through an object."""

    shared: Mapping[int, int]
    seen: dict[int, int]
    chances: list[str]


def value_bytes(owner: Any, skipped: Iterable[str], shared: Mapping[int, int]) -> tuple[bytes, tuple[str, ...]]:
    """Return the value of an object, and what the sources of chance in it will bring.

    Parameters
    ----------
    owner : object
    skipped : iterable of str
        Attributes of `owner` that do not belong to it.
    shared : mapping of int to int
        A number per ``id`` of an object that never changes: it stands for it.

    Raises
    ------
    UnknowableError
        Where some attribute has no value that can be compared.
    """
    walk = _Walk(shared=shared, seen={id(owner): 0}, chances=[])
    left = set(skipped)
    parts = []
    for name, value in sorted(vars(owner).items()):
        if name in left:
            continue
        try:
            parts.append((name, _value(value, walk, 0)))
        except UnknowableError as error:
            raise UnknowableError(f"its attribute '{name}' is or holds {error}") from None
    return marshal.dumps(parts, 2), tuple(walk.chances)  # version 2 makes no references: equal values, equal bytes


def chance_of(source: Any) -> str | None:
    """Return what a source of chance will bring, None where the object is none."""
    if isinstance(source, np.random.Generator):
        return _spelled(source.bit_generator.state)
    if isinstance(source, np.random.RandomState):
        return _spelled(source.get_state(legacy=False))
    return repr(source.getstate()) if isinstance(source, random.Random) else None


def _spelled(state: Any) -> str:
    """Return the state of a generator in full: NumPy shortens long arrays."""
    if isinstance(state, Mapping):
        return " ".join(f"{key} {_spelled(value)}" for key, value in sorted(state.items()))
    return state.tobytes().hex() if isinstance(state, np.ndarray) else repr(state)


def _value(given: Any, walk: _Walk, depth: int) -> Any:  # noqa: PLR0911, PLR0912 - one return per kind
    """Return a value of plain tuples that stands for an object."""
    if isinstance(given, enum.Enum):
        return ("enum", type(given).__qualname__, given.name)
    if type(given) in PLAIN:
        return given
    if id(given) in walk.shared:
        return ("shared", walk.shared[id(given)])
    if isinstance(given, np.generic):
        return given.item()
    if isinstance(given, type | types.FunctionType | types.BuiltinFunctionType | types.ModuleType):
        return ("code", getattr(given, "__qualname__", given.__name__))
    if depth > DEEPEST:
        raise UnknowableError(f"objects in objects more than {DEEPEST} deep")
    if isinstance(given, tuple):  # never changes: whether it is met twice plays no part
        return tuple(_value(item, walk, depth + 1) for item in given)
    if id(given) in walk.seen:
        return ("again", walk.seen[id(given)])
    walk.seen[id(given)] = len(walk.seen)
    inner = functools.partial(_value, walk=walk, depth=depth + 1)
    if isinstance(given, np.ndarray) and not given.dtype.hasobject:
        return _array(given)
    if isinstance(given, list):  # long lists mostly hold plain and shared things: these without a call each
        shared = walk.shared
        return tuple(
            item if type(item) in PLAIN else ("shared", shared[id(item)]) if id(item) in shared else inner(item)
            for item in given
        )
    if isinstance(given, Mapping):
        return (
            "map",
            tuple(sorted(((repr(key), inner(item)) for key, item in given.items()), key=lambda pair: pair[0])),
        )
    if isinstance(given, set | frozenset):
        return ("set", tuple(sorted(repr(item) for item in given)))
    if isinstance(given, types.MethodType):
        return ("method", given.__func__.__qualname__, inner(given.__self__))
    chance = chance_of(given)
    if chance is not None:
        walk.chances.append(chance)
        return "chance"
    return _object(given, inner)


def _array(given: np.ndarray[Any, Any]) -> Any:
    """Return an array's value; a short one is equal to the list of its items, as environments mix the two."""
    if given.size <= SMALL and given.ndim == 1:
        return tuple(given.tolist())
    return ("array", given.dtype.str, given.shape, given.tobytes())


def _object(given: Any, inner: Any) -> Any:
    """Return the value of an object by its attributes."""
    slots = [
        name for kind in type(given).__mro__ for name in _names(getattr(kind, "__slots__", ())) if hasattr(given, name)
    ]
    if not hasattr(given, "__dict__") and not slots:
        raise UnknowableError(f"a {type(given).__name__}, whose value cannot be compared")
    attributes = {name: getattr(given, name) for name in slots} | getattr(given, "__dict__", {})
    attributes.pop("__weakref__", None)
    attributes.pop("__dict__", None)
    return (type(given).__qualname__, tuple((name, inner(value)) for name, value in sorted(attributes.items())))


def _names(slots: Any) -> tuple[str, ...]:
    return (slots,) if isinstance(slots, str) else tuple(slots)
