"""Work that takes long enters, a single line on standard error tells how it goes: only on a terminal, after one second.

What a computation tells to `ratherthan.model.watch.look` is shown there, and for how long it has been at it: the seconds count on
also where it has nothing to tell, as the line is drawn by a thread of its own.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from ratherthan.model.watch import phase, watching

if TYPE_CHECKING:
    from rich.status import Status
    from rich.text import Text

__all__ = ["AFTER", "restore_terminal", "waiting"]

AFTER = 1.0
"""Seconds before anything is shown."""
AGAIN = 0.2
"""The same where something was shown before: who saw a line waits for the next one."""
OFTEN = 4
"""How many times a second it is drawn."""
SHOWN_AGAIN = b"\r\x1b[2K\x1b[?25h"
"""What takes a line away and brings the cursor back."""

_shown: Status | None = None
_seen = False


class _Line:
    """The line, shown from a timer's thread and taken away from the one that works."""

    def __init__(self, text: str) -> None:
        self.doing = text
        self.text = ""
        self.began = time.monotonic()
        self.over = False
        self.status: Status | None = None
        self.lock = threading.Lock()

    def show(self) -> None:
        global _shown, _seen
        from rich.console import Console

        with self.lock:
            if not self.over:
                console = Console(stderr=True)
                self.status = _shown = console.status(self, refresh_per_second=OFTEN)
                self.status.start()
                _seen = True

    def __rich__(self) -> Text:
        """Return the line as it is now."""
        from rich.text import Text

        told = self.doing if not self.text or self.text == self.doing else f"{self.doing}: {self.text}"
        return Text(f"{told} ({time.monotonic() - self.began:.0f} s)", no_wrap=True, overflow="ellipsis")

    def tell(self, text: str) -> None:
        self.text = text

    def end(self) -> None:
        global _shown
        with self.lock:
            self.over = True
            if self.status is not None:
                self.status.stop()
                _shown = None


@contextmanager
def waiting(text: str) -> Iterator[Callable[[str], None]]:
    """Show `text` while the block runs, and what it tells meanwhile, here or to `look`.

    Parameters
    ----------
    text : str
        What is being done.

    Yields
    ------
    callable
        Takes a short text: how far it is.
    """
    doing = text[:1].lower() + text[1:]  # as it follows "while"
    if sys.stderr is None or not sys.stderr.isatty():
        with phase(doing):
            yield _nothing
        return
    line = _Line(text)
    timer = threading.Timer(AGAIN if _seen else AFTER, line.show)
    timer.daemon = True
    timer.start()
    try:
        with watching(tell=line.tell), phase(doing):
            yield line.tell
    finally:
        timer.cancel()
        line.end()


def restore_terminal() -> None:
    """Take the line away in a hurry, where one is shown."""
    if _shown is not None:
        with suppress(OSError):
            os.write(2, SHOWN_AGAIN)


def _nothing(_: str) -> None:
    """Tell nobody."""
