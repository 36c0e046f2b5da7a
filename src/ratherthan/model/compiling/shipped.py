"""A kernel's digest enters, LLVM's text of it leaves: what travels with the package, so that a first run has little to compile.

numba turned the kernels into these texts once, for a processor that has nothing special; a text does not depend on the machine
beyond its 64 bits, and becomes machine code in hundredths of a second. Each has the name of its kernel and the digest of the
kernel's own text and types: where the kernel has changed since, there is no text for it, and numba is asked.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

__all__ = ["Made", "heads", "pack", "text_of_shipped"]

Made = tuple[str, dict[str, Any]]
"""LLVM's text, and its head: the kernel, the types of its arguments, and its result."""

ARCHIVE = "kernels.zip"


@cache
def _archive() -> dict[str, bytes]:
    """Return what is shipped, by name; nothing where it is not there or damaged."""
    try:
        with files(__package__).joinpath(ARCHIVE).open("rb") as file, zipfile.ZipFile(file) as archive:
            return {name: archive.read(name) for name in archive.namelist()}
    except (OSError, zipfile.BadZipFile):
        return {}


def heads() -> dict[str, dict[str, Any]]:
    """Return the heads of all that is shipped, by name."""
    return {name: _parted(whole)[1] for name, whole in _archive().items()}


def text_of_shipped(name: str) -> Made | None:
    """Return LLVM's text and its head, None where the kernel is not shipped for these types."""
    whole = _archive().get(name)
    return None if whole is None else _parted(whole)


def _parted(whole: bytes) -> Made:
    """Return a text and its head, which stands in its first line as a comment."""
    head, _, text = whole.decode("utf-8").partition("\n")
    return text, json.loads(head.removeprefix("; "))


def pack(texts: Mapping[str, Made], path: Path | None = None) -> Path:
    """Write an archive of texts: the same texts make the same bytes."""
    target = Path(str(files(__package__).joinpath(ARCHIVE))) if path is None else path
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, (text, head) in sorted(texts.items()):
            archive.writestr(zipfile.ZipInfo(name), f"; {json.dumps(head)}\n{text}", zipfile.ZIP_DEFLATED, 9)
    return target
