"""How fast maps of 90,000 cells are solved with proved bounds, against equations and against Storm's sound methods."""

from __future__ import annotations

from functools import partial

from benchmarks.harness import Case
from benchmarks.models import slippery_map, still_map
from benchmarks.peers import SOUND, by_storm, by_us
from ratherthan.solve import PolicyIteration

SIDE = 300
FASTEST = "optimistic value iteration"
"""The fastest of Storm's sound methods here, and the only one that is asked on large maps."""


def cases(side: int = SIDE) -> list[Case]:
    slips, stays = partial(slippery_map, side), partial(still_map, side)
    sideways, failing = f"{side} × {side} cells, moves slip", f"{side} × {side} cells, moves may fail"
    methods = SOUND if side < 500 else {FASTEST: SOUND[FASTEST]}
    equations = Case(name="ratherthan, policy iteration", run=by_us(slips, PolicyIteration()), group=sideways)
    return [
        Case(name="ratherthan", run=by_us(slips), group=sideways, peer=True),
        *([equations] if side < 500 else []),
        *(Case(name=f"Storm, {name}", run=by_storm(slips, method), group=sideways) for name, method in methods.items()),
        Case(name="ratherthan", run=by_us(stays), group=failing, peer=True),
        *(Case(name=f"Storm, {name}", run=by_storm(stays, method), group=failing) for name, method in methods.items()),
    ]
