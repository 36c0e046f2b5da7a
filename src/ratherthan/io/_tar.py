"""A tar archive from a stranger enters, packed or not; its members leave one by one, each checked before it is read.

Nothing is ever extracted to disk. The archive is read as one stream: headers of 512 bytes, each followed by its
member. Accepted are ordinary files and folders with plain relative names (POSIX, GNU and pax headers); links, devices,
names that point outside, and names that come twice are refused. gzip and xz are told by their first bytes; while they
unpack, `Limits` watches how much comes out. A member's bytes are handed out only where the caller asks for them with
the size that it expects.
"""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._files import Limits
from ratherthan.io._unpacking import CHUNK, UnpackedStream

__all__ = ["Archive", "Member", "is_tar"]

BLOCK = 512
LONGEST_NAME = 1 << 16
MOST_TRAILING = 1 << 20
MOST_MEMBERS = 1_000_000
MAPPED = 1 << 20
"""From how many bytes on a member is mapped into memory."""
WORDS = 1 << 17


def is_tar(head: bytes) -> bool:
    """Return whether the first 512 bytes of a file are the header of a tar archive."""
    return head[257:262] == b"ustar"


@dataclass(frozen=True, kw_only=True)
class Member:
    """A member of the archive: its name and size in bytes; folders are not handed out."""

    name: str
    size: int


