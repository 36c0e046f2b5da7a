from __future__ import annotations

import re

import pytest
from apps.study.designs import small_design

from ratherthan.apps.study.design import screens
from ratherthan.apps.study.design.checking import check
from ratherthan.apps.study.design.codebook import codebook
from ratherthan.apps.study.design.reading import FILE, read_design
from ratherthan.apps.study.design.stimuli import build
from ratherthan.apps.study.design.timing import duration
from ratherthan.apps.study.design.writing import New, new_study


def warnings(folder) -> list[str]:
    report = check(folder)
    assert report.faults == ()
    return [str(one) for one in report.warnings]


READY = (
    ('contact = "" ', 'contact = "a@example.org" '),
    ("[your name and institution]", "Ada at the Institute"),
)


def test_the_default_design_lacks_only_what_nobody_else_can_know(made):
    found = warnings(made)
    assert len(found) == 2
    assert "no address for questions" in found[0]
    assert "[your name and institution]" in found[1]


def test_a_design_that_is_filled_in_has_no_warnings(changed):
    assert warnings(changed(*READY)) == []


@pytest.mark.parametrize(
    ("pair", "said"),
    [
        (("quota = 84", "quota = 100"), "every 42 people who finish, and 100 is no multiple of it: take 84 or 126"),
        (("quota = 84", "quota = 10"), "take 42"),
        (('kinds = "williams"', 'kinds = "fixed"'), "'constrictive' does not stand in every place equally often"),
        (('maps = "williams"', 'maps = "latin"'), "balanced over places, but"),
        (('maps = "williams"', 'maps = [["m1", "m2", "m3"], ["m2", "m1", "m3"]]'), "This order is not balanced"),
        (("Please choose “Disagree” here.", "Please choose well."), "'Disagree' does not occur in it"),
        (("failed_checks_allowed = 1", "failed_checks_allowed = 0"), "allow 1"),
        (("failed_checks_allowed = 1", "failed_checks_allowed = 2"), "Nobody can fail more checks than that"),
        (('{ value = "18-24", label = "18 to 24" }', '{ value = "16-24", label = "16 to 24" }'), "people under 18"),
        (('language = "en"', 'language = "pt-BR"'), "The explanations are in 'en', the pages in 'pt-BR'"),
        (("done = ", "# done = "), "no code 'done'"),
    ],
)
def test_what_is_doubtful_is_warned_of_with_its_place(changed, pair, said):
    folder = changed(*READY, pair)
    if "language" in pair[0]:
        build(folder)
    found = warnings(folder)
    assert any(said in one for one in found), found
    assert all(re.match(r"design\.toml, line \d+: ", one) for one in found), found


def test_equal_codes_are_warned_of(study, changed):
    text = (study / FILE).read_text(encoding="utf-8")
    done = re.search(r'^done = "(.*)"', text, re.MULTILINE)[1]
    other = re.search(r'^no_consent = "(.*)"', text, re.MULTILINE)[1]
    found = warnings(changed(*READY, (f'"{other}"', f'"{done}"')))
    assert len(found) == 1
    assert "'done' and 'no_consent' have the same code" in found[0]


def test_translated_explanations_are_not_asked_for_again(changed):
    folder = changed(
        *READY, ('language = "en"', 'language = "de"'), ("[thanks]", '[translations.m1]\nselective = "X."\n\n[thanks]')
    )
    build(folder)
    first = next(one for one in warnings(folder) if "maps[1]" in one)
    assert "naive-path, contrastive in [translations.m1]" in first


def test_kinds_that_say_the_same_are_warned_of(changed):
    folder = changed(*READY, ('kind = "constrictive"', 'kind = "responsibility"'))
    build(folder)
    found = warnings(folder)
    assert len(found) == 3
    assert all("'constrictive' says the same as 'responsibility'" in one for one in found)


def test_a_study_without_silence_is_warned_of(tmp_path):
    folder = tmp_path / "loud"
    new_study(folder, New(kinds=("naive-path", "contrastive")))
    assert any("No kind says nothing" in one for one in warnings(folder))


def test_maps_that_cannot_be_compared_are_warned_of(tmp_path):
    folder = tmp_path / "unlike"
    new_study(folder, New(maps=("example:city-1", "example:paper-5x5"), kinds=("none", "naive-path")))
    found = warnings(folder)
    assert any("not comparable in the moves of the route: m1 16, m2 7" in one for one in found)
    assert any("in words: m1 112, m2 49" in one for one in found)


def test_the_papers_age_bands_are_warned_of(tmp_path):
    folder = tmp_path / "young"
    new_study(folder, New(kinds=("none", "naive-path"), ages="paper"))
    assert any("people under 18" in one for one in warnings(folder))
    values = [option.value for option in read_design(folder).about_records[0].options]
    assert values == ["0-17", "18-24", "25-34", "35-49", "50-64", "65+"]


def test_faults_leave_no_report_but_themselves(changed):
    report = check(changed(("quota = 84", "quota = 0")))
    assert len(report.faults) == 1
    assert (report.design, report.codebook, report.warnings) == (None, (), ())


def test_the_codebook_lists_everything_that_a_screen_records(made):
    design = read_design(made)
    recorded = {record.name for one in screens(design, 0) for record in one.records}
    found = {entry.item: entry for entry in codebook(design)}
    assert set(found) == recorded | {"time", "hidden_time"}
    for one in screens(design, 0):
        for record in one.records:
            allowed = {option.value for option in found[record.name].options}
            assert {option.value for option in record.options} <= allowed
            assert one.phase in found[record.name].phases


def test_the_codebook_says_type_unit_values_and_how_often(made):
    found = {entry.item: entry for entry in codebook(read_design(made))}
    rated = found["understanding"]
    assert (rated.type, rated.unit, rated.times, rated.correct) == ("choice", "points", 21, "")
    assert rated.allowed.startswith("1 = Strongly disagree | 2 = Disagree")
    assert (found["preferred"].times, found["time"].unit, found["check-1"].correct) == (12, "s", "2")
    assert found["comment"].allowed == "at most 2000 characters"


def test_what_is_preferred_is_a_kind_or_neither(made):
    found = {entry.item: entry for entry in codebook(read_design(made))}
    values = {option.value for option in found["preferred"].options}
    assert values == {
        "neither",
        "naive-state",
        "responsibility",
        "constrictive",
        "naive-path",
        "selective",
        "contrastive",
    }


def test_more_words_take_longer_and_slow_readers_need_more_time(tmp_path, made):
    short, long = (duration(screens(one, 0)) for one in (small_design(tmp_path), read_design(made)))
    assert short.usual < long.usual
    assert long.fast < long.usual < long.slow
    assert sum(one.minutes for one in long.phases) == pytest.approx(long.usual)
    assert sum(one.pages for one in long.phases) == 41


def test_everybody_needs_the_same_time_whatever_their_order(made):
    design = read_design(made)
    usual = {round(duration(screens(design, slot)).usual, 9) for slot in range(42)}
    assert len(usual) == 1
