"""How fast models that are no maps are solved, each by the method that the program chooses, against Storm's sound methods."""

from __future__ import annotations

from functools import partial

from benchmarks.harness import Case
from benchmarks.models import expander, loops, maze, one_way_city, ring, walk
from benchmarks.peers import SOUND, by_storm, by_us

MODELS = {
    "one-way city, 300 × 300": partial(one_way_city, 300),
    "maze, 300 × 300": partial(maze, 300),
    "expander, 100,000 states": partial(expander, 100_000),
    "ring, 100,000 states": partial(ring, 100_000),
    "walk of six processes, 88,209 states": partial(walk),
    "end components, 100,000 states": partial(loops, 100_000),
}


def cases() -> list[Case]:
    method = SOUND["optimistic value iteration"]
    return [
        case
        for name, model in MODELS.items()
        for case in (
            Case(name="ratherthan", run=by_us(model), group=name, peer=True),
            Case(name="Storm, optimistic value iteration", run=by_storm(model, method), group=name),
        )
    ]