class Archive:
    """The members of a tar archive, one by one.

    Parameters
    ----------
    file : binary file
    limits : Limits
    path : str
        How the file is called in errors.
    """

    def __init__(self, file: BinaryIO, limits: Limits, path: str) -> None:
        self.stream, self.path = UnpackedStream(file, limits, path), path
        self._open = 0  # bytes of the current member not yet read, and the padding behind it
        self._padding = 0
        self._begun = False
        self._map: mmap.mmap | None = None

    def members(self) -> Iterator[Member]:
        """Yield the archive's files in their order; what is not read of one is passed over.

        Raises
        ------
        SourceError
            For anything but ordinary files and folders with plain relative names, each once, in a whole archive.
        """
        seen: set[str] = set()
        while (found := self._next()) is not None:
            name, size, folder = found
            name = self._plain(name)
            if folder:
                continue
            if name in seen:
                raise self._fault(f"has '{_short(name)}' twice")
            seen.add(name)
            if len(seen) > MOST_MEMBERS:
                raise self._fault(f"has more than {MOST_MEMBERS} members")
            yield Member(name=name, size=size)

    def read(self, member: Member) -> npt.NDArray[np.uint8]:
        """Return the bytes of the member that `members` has just yielded, read-only; its size must have been checked.

        Those of a large member of an archive that is not packed are not read: the file is mapped into memory.
        """
        if member.size >= MAPPED and (mapped := self._mapped(member)) is not None:
            return mapped
        data = np.empty(member.size, dtype=np.uint8)
        view = data.data
        for start in range(0, member.size, 16 * CHUNK):
            self._take(view[start : start + 16 * CHUNK])
        data.flags.writeable = False
        return data

    def read_words(self, member: Member) -> npt.NDArray[np.int32] | npt.NDArray[np.uint64]:
        """Return the words of 64 bits of the member that `members` has just yielded, in 32 bits where all of them fit."""
        words = np.empty(member.size // 8, dtype=np.int32)
        block = np.empty(min(len(words), WORDS), dtype="<u8")
        for first in range(0, len(words), WORDS):
            part = block[: len(words) - first]
            self._take(part.view(np.uint8).data)
            if part.max() >= 1 << 31:
                wide = np.empty(len(words), dtype="<u8")
                wide[:first], wide[first : first + len(part)] = words[:first], part
                self._take(wide[first + len(part) :].view(np.uint8).data)
                return wide
            words[first : first + len(part)] = part
        return words

    def _mapped(self, member: Member) -> npt.NDArray[np.uint8] | None:
        """Return a member as a part of the mapped file; None where it is packed, or no file of the system's."""
        if self.stream.packing:
            return None
        try:
            descriptor = self.stream.file.fileno()
            begin, size = self.stream.file.tell(), os.fstat(descriptor).st_size
            if begin + member.size > size:
                return None
            if self._map is None:
                self._map = mmap.mmap(descriptor, 0, access=mmap.ACCESS_READ)
        except (OSError, ValueError):
            return None
        self.stream.skip(member.size)
        self._open = 0
        return np.frombuffer(self._map, dtype=np.uint8, count=member.size, offset=begin)

    def read_part(self, begin: int, end: int) -> npt.NDArray[np.uint8]:
        """Return the bytes from `begin` to `end` of the member that `members` has just yielded; before, nothing of it is read."""
        data = np.empty(end - begin, dtype=np.uint8)
        if not self.stream.skip(begin):
            raise self._fault("breaks off in the middle of a member", "Copy it anew.")
        self._open -= begin
        view = data.data
        for start in range(0, len(data), 16 * CHUNK):
            self._take(view[start : start + 16 * CHUNK])
        return data

    def _take(self, view: memoryview) -> None:
        got = self.stream.readinto(view)
        self._open -= got
        if got < len(view):
            raise self._fault("breaks off in the middle of a member", "Copy it anew.")

    def _next(self) -> tuple[str, int, bool] | None:
        """Return name, size and whether it is a folder of the next member, None at the end."""
        long_name: str | None = None
        long_size: int | None = None
        while True:
            if not self.stream.skip(self._open + self._padding):
                raise self._fault("breaks off in the middle of a member", "Copy it anew.")
            header = self.stream.read(BLOCK)
            if len(header) == BLOCK and not any(header):
                self._finish()
                return None
            kind, name, size = self._parse(header)
            if kind in b"Lxg":
                if size > LONGEST_NAME:
                    raise self._fault(f"has a member name of {size} bytes")
                self._open, self._padding = size, -size % BLOCK
                buffer = bytearray(size)
                self._take(memoryview(buffer))
                if kind in b"L":
                    long_name = self._text(bytes(buffer).rstrip(b"\x00"))
                elif kind in b"x":
                    pax = self._pax(bytes(buffer))
                    long_name, long_size = pax.get("path", long_name), self._pax_size(pax, long_size)
                continue
            name = name if long_name is None else long_name
            size = size if long_size is None else long_size
            folder = kind in b"5" or (kind in b"\x00" and name.endswith("/"))
            if not folder and kind not in b"0\x007":
                what = "a link" if kind in b"12K" else "a device" if kind in b"346" else "neither a file nor a folder"
                raise self._fault(f"has the member '{_short(name)}', which is {what}")
            self._open, self._padding = size, -size % BLOCK
            return name, size, folder

    def _parse(self, header: bytes) -> tuple[bytes, str, int]:
        """Return type, name and size from a header, once its checksum is right."""
        if len(header) < BLOCK:
            raise self._fault("breaks off before its end", "Copy it anew.")
        if not self._begun and not is_tar(header):
            raise self._fault("holds something else than a tar archive", "Check what it is.")
        self._begun = True
        stored = self._number(header[148:156])
        if stored != sum(header) - sum(header[148:156]) + 8 * 0x20:
            raise self._fault(
                "has a header with a wrong checksum", "It may be another kind of file, or damaged: copy it anew."
            )
        name = header[:100].split(b"\x00")[0]
        if header[257:263] == b"ustar\x00" and header[345] != 0:
            name = header[345:500].split(b"\x00")[0] + b"/" + name
        return header[156:157], self._text(name), self._number(header[124:136])

    def _number(self, field: bytes) -> int:
        if field[0] == 0x80:
            return int.from_bytes(field[1:], "big")
        digits = field.split(b"\x00")[0].strip()
        if not all(c in b"01234567" for c in digits):
            raise self._fault("has a header with a broken number", "It may be damaged: copy it anew.")
        return int(digits, 8) if digits else 0

    def _pax(self, data: bytes) -> dict[str, str]:
        """Return the records of a pax header: length, key=value and a line end each."""
        records = {}
        while data.rstrip(b"\x00"):
            length, _, _ = data.partition(b" ")
            if not length.isdigit() or len(length) > 9 or not len(length) + 2 <= int(length) <= len(data):
                raise self._fault("has a broken pax header")
            key, _, value = self._text(data[len(length) + 1 : int(length) - 1]).partition("=")
            records[key] = value
            data = data[int(length) :]
        if any(key.startswith("GNU.sparse") for key in records):
            raise self._fault("has a sparse member")
        return records

    def _pax_size(self, pax: dict[str, str], before: int | None) -> int | None:
        if "size" not in pax:
            return before
        if not (pax["size"].isascii() and pax["size"].isdigit() and len(pax["size"]) < 20):
            raise self._fault("has a pax header with a broken size")
        return int(pax["size"])

    def _text(self, data: bytes) -> str:
        try:
            return data.decode("utf-8")
        except UnicodeDecodeError:
            raise self._fault("has a member whose name is not UTF-8") from None

    def _plain(self, name: str) -> str:
        """Return a member's name without a leading ``./``, once it is sure to stay inside."""
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if name.startswith("/") or ".." in parts or "\x00" in name or "\\" in name:
            raise self._fault(f"has the member '{_short(name)}', whose name points outside")
        return "/".join(parts)

    def _finish(self) -> None:
        """Read what follows the end of the archive, so that a packed file's checksum is checked."""
        trailing = 0
        while (got := len(self.stream.read(1 << 16))) > 0:
            trailing += got
            if trailing > MOST_TRAILING:
                raise self._fault("goes on after its end")

    def _fault(self, what: str, remedy: str = "Write it anew with the tool it came from.") -> SourceError:
        return SourceError(
            f"An archive must be whole and hold plain files only, but '{self.path}' {what}. {remedy}", path=self.path
        )


def _short(name: str) -> str:
    return name if len(name) <= 80 else name[:77] + "…"
