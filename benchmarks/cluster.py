"""How soon workers are there, how fast they answer many missions, and how a model in blocks compares with one process."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.harness import Case, Seen, UnavailableError, lazily
from benchmarks.models import slippery_map

SIDE = 300
COUNTS = (2, 4)


def cases() -> list[Case]:
    found = [
        Case(name="start and end of two workers", run=_start, group="engine"),
        Case(name="1,000 empty tasks", run=partial(_tasks, 1000), group="engine"),
    ]
    for workers in (1, 2):
        name = "one process" if workers == 1 else "two workers, with their start"
        found.append(
            Case(name=name, run=partial(_missions, workers), group="60 missions on 3 models", peer=workers == 1)
        )
    group = f"map {SIDE} x {SIDE}, from its file"
    found.append(Case(name="one process", run=lazily(_whole), group=group, peer=True))
    found += [
        Case(name=f"{n} blocks, with the workers' start", run=lazily(partial(_blocks, n)), group=group) for n in COUNTS
    ]
    return found


def _needed() -> None:
    from ratherthan.cluster.engine import is_there

    if not is_there():
        raise UnavailableError("needs the extra 'cluster'")


def _start() -> None:
    _needed()
    from ratherthan.cluster.engine import engine

    with engine(workers=2):
        pass


def _tasks(count: int) -> None:
    _needed()
    from ratherthan.cluster.engine import engine

    with engine(workers=2) as pool:
        pool.all_of([pool.submit(abs, number) for number in range(count)])


def _missions(workers: int) -> None:
    if workers > 1:
        _needed()
    from ratherthan.cluster import explain_many

    towns = ("city-1", "city-2", "city-3")
    rows = [{"source": f"example:{town}", "state": state} for town in towns for state in range(20)]
    explain_many(rows, workers=workers)


def _archive() -> Path:
    """Write the map as a plain archive; it goes with the machine's temporary files."""
    from ratherthan.io.umb_write import write_umb

    path = Path(tempfile.gettempdir()) / f"ratherthan-benchmark-{SIDE}.umb"
    write_umb(slippery_map(SIDE), path, packing="none")
    return path


def _whole() -> Callable[[], Seen]:
    path = _archive()

    def run() -> Seen:
        import ratherthan as rt

        solution = rt.solve(rt.read(path))
        start = int(solution.problem.mdp.initial[0])
        lower, upper = float(solution.lower[0, start]), float(solution.upper[0, start])
        return Seen(width=(upper - lower) / upper)

    return run


def _blocks(count: int) -> Callable[[], Seen]:
    _needed()
    path = _archive()

    def run() -> Seen:
        from ratherthan.cluster import solve_in_blocks

        found = solve_in_blocks(path, workers=2, blocks=count)
        return Seen(
            width=(found.upper - found.lower) / found.upper, note=f"{found.rounds[0]} + {found.rounds[1]} rounds"
        )

    return run
