"""Files, folders and processes enter that must not outlive the work they were made for; none of them is left.

Whoever makes one removes it at the end. What stands here is for an end that comes all of a sudden: then `remove_leftovers` is
called, perhaps by another thread.
"""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["remove_leftovers", "started", "temporary_folder", "unfinished"]

_paths: dict[Path, int] = {}
_children: dict[int, int] = {}
"""With the process that made them: a copy of it must not remove what is its parent's."""


@contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """Yield the path of a file or folder that is gone after the block, however that ends."""
    _paths[path] = os.getpid()
    try:
        yield path
    finally:
        _remove(path)
        _paths.pop(path, None)


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield a new folder that is gone after the block, with all that is in it."""
    with unfinished(Path(tempfile.gettempdir(), f"ratherthan-{secrets.token_hex(8)}")) as folder:
        folder.mkdir(mode=0o700)
        yield folder


@contextmanager
def started(child: int) -> Iterator[None]:
    """Hold on to a process that was started, by its number, for as long as the block waits for it."""
    _children[child] = os.getpid()
    try:
        yield
    finally:
        _children.pop(child, None)


def remove_leftovers() -> None:
    """Remove what is unfinished, and end the processes that were started."""
    for child, owner in list(_children.items()):
        if owner == os.getpid():
            with suppress(OSError):
                os.kill(child, getattr(signal, "SIGKILL", signal.SIGTERM))
    for path, owner in list(_paths.items()):
        if owner == os.getpid():
            _remove(path)


def _remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(FileNotFoundError):
            path.unlink()
