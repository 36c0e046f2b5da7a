"""Machine code enters, files leave, and back: where compiled code is kept, and what is done when that cannot be.

The first of these that can be written to: the folder that ``NUMBA_CACHE_DIR`` names; the user's own cache; a folder of this user
alone in the place for temporary files. Where none can, nothing is kept.

A file is written whole and moved in place, so that processes may write the same one at once. It begins with a checksum of the
rest: a damaged file is as good as none. A name holds the kernel and a digest of all that the code depends on, the kernel's
text, the types, the processor and the compiler: what is out of date is never found, and is removed when nobody has used it for
a month.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

__all__ = ["SUFFIX", "clear", "digest", "folder", "held", "keep", "kept"]

MARK = b"ratherthan code 1\n"
SUFFIX = ".code"
DAY = 86_400.0
LONGEST = 30 * DAY
"""Seconds that a file is kept after its last use, once another has taken its place."""


def digest(*parts: str) -> str:
    """Return a name for all of `parts` together."""
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()[:32]


def folder() -> Path | None:
    """Return the folder for compiled code, None where none can be written to."""
    return _folder(os.environ.get("NUMBA_CACHE_DIR"))


@cache
def _folder(given: str | None) -> Path | None:
    """Return the first folder that can be written to."""
    for place in _places(given):
        try:
            place.mkdir(parents=True, exist_ok=True, mode=0o700)
            with tempfile.NamedTemporaryFile(dir=place, prefix=".probe-"):
                pass
        except OSError:
            continue
        return place
    return None


def _places(given: str | None) -> Iterator[Path]:
    """Yield where compiled code may be kept, best first."""
    if given:
        yield Path(given) / "ratherthan"
    from platformdirs import user_cache_path

    with suppress(RuntimeError):  # a user without a home
        yield user_cache_path("ratherthan") / "compiled"
    user = os.getuid() if hasattr(os, "getuid") else None
    own = Path(tempfile.gettempdir()) / f"ratherthan-{user}"
    if user is not None and _is_private(own, user):
        yield own


def _is_private(place: Path, user: int) -> bool:
    """Whether a folder among everybody's files is this user's alone, so that nobody else puts code there; made if need be."""
    with suppress(OSError):
        place.mkdir(mode=0o700, exist_ok=True)
        state = place.lstat()
        return state.st_uid == user and not state.st_mode & 0o022 and not place.is_symlink()
    return False


def keep(name: str, facts: dict[str, Any], code: bytes) -> None:
    """Keep machine code and what must be known to run it, if that can be done.

    Parameters
    ----------
    name : str
        The kernel, a dash, and the digest of all that the code depends on.
    facts : dict
        What JSON can hold.
    code : bytes
    """
    place = folder()
    if place is None:
        return
    rest = json.dumps(facts).encode() + b"\n" + code
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(dir=place, prefix=".new-", delete=False) as file:
            temporary = Path(file.name)
            file.write(MARK + hashlib.sha256(rest).digest() + rest)
        temporary.replace(place / (name + SUFFIX))
        _forget(place, name)
    except OSError:  # a full disk, a folder that is gone: it is compiled again next time
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()


def kept(name: str) -> tuple[dict[str, Any], bytes] | None:
    """Return what is kept under `name`, None where there is nothing or it is damaged."""
    place = folder()
    if place is None:
        return None
    path = place / (name + SUFFIX)
    begin = len(MARK) + 32
    try:
        whole = path.read_bytes()
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > DAY:
                os.utime(path)
    except OSError:
        return None
    if not whole.startswith(MARK) or hashlib.sha256(whole[begin:]).digest() != whole[len(MARK) : begin]:
        return None
    facts, _, code = whole[begin:].partition(b"\n")
    return json.loads(facts), code


def _forget(place: Path, name: str) -> None:
    """Remove what took this name's place before and was not used for long, and what a process left half written."""
    kernel, now = name.rpartition("-")[0], time.time()
    for pattern, longest in ((f"{kernel}-*{SUFFIX}", LONGEST), (".new-*", DAY), (".probe-*", DAY)):
        for path in place.glob(pattern):
            with suppress(OSError):
                if now - path.stat().st_mtime > longest:
                    path.unlink()


def held() -> list[Path]:
    """Return the files that are kept."""
    place = folder()
    return [] if place is None else sorted(place.glob("*" + SUFFIX))


def clear() -> int:
    """Remove all compiled code that is kept; return how many bytes that were."""
    removed = 0
    for path in held():
        with suppress(OSError):
            size = path.stat().st_size
            path.unlink()
            removed += size
    return removed
