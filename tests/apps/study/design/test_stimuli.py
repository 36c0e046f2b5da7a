from __future__ import annotations

import json
import re

import pytest

import ratherthan as rt
from ratherthan.apps.study.design import screens
from ratherthan.apps.study.design.checking import measures
from ratherthan.apps.study.design.faults import DesignError
from ratherthan.apps.study.design.reading import FILE, read_design
from ratherthan.apps.study.design.stimuli import build
from ratherthan.apps.study.design.storing import FOLDER, INDEX, size_of
from ratherthan.apps.study.design.writing import New, new_study


def change_index(study, change) -> None:
    path = study / FOLDER / INDEX
    index = json.loads(path.read_text(encoding="utf-8"))
    change(index)
    path.write_text(json.dumps(index), encoding="utf-8")


def test_explanations_are_what_the_core_says_to_the_letter(made):
    design = read_design(made)
    for one in design.maps:
        solution = rt.solve(rt.read(made / one.source))
        for kind in ("naive-path", "selective", "contrastive"):
            assert design.stimuli[one.id, kind].text == rt.narrate(rt.explain(solution, kind=kind))


def test_the_three_maps_are_comparable(made):
    found = measures(read_design(made))
    assert len(found) == 3
    same = {"moves": 14, "critical": 6, "both": 3, "responsibility": 3, "constrictiveness": 0, "neither": 0}
    assert all(one == same for one in found.values())


def test_explanations_of_a_kind_have_the_same_size_on_all_three_maps(made):
    design = read_design(made)
    for kind in design.kinds:
        sizes = {(s.words, s.sentences, s.steps) for (_, name), s in design.stimuli.items() if name == kind.id}
        assert len(sizes) == 1


def test_the_kinds_of_one_step_explain_the_same_one_and_say_different_things(made):
    design = read_design(made)
    for one in design.maps:
        texts = [design.stimuli[one.id, kind].text for kind in ("naive-state", "responsibility", "constrictive")]
        assert len(set(texts)) == 3
        assert len({re.search(r"at grid (\d+)", text)[1] for text in texts}) == 1
        assert "shortest route" in texts[1]
        assert "most flexible" in texts[2]


def test_the_map_files_are_ten_by_ten_with_one_best_route(made):
    for path in (made / "maps").glob("*.roadmap"):
        problem = rt.read(path)
        assert (problem.world.width, problem.world.height) == (10, 10)
        text = rt.narrate(rt.explain(rt.solve(problem)))
        assert "one of the" not in text
        assert text.endswith("All other decisions result in equivalent routes.")


def test_the_picture_gives_no_decision_away(made):
    """No numbers in diamonds, no dashed alternatives, the same picture for all kinds of a map."""
    for picture in read_design(made).pictures.values():
        svg = picture.file.read_text(encoding="utf-8")
        assert 'class="step"' not in svg
        assert 'class="foil"' not in svg
        assert "matters" not in svg
        assert "<script" not in svg
        assert "our route" in svg


def test_what_stands_for_the_picture_names_the_places_of_the_route(made):
    design = read_design(made)
    text = design.pictures["m1"].text
    assert text.startswith("The map of Ashbrook. The robot's route takes 14 moves. It leads over grid 11, grid 12, ")
    assert text.endswith("grid 88.")


def test_a_picture_has_no_words_of_another_language(changed):
    folder = changed(('language = "en"', 'language = "de"'))
    with pytest.raises(DesignError, match="what is asked of it, has changed"):
        read_design(folder)
    assert build(folder) == ("m1", "m2", "m3")
    for picture in read_design(folder).pictures.values():
        svg = picture.file.read_text(encoding="utf-8")
        assert not re.search(r"<text[^>]*>[^<]*[A-Za-z]", svg)
        assert f'width="{picture.width:g}"' in svg


def test_of_a_long_route_some_places_are_named(tmp_path):
    own = tmp_path / "long.roadmap"
    own.write_text(f"map = 'S{'.' * 98}D'\n", encoding="utf-8")
    design = new_study(tmp_path / "study", New(maps=(str(own),), kinds=("none", "selective")))
    text = design.pictures["m1"].text
    assert "takes 99 moves" in text
    assert text.endswith("grid 58, …, grid 99.")


def test_building_again_changes_nothing(study):
    before = {path.name: path.read_bytes() for path in (study / FOLDER).iterdir()}
    assert build(study) == ()
    assert {path.name: path.read_bytes() for path in (study / FOLDER).iterdir()} == before


def test_a_text_that_was_changed_by_hand_is_refused(study):
    def change(index):
        index["maps"]["m2"]["texts"]["selective"]["text"] += " Believe me."

    change_index(study, change)
    with pytest.raises(DesignError, match=r"maps\.m2\.texts\.selective: This text was changed by hand"):
        read_design(study)
    assert build(study) == ("m2/selective",)
    read_design(study)


