"""The process of a command line enters; signals and limits that end it within a second, whatever it is doing, leave.

Python hears a signal between two of its own steps. A compiled kernel or a solver in C has none, and may run for many seconds: nobody
who presses Ctrl-C waits for that. So a thread stands guard. Python's own handler of a signal, in C, writes its number into a
pipe at once; the thread reads it there and gives the work `GRACE` to end in good order, by an exception like any other.
Where that does not come to pass the thread ends the process itself, after removing what is half written and
ending what was started besides. All that is large in numpy, scipy and our kernels runs without the interpreter's lock, so
that the thread can run meanwhile.

Limits work the same way: computations look at the clock themselves (`ratherthan.model.watch`); where one does not,
the thread interrupts it with the limit's own error, and where that does not help either, tells what is known and ends the process.

It costs a thread and a pipe, well below a millisecond, and nothing is ever forked: the work stays in this process and its main
thread. On Windows the pipe is a pair of sockets, as only these can be waited for there.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import FrameType, TracebackType
from typing import Any

from ratherthan.errors import LimitError
from ratherthan.model.watch import Watch

__all__ = ["Answer", "Guard", "Terminated", "guard", "stand_guard"]

GRACE = 0.5
"""Seconds that the work has to end by itself after a signal."""
LATE = 0.4
"""Seconds after a limit from which on the work is interrupted that did not look at the clock."""
STUCK = 1.2
"""Seconds after a limit from which on work that heard no interrupt is left where it is."""
TELLING = 8.0
"""Seconds after a limit in which all that is known must be told."""
TICK = 0.1
LONGEST = 3600.0
"""Seconds that the thread waits at once: the system refuses to wait for thousands of years."""

Answer = Callable[[LimitError], int]
"""Tells what is known where a limit was reached, and returns the exit code."""


class Terminated(KeyboardInterrupt):
    """Somebody wants this process to end, by another signal than Ctrl-C; with the exit code that tells which."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.code = 128 + number


