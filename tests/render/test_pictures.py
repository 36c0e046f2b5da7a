from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from pictures import PICTURES, on_cells, solved, told_few

import ratherthan as rt
from ratherthan.errors import MissingExtraError, QuestionError, SourceError
from ratherthan.explain.telling import told_groups
from ratherthan.render import Picture
from ratherthan.render.canvas import text_width
from ratherthan.render.palette import PAPER, contrast

SVG = "{http://www.w3.org/2000/svg}"
READABLE = 4.5
"""What WCAG 2.2 asks of the contrast of text."""
CAREFUL = 0.8
"""Widths of text are estimated from above."""


@dataclass(frozen=True)
class Said:
    """A line of text: where it stands, its own colour, and the colour behind it."""

    words: str
    left: float
    right: float
    top: float
    bottom: float
    ink: str
    behind: str


def shapes_of(shape: ET.Element) -> Iterator[tuple[float, float, float, float]]:
    """Yield the boxes that a filled shape covers, as far as pictures have them."""
    if shape.tag == f"{SVG}rect":
        x, y, width, height = (float(shape.get(key, "0")) for key in ("x", "y", "width", "height"))
        yield x, y, x + width, y + height
    elif shape.tag == f"{SVG}circle":
        x, y, r = (float(shape.get(key, "0")) for key in ("cx", "cy", "r"))
        yield x - r, y - r, x + r, y + r
    elif shape.tag == f"{SVG}path":
        line = shape.get("d", "")
        for x, y, width, height in re.findall(r"M([\d.-]+) ([\d.-]+)h([\d.-]+)v([\d.-]+)h[\d.-]+z", line):
            yield float(x), float(y), float(x) + float(width), float(y) + float(height)
        if line.endswith("Z"):
            points = [tuple(map(float, pair.split())) for pair in re.split("[ML]", line[:-1]) if pair]
            xs, ys = zip(*points, strict=True)
            yield min(xs), min(ys), max(xs), max(ys)


def texts(picture: Picture) -> list[Said]:
    """Return all lines of text of a picture, with what lies behind the middle of each."""
    root, drawn, found = ET.fromstring(picture.svg), [], []
    definitions = set(root.find(f"{SVG}defs").iter()) if root.find(f"{SVG}defs") is not None else set()
    for element in root.iter():
        if element in definitions:
            continue
        fill = element.get("fill", "none")
        if fill.startswith("#"):
            drawn += [(box, fill) for box in shapes_of(element)]
        if element.tag == f"{SVG}text":
            size, words = float(element.get("font-size", "0")), element.text or ""
            width = CAREFUL * text_width(words, size)
            x, y = float(element.get("x", "0")), float(element.get("y", "0"))
            left = {"middle": x - width / 2, "end": x - width}.get(element.get("text-anchor", "start"), x)
            here = (left + width / 2, y - 0.36 * size)
            behind = [PAPER, *(c for (a, b, c_, d), c in drawn if a <= here[0] <= c_ and b <= here[1] <= d)][-1]
            if element.get("paint-order") == "stroke":
                behind = element.get("stroke", behind)
            found.append(Said(words, left, left + width, y - 0.75 * size, y + 0.2 * size, fill, behind))
    return found


@pytest.fixture(params=PICTURES)
def picture(request: pytest.FixtureRequest) -> Picture:
    """Each of the pictures."""
    return PICTURES[request.param]()


def test_a_picture_is_well_formed_and_says_what_it_shows(picture: Picture) -> None:
    root = ET.fromstring(picture.svg)
    assert root.get("role") == "img"
    assert root.get("aria-labelledby") == "title description"
    assert root.find(f"{SVG}title").text.strip()
    assert len(root.find(f"{SVG}desc").text.split()) >= 3
    assert len(picture.svg.encode()) < 1_000_000


def test_every_text_can_be_read_on_what_lies_behind_it(picture: Picture) -> None:
    for said in texts(picture):
        assert contrast(said.ink, said.behind) >= READABLE, said


def test_no_text_runs_out_of_the_picture(picture: Picture) -> None:
    for said in texts(picture):
        assert said.left >= 0, said
        assert said.right <= picture.width, said
        assert said.top >= 0, said
        assert said.bottom <= picture.height, said


def test_no_two_texts_lie_over_each_other(picture: Picture) -> None:
    lines = [said for said in texts(picture) if said.words.strip()]
    for place, one in enumerate(lines):
        for other in lines[:place]:
            across = min(one.right, other.right) - max(one.left, other.left)
            down = min(one.bottom, other.bottom) - max(one.top, other.top)
            assert across <= 1.0 or down <= 1.0, (one, other)


@pytest.mark.parametrize("name", ["paper-5x5", "value of office", "trees", "factors", "delivery"])
def test_the_same_thing_gives_the_same_bytes(name: str) -> None:
    assert PICTURES[name]().svg == PICTURES[name]().svg


