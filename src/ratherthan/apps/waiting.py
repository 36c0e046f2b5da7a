"""Work that takes long enters, a single line on standard error tells how it goes: only on a terminal, after one second."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.status import Status

__all__ = ["AFTER", "waiting"]

AFTER = 1.0
"""Seconds before anything is shown."""


class _Line:
    """The line, shown from a timer's thread and taken away from the one that works."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.over = False
        self.status: Status | None = None
        self.lock = threading.Lock()

    def show(self) -> None:
        from rich.console import Console
        from rich.markup import escape

        with self.lock:
            if not self.over:
                self.status = Console(stderr=True).status(escape(self.text))
                self.status.start()

    def tell(self, text: str) -> None:
        self.text = text
        with self.lock:
            if self.status is not None:
                from rich.markup import escape

                self.status.update(escape(text))

    def end(self) -> None:
        with self.lock:
            self.over = True
            if self.status is not None:
                self.status.stop()


@contextmanager
def waiting(text: str) -> Iterator[Callable[[str], None]]:
    """Show `text` while the block runs, and what it tells meanwhile.

    Parameters
    ----------
    text : str
        What is being done.

    Yields
    ------
    callable
        Takes a short text: how far it is.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield _nothing
        return
    line = _Line(text)
    timer = threading.Timer(AFTER, line.show)
    timer.daemon = True
    timer.start()
    try:
        yield line.tell
    finally:
        timer.cancel()
        line.end()


def _nothing(_: str) -> None:
    """Tell nobody."""
