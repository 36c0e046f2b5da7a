"""How fast maps of a million cells are solved with proved bounds, against Storm's sound methods."""

from __future__ import annotations

from benchmarks import maps
from benchmarks.harness import Case

SIDE = 1000


def cases() -> list[Case]:
    return maps.cases(SIDE)