@pytest.mark.parametrize("name", ["paper-5x5", "delivery", "trees", "value of paper-5x5"])
def test_pictures_are_as_they_were(name: str, golden: Callable[[str, str], None]) -> None:
    golden(f"pictures/{name.replace(' ', '-')}.svg", PICTURES[name]().svg)


def test_an_explanation_is_drawn_alike_after_a_round_trip_through_json() -> None:
    for name in ("paper-5x5", "office", "delivery"):
        explanation = rt.explain(solved(name))
        assert rt.draw(rt.from_json(rt.to_json(explanation))).svg == rt.draw(explanation).svg


@pytest.mark.parametrize("count", [1, 2, 3, 100])
def test_marks_bear_the_numbers_of_the_sentences(count: int) -> None:
    explanation = told_few(rt.explain(solved("paper-5x5")), count)
    for what in ("route", "graph"):
        root = ET.fromstring(rt.draw(explanation, what).svg)
        marked = [group.get("data-sentence") for group in root.iter(f"{SVG}g") if group.get("class") == "step"]
        assert marked == [str(number) for number, _ in enumerate(told_groups(explanation), 1)]


def test_the_alternatives_are_dashed_and_point_where_they_lead() -> None:
    solution = solved("paper-5x5")
    root = ET.fromstring(rt.draw(rt.explain(solution)).svg)
    foils = [group for group in root.iter(f"{SVG}g") if group.get("class") == "foil"]
    assert len(foils) == 4
    assert all(any(part.get("stroke-dasharray") for part in foil) for foil in foils)
    ends = [tuple(map(float, foil[1].get("d")[1:].replace("L", " ").split())) for foil in foils]
    assert [(round(x1 - x0), y1 > y0) for x0, y0, x1, y1 in ends] == [(0, False), (0, True), (0, True), (0, False)]


def test_where_there_is_no_route_the_cells_that_would_have_to_open_are_marked() -> None:
    explanation = rt.explain(on_cells([".@.", "@@.", "..."]))
    assert explanation.route_outcome == "no way"
    picture = rt.draw(explanation)
    assert "would have to be open" in picture.svg
    assert "There is no route" in picture.svg


def test_search_trees_mark_the_pairs_that_count() -> None:
    svg = rt.draw(solved("paper-5x5"), "trees", state=10).svg
    thick = svg.count('stroke-width="3"/>')
    assert thick == 4 + 2 + 1  # ε(10, east) = 4, ε(10, south) = 2, and one in the legend
    assert "east: 4 left open" in svg
    assert "south: 2 left open" in svg


def test_a_large_tree_says_how_many_states_are_not_drawn() -> None:
    solution = on_cells(["." * 12] * 12)
    svg = rt.draw(solution, "trees").svg
    shown = re.search(r"After \w+ (\d+) more states follow that are not drawn", svg)
    assert shown is not None
    assert 100 < int(shown[1]) < 143


def test_a_file_is_svg_or_png(tmp_path: Path) -> None:
    picture = rt.draw(rt.explain(solved("paper-5x5")))
    picture.save(tmp_path / "map.svg")
    assert (tmp_path / "map.svg").read_text(encoding="utf-8") == picture.svg
    with pytest.raises(SourceError, match=r"\.svg or \.png"):
        picture.save(tmp_path / "map.pdf")
    pytest.importorskip("resvg_py")
    picture.save(tmp_path / "map.png")
    data = (tmp_path / "map.png").read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    assert int.from_bytes(data[16:20], "big") == round(2 * picture.width)


def test_png_without_the_extra_is_refused_in_a_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "resvg_py", None)
    with pytest.raises(MissingExtraError, match=r"ratherthan\[png\]"):
        rt.draw(rt.explain(solved("paper-5x5"))).save(tmp_path / "map.png")
    assert not (tmp_path / "map.png").exists()


@pytest.mark.parametrize(
    ("what", "details", "words"),
    [
        ("route", {}, "Of a solution"),
        ("value", {"state": 3}, "leave the state out"),
        ("factors", {"state": 25}, "from 0 to 24"),
        ("factors", {"rather_than": "south"}, "ask for 'trees'"),
        ("trees", {"state": 8}, "has one"),
        ("trees", {"state": 10, "rather_than": "west"}, "one of south"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(what: str, details: dict[str, object], words: str) -> None:
    with pytest.raises(QuestionError, match=words):
        rt.draw(solved("paper-5x5"), what, **details)


def test_values_of_a_model_without_a_map_are_refused() -> None:
    with pytest.raises(QuestionError, match="lies on none"):
        rt.draw(solved("delivery"), "value")
    with pytest.raises(QuestionError, match="Of an explanation"):
        rt.draw(rt.explain(solved("paper-5x5")), "value")
    with pytest.raises(QuestionError, match="can be drawn, got int"):
        rt.draw(3)
