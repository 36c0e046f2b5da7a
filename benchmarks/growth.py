"""How time and memory grow with the size of a map, 10³ to 10⁷ cells, against Storm up to 10⁶.

Both get the map as a file that another process has written: what counts as memory is what reading and solving take.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.harness import Case, Measured, lazily
from benchmarks.models import slippery_map
from benchmarks.peers import SOUND, by_storm, by_us
from ratherthan.io import read
from ratherthan.io.umb_write import write_umb

SIDES = (32, 100, 316, 1000, 2000, 3162)
MOST_FOR_STORM = 1000


def cases() -> list[Case]:
    method = SOUND["optimistic value iteration"]
    return [
        *(Case(name=f"ratherthan, {side**2:,} cells", run=_from_file(side)) for side in SIDES),
        *(
            Case(name=f"Storm, {side**2:,} cells", run=by_storm(partial(slippery_map, side), method))
            for side in SIDES
            if side <= MOST_FOR_STORM
        ),
    ]


def _from_file(side: int) -> Callable[[], object]:
    """Return a function that solves a map read from a file that is not packed, so that its large arrays are mapped."""

    def make() -> Callable[[], object]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "map.umb"
            subprocess.run([sys.executable, "-m", "benchmarks.growth", str(side), path], check=True)
            problem = read(path)
        return by_us(lambda: problem)

    return lazily(make)


def plot(measured: list[Measured], path: str) -> None:
    """Draw medians over sizes, both on logarithmic axes."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({"svg.hashsalt": "growth", "svg.fonttype": "none", "font.size": 11}):
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        axes = figure.add_subplot()
        for who, mark in (("ratherthan", "o-"), ("Storm", "s--")):
            found = [m for m in measured if m.seconds and m.case.name.startswith(who)]
            sizes = [int(m.case.name.split(", ", 1)[1].split(" ")[0].replace(",", "")) for m in found]
            label = f"{who}, certified" if who == "ratherthan" else f"{who}, optimistic value iteration"
            axes.loglog(sizes, [m.median for m in found], mark, label=label)
        axes.set_xlabel("cells of a slippery map")
        axes.set_ylabel("seconds")
        axes.grid(visible=True, which="both", alpha=0.25)
        axes.legend(frameon=False)
        figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    write_umb(slippery_map(int(sys.argv[1])), sys.argv[2], packing="none")
