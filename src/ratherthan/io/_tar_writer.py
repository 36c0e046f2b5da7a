"""Named files enter, a tar archive leaves: plain or packed; numbers are brought into their stored form a block at a time.

The archive has no owners, times or folders, so that the same files give the same bytes. The data of each file begins at a
multiple of 512 bytes: an archive that is not packed can be mapped into memory as it is.
"""

from __future__ import annotations

import lzma
import tarfile
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, BinaryIO, Protocol

import numpy as np
import numpy.typing as npt

from ratherthan.io._packing import GzipWriter
from ratherthan.model.watch import look

__all__ = ["PACKINGS", "Numbers", "write_tar"]

PACKINGS = ("gzip", "xz", "none")
BLOCK = 1 << 17
RECORD = 20 * 512
"""A tar archive is filled up to a multiple of this."""


class _Taking(Protocol):
    def write(self, data: bytes | memoryview, /) -> int: ...


@dataclass(frozen=True, eq=False)
class Numbers:
    """Numbers, and the type they are stored as."""

    array: npt.NDArray[Any]
    dtype: str

    def __len__(self) -> int:
        """Return how many bytes are stored."""
        return len(self.array) * np.dtype(self.dtype).itemsize

    def blocks(self) -> Iterator[memoryview]:
        """Yield the stored bytes."""
        for first in range(0, len(self.array), BLOCK):
            yield np.ascontiguousarray(self.array[first : first + BLOCK], dtype=self.dtype).view(np.uint8).data


def write_tar(file: BinaryIO, files: Mapping[str, bytes | Numbers], packing: str) -> None:
    """Write files in their order.

    Parameters
    ----------
    file : binary file
    files : mapping of str to bytes or Numbers
    packing : str
        Of `PACKINGS`.
    """
    with _packed(file, packing) as out:
        done = 0
        large = any(len(data) >= 8 << 30 for data in files.values())
        for name, data in files.items():
            member = tarfile.TarInfo(name)
            member.size, member.mode = len(data), 0o644
            head = member.tobuf(tarfile.GNU_FORMAT if large else tarfile.USTAR_FORMAT)
            out.write(head)
            for block in data.blocks() if isinstance(data, Numbers) else (data,):
                look()
                out.write(block)
            out.write(bytes(-len(data) % 512))
            done += len(head) + len(data) + -len(data) % 512
        out.write(bytes(1024 + -(done + 1024) % RECORD))


def _packed(file: BinaryIO, packing: str) -> AbstractContextManager[_Taking]:
    if packing == "none":
        return nullcontext(file)
    if packing == "xz":
        return lzma.LZMAFile(file, "wb", preset=1)
    return GzipWriter(file)
