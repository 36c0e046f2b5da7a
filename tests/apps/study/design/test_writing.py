from __future__ import annotations

import re
from dataclasses import replace

import pytest

import ratherthan as rt
from ratherthan.apps.study.design import screens
from ratherthan.apps.study.design.filling import languages
from ratherthan.apps.study.design.reading import FILE, read_design
from ratherthan.apps.study.design.stimuli import build
from ratherthan.apps.study.design.writing import New, new_study
from ratherthan.errors import InputError, QuestionError, SourceError

FEW = ("none", "naive-path", "contrastive")


@pytest.mark.parametrize("language", languages())
def test_the_texts_of_every_language_are_a_whole_design(tmp_path, language):
    design = new_study(tmp_path / "study", New(language=language))
    assert design.language == language
    assert len(screens(design, 0)) == 41
    text = (tmp_path / "study" / FILE).read_text(encoding="utf-8")
    assert not re.search(r"@[a-z_0-9]+@", text)
    assert "\n#: " not in text


def test_languages_say_the_same_in_the_same_places(tmp_path):
    one, other = (new_study(tmp_path / name, New(language=name)) for name in ("en", "de"))
    for a, b in zip(screens(one, 4), screens(other, 4), strict=True):
        assert (a.id, a.phase, len(a.paragraphs)) == (b.id, b.phase, len(b.paragraphs))
        for x, y in zip(a.records, b.records, strict=True):
            assert (x.name, x.type, x.correct, [o.value for o in x.options]) == (
                y.name,
                y.type,
                y.correct,
                [o.value for o in y.options],
            )
        if a.phase == "attention":
            right = next(o.label for o in b.records[0].options if o.value == b.records[0].correct)
            assert right in b.records[0].label


def test_every_part_of_the_file_has_a_note(made):
    text = (made / FILE).read_text(encoding="utf-8")
    assert sum(line.startswith("#") for line in text.splitlines()) > 30


def test_two_studies_have_other_codes_and_each_four_different_ones(tmp_path):
    one, other = (new_study(tmp_path / name, New(kinds=FEW)).codes for name in ("a", "b"))
    codes = [*vars(one).values(), *vars(other).values()]
    assert len(set(codes)) == 8
    assert all(re.fullmatch(r"[A-Z2-9]{8}", code) for code in codes)


def test_the_quota_is_two_rounds_of_the_plan(tmp_path):
    assert new_study(tmp_path / "a", New()).quota == 84
    assert new_study(tmp_path / "b", New(kinds=FEW)).quota == 12
    assert new_study(tmp_path / "c", New(kinds=FEW, quota=30)).quota == 30


def test_fewer_kinds_leave_the_groupings_that_are_whole(tmp_path):
    design = new_study(tmp_path / "study", New(kinds=("none", "naive-path", "selective")))
    assert [kind.id for kind in design.kinds] == ["none", "naive-path", "selective"]
    assert [group.kinds for group in design.groupings] == [("naive-path", "selective")]
    assert new_study(tmp_path / "few", New(kinds=FEW)).groupings == ()


@pytest.mark.parametrize(("maps", "kinds"), [(1, 1), (1, 2), (1, 3), (2, 2)])
def test_small_studies_have_checks_only_behind_trials(tmp_path, maps, kinds):
    names = ("naive-path", "contrastive", "selective")[:kinds]
    design = new_study(tmp_path / "study", New(maps=("example:city-1",) * maps, kinds=names))
    assert all(1 <= check.after <= maps * kinds for check in design.attention)
    assert len(design.maps) == maps
    assert len({one.source for one in design.maps}) == maps


def test_a_road_map_is_taken_over_byte_for_byte(tmp_path):
    own = tmp_path / "My Town!.roadmap"
    own.write_text("# my town\ntitle = \"“Here” \\\\ there\"\nmap = 'S..D'\n", encoding="utf-8")
    design = new_study(tmp_path / "study", New(maps=(str(own),), kinds=FEW))
    assert (tmp_path / "study" / "maps" / "my-town.roadmap").read_bytes() == own.read_bytes()
    assert design.maps[0].title == "“Here” \\ there"
    assert design.stimuli["m1", "naive-path"].steps == 3


def test_another_start_is_written_down(tmp_path):
    design = new_study(tmp_path / "study", New(maps=("example:city-1",), kinds=FEW, start="54"))
    assert design.maps[0].start == "54"
    assert "at grid 54" in design.stimuli["m1", "naive-path"].text


def test_what_is_no_road_map_is_taken_over_as_an_archive_that_needs_nothing_else(tmp_path):
    design = new_study(tmp_path / "study", New(maps=("example:delivery",), property="safest", kinds=FEW))
    source = design.maps[0].source
    assert source == "maps/delivery.umb"
    solution = rt.solve(rt.read(tmp_path / "study" / source, objective="safest"))
    assert design.stimuli["m1", "contrastive"].text == rt.narrate(rt.explain(solution))


def test_a_robots_map_is_taken_over_with_start_and_goal(tmp_path):
    own = tmp_path / "room.map"
    own.write_text("type octile\nheight 4\nwidth 5\nmap\n.....\n.@@@.\n.@.@.\n.....\n", encoding="utf-8")
    wanted = New(maps=(str(own),), kinds=FEW, start="0,0", drive={"goal": "4,3", "slip": 0.0})
    design = new_study(tmp_path / "study", wanted)
    assert design.maps[0].source == "maps/room.umb"
    own.unlink()
    assert read_design(tmp_path / "study").stimuli["m1", "contrastive"].text


