"""Pictures to look at: of every example, and of models that are hard to draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import ratherthan as rt
from ratherthan.explain.explanation import Explanation
from ratherthan.io.grids.gridmap import Drive, problem_on
from ratherthan.io.grids.ground import Ground
from ratherthan.model.world import Frame
from ratherthan.render import Picture
from ratherthan.solve import Solution

EXAMPLES = ("paper-5x5", "city-1", "city-2", "city-3", "office", "pedestrians")
HARD = 'A <b>&"very"</b> long ]]> name \x07 地図の上の道 מפה של העיר'


def solved(name: str) -> Solution:
    """Return an example, solved; the delivery for its energy."""
    problem = rt.read(f"example:{name}")
    if name == "delivery":
        return rt.solve(problem, rt.parse_property('R{"energy"}min=? [F "delivered"]', problem))
    return rt.solve(problem)


def told_few(explanation: Explanation, count: int) -> Explanation:
    """Return an explanation of which only the first decisions are told."""
    steps, left = [], count
    for step in explanation.steps:
        told = step.critical is False or left > 0
        left -= step.critical is not False
        steps.append(replace(step, told=told))
    return replace(explanation, steps=tuple(steps))


def on_cells(rows: list[str], *, title: str = "", metres: bool = False) -> Solution:
    """Return the way from the upper left to the lower right cell of a map of dots and at-signs, solved."""
    closed = np.array([[letter == "@" for letter in row] for row in rows])
    ground = Ground(
        kinds=("open ground", "wall"),
        kind=closed.astype(np.uint8),
        open=~closed,
        water=np.zeros_like(closed),
        doubt=np.zeros(closed.shape),
        frame=Frame(resolution=0.25, x=-3.1, y=100.0) if metres else None,
    )
    drive = Drive(start="0,0", goal=f"{closed.shape[1] - 1},{closed.shape[0] - 1}", radius=0.0)
    problem = problem_on(ground, drive, source=title or "a map")
    assert problem.world is not None
    zone = np.zeros(closed.size, dtype=np.bool_)
    zone[: closed.size // 2] = True
    world = replace(problem.world, title=title, zones={title: zone} if title else {})
    return rt.solve(replace(problem, world=world))


def pictures() -> dict[str, Callable[[], Picture]]:
    """Return what is drawn, by name."""
    found: dict[str, Callable[[], Picture]] = {}
    for name in EXAMPLES:
        found[name] = lambda name=name: rt.draw(rt.explain(solved(name)))
        found[f"{name} as a graph"] = lambda name=name: rt.draw(rt.explain(solved(name)), "graph")
        found[f"{name} with few numbers"] = lambda name=name: rt.draw(told_few(rt.explain(solved(name)), 2))
        for what in ("value", "spread", "policy"):
            found[f"{what} of {name}"] = lambda name=name, what=what: rt.draw(solved(name), what)
    found["delivery"] = lambda: rt.draw(rt.explain(solved("delivery")))
    found["trees"] = lambda: rt.draw(solved("paper-5x5"), "trees", state=10)
    found["trees of a city"] = lambda: rt.draw(solved("city-1"), "trees", state=26, rather_than="south")
    found["trees of the delivery"] = lambda: rt.draw(solved("delivery"), "trees", state=1)
    found["factors"] = lambda: rt.draw(solved("paper-5x5"), "factors", state=5)
    found["one state"] = lambda: rt.draw(rt.explain(solved("paper-5x5"), state=10, rather_than="south"))
    for name, rows in {
        "one cell": ["."],
        "a row": ["." * 40],
        "a column": ["."] * 40,
        "a room": ["...", ".@.", "..."],
    }.items():
        for metres in (False, True):
            solution = on_cells(rows, title=HARD, metres=metres)
            said = f"{name} in metres" if metres else name
            found[said] = lambda solution=solution: rt.draw(rt.explain(solution))
            found[f"{said} as a graph"] = lambda solution=solution: rt.draw(rt.explain(solution), "graph")
            found[f"value of {said}"] = lambda solution=solution: rt.draw(solution)
    found["no route"] = lambda: rt.draw(rt.explain(on_cells([".@.", "@@.", "..."], title="closed")))
    found["several hundred cells"] = lambda: rt.draw(rt.explain(on_cells(["." * 200] * 3)))
    return found


PICTURES = pictures()
