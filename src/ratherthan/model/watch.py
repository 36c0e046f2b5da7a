"""Limits of time and memory enter; long computations look at them now and then, and stop in good order where one is reached.

A computation does not know who waits for it. Whoever starts it says how long it may take and how much memory it may use, and
where to tell how far it is::

    with watching(Limits(seconds=10.0), tell=print):
        solution = solve(problem)

Every loop that can take long calls `look` at least some times a second; so does a loop over slices of a kernel, which cannot be
interrupted itself. `look` raises `LimitError` when a limit is reached, and lets an interrupt (Ctrl-C) through by being plain Python.
`room_for` asks before something large is made. `phase` names what is being done, for the message; `keep` lays down what is known
so far, for the answer that is given where a limit stops the rest.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

from ratherthan.errors import LimitError, QuestionError
from ratherthan.model.memory import memory_held, memory_left, size_text

__all__ = [
    "Limits",
    "Watch",
    "current",
    "keep",
    "look",
    "memory_held",
    "memory_left",
    "phase",
    "room_for",
    "unlimited",
    "watching",
]

PAUSE = 0.05
"""Seconds between two looks at the memory, which cost a call of the system each."""
UNGRANTED = "more was asked for than it leaves"
SMALL = 1 << 22
"""Bytes for which nobody asks whether there is room, unless a limit is set."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """How much a computation may take.

    Parameters
    ----------
    seconds : float, optional
        Of wall-clock time, from the moment on that it is watched.
    memory : int, optional
        Bytes that the process may hold. Without it, what the machine has left.

    Raises
    ------
    QuestionError
        If one of them is no number above 0.
    """

    seconds: float | None = None
    memory: int | None = None

    def __post_init__(self) -> None:
        """Refuse what is no limit."""
        for name, unit in (("seconds", "seconds"), ("memory", "bytes")):
            given = getattr(self, name)
            if given is None:
                continue
            if isinstance(given, bool) or not isinstance(given, int | float) or not given > 0 or math.isinf(given):
                raise QuestionError(
                    f"A limit must be a number of {unit} above 0, got {name}={given!r}. Leave it out for no limit.",
                    **{name: given},
                )


@dataclass(kw_only=True)
class Board:
    """What a computation tells whoever watches it, also from another thread."""

    phase: str | None = None
    text: str = ""
    kept: dict[str, Any] = field(default_factory=dict)
    looked: float = 0.0
    stopped: bool = False


@dataclass(frozen=True, kw_only=True)
class Watch:
    """Limits that hold, from when to when, and who is told.

    Parameters
    ----------
    limits : Limits
    until : float
        When the time is over, on the clock of `time.monotonic`; ∞ where there is no limit.
    tell : callable
        Takes a short text: how far it is.
    board : Board
        Shared by all watches within one another.
    """

    limits: Limits
    until: float
    tell: Callable[[str], None]
    board: Board

    def reached(self) -> LimitError | None:
        """Return the error of the limit that is reached, None where none is."""
        doing = "" if self.board.phase is None else f" while {self.board.phase}"
        if time.monotonic() >= self.until:
            seconds = self.limits.seconds
            return LimitError(
                f"The time limit of {seconds:g} s was reached{doing}.",
                limit="time",
                seconds=seconds,
                phase=self.board.phase,
            )
        most = self.limits.memory
        if most is not None and (held := memory_held()) > most:
            return self.too_much(f"{size_text(held)} were held")
        return None

    def too_much(self, why: str) -> LimitError:
        """Return the error of too much memory."""
        doing = "" if self.board.phase is None else f" while {self.board.phase}"
        return LimitError(
            f"The memory limit of {size_text(self.limits.memory or 0)} was reached{doing}: {why}.",
            limit="memory",
            memory=self.limits.memory,
            phase=self.board.phase,
        )


def _nobody(_: str) -> None:
    """Tell nobody."""


_NONE = Watch(limits=Limits(), until=float("inf"), tell=_nobody, board=Board())
_watch: ContextVar[Watch] = ContextVar("ratherthan.watch", default=_NONE)


def current() -> Watch:
    """Return the watch that holds here."""
    return _watch.get()


@contextmanager
def watching(limits: Limits | None = None, tell: Callable[[str], None] | None = None) -> Iterator[Watch]:
    """Hold the computations in the block to `limits`, besides those that hold already.

    Parameters
    ----------
    limits : Limits, optional
    tell : callable, optional
        Takes a short text: how far it is. Without it, whoever was told before.

    Yields
    ------
    Watch
        What holds in the block.

    Raises
    ------
    LimitError
        Where the block reaches a limit; also if the memory that is permitted does not suffice for an array.
    """
    outer, limits = _watch.get(), limits or Limits()
    until = float("inf") if limits.seconds is None else time.monotonic() + limits.seconds
    least = [most for most in (limits.memory, outer.limits.memory) if most is not None]
    watch = Watch(
        limits=Limits(
            seconds=limits.seconds if until <= outer.until else outer.limits.seconds,
            memory=min(least, default=None),
        ),
        until=min(until, outer.until),
        tell=tell or outer.tell,
        board=Board() if outer.board is _NONE.board else outer.board,
    )
    token = _watch.set(watch)
    try:
        yield watch
    except MemoryError as error:
        if limits.memory is None:
            raise
        raise watch.too_much(UNGRANTED) from error
    finally:
        _watch.reset(token)


@contextmanager
def unlimited() -> Iterator[None]:
    """Let the block go on although a limit is reached: for the short work of telling what is known."""
    outer = _watch.get()
    token = _watch.set(
        Watch(limits=Limits(), until=float("inf"), tell=outer.tell, board=Board(phase=outer.board.phase))
    )
    try:
        yield
    finally:
        _watch.reset(token)


@contextmanager
def phase(doing: str) -> Iterator[None]:
    """Name what the block does, as it follows "while" in a sentence: "reading 'map.umb'".

    Parameters
    ----------
    doing : str
    """
    watch = _watch.get()
    board = watch.board
    if board is _NONE.board:  # nobody watches: what is named here must not be seen by others
        yield
        return
    before, board.phase = board.phase, doing
    if before is None:  # within a phase its parts tell for themselves
        watch.tell(doing[:1].upper() + doing[1:])
    try:
        look()
        yield
    except MemoryError as error:
        if watch.limits.memory is None:
            raise
        raise watch.too_much(UNGRANTED) from error
    finally:
        board.phase = before


def keep(**parts: Any) -> None:
    """Lay down what is known so far, for the answer that is given where a limit stops the rest; nothing where nobody watches.

    Parameters
    ----------
    **parts : Any
        By name. The solver knows ``lower``, ``upper`` and ``guess``, values on the nodes of ``system``, ``rows`` and ``solved``, a
        policy's rows there and its solution, and ``engine``, the name of the method.
    """
    board = _watch.get().board
    if board is not _NONE.board:
        board.kept = board.kept | parts  # made anew, as another thread may be reading


def look(text: str | None = None) -> None:
    """Tell how far a computation is, and stop it where a limit is reached.

    Parameters
    ----------
    text : str, optional
        How far it is, in a few words.

    Raises
    ------
    LimitError
        If the time is over, or more memory is held than is permitted.
    """
    watch = _watch.get()
    if text is not None:
        watch.board.text = text
        watch.tell(text)
    if watch.limits.memory is None:
        if time.monotonic() < watch.until:
            return
    elif (now := time.monotonic()) < watch.until:
        if now - watch.board.looked < PAUSE:
            return
        watch.board.looked = now
    error = watch.reached()
    if error is not None:
        watch.board.stopped = True
        raise error


def room_for(size: float, what: str) -> None:
    """Raise where `size` more bytes cannot be had, before they are asked for.

    Parameters
    ----------
    size : float
        Bytes.
    what : str
        What they are for, as the beginning of a sentence: "A model of 10 states".

    Raises
    ------
    LimitError
        With what is needed and what there is.
    """
    limit = _watch.get().limits.memory
    if size < SMALL and limit is None:
        return
    left = memory_left()
    bound = "this machine has"
    if limit is not None and limit - memory_held() < left:
        left, bound = limit - memory_held(), f"the limit of {size_text(limit)} leaves"
    if size > left:
        raise LimitError(
            f"{what} must have about {size_text(size)} of memory, but {bound} {size_text(max(left, 0))}. "
            "Take a smaller model or a machine with more memory.",
            limit="memory",
            size=int(size),
        )