def test_a_picture_that_was_changed_by_hand_is_refused(study):
    picture = study / FOLDER / "m1.svg"
    picture.write_text(picture.read_text(encoding="utf-8") + "<!-- -->", encoding="utf-8")
    with pytest.raises(DesignError, match=r"m1\.svg' was changed by hand"):
        read_design(study)
    picture.unlink()
    with pytest.raises(DesignError, match=r"m1\.svg' is missing"):
        read_design(study)


def test_measures_that_were_changed_by_hand_are_refused(study):
    change_index(study, lambda index: index["maps"]["m1"]["route"].update(moves=3))
    with pytest.raises(DesignError, match="maps.m1: This was changed by hand"):
        read_design(study)


def test_a_map_that_has_changed_since_is_told(study):
    path = study / "maps" / "cedarton.roadmap"
    path.write_text(path.read_text(encoding="utf-8").replace("success = 0.9", "success = 0.8"), encoding="utf-8")
    with pytest.raises(DesignError, match="maps.m3: The map, or what is asked of it, has changed"):
        read_design(study)
    build(study)
    read_design(study)


def test_a_state_that_was_asked_for_is_explained(changed):
    folder = changed(('source = "maps/ashbrook.roadmap"', 'source = "maps/ashbrook.roadmap"\nstate = 14'))
    with pytest.raises(DesignError, match="the state it explains, has changed"):
        read_design(folder)
    assert build(folder) == ("m1/naive-state", "m1/responsibility", "m1/constrictive")
    assert "at grid 14" in read_design(folder).stimuli["m1", "naive-state"].text


def test_a_kind_of_ones_own_is_told_by_scope_and_factors(changed):
    folder = changed(('kind = "selective"', 'scope = "route"\nfactors = ["selectiveness", "responsibility"]'))
    assert build(folder) == ("m1/selective", "m2/selective", "m3/selective")
    text = read_design(folder).stimuli["m1", "selective"].text
    assert "because it leads to the shortest route" in text
    assert "flexible" not in text


def test_missing_stimuli_say_how_they_are_made(study):
    (study / FOLDER / INDEX).unlink()
    with pytest.raises(DesignError, match="'ratherthan study build' computes them"):
        read_design(study)


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"format": 9, "maps": {}}', '{"format": 1, "maps": []}', "[" * 100_000]
)
def test_an_index_that_is_none_is_refused(study, text):
    (study / FOLDER / INDEX).write_text(text, encoding="utf-8")
    with pytest.raises(DesignError, match=r"stimuli\.json"):
        read_design(study)


@pytest.mark.parametrize("where", ["m1", "texts"])
def test_an_entry_that_is_missing_is_told(study, where):
    def change(index):
        del (index["maps"] if where == "m1" else index["maps"]["m1"])[where]

    change_index(study, change)
    with pytest.raises(DesignError, match="maps.m1: The explanations of this map are not there yet"):
        read_design(study)


def test_a_translation_is_shown_in_place_of_the_text_and_marked(changed):
    folder = changed(("[thanks]", '[translations.m1]\nnaive-state = "Wir fahren nach Osten."\n\n[thanks]'))
    design = read_design(folder)
    found = design.stimuli["m1", "naive-state"]
    assert (found.text, found.words, found.by_hand) == ("Wir fahren nach Osten.", 4, True)
    assert not design.stimuli["m2", "naive-state"].by_hand
    assert "Wir fahren nach Osten." in {one.explanation for one in screens(design, 0)}


def test_a_translation_of_what_is_not_there_is_refused(changed):
    folder = changed(("[thanks]", '[translations.m9]\nselectiv = "x"\n\n[thanks]'))
    with pytest.raises(DesignError, match="not known here; known are m1, m2, m3"):
        read_design(folder)


@pytest.mark.parametrize(
    ("drawing", "said"),
    [("S#D", "must have a route"), ("S..", "destination"), ("SxD", "must have a route")],
)
def test_a_map_without_a_route_is_refused_with_its_place(study, drawing, said):
    (study / "maps" / "ashbrook.roadmap").write_text(f"map = '{drawing}'\n", encoding="utf-8")
    before = (study / FOLDER / INDEX).read_bytes()
    with pytest.raises(DesignError, match=r"^design\.toml: maps\[1\]: 'maps/ashbrook\.roadmap'") as caught:
        build(study)
    assert said in str(caught.value)
    assert (study / FOLDER / INDEX).read_bytes() == before


@pytest.mark.parametrize(
    ("text", "size"),
    [("", (0, 0)), ("Go.", (1, 1)), ("Go to 1.5 m. Then stop.", (6, 2)), ("No stop", (2, 1)), ("Was? Ja!", (2, 2))],
)
def test_the_size_of_a_text_is_its_words_and_sentences(text, size):
    assert size_of(text) == size


def test_a_design_without_a_file_name_is_found_in_its_folder(study):
    assert build(study / FILE) == ()
