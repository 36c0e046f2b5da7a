"""How fast the largest probability to arrive is found on maps with traps, against Storm's sound methods."""

from __future__ import annotations

from functools import partial

from benchmarks.harness import Case
from benchmarks.models import trap_map
from benchmarks.peers import SOUND, by_storm, by_us

SIDE = 300


def cases() -> list[Case]:
    model, name = partial(trap_map, SIDE), f"{SIDE} × {SIDE} cells, one in seven a trap"
    return [
        Case(name="ratherthan", run=by_us(model), group=name, peer=True),
        *(Case(name=f"Storm, {words}", run=by_storm(model, method), group=name) for words, method in SOUND.items()),
    ]
