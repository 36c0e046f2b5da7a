"""What ``--time-limit`` and ``--memory-limit`` say enters; limits that hold while a command works leave.

A limit of memory holds in two ways. Before something large is made there is a look at whether it fits
(`ratherthan.model.watch.room_for`); and where the system can, it grants no more (RLIMIT_DATA of Linux), so that what nobody foresaw
ends in a MemoryError and its sentence, too.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from ratherthan.apps.door import code_of, say
from ratherthan.errors import LimitError, StoppedError
from ratherthan.model.memory import memory_held, size_text
from ratherthan.model.watch import Limits, Watch, watching

if TYPE_CHECKING:
    from ratherthan.solve import Solution

__all__ = ["Amount", "Duration", "limited", "speaking", "with_value"]

SECONDS = {"": 1.0, "ms": 1e-3, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
BYTES = {"": 1, "b": 1, "k": 2**10, "m": 2**20, "g": 2**30, "t": 2**40}
NUMBER = re.compile(r"\s*(\d+(?:\.\d*)?|\.\d+)\s*([a-z]*)\s*", re.IGNORECASE | re.ASCII)
LEAST = 1 << 26
"""Bytes that a process must be allowed beyond those that it holds, to do anything at all."""


class Duration(click.ParamType[float]):
    """Seconds, as 10, 10s, 2m or 1h."""

    name = "duration"

    def convert(self, value: str | float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number of seconds."""
        seconds = value if isinstance(value, int | float) else _amount(value, SECONDS)
        if seconds is None or not 0.0 < seconds < float("inf"):
            self.fail(f"A time limit must be a time above 0, such as 10, 10s, 2m or 1h, got '{value}'.", param, ctx)
        return float(seconds)


class Amount(click.ParamType[int]):
    """Bytes, as 500MB or 4GB; a unit is 1024 of the one below it."""

    name = "size"

    def convert(self, value: str | float, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number of bytes."""
        size = value if isinstance(value, int | float) else _amount(value, _byte_units())
        if size is None or not 1.0 <= size < float("inf"):
            self.fail(
                f"A memory limit must be a size above 0 with its unit, such as 500MB or 4GB, got '{value}'.", param, ctx
            )
        return int(size)


def _byte_units() -> dict[str, int]:
    """Return the units of memory in all their spellings: g, gb, gib."""
    return BYTES | {f"{unit}{end}": size for unit, size in BYTES.items() if size > 1 for end in ("b", "ib")}


def _amount(text: str, units: dict[str, float] | dict[str, int]) -> float | None:
    """Return a number times its unit, None where it is none."""
    match = NUMBER.fullmatch(text)
    if match is None or match[2].lower() not in units:
        return None
    return float(match[1]) * units[match[2].lower()]


@contextmanager
def limited(seconds: float | None, memory: int | None) -> Iterator[Watch]:
    """Hold the block to limits, and let the guard of the process, where it has one, see to it.

    Parameters
    ----------
    seconds : float, optional
    memory : int, optional
        Bytes.

    Yields
    ------
    Watch
    """
    from ratherthan.apps import guard

    if memory is not None and (held := memory_held()) + LEAST > memory:
        raise click.BadParameter(
            f"A memory limit must leave the program room to work, at least {size_text(held + LEAST)}, got {size_text(memory)}.",
            param_hint="'--memory-limit'",
        )
    with watching(Limits(seconds=seconds, memory=memory)) as watch, _granted(memory):
        if guard.guard is not None:
            guard.guard.hold(watch, _known(_said))
        yield watch


def _said(error: StoppedError) -> int:
    """Say what is known, and return the exit code."""
    say(error.message)
    return code_of(error)


@contextmanager
def speaking(tell: Callable[[StoppedError], None]) -> Iterator[None]:
    """Have `tell` say what is known where a limit stops the solver in the block, if that cannot even be interrupted.

    Parameters
    ----------
    tell : callable
        Takes the error with what is proved by then; it is called in another thread, and the process ends after it.
    """
    from ratherthan.apps.guard import guard

    if guard is None:
        yield
        return

    def answer(error: StoppedError) -> int:
        tell(error)
        return code_of(error)

    before, guard.answer = guard.answer, _known(answer)
    try:
        yield
    finally:
        guard.answer = before


def _known(answer: Callable[[StoppedError], int]) -> Callable[[LimitError], int]:
    """Return what tells of a limit, by what is known of the problem that is being solved, if one is."""

    def told(limit: LimitError) -> int:
        from ratherthan.apps import guard

        watch = None if guard.guard is None else guard.guard.watch
        kept = {} if watch is None else watch.board.kept
        if "problem" not in kept:
            say(limit.message)
            return code_of(limit)
        from ratherthan.solve.stopped import unsolved

        return answer(unsolved(limit, kept))

    return told


@contextmanager
def with_value(solution: Solution) -> Iterator[None]:
    """Let a limit that is reached in the block say what value was found before."""
    try:
        yield
    except LimitError as limit:
        initial = solution.problem.mdp.initial
        if len(initial) != 1 or "solution" in limit.place:
            raise
        lower, upper = (float(bound[0, initial[0]]) for bound in (solution.lower, solution.upper))
        raise type(limit)(
            f"{limit.message} The value at the start was found before: it is between {lower:.10g} and {upper:.10g}.",
            **limit.place,
        ) from limit


@contextmanager
def _granted(memory: int | None) -> Iterator[None]:
    """Let the system grant no more memory than that, where it can; what it granted and nobody uses does not count."""
    if memory is None or sys.platform != "linux":
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    unused = max(_data() - memory_held(), 0)
    most = memory + unused + LEAST
    if before[1] != resource.RLIM_INFINITY:
        most = min(most, before[1])
    resource.setrlimit(resource.RLIMIT_DATA, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def _data() -> int:
    """Return the bytes that the system has granted this process for data, used or not."""
    import resource
    from pathlib import Path

    try:
        return int(Path("/proc/self/statm").read_bytes().split()[5]) * resource.getpagesize()
    except (OSError, ValueError, IndexError):
        return 0
