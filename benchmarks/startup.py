"""How long a person waits for the command: whole processes, against Python alone and Python with numpy."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from benchmarks.harness import Case, UnavailableError

EXAMPLE = "example:city-1"  # 100 states: small enough that nothing needs to be compiled
COMMAND = str(Path(sys.executable).parent / "ratherthan")


def process(*words: str) -> Callable[[], object]:
    """Return a function that runs the command `words` to its end."""

    def run() -> None:
        done = subprocess.run(
            words,
            env=os.environ | {"NO_COLOR": "1"},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise UnavailableError((done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1])

    return run


def cases() -> list[Case]:
    return [
        Case(name="python -c pass", run=process(sys.executable, "-c", "pass"), peer=True),
        Case(name="python -c 'import numpy'", run=process(sys.executable, "-c", "import numpy"), peer=True),
        Case(name="python -c 'import ratherthan'", run=process(sys.executable, "-c", "import ratherthan")),
        Case(name="ratherthan --help", run=process(COMMAND, "--help")),
        Case(name=f"ratherthan explain {EXAMPLE}", run=process(COMMAND, "explain", EXAMPLE)),
    ]
