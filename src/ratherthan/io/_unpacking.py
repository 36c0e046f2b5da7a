"""A file that may be packed by gzip or xz enters; its unpacked bytes leave in order, watched by `Limits`."""

from __future__ import annotations

import lzma
import os
import zlib
from typing import BinaryIO, Protocol

from ratherthan.errors import SourceError
from ratherthan.io._files import Limits

__all__ = ["CHUNK", "UnpackedStream", "packing_of"]

CHUNK = 1 << 20
XZ_MEMORY = 256 << 20
LONGEST_MAGIC = 6
MAGIC = {b"\x1f\x8b": "gzip", b"\xfd7zXZ\x00": "xz"}


def packing_of(head: bytes) -> str:
    """Return ``"gzip"``, ``"xz"`` or ``""`` from the first bytes of a file."""
    return next((name for magic, name in MAGIC.items() if head.startswith(magic)), "")


class _Unpacker(Protocol):
    """What zlib's and lzma's decompressors have in common."""

    @property
    def eof(self) -> bool: ...
    @property
    def unused_data(self) -> bytes: ...


class UnpackedStream:
    """The unpacked bytes of a file, in order.

    Parameters
    ----------
    file : binary file
        Read from its beginning; packed if its first bytes say so.
    limits : Limits
        How much more may come out than goes in.
    path : str
        How the file is called in errors.
    """

    def __init__(self, file: BinaryIO, limits: Limits, path: str) -> None:
        self.file, self.limits, self.path = file, limits, path
        file.seek(0)
        self.packing = packing_of(file.read(6))
        file.seek(0)
        self.packed = self.unpacked = 0
        self.left = memoryview(b"")  # unpacked, not handed out
        self.unpacker = self._new_unpacker()
        self.waiting = b""  # packed, not yet given to the unpacker
        self.ended = False

    def _new_unpacker(self) -> _Unpacker | None:
        if self.packing == "gzip":
            return zlib.decompressobj(wbits=31)
        return lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=XZ_MEMORY) if self.packing == "xz" else None

    def readinto(self, buffer: memoryview) -> int:
        """Fill `buffer` as far as the file goes; return how many bytes there were."""
        done = 0
        while done < len(buffer):
            if not len(self.left):
                if self.unpacker is None:
                    count = self.file.readinto(buffer[done:])  # type: ignore[attr-defined]
                    self.packed += count
                    return done + int(count)
                if self.ended:
                    break
                self.left = memoryview(self._unpack())
                continue
            count = min(len(self.left), len(buffer) - done)
            buffer[done : done + count] = self.left[:count]
            self.left = self.left[count:]
            done += count
        return done

    def skip(self, count: int) -> bool:
        """Pass over `count` bytes; return whether there were so many."""
        if self.unpacker is None:
            self.file.seek(count, os.SEEK_CUR)
            return self.file.tell() <= os.fstat(self.file.fileno()).st_size
        buffer = bytearray(min(count, CHUNK))
        while count > 0:
            part = memoryview(buffer)[: min(count, CHUNK)]
            if self.readinto(part) < len(part):
                return False
            count -= len(part)
        return True

    def read(self, count: int) -> bytes:
        """Return up to `count` bytes; `count` must be small."""
        buffer = bytearray(count)
        return bytes(buffer[: self.readinto(memoryview(buffer))])

    def _unpack(self) -> bytes:
        """Return the next unpacked bytes, empty where more must be asked for or the end is reached."""
        try:
            return self._unpack_chunk()
        except lzma.LZMAError as error:
            if "memory" in str(error).lower():
                reason = "it needs more than 256 MiB to unpack; pack it with a lower level"
            else:
                reason = f"{error}"
            raise SourceError(
                f"An xz file must be whole, but '{self.path}' cannot be unpacked: {reason}.", path=self.path
            ) from error
        except zlib.error as error:
            raise SourceError(
                f"A gzip file must be whole, but '{self.path}' cannot be unpacked: {error}. Copy it anew.",
                path=self.path,
            ) from error

    def _unpack_chunk(self) -> bytes:
        if self.unpacker is not None and self.unpacker.eof:  # several packed streams may follow one another
            self.waiting = self.unpacker.unused_data.lstrip(b"\x00") if not self.waiting else self.waiting
            if len(self.waiting) < LONGEST_MAGIC:
                self.waiting += self._packed_bytes()
            if packing_of(self.waiting[:LONGEST_MAGIC]) != self.packing:
                self.ended = True
                return b""
            self.unpacker = self._new_unpacker()
        unpacker = self.unpacker
        if isinstance(unpacker, lzma.LZMADecompressor):
            if unpacker.needs_input and not self.waiting:
                self.waiting = self._packed_bytes()
                self._demand_more()
            given, self.waiting = self.waiting, b""
            data = unpacker.decompress(given, max_length=CHUNK)
        else:
            assert unpacker is not None
            if not self.waiting:
                self.waiting = self._packed_bytes()
                self._demand_more()
            data = unpacker.decompress(self.waiting, CHUNK)  # type: ignore[attr-defined]
            self.waiting = unpacker.unconsumed_tail  # type: ignore[attr-defined]
        self.unpacked += len(data)
        self.limits.check_ratio(self.unpacked, self.packed, self.path)
        return data

    def _packed_bytes(self) -> bytes:
        data = self.file.read(1 << 18)
        self.packed += len(data)
        return data

    def _demand_more(self) -> None:
        if not self.waiting:
            raise SourceError(
                f"A {self.packing} file must be whole, but '{self.path}' breaks off after {self.packed} bytes. Copy it anew.",
                path=self.path,
            )
