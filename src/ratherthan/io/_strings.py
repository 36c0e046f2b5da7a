"""Strings enter, offsets and one block of UTF-8 leave, and back: a million of them are never made at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError

__all__ = ["PackedStrings", "pack_strings"]

Bytes = npt.NDArray[np.uint8]
Words = npt.NDArray[np.uint64]


class PackedStrings(Sequence[str]):
    """Strings in one block of UTF-8, decoded one by one when asked for.

    Parameters
    ----------
    offsets : array of uint64, ``[N+1]``
        Where each begins and the last ends.
    block : array of uint8
    where : str
        How the block is called in errors.

    Raises
    ------
    SourceError
        Where the offsets do not fit the block, or a string is not UTF-8.
    """

    def __init__(self, offsets: Words, block: Bytes, where: str) -> None:
        fits = (
            len(offsets) and offsets[0] == 0 and offsets[-1] == len(block) and bool((offsets[1:] >= offsets[:-1]).all())
        )
        if not fits:
            raise SourceError(
                f"Strings must lie one after the other, but the offsets of {where} do not rise from 0 to the "
                f"{len(block)} bytes of its strings. Write the archive anew."
            )
        self.block = block.tobytes()
        starts = offsets[:-1][offsets[:-1] < len(block)].astype(np.int64)
        try:
            self.block.decode("utf-8")
            whole = not bool((block[starts] & 0xC0 == 0x80).any())
        except UnicodeDecodeError:
            whole = False
        if not whole:
            raise SourceError(f"Strings must be UTF-8, but one of {where} is not. Write the archive anew.")
        self.offsets = offsets.astype(np.int64)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[str]: ...
    def __getitem__(self, index: int | slice) -> str | Sequence[str]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        index = range(len(self))[index]
        return self.block[self.offsets[index] : self.offsets[index + 1]].decode("utf-8")


def pack_strings(strings: Sequence[str]) -> tuple[Words, Bytes]:
    """Return the offsets ``[N+1]`` and the block of UTF-8 of some strings."""
    try:
        encoded = [string.encode("utf-8") for string in strings]
    except UnicodeEncodeError as error:
        raise SourceError(
            f"Names must be whole Unicode text to be written, got {error.object!r}. Rename it."
        ) from error
    offsets = np.zeros(len(encoded) + 1, dtype="<u8")
    np.cumsum([len(string) for string in encoded], out=offsets[1:], dtype=np.uint64)
    return offsets, np.frombuffer(b"".join(encoded), dtype=np.uint8)
