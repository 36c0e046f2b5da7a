"""Where there is no way on a map, the cells that would have to open are a smallest set, for which a way is there."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.io.grids.drive import Drive
from ratherthan.io.grids.gridmap import read_gridmap
from ratherthan.io.grids.moves import Motion
from ratherthan.narrate import from_json, to_json
from ratherthan.verify import verify
from ratherthan.verify.verdict import Verdict


def problem_of(tmp_path, rows, **drive):
    path = tmp_path / "a.map"
    text = "\n".join("".join(row) for row in rows)
    path.write_text(f"type octile\nheight {len(rows)}\nwidth {len(rows[0])}\nmap\n{text}\n")
    return rt.read(path, **{"slip": 0.0, "goal": f"{len(rows[0]) - 1},{len(rows) - 1}", "start": "0,0"} | drive)


def explained(problem):
    return rt.explain(rt.solve(problem))


def arrives(rows, width, height):
    """Whether a flood over straight steps arrives, the benchmark's rule for water included."""
    seen, waiting = {(0, 0)}, [(0, 0)]
    while waiting:
        column, row = waiting.pop()
        for right, down in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            c, r = column + right, row + down
            if not (0 <= c < width and 0 <= r < height) or (c, r) in seen or rows[r][c] in "@T":
                continue
            if (rows[r][c] == "W") == (rows[row][column] == "W"):
                seen.add((c, r))
                waiting.append((c, r))
    return (width - 1, height - 1) in seen


def least_by_trial(rows, width, height):
    closed = [(c, r) for r in range(height) for c in range(width) if rows[r][c] in "@T"]
    for count in range(len(closed) + 1):
        for chosen in combinations(closed, count):
            opened = [list(row) for row in rows]
            for c, r in chosen:
                opened[r][c] = "."
            if arrives(opened, width, height):
                return count
    return None


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.parametrize("directions", [4, 8])
def test_no_smaller_set_of_cells_would_do(tmp_path, seed, directions):
    rng = np.random.default_rng(seed)
    width, height = (int(n) for n in rng.integers(1, 5, 2))
    rows = rng.choice(list(".@TW"), (height, width), p=(0.4, 0.3, 0.15, 0.15))
    rows[0, 0], rows[-1, -1] = ".", rng.choice([".", "W"])
    if rows.size == 1:
        rows[0, 0] = "."
    explanation = explained(problem_of(tmp_path, rows, directions=directions))
    least = least_by_trial(rows, width, height)
    if least is None or least == 0:
        assert explanation.openings == ()
        assert (explanation.route_outcome != "no way") == (least == 0)
        return
    assert explanation.route_outcome == "no way"
    assert len(explanation.openings) == least
    opened = rows.copy()
    for cell in explanation.openings:
        column, row = cell.place
        assert cell.kind == {"@": "wall", "T": "trees"}[rows[row, column]]
        opened[row, column] = "."
    assert arrives(opened, width, height)
    again = explained(problem_of(tmp_path, opened, directions=directions))
    assert again.route_outcome in ("arrives", "there")


WALLED = [".....", ".@@@.", ".@.@.", ".@@@.", "....."]


def test_openings_are_said_stored_and_checked(tmp_path):
    problem = problem_of(tmp_path, WALLED, goal="2,2")
    explanation = explained(problem)
    text = rt.narrate(explanation)
    assert text.startswith(
        "There is no way to arrive from cell (0, 0) because of a wall. At least 1 cell would have to open, "
    )
    document = to_json(explanation)
    assert from_json(document).openings == explanation.openings
    assert verify(json.loads(document), problem).fails == 0


@pytest.mark.parametrize("change", ["none", "another", "more", "kind", "open"])
def test_other_openings_are_contradicted(tmp_path, change):
    problem = problem_of(tmp_path, WALLED, goal="2,2")
    explanation = explained(problem)
    (cell,) = explanation.openings
    told = {
        "none": (),
        "another": (replace(cell, place=(1, 1), name="cell (1, 1)"),),
        "more": (cell, replace(cell, place=(1, 1), name="cell (1, 1)")),
        "kind": (replace(cell, kind="trees"),),
        "open": (replace(cell, place=(0, 1), name="cell (0, 1)"),),
    }[change]
    document = json.loads(to_json(replace(explanation, openings=told)))
    checks = {check.what: check.verdict for check in verify(document, problem).checks}
    assert checks["route"] == Verdict.FAILS


def test_the_robots_size_is_told_from_a_wall(tmp_path):
    rows = ["......@......"] * 3 + ["............."] + ["......@......"] * 3
    narrow = explained(problem_of(tmp_path, rows, start="1,3", goal="11,3", radius=1.2))
    assert {cell.kind for cell in narrow.openings} == {"too narrow"}
    assert "because of a passage that is too narrow for the robot. At least" in rt.narrate(narrow)
    rows[3] = rows[0]
    walled = explained(problem_of(tmp_path, rows, start="1,3", goal="11,3", radius=1.2))
    assert "because of a wall and too little room for the robot. At least 3 cells" in rt.narrate(walled)


def test_forbidden_ground_is_called_so(tmp_path):
    problem_of(tmp_path, ["..."])
    (tmp_path / "a.zones.toml").write_text('["the stairs"]\ncells = [[1, 0], [1, 0]]\nforbidden = true\n')
    motion = Motion(slip=0.0)
    explanation = explained(read_gridmap(tmp_path / "a.map", Drive(start="0,0", goal="2,0", motion=motion)))
    assert "because of forbidden ground. At least 1 cell would have to open, for example cell (1, 0)." in rt.narrate(
        explanation
    )
