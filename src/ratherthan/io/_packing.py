"""Bytes enter in order, a gzip file leaves: packed block by block on all processors, the same bytes whatever their number.

A block is packed by itself and ends on a byte (a sync flush), so that blocks can be packed side by side and simply follow one
another in one gzip member, which every reader of the format takes. The level is low: the numbers of a model repeat themselves
so much that higher ones take three to six times as long and save a few per cent, or nothing.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import BinaryIO, Self

from ratherthan.model.watch import look

__all__ = ["LEVEL", "GzipWriter"]

LEVEL = 1
BLOCK = 1 << 20
HEAD = b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x04\xff"  # no name, no time, the fastest packing, on no system in particular


class GzipWriter:
    """Packs what is written to it; used in a ``with`` block, at whose end the file is whole.

    Parameters
    ----------
    file : binary file
        Where the packed bytes go.
    """

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        self.pending = bytearray()
        self.crc = self.size = 0
        self.most = 2 * (os.cpu_count() or 1)
        self.packed: deque[Future[bytes]] = deque()
        self.pool = ThreadPoolExecutor(os.cpu_count() or 1)

    def __enter__(self) -> Self:
        self.file.write(HEAD)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._pack(bytes(self.pending), zlib.Z_FINISH)
                self._pass_on(0)
                self.file.write(struct.pack("<II", self.crc, self.size & 0xFFFFFFFF))
        finally:
            self.pool.shutdown(cancel_futures=True)

    def write(self, data: bytes | memoryview) -> int:
        """Take the next bytes."""
        self.pending += data
        while len(self.pending) >= BLOCK:
            self._pack(bytes(memoryview(self.pending)[:BLOCK]), zlib.Z_SYNC_FLUSH)
            del self.pending[:BLOCK]
        return len(data)

    def _pack(self, block: bytes, ending: int) -> None:
        self.packed.append(self.pool.submit(_packed, block, ending))
        self.crc = zlib.crc32(block, self.crc)
        self.size += len(block)
        self._pass_on(self.most)

    def _pass_on(self, waiting: int) -> None:
        """Write what is packed, until at most so many blocks wait."""
        while len(self.packed) > waiting:
            look()
            self.file.write(self.packed.popleft().result())


def _packed(block: bytes, ending: int) -> bytes:
    packer = zlib.compressobj(LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packer.compress(block) + packer.flush(ending)
