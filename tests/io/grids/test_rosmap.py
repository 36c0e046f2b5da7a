"""Maps of the ROS map server: modes, thresholds, images of every kind, and where the map lies in the world."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from PIL import Image

import ratherthan as rt
from ratherthan.errors import QuestionError, SourceError
from ratherthan.io.grids.gridmap import Drive, read_gridmap
from ratherthan.io.grids.rosmap import read_rosmap

BASE = {
    "image": "map.png",
    "resolution": 0.5,
    "origin": [-1.0, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def written(folder, pixels, mode=None, **words):
    said = {key: value for key, value in {**BASE, **words}.items() if value is not None}
    (folder / "map.yaml").write_text("\n".join(f"{key}: {json.dumps(value)}" for key, value in said.items()) + "\n")
    image = Image.fromarray(np.asarray(pixels))
    (image if mode is None else image.convert(mode)).save(folder / "map.png")
    return folder / "map.yaml"


GREY = np.array([[0, 254, 205], [254, 100, 200]], dtype=np.uint8)  # p: 1, 0.004, 0.196; 0.004, 0.61, 0.216


@pytest.mark.parametrize("mode", ["L", "RGB", "RGBA", "LA", "P"])
def test_trinary_images_of_every_kind_say_the_same(tmp_path, mode):
    ground = read_rosmap(written(tmp_path, GREY, mode))
    assert ground.open.tolist() == [[False, True, False], [True, False, False]]
    assert ground.kind.tolist() == [[1, 0, 2], [0, 2, 2]]


def test_deep_images_are_read_by_their_shade(tmp_path):
    ground = read_rosmap(written(tmp_path, GREY.astype(np.uint16) * 257))
    assert ground.kind.tolist() == [[1, 0, 2], [0, 2, 2]]


def test_negate_turns_black_and_white_round(tmp_path):
    assert read_rosmap(written(tmp_path, GREY, negate=1)).kind.tolist() == [[0, 1, 1], [1, 2, 1]]


def scaled(folder, pixels, **words):
    path = written(folder, pixels, **words)
    path.write_text(path.read_text() + "mode: scale\n")
    return read_rosmap(path)


def test_scale_leaves_a_chance_between_the_thresholds(tmp_path):
    pixels = np.array([[255, 128, 64, 0]], dtype=np.uint8)
    ground = scaled(tmp_path, pixels, free_thresh=0.0, occupied_thresh=1.0)
    assert ground.open.tolist() == [[True, True, False, False]]
    assert ground.doubt[0, :2] == pytest.approx([0.0, 127 / 255])


def test_scale_takes_what_is_transparent_for_unknown(tmp_path):
    pixels = np.full((1, 3, 4), 255, dtype=np.uint8)
    pixels[0, :, 3] = [255, 254, 0]
    assert scaled(tmp_path, pixels).kind.tolist() == [[0, 2, 2]]


def test_raw_values_are_percent(tmp_path):
    path = written(tmp_path, np.array([[0, 50, 51, 100, 101, 255]], dtype=np.uint8))
    path.write_text(path.read_text() + "mode: raw\n")
    ground = read_rosmap(path)
    assert ground.kind.tolist() == [[0, 0, 1, 1, 2, 2]]
    assert ground.doubt[0, 1] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"image": "other.png"}, "'image' must be a file beside it, but there is no"),
        ({"free_thresh": 0.7}, "'free_thresh' must be below 'occupied_thresh'"),
        ({"resolution": 0}, "'resolution' must be above 0"),
        ({"resolution": "wide"}, "'resolution' must be a number, got 'wide'"),
        ({"resolution": None}, "'resolution' must be a number, got None"),
        ({"origin": [1]}, "'origin' must be"),
        ({"origin": [1, "a", 0]}, "'origin' must be a number"),
        ({"negate": 2}, "'negate' must be 0 or 1"),
        ({"mode": "fancy"}, "'mode' must be one of trinary, scale, raw"),
        ({"image": None}, "got no 'image'"),
    ],
)
def test_a_description_that_is_wrong_is_refused(tmp_path, words, said):
    with pytest.raises(SourceError, match=said):
        read_rosmap(_described(tmp_path, words))


def _described(folder, words):
    said = {key: value for key, value in {**BASE, **words}.items() if value is not None}
    Image.fromarray(GREY).save(folder / "map.png")
    (folder / "map.yaml").write_text("\n".join(f"{key}: {json.dumps(value)}" for key, value in said.items()) + "\n")
    return folder / "map.yaml"


def test_what_is_no_yaml_and_what_is_no_image_is_said(tmp_path):
    (tmp_path / "map.yaml").write_text("image: [\n")
    with pytest.raises(SourceError, match="must be described in YAML"):
        read_rosmap(tmp_path / "map.yaml")
    path = written(tmp_path, GREY)
    (tmp_path / "map.png").write_bytes(b"no picture")
    with pytest.raises(SourceError, match="The image of a map must be readable"):
        read_rosmap(path)


def test_metres_and_cells_mean_the_same_place_also_where_the_map_is_turned(tmp_path):
    path = written(tmp_path, np.full((4, 6), 254, dtype=np.uint8), origin=[3.0, -2.0, math.pi / 2])
    problem = read_gridmap(path, Drive(goal="5,0", radius=0.0))
    names = problem.mdp.names
    # turned a quarter to the left: the columns run up, the rows from right to left
    assert names[names.find("0,3")] == "(2.8 m, -1.7 m)"
    assert names.find("2.75m,-1.75m") == names.find("0,3") == names.find("(2.8 m, -1.7 m)")
    with pytest.raises(QuestionError, match="must lie on the map, which has x from 1 to 3 m and y from -2 to 1 m"):
        names.find("4m,0m")


def test_every_known_map_reads_with_the_cells_that_are_known(shared_data):
    known = json.loads((shared_data / "expected.json").read_text())["maps"]
    for name, facts in known.items():
        if not name.endswith(".yaml"):
            continue
        ground = read_rosmap(shared_data / name)
        width, height = facts["size"]
        assert ground.open.shape == (height, width)
        counts = [int((ground.kind == kind).sum()) for kind in range(3)]
        assert counts == [facts["free"], facts["occupied"], facts["unknown"]]


def test_start_and_goal_in_metres_are_explained(shared_data):
    problem = read_gridmap(
        shared_data / "maps/ros/turtlebot3/map.yaml", Drive(start="-1.9m,-0.5m", goal="2.0m,0.5m", cell=0.1)
    )
    solution = rt.solve(problem)
    assert solution.outcome is rt.Outcome.CERTIFIED
    assert 4.0 < solution.values[0, int(problem.mdp.initial[0])] < 6.0
