"""A stream with one array of NumPy's format enters, the array leaves, once its header agrees with its size."""

from __future__ import annotations

import io
import math
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError

__all__ = ["array_from", "mapped_array"]

CHUNK = 1 << 24
LONGEST_HEADER = 1 << 16


def array_from(stream: IO[bytes], file_size: int, shown: str) -> npt.NDArray[Any]:
    """Return the array of a ``.npy`` file.

    Parameters
    ----------
    stream : binary file
        At its beginning.
    file_size : int
        How many bytes it has.
    shown : str
        How it is called in errors.

    Raises
    ------
    SourceError
        Where it holds pickled objects.
    ValueError, EOFError
        Where it is damaged.
    """
    shape, in_columns, dtype = _header(stream, file_size, shown)
    count = math.prod(shape)
    size = count * dtype.itemsize
    data = np.empty(size, dtype=np.uint8)
    done = 0
    while done < size:
        got = stream.readinto(data.data[done : done + CHUNK])  # type: ignore[attr-defined]
        if not got:
            raise EOFError(f"{shown} breaks off")
        done += got
    if stream.read(1):
        raise ValueError(f"{shown} is longer than its header says")
    data.flags.writeable = False  # nobody else holds it: a model takes it over as it is
    array = data.view(dtype) if dtype.itemsize else np.zeros(count, dtype=dtype)
    return array.reshape(shape, order="F" if in_columns else "C")


def mapped_array(data: npt.NDArray[np.uint8], shown: str) -> npt.NDArray[Any] | None:
    """Return the array of a ``.npy`` file that lies in memory, as a part of it; None where it does not lie so that it can be.

    Parameters and errors as in `array_from`.
    """
    stream = io.BytesIO(data[:LONGEST_HEADER].tobytes())
    shape, in_columns, dtype = _header(stream, len(data), shown)
    begin, count = stream.tell(), math.prod(shape)
    if begin + count * dtype.itemsize != len(data):
        raise ValueError(f"{shown} is longer or shorter than its header says")
    if not dtype.itemsize or (data.ctypes.data + begin) % dtype.alignment:
        return None
    return data[begin:].view(dtype).reshape(shape, order="F" if in_columns else "C")


def _header(stream: IO[bytes], file_size: int, shown: str) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return the shape, whether columns come first, and the type of an array, once it is sure that it holds plain values."""
    version = np.lib.format.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"format version {version[0]}.{version[1]} of {shown} is not 1.0 or 2.0")
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, in_columns, dtype = read_header(stream)
    if dtype.hasobject:
        raise SourceError(
            f"Arrays must hold numbers, truth values or text, but {shown} holds pickled objects, which could run any "
            "program. Save it as numbers.",
            path=shown,
        )
    count = math.prod(shape)
    size = count * dtype.itemsize
    if any(n < 0 for n in shape) or size > file_size or (dtype.itemsize == 0 and count > file_size):
        raise ValueError(f"by its header {shown} has {size} bytes, got {file_size}")
    return shape, in_columns, dtype
