"""The command line on maps of robots: what can be asked, what is answered, and one sentence for what cannot be."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

MAP = ["........", "...@....", "...@....", "........"]


@pytest.fixture
def hall(tmp_path):
    rows = "\n".join(MAP)
    (tmp_path / "hall.map").write_text(f"type octile\nheight 4\nwidth 8\nmap\n{rows}\n")
    (tmp_path / "hall.scen").write_text(
        "version 1\n0\thall.map\t8\t4\t0\t0\t7\t0\t7.0\n0\thall.map\t8\t4\t0\t1\t7\t3\t8.0\n"
    )
    return tmp_path / "hall.map"


@pytest.fixture
def depot(tmp_path):
    pixels = np.full((20, 30), 254, dtype=np.uint8)
    pixels[:14, 14] = 0
    Image.fromarray(pixels).save(tmp_path / "depot.pgm")
    (tmp_path / "depot.yaml").write_text(
        "image: depot.pgm\nresolution: 0.1\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    return tmp_path / "depot.yaml"


def test_start_and_goal_in_cells_in_metres_and_by_a_row(said, hall, depot):
    assert said("solve", hall, "--start", "0,0", "--goal", "7,0", "--slip", "0").splitlines()[1] == "value     7.0"
    by_row = json.loads(
        said("solve", hall, "--scen", hall.with_suffix(".scen"), "--row", "1", "--slip", "0", "--format", "json")
    )
    assert by_row["value"] == pytest.approx(5 + 2 * 2**0.5)
    in_metres = said("explain", depot, "--start=-0.5m,3m", "--goal", "1m,3m", "--kind", "naive-path", "--slip", "0")
    assert in_metres.startswith("First, we drive southeast at (-0.45 m, 3.05 m). Next, we drive ")


@pytest.mark.parametrize(
    "command",
    [("explain",), ("factors",), ("solve",), ("tradeoffs", "--most", "2"), ("info",)],
    ids=lambda words: words[0],
)
def test_every_command_that_reads_a_source_takes_them(said, hall, command):
    name, *more = command
    asked = ("--start", "0,0", "--goal", "7,3", "--slip", "0.2", "--directions", "4", "--stay", "0.1", "--radius", "0")
    asked += ("--cell", "1", "--speed", "2,swamp=0.1", "--safe", "2", "--unknown", "closed")
    assert said(name, hall, *asked, *more)


def test_what_was_explained_is_verified_and_converted(said, ask, hall):
    asked = ("--start", "0,0", "--goal", "7,0")
    text = said("explain", hall, *asked)
    assert ask("explain", hall, *asked, "--output", "route.json").exit_code == 0
    assert "contradicted: 0" in said("verify", "route.json", hall, *asked)
    assert ask("convert", hall, *asked, "hall.umb").exit_code == 0
    assert said("explain", "hall.umb") == text
    assert said("solve", "hall.umb", "--start", "0,3") == said("solve", hall, "--start", "0,3", "--goal", "7,0")


def test_no_route_is_an_answer_with_the_cells_that_would_have_to_open(said, tmp_path):
    (tmp_path / "two.map").write_text("type octile\nheight 2\nwidth 5\nmap\n..@..\n..T..\n")
    text = said("explain", tmp_path / "two.map", "--start", "0,0", "--goal", "4,0")
    assert text == (
        "There is no way to arrive from cell (0, 0) because of a wall. At least 1 cell would have to open, for example cell (2, 0).\n"
    )
    document = json.loads(said("explain", tmp_path / "two.map", "--start", "0,0", "--goal", "4,0", "--format", "json"))
    assert document["openings"] == [{"place": [2, 0], "name": "cell (2, 0)", "kind": "wall"}]


def sentence(result):
    """The one sentence with which bad input is refused."""
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("ratherthan: ")
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr
    return result.stderr


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ((), "This map has no goal yet. Give one with --goal"),
        (("-p", "shortest"), "This map has no goal yet"),
        (("-p", 'R{"distance"}min=? [F "goal"]'), "got 'goal'. This map has no goal yet"),
        (("--goal", "7,0"), "It must be clear where to start"),
        (
            ("--start", "0,0", "--goal", "3,1"),
            "The goal: A robot must be able to stand there, but at cell (3, 1) is an obstacle",
        ),
        (
            ("--start", "3,1", "--goal", "0,0"),
            "The start: A robot must be able to stand there, but at cell (3, 1) is an obstacle",
        ),
        (("--start", "1m,1m", "--goal", "0,0"), "This map has no place in the world"),
        (("--start", "9,9", "--goal", "0,0"), "A cell must lie on the map, which has columns 0 to 7 and rows 0 to 3"),
        (("--start", "0,0", "--goal", "7,0", "--radius", "3"), "A robot of radius 3 must fit somewhere on the map"),
        (("--start", "0,0", "--goal", "7,0", "--cell", "1.5"), "The side of a cell must be a multiple"),
        (("--start", "0,0", "--goal", "7,0", "--slip", "1.5"), "The chance to slip must be from 0 to below 1"),
        (("--start", "0,0", "--goal", "7,0", "--speed", "0"), "The speed must be a number above 0"),
        (("--start", "0,0", "--goal", "7,0", "--speed", "ice=2"), "A speed must be for a kind of ground of the map"),
        (("--start", "0,0", "--scen", "hall.scen"), "Start and goal must be given once"),
        (("--scen", "hall.scen", "--row", "7"), "There must be such a row: it has the rows 0 to 1, got 7"),
        (("--row", "1", "--goal", "0,0"), "A row must be one of a scenario file"),
        (("--scen", "nowhere.scen"), "nowhere.scen"),
        (("--start", "0,0", "--goal", "7,0", "--zones", "nowhere.toml"), "nowhere.toml"),
        (("--start", "0,0", "--goal", "7,0", "--unknown", "free"), "on maps of the ROS map server alone"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_sentence(ask, hall, asked, said):
    assert said in sentence(ask("explain", hall, *asked))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "type octile\nheight 2\nwidth 4\nmap\n....\n...\n",
            "line 6: A row must have the 4 letters that the header says, got '3'",
        ),
        ("type octile\nheight 3\nwidth 4\nmap\n....\n....\n", "must have the 3 rows that its header says, got 2"),
        (
            "type octile\nheight 2\nwidth 4\nmap\n....\n..x.\n",
            "line 6, column 3: A cell must be one of . G @ O S W T, got 'x'",
        ),
        ("type octile\nheight 2\nwidth 4\n....\n....\n", "A line before 'map' must be"),
        ("type octile\n", "line 'map'"),
        ("", "must not be empty"),
    ],
)
def test_a_damaged_map_is_refused_with_its_line(ask, tmp_path, text, said):
    (tmp_path / "bad.map").write_text(text)
    assert said in sentence(ask("info", tmp_path / "bad.map"))


def test_line_ends_and_trailing_blanks_do_not_matter(said, tmp_path):
    plain = "type octile\nheight 2\nwidth 4\nmap\n....\n.@..\n"
    told = []
    for name, text in (
        ("a", plain),
        ("b", plain.replace("\n", "\r")),
        ("c", plain.replace("\n", " \t\r\n")),
        ("d", plain + "\n\n"),
    ):
        (tmp_path / f"{name}.map").write_bytes(text.encode())
        told.append(said("explain", tmp_path / f"{name}.map", "--start", "0,0", "--goal", "3,1"))
    assert len(set(told)) == 1


def test_a_scenario_of_another_map_is_refused(ask, hall, tmp_path):
    (tmp_path / "other.scen").write_text("version 1\n0\tother.map\t8\t4\t0\t0\t7\t0\t7.0\n")
    assert "A scenario must be for the map it is used on" in sentence(ask("explain", hall, "--scen", "other.scen"))


def test_thresholds_the_wrong_way_round_and_a_missing_image_are_refused(ask, depot):
    text = depot.read_text()
    depot.write_text(text.replace("0.65", "0.1"))
    assert "'free_thresh' must be below 'occupied_thresh'" in sentence(ask("info", depot))
    depot.write_text(text.replace("depot.pgm", "gone.pgm"))
    assert "'image' must be a file beside it" in sentence(ask("info", depot))


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "I;16"])
def test_coloured_and_deep_images_say_the_same_as_grey_ones(said, depot, mode):
    asked = ("--start=-0.5m,3m", "--goal", "1m,3m")
    grey = said("explain", depot, *asked)
    image = Image.open(depot.with_suffix(".pgm"))
    deep = Image.fromarray(np.asarray(image).astype(np.uint16) * 257) if mode == "I;16" else image.convert(mode)
    deep.save(depot.with_name("deep.png"))
    depot.write_text(depot.read_text().replace("depot.pgm", "deep.png"))
    assert said("explain", depot, *asked) == grey


def test_a_radius_that_closes_every_door_is_an_answer(said, depot):
    text = said("explain", depot, "--start=-0.4m,3m", "--goal", "1.2m,3m", "--radius", "0.35")
    assert text.startswith(
        "There is no way to arrive from (-0.35 m, 3.05 m) because of a passage that is too narrow for the robot."
    )
