"""Cases enter, a table of medians and ratios leaves.

All cases of a benchmark take turns, round after round, so that whatever else the machine does in the meantime hits them
alike; the ratio of two medians of one run is what counts. Absolute times are printed to be read, never asserted.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

__all__ = ["Case", "Measured", "measure", "table"]


@dataclass(frozen=True, kw_only=True)
class Case:
    """One thing to time.

    Parameters
    ----------
    name : str
        What is timed, in words.
    run : callable
        Does it once. It raises `UnavailableError` where this machine cannot do it.
    peer : bool
        Whether the other cases are compared with this one.
    """

    name: str
    run: Callable[[], object]
    peer: bool = False


class UnavailableError(Exception):
    """A case cannot be run here; the message says why."""


@dataclass(frozen=True, kw_only=True)
class Measured:
    """The times of one case in seconds, one per round; or why there are none."""

    case: Case
    seconds: Sequence[float] = field(default_factory=list)
    missing: str = ""

    @property
    def median(self) -> float:
        """The median time in seconds."""
        return statistics.median(self.seconds)


def measure(cases: Sequence[Case], rounds: int) -> list[Measured]:
    """Run every case once to warm up, then `rounds` times in turn."""
    seconds: dict[str, list[float]] = {case.name: [] for case in cases}
    missing: dict[str, str] = {}
    for turn in range(rounds + 1):
        for case in cases:
            if case.name in missing:
                continue
            start = time.perf_counter()
            try:
                case.run()
            except UnavailableError as reason:
                missing[case.name] = str(reason)
                continue
            if turn > 0:
                seconds[case.name].append(time.perf_counter() - start)
    return [Measured(case=case, seconds=seconds[case.name], missing=missing.get(case.name, "")) for case in cases]


def table(title: str, measured: Sequence[Measured]) -> str:
    """Return the lines to print: median, least and largest time, and the ratio to each peer."""
    peers = [m for m in measured if m.case.peer and m.seconds]
    width = max(len(m.case.name) for m in measured)
    rows = [title, "  ".join([" " * width, " median", "  least", "largest", *(f"/ {p.case.name}" for p in peers)])]
    for m in measured:
        if not m.seconds:
            rows.append(f"{m.case.name:<{width}}  not run: {m.missing}")
            continue
        times = [f"{t * 1e3:5.0f}ms" for t in (m.median, min(m.seconds), max(m.seconds))]
        ratios = [f"{m.median / p.median:>{len(p.case.name) + 1}.2f}×" for p in peers]
        rows.append("  ".join([f"{m.case.name:<{width}}", *times, *ratios]))
    return "\n".join(rows)
