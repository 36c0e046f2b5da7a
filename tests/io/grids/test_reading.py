"""Maps of cells as `read` takes them: told by suffix or content, asked by keywords, written and read again."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from PIL import Image

import ratherthan as rt
from ratherthan.errors import QuestionError, SourceError
from ratherthan.io import write
from ratherthan.io.grids.names import CellNames
from ratherthan.model.states import state_number

MAP = "type octile\nheight 3\nwidth 5\nmap\n.....\n.@@T.\nSS.WW\n"


@pytest.fixture
def hall(tmp_path):
    (tmp_path / "hall.map").write_text(MAP)
    return tmp_path / "hall.map"


@pytest.fixture
def depot(tmp_path):
    pixels = np.full((8, 10), 254, dtype=np.uint8)
    pixels[3:5, 4] = 0
    pixels[7, :] = 205
    Image.fromarray(pixels).save(tmp_path / "depot.png")
    (tmp_path / "depot.yaml").write_text(
        "image: depot.png\nresolution: 0.5\norigin: [-2.0, 1.0, 0.3]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return tmp_path / "depot.yaml"


def test_maps_are_told_by_their_contents_too(hall, depot):
    for path, states in ((hall, 12), (depot, 68)):
        bare = path.with_name("something")
        shutil.copy(path, bare)
        assert rt.read(bare, radius=0.0).mdp.states == states
        assert rt.read(bare, radius=0.0).world.kinds == rt.read(path, radius=0.0).world.kinds


def test_places_are_texts_or_pairs_and_mean_the_same(hall):
    texts = rt.read(hall, start="4,0", goal="0,2")
    pairs = rt.read(hall, start=(4, 0), goal=(0, 2))
    assert texts.mdp.initial.tolist() == pairs.mdp.initial.tolist() == [4]
    assert np.flatnonzero(texts.mdp.labels["goal"]).tolist() == np.flatnonzero(pairs.mdp.labels["goal"]).tolist() == [7]
    assert rt.read(hall, start=4, goal="0,2").mdp.initial.tolist() == [4]
    assert state_number(texts.mdp, "cell (0, 2)") == state_number(texts.mdp, "0,2") == 7


def test_a_map_offers_the_shortest_the_fastest_and_the_least_risky_way(hall):
    problem = rt.read(hall, goal="0,2")
    assert list(problem.properties) == ["shortest", "fastest", "least risk"]
    assert problem.objective == problem.properties["shortest"]
    assert rt.read(hall).objective is None


def test_a_map_without_a_goal_says_what_is_missing(hall):
    with pytest.raises(rt.RatherthanError, match=r"has no goal yet. Give one with --goal"):
        rt.solve(rt.read(hall, objective=None, start="0,0"))


def test_speeds_are_for_kinds_of_ground(hall):
    plain, text, table = (
        rt.read(hall, speed=speed).mdp.rewards["time"].choice for speed in (2.0, "1,swamp=0.25", {"swamp": 0.25})
    )
    assert np.unique(plain).tolist() == [0.5]
    assert np.unique(text).tolist() == [1.0, 4.0]
    assert np.array_equal(text, table)


@pytest.mark.parametrize("suffix", [".npz", ".umb"])
@pytest.mark.parametrize("cell", [None, 2])
def test_names_map_and_words_survive_another_format(hall, depot, tmp_path, suffix, cell):
    for path, asked in ((hall, {"goal": "2,0" if cell is None else "0,0"}), (depot, {"radius": 0.2})):
        if path == hall and cell is not None:
            path.write_text("type octile\nheight 5\nwidth 5\nmap\n" + ".....\n" * 5)
            asked = {"goal": "0,4"}
        asked = asked | ({} if cell is None else {"cell": cell if path == hall else 1.0})
        path.with_suffix(".zones.toml").write_text('["the crossing"]\ncells = [[0, 0], [1, 4]]\n')
        problem = rt.read(path, **asked)
        write(problem, tmp_path / f"copy{suffix}")
        again = rt.read(tmp_path / f"copy{suffix}")
        old, new = problem.mdp.names, again.mdp.names
        assert isinstance(new.strings, CellNames)
        assert [new[s] for s in range(len(new))] == [old[s] for s in range(len(old))]
        assert [new.find(old[s]) for s in range(len(old))] == list(range(len(old)))
        assert again.world.frame == problem.world.frame
        assert {zone: mask.tolist() for zone, mask in again.world.zones.items()} == {
            zone: mask.tolist() for zone, mask in problem.world.zones.items()
        }
        assert (again.lexicon, again.objective, again.lacks) == (problem.lexicon, problem.objective, problem.lacks)


def test_a_million_names_take_a_few_letters(tmp_path):
    side = 300
    (tmp_path / "plain.map").write_text(f"type octile\nheight {side}\nwidth {side}\nmap\n" + ("." * side + "\n") * side)
    write(rt.read(tmp_path / "plain.map", directions=4, slip=0.0, safe=0.0), tmp_path / "plain.npz")
    with np.load(tmp_path / "plain.npz") as arrays:
        assert "names" not in arrays.files
        assert not any("names" in name for name in arrays.files)


def test_larger_cells_are_called_by_the_cells_they_hold(tmp_path):
    (tmp_path / "a.map").write_text("type octile\nheight 5\nwidth 4\nmap\n" + "....\n" * 5)
    names = rt.read(tmp_path / "a.map", cell=2).mdp.names  # counted from below: the top row stands alone and is closed
    assert [names[s] for s in range(len(names))] == [
        "cells (0, 1) to (1, 2)",
        "cells (2, 1) to (3, 2)",
        "cells (0, 3) to (1, 4)",
        "cells (2, 3) to (3, 4)",
    ]
    assert [names.find(text) for text in ("0,1", "1,2", "cells (2, 3) to (3, 4)", "3,4")] == [0, 0, 3, 3]
    with pytest.raises(QuestionError, match="columns 0 to 3 and rows 0 to 4"):
        names.find("4,0")


def test_unknown_ground_may_be_free_and_is_a_risk(depot):
    closed, free = (rt.read(depot, radius=0.0, unknown=word) for word in ("closed", "free"))
    assert (closed.mdp.states, free.mdp.states) == (68, 78)
    assert free.mdp.rewards["risk"].branch.max() > closed.mdp.rewards["risk"].branch.max()


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"goal": 3}, "must be a cell, .* or a point in metres"),
        ({"goal": (1.5, 2.5)}, "must be a cell, .* or a point in metres"),
        ({"slip": "much"}, "'slip' must be a number"),
        ({"directions": 6}, "4 or 8, got 6"),
        ({"row": 3}, "must be one of a scenario file"),
        ({"speed": "fast"}, "A speed must be a number, or several as 0.8,swamp=0.2"),
        ({"speed": "1,2"}, "A speed must be a number"),
        ({"slop": 0.1}, "got 'slop'"),
    ],
)
def test_what_cannot_be_asked_is_refused(hall, asked, said):
    with pytest.raises(QuestionError, match=said):
        rt.read(hall, **asked)


def test_what_is_asked_of_maps_is_refused_elsewhere():
    with pytest.raises(
        SourceError, match=r"Only a map of cells .* can be asked for goal, slip, but 'example:paper-5x5' is none"
    ):
        rt.read("example:paper-5x5", goal="1,1", slip=0.2)
    assert rt.read("example:paper-5x5", goal=None, slip=None).mdp.states == 25


@pytest.mark.parametrize("change", ["scale", "drawn", "zones", "frame", "resolution"])
def test_damaged_names_of_cells_are_refused(depot, tmp_path, change):
    import json
    import zipfile

    write(rt.read(depot, radius=0.0), tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        arrays = {name: archive.read(name) for name in archive.namelist()}
    with np.load(tmp_path / "a.npz") as loaded:
        table = json.loads(loaded["ratherthan/problem.json"].tobytes())
    edits = {
        "scale": lambda: table["cells"].update(scale=0),
        "drawn": lambda: table["cells"].update(drawn=[3, 3]),
        "zones": lambda: table["cells"].update(zones=["nowhere"]),
        "frame": lambda: table["world"].update(frame={"x": "a"}),
        "resolution": lambda: table["world"]["frame"].update(resolution=0),
    }
    edits[change]()
    with np.load(tmp_path / "a.npz") as loaded:
        parts = {name: loaded[name] for name in loaded.files}
    parts["ratherthan/problem.json"] = np.frombuffer(json.dumps(table).encode(), dtype=np.uint8)
    np.savez(tmp_path / "b.npz", **parts)
    assert arrays
    with pytest.raises(SourceError, match="must have"):
        rt.read(tmp_path / "b.npz")