class Guard:
    """What stands by while a command works; made by `stand_guard`.

    Parameters
    ----------
    say : callable
        Takes the message of a limit that nobody else told.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self.say = say
        self.signal = 0
        self.heard = 0.0
        self.raised = False
        self.working = False
        self.answering = False
        self.interrupts = 0
        self.watch: Watch | None = None
        self.answer: Answer | None = None
        self.limit: LimitError | None = None
        self.since = 0.0
        self.main = threading.main_thread().ident or 0
        self.ear, self.mouth = _pipe()

    @property
    def code(self) -> int:
        """The exit code of a process that a signal ended."""
        return 128 + (self.signal or signal.SIGINT)

    @property
    def limit_reached(self) -> bool:
        """Whether a limit ended the work, noticed by the work or by the thread."""
        return self.limit is not None or (self.watch is not None and self.watch.board.stopped)

    def start(self) -> None:
        """Begin to listen."""
        signal.set_wakeup_fd(self.mouth.fileno(), warn_on_full_buffer=False)
        for number in _heard():
            if number != getattr(signal, "SIGHUP", None) or signal.getsignal(number) != signal.SIG_IGN:  # nohup
                signal.signal(number, self.on_signal)
        sys.unraisablehook, sys.excepthook = self.on_unraisable, self.on_uncaught
        threading.Thread(target=self.listen, name="guard", daemon=True).start()

    def cause(self, error: BaseException) -> BaseException:
        """Return what ended the work: an interrupt may come out as another error, where it broke something on its way."""
        if self.raised and self.signal:
            return KeyboardInterrupt()
        return self.limit if self.raised and self.limit is not None and not isinstance(error, LimitError) else error

    def hold(self, watch: Watch | None, answer: Answer | None = None) -> None:
        """Watch over these limits from now on, over none without them; `answer` tells what is known where a limit is reached."""
        self.watch, self.answer, self.limit = watch, answer, None
        with suppress(OSError):
            self.mouth.send(b"\0")

    def on_signal(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 - the signature of handlers
        """Interrupt the main thread: once, as it must not be interrupted while it clears up."""
        while self.answering:  # the other thread speaks, and ends the process
            time.sleep(TICK)
        if not self.working:  # nothing is under way, or not any more: nobody would catch what is raised
            self.signal = self.signal or number
            self.end(self.code)
        if self.raised:
            return
        if self.limit is not None and self.watch is not None and self.interrupts and not self.heard:
            if self.watch.board.stopped:  # it was noticed in the meantime
                return
            self.raised = self.watch.board.stopped = True
            raise self.limit
        self.raised, self.signal = True, self.signal or number
        raise KeyboardInterrupt if number == signal.SIGINT else Terminated(number)

    def on_uncaught(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        """End the process where an interrupt came in the moment between two that would have caught it."""
        if self.signal and issubclass(kind, KeyboardInterrupt):
            self.end(self.code)
        sys.__excepthook__(kind, error, trace)

    def on_unraisable(self, told: Any) -> None:
        """Have the thread interrupt once more where the interrupt came at a place that swallows every error."""
        if issubclass(told.exc_type, KeyboardInterrupt | LimitError):  # the value may be missing
            self.raised, self.interrupts = False, 0
            if self.watch is not None:
                self.watch.board.stopped = False
        else:
            sys.__unraisablehook__(told)

    def listen(self) -> None:
        """Wait for signals and for limits to be reached."""
        import select

        while True:
            ready, _, _ = select.select([self.ear], [], [], self._pause())
            if ready:
                numbers = self.ear.recv(64)
                ours = [number for number in numbers if number in _heard()]
                mine = min(self.interrupts, ours.count(signal.SIGINT)) if self.limit is not None else 0
                if len(ours) > mine and not self.heard:
                    self.signal, self.heard = self.signal or ours[0], time.monotonic()
            if self.heard and time.monotonic() > self.heard + GRACE:
                self.end(self.code)
            if self.heard and time.monotonic() > self.heard + TICK and not self.raised:
                self._interrupt()
            if self.watch is not None and not self.heard:
                self._attend(self.watch)

    def _pause(self) -> float | None:
        """Return for how long nothing can happen but a signal, None for ever."""
        if self.heard or self.limit is not None:
            return TICK
        if self.watch is None:
            return None
        if self.watch.limits.memory is not None:
            return TICK
        left = self.watch.until - time.monotonic()
        return None if left == float("inf") else min(max(left, 0.01), LONGEST)

    def _attend(self, watch: Watch) -> None:
        """Interrupt work that does not notice that a limit is reached; leave it where it is if it cannot be interrupted."""
        if self.limit is None:
            self.limit, self.since = watch.reached(), time.monotonic()
            return
        late = time.monotonic() - self.since
        noticed = self.raised or watch.board.stopped
        if late > TELLING:
            self.say(self.limit.message)
            self.end(1)
        if noticed or late < LATE:
            return
        if not self.interrupts:
            self._interrupt()
        elif late > STUCK:
            self.answering = True
            if self.raised or watch.board.stopped:  # at the last moment
                self.answering = False
                return
            self.end(self._answered(self.limit))

    def _answered(self, limit: LimitError) -> int:
        """Tell what is known, from this thread."""
        try:
            if self.answer is not None:
                return self.answer(limit)
        except Exception as error:  # noqa: BLE001 - what is known could not be told: the sentence alone is left
            if os.environ.get("RATHERTHAN_DEBUG"):
                sys.__excepthook__(type(error), error, error.__traceback__)
        self.say(limit.message)
        return 1

    def _interrupt(self) -> None:
        """Let the main thread be interrupted between two of its steps."""
        self.interrupts += 1
        if hasattr(signal, "pthread_kill"):  # which also ends the waiting of a call of the system
            signal.pthread_kill(self.main, signal.SIGINT)
        else:
            _thread.interrupt_main(signal.SIGINT)

    def end(self, code: int) -> None:
        """End the process now, with nothing half written and nobody left working."""
        for room, verb in (("io._leftovers", "remove_leftovers"), ("apps.waiting", "restore_terminal")):
            module = sys.modules.get(f"ratherthan.{room}")
            if module is not None:
                with suppress(Exception):
                    getattr(module, verb)()
        os._exit(code)


guard: Guard | None = None
"""That of this process, where it is a command line's."""


def stand_guard(say: Callable[[str], None]) -> Guard:
    """Return the guard of this process; the first call sets it up, in the main thread."""
    global guard
    if guard is None:
        guard = Guard(say)
        guard.start()
    return guard


def _heard() -> tuple[int, ...]:
    """Return the signals that end a command."""
    names = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    return tuple(int(getattr(signal, name)) for name in names if hasattr(signal, name))


class _End:
    """One end of a pipe, with the verbs of a socket."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor

    def fileno(self) -> int:
        return self.descriptor

    def recv(self, most: int) -> bytes:
        return os.read(self.descriptor, most)

    def send(self, numbers: bytes) -> int:
        return os.write(self.descriptor, numbers)


def _pipe() -> tuple[Any, Any]:
    """Return two ends between which numbers go, the second of which never blocks."""
    if sys.platform == "win32":
        import socket

        ends = socket.socketpair()
        ends[1].settimeout(0.0)
        return ends
    ear, mouth = os.pipe()
    os.set_blocking(mouth, False)
    return _End(ear), _End(mouth)
