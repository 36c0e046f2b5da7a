"""A path enters; the text of a DRN file leaves as a stream of bytes, unpacked where it is packed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO, Protocol

import numpy as np

from ratherthan.errors import SourceError
from ratherthan.io._files import Limits, open_source
from ratherthan.io._tar import Archive, is_tar
from ratherthan.io._unpacking import UnpackedStream, packing_of

__all__ = ["Text", "open_text"]


class Text(Protocol):
    """What can be read from; packed or not."""

    def read(self, count: int, /) -> bytes:
        """Return up to `count` bytes, none at the end."""


class _Bytes:
    """Bytes in memory, read from their beginning."""

    def __init__(self, data: memoryview) -> None:
        self.data = data

    def read(self, count: int) -> bytes:
        found, self.data = self.data[:count].tobytes(), self.data[count:]
        return found


@contextmanager
def open_text(path: str | os.PathLike[str], limits: Limits) -> Iterator[Text]:
    """Open a DRN file for reading.

    Parameters
    ----------
    path : path
        Plain text; or packed by gzip or xz; or the only file of a packed tar archive, as newer Storms write it.
    limits : Limits

    Yields
    ------
    Text

    Raises
    ------
    SourceError
        Where it cannot be read or unpacked, or the archive holds more than one file.
    """
    shown = os.fspath(path)
    with open_source(path) as file:
        packed = bool(packing_of(file.read(6)))
        head = UnpackedStream(file, limits, shown).read(512)
        if is_tar(head):
            yield _Bytes(_only_member(file, limits, shown))
        elif packed:
            yield UnpackedStream(file, limits, shown)
        else:
            file.seek(0)
            yield file


def _only_member(file: BinaryIO, limits: Limits, shown: str) -> memoryview:
    archive = Archive(file, limits, shown)
    found: list[memoryview] = []
    for member in archive.members():
        if found:
            raise SourceError(
                f"A packed DRN file must hold one file, but '{shown}' also holds '{member.name}'. Unpack it first.",
                path=shown,
            )
        limits.check_bytes(member.size, shown)
        found.append(np.asarray(archive.read(member)).data)
    if not found:
        raise SourceError(f"A packed DRN file must hold a file, but '{shown}' holds none. Write it anew.", path=shown)
    return found[0]
