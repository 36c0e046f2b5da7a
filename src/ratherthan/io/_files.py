"""A path enters; a readable file with a limit on what it may unpack to, or a whole new file in its place, leaves."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from ratherthan.errors import SourceError
from ratherthan.io._leftovers import unfinished
from ratherthan.model.watch import room_for

__all__ = ["Limits", "open_source", "size_text", "write_atomically"]

GIB = 1 << 30
WITH_COPIES = 1.5
"""How many times its arrays a model takes while it is read and checked."""


def _memory_bytes() -> int:
    """Return the machine's memory, 16 GiB where it does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 16 * GIB


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a packed file may unpack to. A file is a stranger: a few bytes can claim to be very many.

    Parameters
    ----------
    most_bytes : int, optional
        The most that all its arrays together may hold; 8 GiB or a third of the memory, whichever is less, by default.
    most_ratio : float
        The most unpacked bytes per packed byte, once more than `free_bytes` are unpacked.
    free_bytes : int
        As much may be unpacked whatever the ratio.
    """

    most_bytes: int | None = None
    most_ratio: float = 500.0
    free_bytes: int = 64 << 20

    @property
    def bytes(self) -> int:
        """The most bytes, the default filled in."""
        return self.most_bytes if self.most_bytes is not None else min(8 * GIB, _memory_bytes() // 3)

    def check_bytes(self, wanted: int, path: str) -> None:
        """Raise SourceError where `wanted` bytes are too many."""
        if wanted > self.bytes:
            raise SourceError(
                f"A model must fit into {size_text(self.bytes)} of memory, but '{path}' declares {size_text(wanted)}. "
                "Where the file can be trusted, read it with limits=Limits(most_bytes=…).",
                path=path,
            )
        room_for(WITH_COPIES * wanted, f"The model in '{path}'")

    def check_ratio(self, unpacked: int, packed: int, path: str) -> None:
        """Raise SourceError where far more comes out of a packed file than went in."""
        if unpacked > self.free_bytes and unpacked > self.most_ratio * packed:
            raise SourceError(
                f"A packed file must unpack to at most {self.most_ratio:g} times its size, but '{path}' unpacks to "
                f"{size_text(unpacked)} and more out of {size_text(packed)}. Where the file can be trusted, unpack it "
                "first, or read it with limits=Limits(most_ratio=…).",
                path=path,
            )


def size_text(count: int) -> str:
    """Return a number of bytes as a person reads it: 512 bytes, 3.0 MiB."""
    if count < 1 << 10:
        return f"{count} bytes"
    size = float(count)
    for unit in ("KiB", "MiB", "GiB", "TiB", "PiB"):
        size /= 1024
        if size < 1024 or unit == "PiB":
            break
    return f"{size:.1f} {unit}"


@contextmanager
def open_source(path: str | os.PathLike[str], what: str = "a model") -> Iterator[BinaryIO]:
    """Open a file for reading.

    Parameters
    ----------
    path : path
    what : str
        What it should hold, with an article.

    Yields
    ------
    binary file
        Not empty, at its beginning.

    Raises
    ------
    SourceError
        Where it is missing, a folder, not an ordinary file, empty, or may not be read.
    """
    shown = os.fspath(path)
    try:
        if Path(path).is_dir():
            raise SourceError(
                f"{what.capitalize()} must be a file, but '{shown}' is a folder. Name a file in it.", path=shown
            )
        if Path(path).exists() and not Path(path).is_file():
            raise SourceError(f"{what.capitalize()} must be an ordinary file, but '{shown}' is none.", path=shown)
        file = Path(path).open("rb")  # noqa: SIM115 - the errors of opening are told apart from those of the block
    except FileNotFoundError:
        raise SourceError(
            f"A file must exist to be read, but there is no '{shown}'. Check its name.", path=shown
        ) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise SourceError(f"A file must be readable, but '{shown}' is not: {reason}.", path=shown) from error
    with file:
        if os.fstat(file.fileno()).st_size == 0:
            raise SourceError(
                f"{what.capitalize()} must not be empty, but '{shown}' has no bytes. Write or copy it anew.", path=shown
            )
        yield file


@contextmanager
def write_atomically(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Write a file whole or not at all: into a new file beside it, which takes its place at the end.

    Parameters
    ----------
    path : path

    Yields
    ------
    binary file
        To write into; thrown away where the block raises.

    Raises
    ------
    SourceError
        Where the folder is missing or may not be written to, the disk is full, or `path` is a folder.
    """
    import secrets

    target, shown = Path(path), os.fspath(path)
    check_target(path)
    part = target.with_name(f".{target.name[:80]}.{secrets.token_hex(6)}.part")
    try:
        with unfinished(part):
            descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
            with os.fdopen(descriptor, "wb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            part.replace(target)
    except OSError as error:
        raise _unwritable(shown, error) from error


def check_target(path: str | os.PathLike[str], unlike: str | None = None) -> None:
    """Raise SourceError where a file cannot be written for sure, or is the one at `unlike`: before anything long begins."""
    target, shown = Path(path), os.fspath(path)
    try:
        if target.is_dir():
            raise SourceError(
                f"What is written must go to a file, but '{shown}' is a folder. Give a file name.", path=shown
            )
        target.parent.stat()
    except OSError as error:
        raise _unwritable(shown, error) from error
    same = False
    if unlike is not None:
        with suppress(OSError, ValueError):  # a file that is not there is not the same
            same = os.path.samefile(unlike, target)  # noqa: PTH121 - of a name that may be none
    if same:
        raise SourceError(
            f"The answer must go to another file than the model comes from, but '{shown}' is both. Give another name.",
            path=shown,
        )


def _unwritable(shown: str, error: OSError) -> SourceError:
    full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    what_to_do = "Make room there, or write to another place" if full else "Check its folder"
    return SourceError(
        f"'{shown}' must be writable, but it cannot be written: {error.strerror or error}. {what_to_do}.",
        path=shown,
    )
