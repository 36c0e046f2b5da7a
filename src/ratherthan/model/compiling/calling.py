"""A kernel and machine code for it enter; a function that takes and returns what the kernel does leaves.

The arguments' numbers are packed, the code is called (Python's lock is given up meanwhile), and what it wrote is read: numbers,
arrays, tuples. Memory that the kernel took belongs to the array that it comes back as, and is given back with it.
"""

from __future__ import annotations

import ctypes
import importlib
import math
import pickle
import struct
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ratherthan.model.compiling._kernels import Place
from ratherthan.model.compiling.signature import UnusualError, packed

__all__ = ["Code", "arrays_of"]

FINE = (0, -2)
"""What a kernel answers where nothing went wrong: there is a result, or it is None."""


class Code:
    """Machine code of a kernel for one row of types."""

    def __init__(self, code: bytes, types: Sequence[Any], result: Any, numbers: Sequence[int | float]) -> None:
        self._pack = packed(types, numbers).pack
        self._place = Place(code)  # the code goes when this goes
        self._call = self._place.call
        self._read, codes = _reader(result)
        self._results = struct.Struct("=" + codes)

    def __call__(self, arguments: Sequence[object], numbers: Sequence[int | float]) -> Any:
        """Run it."""
        results = ctypes.create_string_buffer(self._results.size)
        error = ctypes.c_void_p()
        code = self._call(self._pack(*numbers), ctypes.addressof(results), ctypes.addressof(error))
        if code not in FINE:
            raise _error(error.value)
        return self._read(iter(self._results.unpack(results)), arguments)


class _Told(ctypes.Structure):
    """What numba tells of an error: its class and words, pickled, and how many words are missing."""

    _fields_ = (
        ("data", ctypes.c_void_p),
        ("length", ctypes.c_int32),
        ("_hash", ctypes.c_void_p),
        ("_unwrap", ctypes.c_void_p),
        ("more", ctypes.c_int32),
    )


def _error(address: int | None) -> BaseException:
    """Return the error that a kernel ended with."""
    if not address:
        return SystemError("A kernel ended with an error that has no name.")
    told = _Told.from_address(address)
    kind, words = pickle.loads(ctypes.string_at(told.data, told.length))[:2]  # a constant of the code itself
    if told.more:  # words that were only known when it happened
        words = ("Arrays in a compiled loop must fit each other, but they do not.",)
    error: BaseException = kind(*(words or ()))
    return error


def _reader(result: Any) -> tuple[Callable[[Iterator[Any], Sequence[object]], Any], str]:
    """Return what makes a result from its numbers, and how they are packed."""
    if result is None:
        return lambda numbers, arguments: None, ""  # noqa: ARG005 - one shape for all readers
    if isinstance(result, str):
        if result == "|b1":
            return lambda numbers, arguments: bool(next(numbers)), "q"  # noqa: ARG005
        return lambda numbers, arguments: next(numbers), {"f": "d", "i": "q", "u": "Q"}[result[1]]  # noqa: ARG005
    if result[0] == "array":
        _, dtype, dimensions, locked = result

        def array(numbers: Iterator[Any], arguments: Sequence[object]) -> Any:
            block, address = next(numbers), next(numbers)
            shape = tuple(next(numbers) for _ in range(dimensions))
            strides = tuple(next(numbers) for _ in range(dimensions))
            return _array(block, arguments, {"data": (address, locked), "shape": shape, "strides": strides}, dtype)

        return array, "QQ" + "q" * (2 * dimensions)
    parts = [_reader(part) for part in result[2]]
    made = tuple if result[1] is None else _class(result[1])._make

    def several(numbers: Iterator[Any], arguments: Sequence[object]) -> Any:
        return made([read(numbers, arguments) for read, _ in parts])

    return several, "".join(codes for _, codes in parts)


def _class(place: str) -> Any:
    """Return a named tuple by its module and name."""
    module, _, name = place.partition(":")
    thing: Any = importlib.import_module(module)
    for part in name.split("."):
        thing = getattr(thing, part, None)
    if not (isinstance(thing, type) and issubclass(thing, tuple) and hasattr(thing, "_make")):
        raise UnusualError(f"a tuple {place}")
    return thing


class _Block(ctypes.Structure):
    """The head of a block of memory of a kernel: how many arrays hold it."""

    _fields_ = (("holders", ctypes.c_int64),)


def _release(
    block: int,
    *,
    head: Callable[[int], _Block] = _Block.from_address,
    give: Callable[[ctypes.c_void_p], object] = ctypes.pythonapi.PyMem_RawFree,
    pointer: Callable[[int], ctypes.c_void_p] = ctypes.c_void_p,
) -> None:
    """Let go of a block of memory, which several arrays may hold; this works also while the interpreter ends."""
    if block:
        held = head(block)
        held.holders -= 1
        if held.holders == 0:
            give(pointer(block))


class _Held:
    """Memory that a kernel took, or lent from an argument: numpy makes an array of it and keeps this alive."""

    __slots__ = ("__array_interface__", "_block", "_lender")

    def __init__(self, interface: dict[str, Any], block: int, lender: object) -> None:
        self.__array_interface__ = interface
        self._block = block
        self._lender = lender

    def __del__(self, release: Callable[[int], None] = _release) -> None:
        release(self._block)


def _array(block: int, arguments: Sequence[object], interface: dict[str, Any], dtype: str) -> Any:
    """Return an array over memory of a kernel, or over that of an argument."""
    if math.prod(interface["shape"]) == 0:
        _release(block)
        return np.empty(interface["shape"], dtype)
    lender = None
    if not block:
        address, _ = interface["data"]
        lender = next((array for array in arrays_of(arguments) if _holds(array, address)), None)
        interface["data"] = (address, lender is None or not lender.flags.writeable)
    return np.asarray(_Held(interface | {"typestr": dtype, "version": 3}, block, lender))


def _holds(array: Any, address: int) -> bool:
    """Whether an address lies within an array."""
    low, high = np.lib.array_utils.byte_bounds(array)
    return bool(low <= address < high)


def arrays_of(arguments: Sequence[object]) -> Iterator[Any]:
    """Yield all arrays among `arguments` and in their tuples."""
    for argument in arguments:
        if isinstance(argument, np.ndarray):
            yield argument
        elif isinstance(argument, tuple):
            yield from arrays_of(argument)
