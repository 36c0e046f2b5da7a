"""Zones that a person marks: where they are, what they do, and what cannot be said of them."""

from __future__ import annotations

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.errors import QuestionError, SourceError
from ratherthan.io.grids.gridmap import Drive, read_gridmap
from ratherthan.io.grids.moves import Motion
from ratherthan.model.objective import ExpectedCost

MAP = "type octile\nheight 3\nwidth 5\nmap\n.....\n.....\n.....\n"
CERTAIN = Motion(slip=0.0, directions=4)


@pytest.fixture
def hall(tmp_path):
    (tmp_path / "hall.map").write_text(MAP)
    return tmp_path / "hall.map"


def test_a_zone_beside_the_map_is_found_and_its_name_is_said(hall):
    hall.with_suffix(".zones.toml").write_text('["the crossing"]\ncells = [[1, 0], [2, 1]]\nrisk = 2\n')
    problem = read_gridmap(hall, Drive(start="0,0", goal="4,0", motion=CERTAIN, safe=0.0))
    assert problem.mdp.names[1] == "the crossing, cell (1, 0)"
    assert problem.mdp.names.find("the crossing, cell (1, 0)") == problem.mdp.names.find("1,0") == 1
    assert np.flatnonzero(problem.mdp.labels["the crossing"]).tolist() == [1, 2, 6, 7]
    shortest = rt.solve(problem)
    safest = rt.solve(problem, ExpectedCost(goal='"goal"', reward="risk"))
    assert (shortest.values[0, 0], safest.values[0, 0]) == (4.0, pytest.approx(0.08))  # round below, a hundredth each


def test_a_forbidden_zone_is_closed_and_a_slow_one_takes_time(hall, tmp_path):
    (tmp_path / "z.toml").write_text(
        '["stairs"]\ncells = [[1, 0], [1, 1]]\nforbidden = true\n["mud"]\ncells = [[2, 0], [3, 2]]\nspeed = 0.5\n'
    )
    problem = read_gridmap(hall, Drive(start="0,0", goal="4,0", motion=CERTAIN, zones=str(tmp_path / "z.toml")))
    start = int(problem.mdp.initial[0])
    assert rt.solve(problem).values[0, start] == 8.0
    assert rt.solve(problem, ExpectedCost(goal='"goal"', reward="time")).values[0, start] == 10.0
    with pytest.raises(QuestionError, match=r"at cell \(1, 0\) is an obstacle.*can stand: cell \(0, 0\)"):
        problem.mdp.names.find("1,0")


def test_a_polygon_holds_the_cells_whose_middle_is_inside(hall, tmp_path):
    (tmp_path / "z.toml").write_text('["wedge"]\ncells = [[0, 0], [4, 0], [0, 4]]\n')
    problem = read_gridmap(hall, Drive(zones=str(tmp_path / "z.toml")))
    inside = problem.mdp.labels["wedge"].reshape(3, 5)
    assert inside[1].tolist() == [True, True, True, False, False]
    assert inside[2].tolist() == [True, True, False, False, False]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[a]\nrisk = 1\n", "must say where it is, by either"),
        ("[a]\ncells = [[0,0],[1,1]]\nmetres = [[0,0],[1,1]]\n", "by either"),
        ("[a]\nmetres = [[0,0],[1,1]]\n", "has no place in the world"),
        ("[a]\ncells = [[0,0]]\n", "two or more corners"),
        ("[a]\ncells = [[0.5,0],[1,1]]\n", "in whole numbers"),
        ("[a]\ncells = [[9,9],[12,12]]\n", "must hold the middle of some cell"),
        ("[a]\ncells = [[0,0],[1,1]]\nrisk = -1\n", "'risk' must be a number from 0 on, got -1"),
        ("[a]\ncells = [[0,0],[1,1]]\nrisk = nan\n", "'risk' must be a number"),
        ("[a]\ncells = [[0,0],[1,1]]\nspeed = 0\n", "say forbidden = true"),
        ("[a]\ncells = [[0,0],[1,1]]\nforbidden = 1\n", "must be true or false"),
        ("[a]\ncells = [[0,0],[1,1]]\ncolour = 1\n", "got 'colour'"),
        ("[goal]\ncells = [[0,0],[1,1]]\n", "must not be called 'goal'"),
        ("a = 1\n", "must be a table"),
        ("[a\n", "must be written in TOML"),
    ],
)
def test_a_zone_that_cannot_be_is_refused_with_its_name(hall, tmp_path, text, said):
    (tmp_path / "z.toml").write_text(text)
    with pytest.raises(SourceError, match=said):
        read_gridmap(hall, Drive(zones=str(tmp_path / "z.toml")))


@pytest.mark.parametrize(
    ("drive", "said"),
    [
        ({"start": "9,9"}, "The start: A cell must lie on the map, which has columns 0 to 4 and rows 0 to 2"),
        ({"goal": "1m,1m"}, "The goal: This map has no place in the world"),
        ({"goal": "home"}, "The goal must be a cell as column,row"),
        ({"radius": 9.0}, "must fit somewhere on the map"),
        ({"radius": -1.0}, "The radius must be a length from 0 on"),
        ({"cell": 0.0}, "The cell must be a length above 0"),
        ({"speed": 0.0}, "The speed must be a number above 0"),
        ({"speeds": {"wall": -1.0}}, "The speed on wall must be a number above 0"),
        ({"speeds": {"ice": 1.0}}, "kind of ground of the map, open ground, wall, swamp, water, trees; got 'ice'"),
        ({"unknown": "perhaps"}, "closed or free, got 'perhaps'"),
        ({"unknown": "free"}, "of the ROS map server alone"),
        ({"scenario": "a.scen", "start": "0,0"}, "must be given once"),
    ],
)
def test_what_does_not_fit_the_map_is_refused(hall, drive, said):
    with pytest.raises(QuestionError, match=said):
        read_gridmap(hall, Drive(**drive))
