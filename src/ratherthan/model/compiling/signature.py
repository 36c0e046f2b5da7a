"""The arguments of a kernel enter, their types and their numbers leave: what machine code is chosen by, and what it is given.

A kernel takes arrays, whole numbers, numbers and truths, and tuples of these, named or not. `taken` goes through them once: the
types make the key under which the machine code is found, the numbers are packed for it, eight bytes each:

* of an array: its address, how many elements it has, its shape and its strides;
* of anything else: the value.

Arrays that may be written and arrays that are locked have the same type here; whether a kernel writes to an argument is found
out from its text (see `source`).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

__all__ = ["Leaf", "UnusualError", "described", "leaves", "packed", "taken"]

Leaf = tuple[str, int, bool]
"""The type of an array: its dtype, dimensions, and whether it is contiguous; of a number: its dtype, -1 and True."""
ARRAYS = frozenset(("<i2", "<i4", "<i8", "<u2", "<u4", "<u8", "<f4", "<f8", "|i1", "|u1", "|b1"))
INTEGER: Leaf = ("<i8", -1, True)
NUMBER: Leaf = ("<f8", -1, True)
TRUTH: Leaf = ("|b1", -1, True)


class UnusualError(Exception):
    """An argument, a result or a kernel is none that the short way knows; it goes numba's own."""


def taken(arguments: Sequence[object]) -> tuple[tuple[Any, ...], list[int | float]]:
    """Return the types of `arguments`, flat, and the numbers that they are.

    Raises
    ------
    UnusualError
        If an argument is of another type.
    """
    types: list[Any] = []
    numbers: list[int | float] = []
    for argument in arguments:
        _take(argument, types, numbers)
    return tuple(types), numbers


def _take(argument: object, types: list[Any], numbers: list[int | float]) -> None:
    """Add one argument."""
    if isinstance(argument, np.ndarray):
        dtype, flags = argument.dtype.str, argument.flags
        if dtype not in ARRAYS or not flags.aligned or argument.ndim == 0:
            raise UnusualError(f"an array of {argument.dtype}")
        types.append((dtype, argument.ndim, flags.c_contiguous))
        numbers.append(argument.__array_interface__["data"][0])
        numbers.append(argument.size)
        numbers.extend(argument.shape)
        numbers.extend(argument.strides)
    elif isinstance(argument, bool | np.bool_):
        types.append(TRUTH)
        numbers.append(int(argument))
    elif isinstance(argument, int | np.integer):
        types.append(INTEGER)
        numbers.append(int(argument))
    elif isinstance(argument, float):
        types.append(NUMBER)
        numbers.append(argument)
    elif isinstance(argument, tuple) and argument:
        types.append((type(argument), len(argument)))
        for part in argument:
            _take(part, types, numbers)
    else:
        raise UnusualError(f"an argument of type {type(argument).__name__}")


def packed(types: Sequence[Any], numbers: Sequence[int | float]) -> struct.Struct:
    """Return what packs the numbers of arguments of these types."""
    codes = []
    for kind in types:
        if isinstance(kind[0], str):
            codes.append("d" if kind == NUMBER else "q" if kind[1] < 0 else "Q" + "q" * (2 * kind[1] + 1))
    packing = struct.Struct("=" + "".join(codes))
    if packing.size != 8 * len(numbers):
        raise UnusualError("numbers of another count")
    return packing


def leaves(types: Sequence[Any]) -> Iterator[Leaf]:
    """Yield the types without the tuples."""
    for kind in types:
        if isinstance(kind[0], str):
            yield kind


def described(types: Sequence[Any]) -> str:
    """Return the types as a text that is the same in every process.

    Examples
    --------
    >>> described([("<i4", 1, True), ("<i8", -1, True), (tuple, 1), ("<f8", 2, False)])
    '<i4 1 C, <i8, tuple 1, <f8 2 A'
    """
    words = []
    for kind in types:
        if not isinstance(kind[0], str):
            named = kind[0]
            fields = " ".join(getattr(named, "_fields", ()))
            place = "tuple" if named is tuple else f"{named.__module__}.{named.__qualname__}({fields})"
            words.append(f"{place} {kind[1]}")
        else:
            words.append(kind[0] if kind[1] < 0 else f"{kind[0]} {kind[1]} {'C' if kind[2] else 'A'}")
    return ", ".join(words)