@pytest.mark.parametrize(
    ("wanted", "error", "said"),
    [
        (New(kinds=("selectiv",)), QuestionError, "Did you mean 'selective'?"),
        (New(kinds=("none", "none")), QuestionError, "once"),
        (New(language="plain English"), QuestionError, "de, en"),
        (New(language="x" * 50), QuestionError, "de, en"),
        (New(at_most=0), QuestionError, "from 1 on; got 0"),
        (New(maps=("nowhere.roadmap",)), SourceError, "nowhere.roadmap"),
        (New(maps=("example:nowhere",)), SourceError, "nowhere"),
        (New(maps=("example:city-1",), property="nonsense"), InputError, "nonsense"),
        (New(maps=("example:city-1",), property='R{"distance"}<=5 [F "destination"]'), InputError, "best value"),
        (New(maps=("example:city-1",), start="9999"), InputError, "9999"),
    ],
)
def test_what_cannot_become_a_study_is_refused_and_leaves_nothing(tmp_path, wanted, error, said):
    with pytest.raises(error, match=re.escape(said)):
        new_study(tmp_path / "study", wanted)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_in_use_is_left_alone(tmp_path):
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "thesis.txt").write_text("all of it")
    with pytest.raises(SourceError, match="is there already"):
        new_study(tmp_path / "study", New())
    assert [path.name for path in (tmp_path / "study").iterdir()] == ["thesis.txt"]


def test_an_empty_folder_may_be_filled(tmp_path):
    (tmp_path / "study").mkdir()
    assert new_study(tmp_path / "study", New(kinds=FEW)).folder == tmp_path / "study"


def test_a_folder_in_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(SourceError, match="folder to stand in"):
        new_study(tmp_path / "a" / "b", New())


def test_the_consent_tells_how_long_it_takes(made):
    consent = next(one for one in screens(read_design(made), 0) if one.phase == "consent")
    assert "This takes about 25 minutes." in consent.paragraphs[1]


GRID = """type octile
height 4
width 6
map
......
.@@@..
.@....
......
"""


def _pages(folder):
    """Return the texts of the pages about the maps, and the ids of the questions on them."""
    design = read_design(folder)
    texts = " ".join(text for page in design.instructions for text in page.paragraphs)
    return texts, [question.name for question in design.comprehension.questions]


@pytest.mark.parametrize("language", languages())
def test_instructions_fit_what_the_maps_show(tmp_path, language):
    (tmp_path / "grid.map").write_text(GRID, encoding="utf-8")
    ground = {"goal": "5,3"}
    for name, wanted, asked in (
        ("paper", New(), "grey-arrow"),
        ("roads", New(maps=("example:city-1",)), "dark-square"),
        ("ground", New(maps=(str(tmp_path / "grid.map"),), start="0,0", drive=ground), "dark-square"),
        ("other", New(maps=("gym:FrozenLake-v1",)), "dark-square"),
    ):
        if name == "other":
            pytest.importorskip("gymnasium", reason="needs the extra gymnasium")
        new_study(tmp_path / name, replace(wanted, kinds=FEW, language=language))
        texts, questions = _pages(tmp_path / name)
        assert questions == ["blue-line", asked]
        assert ("[" in texts) == (name != "paper")
        arrows = {"en": "one-way streets", "de": "Einbahnstraßen"}[language]
        assert (arrows in texts) == (name in ("paper", "roads"))


def test_an_archive_of_a_map_of_cells_is_known_as_one(tmp_path):
    (tmp_path / "grid.map").write_text(GRID, encoding="utf-8")
    rt.write(rt.read(str(tmp_path / "grid.map"), start="0,0", goal="5,3"), tmp_path / "a.umb")
    new_study(tmp_path / "study", New(maps=(str(tmp_path / "a.umb"), "example:city-1"), kinds=FEW))
    assert "Say here what your maps show" in _pages(tmp_path / "study")[0]
    new_study(tmp_path / "alike", New(maps=(str(tmp_path / "a.umb"),) * 2, kinds=FEW))
    assert "White is free ground." in _pages(tmp_path / "alike")[0]


def test_a_map_without_a_way_says_why(tmp_path):
    walled = (
        GRID.replace("......\n.@@@..\n", "@@@@@@\n@@@@@@\n").replace(".@....", "..@...").replace("......\n", "..@...\n")
    )
    (tmp_path / "grid.map").write_text(walled, encoding="utf-8")
    with pytest.raises(InputError, match="There is no way to arrive"):
        new_study(
            tmp_path / "study", New(maps=(str(tmp_path / "grid.map"),), start="0,2", drive={"goal": "5,3"}, kinds=FEW)
        )


def test_the_picture_bears_the_title_of_the_design(tmp_path):
    folder = tmp_path / "study"
    new_study(folder, New(maps=("example:city-1",), kinds=FEW))
    text = (folder / FILE).read_text(encoding="utf-8")
    old = read_design(folder).maps[0].title
    (folder / FILE).write_text(text.replace(f'title = "{old}"', 'title = "Zedville"'), encoding="utf-8")
    with pytest.raises(InputError, match="has changed since"):
        read_design(folder)
    assert build(folder) == ("m1",)
    picture = read_design(folder).pictures["m1"].file.read_text(encoding="utf-8")
    assert "Zedville" in picture
    assert old not in picture
