"""An archive's file enters; the header out of its index leaves, and the bytes of the files that the header makes needed."""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._files import Limits, size_text
from ratherthan.io._tar import Archive
from ratherthan.io._umb_index import Header, bits_size, parse_index

__all__ = ["OWN", "read_contents", "read_header"]

Array = npt.NDArray[Any]
WORDS = frozenset({"state-to-choices.bin", "choice-to-branches.bin", "branch-to-target.bin"})
LONGEST_INDEX = 16 << 20
OWN = "ratherthan/"
"""The folder in which what the format has no place for is kept: see `ratherthan.io._extras`."""


def read_header(file: BinaryIO, limits: Limits, shown: str) -> Header:
    """Return the header out of ``index.json``, the first file of the archive, or any other.

    Parameters
    ----------
    file : binary file
    limits : Limits
    shown : str
        How the archive is called in errors.

    Raises
    ------
    SourceError
        Where there is none, it breaks the format, or the arrays that it declares would take too much memory.
    """
    archive = Archive(file, limits, shown)
    elsewhere = ""
    for member in archive.members():
        if member.name == "index.json":
            if member.size > LONGEST_INDEX:
                raise SourceError(
                    f"index.json must be small, but that of '{shown}' has {size_text(member.size)}.", path=shown
                )
            header = parse_index(archive.read(member).tobytes(), shown)
            _check_memory(header, limits, shown)
            return header
        if member.name.endswith("/index.json"):
            elsewhere = f"; it has '{member.name}': pack the files without their folder"
    raise SourceError(f"A UMB file must have an index.json at its top, but '{shown}' has none{elsewhere}.", path=shown)


def _check_memory(header: Header, limits: Limits, shown: str) -> None:
    """Raise SourceError where the arrays that the index declares would take too much memory."""
    wanted = 8 * (header.states + header.choices + 2) + 4 * header.choices
    wanted += (8 + (header.probability.bits // 8 if header.probability else 8)) * header.branches
    wanted += header.states * len(header.labels)
    wanted += sum(
        header.count(entity) * reward.kind.bits // 8 for reward in header.rewards for entity in reward.applies_to
    )
    limits.check_bytes(wanted, shown)


def _sizes(header: Header) -> dict[str, int]:
    """Return the size in bytes of every file of which the index tells it."""
    sizes = {
        "state-to-choices.bin": 8 * (header.states + 1),
        "state-is-initial.bin": bits_size(header.states),
        "choice-to-branches.bin": 8 * (header.choices + 1),
        "branch-to-target.bin": 8 * header.branches,
    }
    if header.probability is not None:
        sizes["branch-to-probability.bin"] = header.probability.bits // 8 * header.branches
    if header.choice_actions:
        sizes["actions/choices/values.bin"] = 4 * header.choices
        sizes["actions/choices/string-mapping.bin"] = 8 * (header.choice_actions + 1)
    for label in header.labels:
        sizes[f"{label.folder}/states/values.bin"] = bits_size(header.states)
    for reward in header.rewards:
        for entity in reward.applies_to:
            sizes[f"{reward.folder}/{entity}/values.bin"] = reward.kind.bits // 8 * header.count(entity)
    if header.valuations is not None:
        if header.valuations.strings is not None:
            sizes["valuations/states/string-mapping.bin"] = 8 * (header.valuations.strings + 1)
        if len(header.valuations.classes) > 1:
            sizes["valuations/states/valuation-to-class.bin"] = 4 * header.states
    return sizes


def read_contents(file: BinaryIO, header: Header, limits: Limits, shown: str) -> dict[str, Array]:
    """Return the bytes of the files that are needed, each of the size that the index demands; those of `WORDS` as numbers.

    Parameters
    ----------
    file : binary file
    header : Header
    limits : Limits
    shown : str
        How the archive is called in errors.

    Raises
    ------
    SourceError
        Where a file has another size, or all of them together are too large.
    """
    sizes, free = _sizes(header), {"actions/choices/strings.bin"}
    if header.valuations is not None:
        folder = "valuations/states"
        free |= {f"{folder}/valuations.bin", f"{folder}/strings.bin", f"{folder}/string-mapping.bin"}
    data: dict[str, Array] = {}
    total = 0
    archive = Archive(file, limits, shown)
    for member in archive.members():
        if member.name not in sizes and member.name not in free and not member.name.startswith(OWN):
            continue
        demanded = sizes.get(member.name, member.size)
        if member.size != demanded:
            raise SourceError(
                f"'{member.name}' of '{shown}' must have {demanded} bytes by the counts in index.json, got {member.size}. "
                "Write the archive anew.",
                path=shown,
                member=member.name,
            )
        total += member.size
        limits.check_bytes(total, shown)
        data[member.name] = archive.read_words(member) if member.name in WORDS else archive.read(member)
    return data
