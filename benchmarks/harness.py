"""Cases enter, a table of medians, ratios, memory and widths of intervals leaves.

All cases of a benchmark take turns, round after round, so that whatever else the machine does in the meantime hits them
alike; the ratio of two medians of one run is what counts. Absolute times are printed to be read, never asserted. Every case lives in
a process of its own: so its peak of memory is its own, and what does not come to an end can be stopped.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import resource
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

__all__ = ["Case", "Measured", "Seen", "UnavailableError", "lazily", "measure", "table"]

ENOUGH = 60.0
"""Seconds after which a case is not timed again."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What a case may tell besides its time.

    Parameters
    ----------
    width : float
        The relative width of the interval that is proved or promised.
    note : str
        Anything else worth a word.
    """

    width: float = float("nan")
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One thing to time.

    Parameters
    ----------
    name : str
        What is timed, in words.
    run : callable
        Does it once, and may return what it saw. It raises `UnavailableError` where this machine cannot do it. What must be made
        beforehand is made in the first call, which is not timed: see `lazily`.
    peer : bool
        Whether the other cases of its group are compared with this one.
    group : str
        What all cases compared with one another do.
    """

    name: str
    run: Callable[[], object]
    peer: bool = False
    group: str = ""


class UnavailableError(Exception):
    """A case cannot be run here; the message says why."""


@dataclass(kw_only=True)
class Measured:
    """The times of one case in seconds, one per round; or why there are none."""

    case: Case
    seconds: list[float] = field(default_factory=list)
    memory: int = 0  # bytes, the peak of the process
    seen: Seen = field(default_factory=Seen)
    missing: str = ""

    @property
    def median(self) -> float:
        """The median time in seconds."""
        return statistics.median(self.seconds)


def lazily(make: Callable[[], Callable[[], object]]) -> Callable[[], object]:
    """Return a function whose first call makes what it then calls, and calls it."""
    made = cache(make)

    def run() -> object:
        return made()()

    return run


def measure(module: str, rounds: int, most: float = 600.0) -> list[Measured]:
    """Run every case of a benchmark once to warm up, then up to `rounds` times in turn.

    Parameters
    ----------
    module : str
        A module with a function `cases`.
    rounds : int
    most : float
        Seconds after which a single run is stopped.
    """
    measured = [Measured(case=case) for case in importlib.import_module(module).cases()]
    workers = [_Worker(module, number) for number in range(len(measured))]
    try:
        for turn in range(rounds + 1):
            for m, worker in zip(measured, workers, strict=True):
                if not m.missing and (turn <= 1 or sum(m.seconds) < ENOUGH):
                    _once(m, worker, most, timed=turn > 0)
    finally:
        for worker in workers:
            worker.end()
    return measured


def _once(m: Measured, worker: _Worker, most: float, *, timed: bool) -> None:
    """Let a case run once, and note what came of it."""
    answer = worker.ask(most)
    if isinstance(answer, str):
        m.missing = answer
        worker.end()
        return
    seconds, m.memory, m.seen = answer
    if timed:
        m.seconds.append(seconds)


class _Worker:
    """The process in which a case lives; started when it is first asked."""

    def __init__(self, module: str, number: int) -> None:
        self.words = (module, number)
        self.process: BaseProcess | None = None
        self.line: Connection | None = None

    def ask(self, most: float) -> tuple[float, int, Seen] | str:
        """Return time, memory and what was seen of one run; or why there is none."""
        if self.process is None or self.line is None:
            context = multiprocessing.get_context("spawn")
            self.line, other = context.Pipe()
            self.process = context.Process(target=_serve, args=(*self.words, other), daemon=True)
            self.process.start()
            other.close()
        self.line.send("run")
        try:
            if not self.line.poll(most):
                return f"stopped after {most:.0f} s"
            answer: tuple[float, int, Seen] | str = self.line.recv()
        except EOFError:
            return "its process broke off"
        return answer

    def end(self) -> None:
        """Stop the process."""
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.process = None


def _serve(module: str, number: int, line: Connection) -> None:
    """Run a case each time that one is asked for."""
    case = importlib.import_module(module).cases()[number]
    with suppress(EOFError):
        while line.recv():
            start = time.perf_counter()
            try:
                seen = case.run()
            except UnavailableError as reason:
                line.send(str(reason))
                continue
            seconds = time.perf_counter() - start
            line.send((seconds, _peak(), seen if isinstance(seen, Seen) else Seen()))
    os._exit(0)


def _peak() -> int:
    """Return the most bytes of memory that this process has held."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def table(title: str, measured: Sequence[Measured]) -> str:
    """Return the lines to print, a table of Markdown for each group: median, range, ratios, memory and width."""
    groups = dict.fromkeys(m.case.group for m in measured)
    return "\n\n".join(_table(group or title, [m for m in measured if m.case.group == group]) for group in groups)


def _table(title: str, measured: Sequence[Measured]) -> str:
    """Return the table of one group."""
    peers = [m for m in measured if m.case.peer and m.seconds]
    wide = any(m.seen.width == m.seen.width for m in measured)
    heads = [title, "median", "range", *(f"/ {p.case.name}" for p in peers), "memory", *(["width"] if wide else []), ""]
    lines = [heads, ["---", *["---:"] * (len(heads) - 2), "---"]]
    for m in measured:
        if not m.seconds:
            lines.append([m.case.name, *[""] * (len(heads) - 2), f"not run: {m.missing}"])
            continue
        ratios = [f"{m.median / p.median:.2f}×" for p in peers]
        width = [] if not wide else [f"{m.seen.width:.1e}" if m.seen.width == m.seen.width else ""]
        span = f"{_time(min(m.seconds))} – {_time(max(m.seconds))}"
        lines.append([m.case.name, _time(m.median), span, *ratios, f"{m.memory / 2**20:.0f} MB", *width, m.seen.note])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _time(seconds: float) -> str:
    """Return a time in a unit that suits."""
    return f"{seconds * 1e3:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"
