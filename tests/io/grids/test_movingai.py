"""Maps and scenario files of the MovingAI benchmarks: what they say, and what is wrong with them in one sentence."""

from __future__ import annotations

import json

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.errors import SourceError
from ratherthan.io.grids.gridmap import Drive, read_gridmap
from ratherthan.io.grids.moves import Motion
from ratherthan.io.grids.movingai import parse_map, read_map, read_way

HEADER = "type octile\nheight 2\nwidth 3\nmap\n"


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("trailing", ["", " ", "\t ", "\n\n"])
def test_line_ends_and_trailing_blanks_do_not_matter(ends, trailing):
    text = (HEADER + f"..@{trailing if trailing.strip(chr(10)) else ''}\nST.{trailing}").replace("\n", ends)
    assert parse_map(text).open.tolist() == [[True, True, False], [True, False, True]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEADER + "...\n..", r"line 6: A row must have the 3 letters that the header says, got '2'"),
        (HEADER + "...\n....", r"line 6: A row must have the 3 letters"),
        (HEADER + "...", r"must have the 2 rows that its header says, got 1"),
        (HEADER + "...\n...\n...", r"must have the 2 rows that its header says, got 3"),
        (HEADER + "...\n.x.", r"line 6, column 2: A cell must be one of .* got 'x'"),
        ("type octile\nheight 2\nmap\n..\n..", r"must say the map's width"),
        ("type octile\nheight -2\nwidth 2\nmap\n", r"must say the map's height, .* got '-2'"),
        ("type octile\nheight 1000000\nwidth 1000000\nmap\n", r"at most \d+ cells"),
        ("hello\n", r"line 1: A line before 'map' must be"),
        ("", r"must have a line 'map'"),
    ],
)
def test_a_map_that_is_wrong_is_refused_with_its_place(text, said):
    with pytest.raises(SourceError, match=said):
        parse_map(text)


def test_water_is_entered_from_water_only(tmp_path):
    (tmp_path / "lake.map").write_text("type octile\nheight 1\nwidth 5\nmap\n.WW.S\n")
    problem = read_gridmap(tmp_path / "lake.map", Drive(goal="4,0", start="3,0", motion=Motion(slip=0.0)))
    assert rt.solve(problem).values[0].tolist() == [np.inf, np.inf, np.inf, 1.0, 0.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0\ta.map\t3\t2\t0\t0\t2\t1\t2.4\n", "must begin with 'version 1'"),
        ("version 1\n0\ta.map\t3\t2\t0\t0\t2\n", r"line 2: A row must be: bucket"),
        ("version 1\n0\ta.map\t3\t2\tx\t0\t2\t1\t2.4\n", r"line 2: A row must be: bucket"),
        ("version 1\n", r"has the rows 0 to -1, got 0"),
    ],
)
def test_a_scenario_that_is_wrong_is_refused_with_its_place(tmp_path, text, said):
    (tmp_path / "a.scen").write_text(text)
    with pytest.raises(SourceError, match=said):
        read_way(tmp_path / "a.scen", 0)


def test_a_scenario_for_another_map_is_refused(tmp_path):
    (tmp_path / "mine.map").write_text(HEADER + "...\n...\n")
    (tmp_path / "a.scen").write_text("version 1\n0\tmaps/other.map\t3\t2\t0\t0\t2\t1\t2.4\n")
    with pytest.raises(SourceError, match="must be for the map it is used on: row 0 is for 'maps/other.map'"):
        read_gridmap(tmp_path / "mine.map", Drive(scenario=str(tmp_path / "a.scen")))


@pytest.mark.slow
def test_without_slips_the_expected_distance_is_the_published_length(shared_data):
    folder = shared_data / "maps" / "movingai"
    tried = 0
    for path in sorted(folder.glob("*.map")):
        scenario = next((s for s in sorted(folder.glob("*.scen")) if s.name.startswith(path.stem)), None)
        if scenario is None or path.stat().st_size > 100_000:
            continue
        rows = sum(1 for line in scenario.read_text().splitlines()[1:] if line.strip())
        for row in np.linspace(0, rows - 1, 4).astype(int):
            way = read_way(scenario, int(row))
            drive = Drive(scenario=str(scenario), row=int(row), motion=Motion(slip=0.0))
            problem = read_gridmap(path, drive)
            found = rt.solve(problem)
            start = int(problem.mdp.initial[0])
            assert found.values[0, start] == pytest.approx(way.length, rel=1e-5, abs=1e-4), (path.name, row)
            tried += 1
    assert tried >= 20


def test_the_maps_have_the_cells_that_are_known(shared_data):
    known = json.loads((shared_data / "expected.json").read_text())["maps"]
    for name, facts in known.items():
        if not name.endswith(".map"):
            continue
        ground = read_map(shared_data / name)
        assert ground.open.shape == (facts["h"], facts["w"])
        assert int(ground.open.sum()) == sum(facts["chars"].get(letter, 0) for letter in ".GSW")
