"""How long a person waits for the command: whole processes, against Python alone and Python with numpy.

The very first run of a large model finds no compiled code; how long that takes is compared with a later run, and with numba alone.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import ratherthan as rt
from benchmarks.harness import Case, UnavailableError
from benchmarks.models import slippery_map

EXAMPLE = "example:city-1"  # 100 states: small enough that nothing needs to be compiled
COMMAND = str(Path(sys.executable).parent / "ratherthan")
SIDE = 300


def process(*words: str, **environment: str) -> Callable[[], object]:
    """Return a function that runs the command `words` to its end."""

    def run() -> None:
        done = subprocess.run(
            words,
            env=os.environ | {"NO_COLOR": "1"} | environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise UnavailableError((done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1])

    return run


@cache
def room() -> Path:
    """Return a folder for this process, with a map in it."""
    place = tempfile.TemporaryDirectory(prefix="ratherthan-startup-")
    _KEPT.append(place)
    rt.write(slippery_map(SIDE), Path(place.name) / "map.npz")
    return Path(place.name)


_KEPT: list[tempfile.TemporaryDirectory[str]] = []


def explained(*, wish: str = "auto", kept: bool = True) -> Callable[[], object]:
    """Return a function that explains the map, with compiled code at hand or without."""

    def run() -> None:
        here = room()
        with tempfile.TemporaryDirectory(dir=here) as empty:
            code = str(here / "code") if kept else empty
            answer = str(here / "answer.json")
            process(
                COMMAND, "explain", str(here / "map.npz"), "-o", answer, NUMBA_CACHE_DIR=code, RATHERTHAN_COMPILE=wish
            )()

    return run


def cases() -> list[Case]:
    large = f"explain a map of {SIDE} × {SIDE}"
    return [
        Case(name="python -c pass", run=process(sys.executable, "-c", "pass"), peer=True),
        Case(name="python -c 'import numpy'", run=process(sys.executable, "-c", "import numpy"), peer=True),
        Case(name="python -c 'import ratherthan'", run=process(sys.executable, "-c", "import ratherthan")),
        Case(name="ratherthan --help", run=process(COMMAND, "--help")),
        Case(name=f"ratherthan explain {EXAMPLE}", run=process(COMMAND, "explain", EXAMPLE)),
        Case(name=f"{large}, the very first run", run=explained(kept=False)),
        Case(name=f"{large}, later", run=explained()),
        Case(name=f"{large}, the very first run, numba alone", run=explained(wish="numba", kept=False)),
        Case(name=f"{large}, later, numba alone", run=explained(wish="numba")),
    ]
