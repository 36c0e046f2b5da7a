"""Long routes: few sentences of them, of a map or of a kind."""

from __future__ import annotations

import re

import pytest

import ratherthan as rt
from ratherthan.apps.study.design import screens
from ratherthan.apps.study.design.checking import check
from ratherthan.apps.study.design.faults import DesignError
from ratherthan.apps.study.design.reading import FILE, read_design
from ratherthan.apps.study.design.stimuli import build
from ratherthan.apps.study.design.writing import New, new_study

ROUTE = ("naive-path", "selective", "contrastive")
STATE = ("naive-state", "responsibility", "constrictive")


def test_few_sentences_are_those_of_the_core(changed, study):
    folder = changed(('source = "maps/ashbrook.roadmap"', 'source = "maps/ashbrook.roadmap"\nat_most = 3'))
    assert set(build(folder)) == {f"m1/{kind}" for kind in ROUTE}
    design = read_design(folder)
    solution = rt.solve(rt.read(str(study / "maps" / "ashbrook.roadmap")))
    for kind in ROUTE:
        assert design.stimuli["m1", kind].text == rt.narrate(rt.explain(solution, kind=kind, at_most=3))


def test_the_kinds_number_goes_before_the_maps(changed):
    folder = changed(
        ('source = "maps/ashbrook.roadmap"', 'source = "maps/ashbrook.roadmap"\nat_most = 3'),
        ('kind = "selective"', 'kind = "selective"\nat_most = 1'),
    )
    build(folder)
    found = read_design(folder).stimuli
    told = {
        (name, kind): len(re.findall(r"\b[Ww]e move\b", found[name, kind].text))
        for name in ("m1", "m2")
        for kind in ROUTE
    }
    assert told["m1", "selective"] == told["m2", "selective"] == 1
    assert told["m1", "contrastive"] == 3
    assert told["m2", "contrastive"] == 6


def test_a_number_that_changed_asks_for_a_build(changed):
    folder = changed(('source = "maps/ashbrook.roadmap"', 'source = "maps/ashbrook.roadmap"\nat_most = 3'))
    with pytest.raises(DesignError) as caught:
        read_design(folder)
    assert len(caught.value.faults) == len(ROUTE)
    build(folder)
    assert read_design(folder).maps[0].at_most == 3


@pytest.mark.parametrize("number", ["0", "-1", "1001", "1.5", "true", '"7"', "nan"])
def test_a_number_of_sentences_is_a_whole_number_from_1(changed, number):
    folder = changed(('source = "maps/ashbrook.roadmap"', f'source = "maps/ashbrook.roadmap"\nat_most = {number}'))
    with pytest.raises(DesignError, match=r"maps\[1\]\.at_most: This must be a whole number from 1 to 1000"):
        read_design(folder)


@pytest.mark.parametrize("kind", ["none", *STATE])
def test_a_kind_that_is_not_about_a_route_has_no_number(changed, kind):
    with pytest.raises(DesignError, match=r"at_most: A number of sentences must be for a kind about a whole route"):
        read_design(changed((f'kind = "{kind}"', f'kind = "{kind}"\nat_most = 2')))


def test_a_combination_may_have_a_number_where_it_is_about_a_route(changed):
    folder = changed(('kind = "selective"', 'scope = "route"\nfactors = ["selectiveness"]\nat_most = 2'))
    build(folder)
    assert read_design(folder).kinds[5].at_most == 2
    with pytest.raises(DesignError, match="about a whole route"):
        read_design(changed(('scope = "route"', 'scope = "state"')))


def test_a_new_study_takes_a_number_for_all_its_maps(tmp_path):
    design = new_study(tmp_path / "study", New(at_most=4))
    assert [one.at_most for one in design.maps] == [4, 4, 4]


def _corridor(folder, cells):
    """Write a road map of one long street with a corner, and return its file."""
    file = folder / "long.roadmap"
    side = cells // 2
    rows = ["S" + "." * side] + ["#" * side + "."] * (side - 1) + ["#" * side + "D"]
    text = 'title = "Long"\nsuccess = 0.9\nproperty = \'R{"distance"}min=? [F "destination"]\'\nmap = \'\'\'\n'
    file.write_text(text + "\n".join(rows) + "\n'''\n[costs]\ndistance = 1\n", encoding="utf-8")
    return file


@pytest.mark.slow
def test_a_route_that_is_too_long_to_be_told_says_how_it_can_be(tmp_path):
    source = str(_corridor(tmp_path, 1200))
    with pytest.raises(DesignError, match=r"at_most = 7 .* \(--at-most 7 "):
        new_study(tmp_path / "a", New(maps=(source,), kinds=("none", "naive-path")))
    design = new_study(tmp_path / "b", New(maps=(source,), kinds=("none", "naive-path"), at_most=7))
    assert design.stimuli["m1", "naive-path"].words < 100
    assert design.stimuli["m1", "naive-path"].steps > 1


def test_what_few_people_would_read_is_warned_of(tmp_path):
    source = str(_corridor(tmp_path, 80))
    new_study(tmp_path / "a", New(maps=(source,), kinds=("none", "naive-path")))
    (found,) = [str(one) for one in check(tmp_path / "a").warnings if "at_most" in one.sentence]
    assert "naive-path" in found
    text = (tmp_path / "a" / FILE).read_text(encoding="utf-8")
    (tmp_path / "a" / FILE).write_text(text.replace('long.roadmap"', 'long.roadmap"\nat_most = 3'), encoding="utf-8")
    assert build(tmp_path / "a") == ("m1/naive-path",)
    assert not [one for one in check(tmp_path / "a").warnings if "at_most" in one.sentence]
    assert screens(read_design(tmp_path / "a"), 0)
