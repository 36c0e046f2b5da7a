"""Work that cannot be interrupted enters; it is done in a process of its own, which can."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

from ratherthan.io._leftovers import started, temporary_folder
from ratherthan.model.watch import look

__all__ = ["apart", "follow_parent"]

LONGEST = 0.05
"""Seconds between two looks at whether it has ended."""
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG of Linux


def apart(work: Callable[[], object]) -> None:
    """Do some work in a copy of this process, for what it leaves in files; where the system makes no such copies, here.

    Parameters
    ----------
    work : callable
        Must not need other threads. What it prints goes nowhere.

    Raises
    ------
    RuntimeError
        With the message of what it raised, or where the copy broke off.
    MemoryError
        If the memory did not suffice.
    """
    if sys.platform != "linux":
        work()
        return
    with temporary_folder() as folder:
        path = folder / "error.json"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the copy uses none
            child = os.fork()
        if child == 0:
            _work(work, path)
        try:
            with started(child):
                status = _ended(child)
        except BaseException:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            raise
        code = os.waitstatus_to_exitcode(status)
        if path.is_file():
            kind, message = json.loads(path.read_text(encoding="utf-8"))
            raise MemoryError(message) if kind == MemoryError.__name__ else RuntimeError(message)
    if code == -signal.SIGKILL:
        raise MemoryError
    if code != 0:
        raise RuntimeError(f"it broke off ({f'signal {-code}' if code < 0 else f'exit code {code}'})")


def _ended(child: int) -> int:
    """Return the status of a process when it has ended; meanwhile limits hold."""
    pause = 0.001
    while True:
        number, status = os.waitpid(child, os.WNOHANG)
        if number:
            return status
        look()
        time.sleep(pause)
        pause = min(2.0 * pause, LONGEST)


def _work(work: Callable[[], object], path: Path) -> None:
    """Do the work in the copy, and end it."""
    code = 1
    try:
        follow_parent()
        signal.set_wakeup_fd(-1)  # that of the one that waits
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one that waits hears it, and ends the copy
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        work()
        code = 0
    except BaseException as error:  # noqa: BLE001 - it is told to the one that waits
        message = str(error) or str(getattr(error, "message", ""))
        path.write_text(json.dumps([type(error).__name__, message]), encoding="utf-8")
    finally:
        os._exit(code)


def follow_parent() -> None:
    """End with the process that asked, where the system can see to it."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
