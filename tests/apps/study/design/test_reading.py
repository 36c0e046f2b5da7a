from __future__ import annotations

import json
import random
import tomllib

import pytest

from ratherthan.apps.study.design import screens
from ratherthan.apps.study.design.checking import check
from ratherthan.apps.study.design.faults import DesignError
from ratherthan.apps.study.design.lines import lines_of
from ratherthan.apps.study.design.reading import FILE, read_design, read_draft
from ratherthan.errors import InputError


def faults(folder) -> list[str]:
    with pytest.raises(DesignError) as caught:
        read_design(folder)
    return [str(fault) for fault in caught.value.faults]


def line_of(folder, piece: str) -> int:
    text = (folder / FILE).read_text(encoding="utf-8")
    return text[: text.index(piece)].count("\n") + 1


def test_the_default_design_is_the_papers(made):
    design = read_design(made)
    kinds = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")
    assert tuple(kind.id for kind in design.kinds) == kinds
    assert (len(design.maps), len(design.items), len(design.attention)) == (3, 2, 2)
    assert [len(item.options) for item in design.items] == [5, 5]
    assert [item.name for item in design.items] == ["understanding", "trust"]
    assert [(group.kinds, group.neither is not None) for group in design.groupings] == [
        (("naive-state", "responsibility"), True),
        (("naive-state", "constrictive"), True),
        (("naive-path", "selective"), True),
        (("responsibility", "constrictive", "selective", "contrastive"), False),
    ]
    assert len(screens(design, 0)) == 41


def test_a_folder_and_the_file_in_it_are_the_same_design(made):
    assert read_design(made) == read_design(made / FILE)


@pytest.mark.parametrize(
    ("pair", "said"),
    [
        (('id = "trust"', 'id = "understanding"'), "is already the id of items[1]"),
        (('id = "trust"', 'id = "consent"'), "a column of the program's own"),
        (('id = "trust"', 'id = "Trust Me"'), "An id must begin with a small letter"),
        (('id = "trust"\n', ""), "An id is missing"),
        (('id = "m2"', 'id = "m1"'), "Ids must differ, but 'm1'"),
        (
            ('source = "maps/birchfield.roadmap"', 'source = "maps/gone.roadmap"'),
            "There must be a file 'maps/gone.roadmap'",
        ),
        (('source = "maps/birchfield.roadmap"\n', ""), "A text is missing: write source"),
        (('kind = "selective"', 'kind = "selectiv"'), "Did you mean 'selective'?"),
        (('kind = "selective"', 'kind = "selective"\nscope = "route"'), "either by 'kind' or by 'scope'"),
        (('kind = "selective"', 'scope = "route"\nfactors = ["selectivity"]'), "some of selectiveness"),
        (('kind = "selective"', 'scope = "town"'), "one of state, route"),
        (('"naive-state", "responsibility"]', '"naive-state", "responsability"]'), "got 'responsability'"),
        (('"naive-state", "responsibility"]', '"naive-state", "naive-state"]'), "each kind once"),
        (('kinds = ["naive-state", "responsibility"]', "kinds = []"), "The list is empty"),
        (('"Disagree", "Neither', '"Neither'), "a label for each of its 5 points, got 4"),
        (('"Disagree", "Neither', '"Agree", "Neither'), "The labels of a scale must differ"),
        (("points = 5", 'points = "5"'), "must be a whole number"),
        (("points = 5", "pionts = 5"), "Did you mean 'points'?"),
        (("quota = 84", "quota = 0"), "must be a whole number from 1"),
        (("quota = 84", "quota = 8_000_000_000_000_000_000_000_000"), "got a very long number"),
        (("longest_gap = 24", "longest_gap = -1"), "above 0"),
        (("longest_gap = 24", "longest_gap = nan"), "must be a number"),
        (('language = "en"', 'language = "plain English"'), "must be a tag"),
        (('title = "Thank you"', 'title = "Thank\\u0000you"'), "without control characters, got U+0000"),
        (('title = "Thank you"', 'title = "Thank \\u202Eyou"'), "got U+202E"),
        (('title = "Thank you"', 'title = "  "'), "The text is empty"),
        (('title = "Thank you"', "title = 7"), "must be a text in quotes, got 7"),
        (('title = "Thank you"', f'title = "{"x" * 5000}"'), "at most 300 characters here, got 5000"),
        (('title = "Thank you"', 'titel = "Thank you"'), "Did you mean 'title'?"),
        (('correct = "route"', 'correct = "rout"'), "must be one of route, river, border; got 'rout'"),
        (('correct = "route"\n', ""), "must be one of route, river, border; got nothing"),
        (("correct = 2", "correct = 9"), "must be one of 1, 2, 3, 4, 5; got 9"),
        (("\nafter = 6", "\nafter = 60"), "of which there are 21; got 60"),
        (('kinds = "williams"', 'kinds = "wiliams"'), "Did you mean 'williams'?"),
        (('maps = "williams"', 'maps = [["m1", "m2"]]'), "each of m1, m2, m3 once, got 'm1', 'm2'"),
        (('maps = "williams"', "maps = []"), "or 1 to"),
        (("[thanks]", "[thank]"), "A section is missing: [thanks]"),
        (("[trial]", "[trail]"), "A section is missing: [trial]"),
        (('value = "route", label', 'value = "river", label'), "got 'river' twice"),
        (("attempts = 2", "attempts = 0"), "must be a whole number from 1"),
        (("required = false", 'required = "no"'), "true or false, without quotes"),
        (('done = "', 'done = "a b'), "only letters, digits"),
    ],
)
def test_every_fault_is_told_with_its_place(changed, pair, said):
    folder = changed(pair)
    found = faults(folder)
    assert any(said in fault for fault in found), found
    assert all(fault.startswith("design.toml") for fault in found)


def test_a_fault_is_told_with_its_line_and_key(changed):
    folder = changed(('id = "trust"', 'id = "understanding"'))
    (found,) = faults(folder)
    where = line_of(folder, '[[items]]\nid = "understanding"\ntext = "I trust') + 1
    assert found.startswith(f"design.toml, line {where}: items[2].id: ")


def test_all_faults_are_told_at_once(changed):
    folder = changed(("quota = 84", "quota = -3"), ('id = "trust"', 'id = "Trust"'), ("[thanks]", "[thank]"))
    found = faults(folder)
    assert len(found) == 4
    with pytest.raises(InputError, match=r"And 3 more faults: 'ratherthan study check' lists all\.$"):
        read_design(folder)


def test_broken_toml_is_told_with_its_line(changed):
    (found,) = faults(changed(('title = "Thank you"', 'title = "Thank you')))
    assert "The file must be TOML" in found
    assert "in line" in found


@pytest.mark.parametrize(
    "text", ["", "format = 2", 'format = "1"', "format = 99", "a" * 100, "[[[[", "x = " + "[" * 5000]
)
def test_what_is_no_design_is_refused_in_a_sentence(study, text):
    (study / FILE).write_text(text, encoding="utf-8")
    (found,) = faults(study)
    assert found.startswith("design.toml: The ")


def test_a_design_of_a_newer_format_says_what_to_do(changed):
    (found,) = faults(changed(("format = 1", "format = 2")))
    assert "newer version of this program" in found


def test_bytes_that_are_no_text_are_refused_with_their_line(study):
    (study / FILE).write_bytes(b'format = 1\ntitle = "\xff"\n')
    (found,) = faults(study)
    assert "line 2 is not" in found


def test_a_design_that_is_not_there_says_how_one_is_made(tmp_path):
    with pytest.raises(DesignError, match="study new"):
        read_design(tmp_path)


def test_a_script_in_a_text_is_text(changed):
    script = '<script>alert("x")</script>'
    folder = changed(("I trust that this information is correct.", script.replace('"', '\\"')))
    trial = next(one for one in screens(read_design(folder), 0) if one.phase == "trial")
    assert trial.records[1].label == script


def test_the_order_of_everything_can_be_changed_in_the_file(changed):
    rows = '[["m1", "m2", "m3"], ["m3", "m2", "m1"]]'
    design = read_design(changed(('maps = "williams"', f"maps = {rows}"), ('kinds = "williams"', 'kinds = "fixed"')))
    trials = [one for one in screens(design, 1) if one.phase == "trial"]
    assert [one.map for one in trials[::7]] == ["m3", "m2", "m1"]
    assert [one.kind for one in trials[:7]] == [kind.id for kind in design.kinds]


def test_items_of_other_types_can_be_asked(changed):
    more = (
        '[[items]]\nid = "certainty"\ntext = "How sure are you?"\ntype = "number"\nleast = 0\nmost = 100\nunit = "%"\n\n'
        '[[items]]\nid = "why"\ntext = "Why?"\ntype = "text"\nlongest = 200\n\n'
        '[[items]]\nid = "seen"\ntext = "I have seen the map."\ntype = "flag"\n\n'
        '[[items]]\nid = "like"\ntext = "Do you like it?"\noptions = ["yes", { value = 0, label = "no" }]\n\n'
    )
    design = read_design(changed(("# Attention checks.", f"{more}# Attention checks.")))
    number, text, flag, choice = design.items[2:]
    assert (number.least, number.most, number.unit) == (0.0, 100.0, "%")
    assert (text.longest, text.required) == (200, False)
    assert flag.required
    assert [(one.value, one.label) for one in choice.options] == [("yes", "yes"), (0, "no")]


def test_the_fingerprint_changes_with_what_people_see_and_not_with_the_quota(study, changed):
    before = read_design(study).fingerprint
    assert read_design(changed(("quota = 84", "quota = 42"), ('done = "', 'done = "X'))).fingerprint == before
    assert read_design(changed(('title = "Thank you"', 'title = "Thanks"'))).fingerprint != before


def test_paragraphs_may_be_one_text_with_blank_lines(changed):
    text = '"""One\nparagraph.\n\nAnother."""'
    design = read_design(changed(('paragraphs = ["That was all. Your answers are stored."]', f"paragraphs = {text}")))
    assert design.thanks.paragraphs == ("One paragraph.", "Another.")


def test_ids_of_maps_and_kinds_that_can_be_read_in_two_ways_are_refused(changed):
    folder = changed(('id = "m1"', 'id = "m"'), ('id = "m2"', 'id = "m-naive"'), ('id = "none"', 'id = "path"'))
    with pytest.raises(DesignError, match="'m-naive-path' can be read in two ways"):
        read_draft(folder)


def test_a_key_that_steers_terminals_is_shown_harmless(study):
    (study / FILE).write_text(f'format = 1\n"\\u001b[31m{"k" * 500}" = 1\n', encoding="utf-8")
    found = [fault for fault in faults(study) if "This key is not known" in fault]
    assert len(found) == 1
    assert found[0].isprintable()
    assert len(found[0]) < 500


def test_lines_are_found_in_nested_lists_and_after_long_texts():
    text = 'a = """\n[b]\n"""\n[c]\nd = 1\n[[c.e]]\nf = 1\n[[c.e]]\nf = [\n  1,\n]\ng.h = 2\n'
    found = lines_of(text)
    assert found[("c",)] == 4
    assert found[("c", "e", 2, "f")] == 9
    assert found[("c", "e", 2, "g", "h")] == 12
    assert ("b",) not in found
    assert lines_of('# a """ in a note\na = 1') == {("a",): 2}


def spelled(value) -> str:
    """Return a value as TOML writes it on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {spelled(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(spelled, value)) + "]"
    return (
        str(value).lower() if isinstance(value, bool) else json.dumps(value) if isinstance(value, str) else str(value)
    )


def paths(value, before=()):
    if before:
        yield before
    if isinstance(value, dict | list):
        for key, one in value.items() if isinstance(value, dict) else enumerate(value):
            yield from paths(one, (*before, key))


STRANGE = (
    *(
        0,
        -1,
        2,
        10**30,
        1.5,
        float("nan"),
        float("inf"),
        True,
        False,
        "",
        "x",
        "\x00",
        "a\nb",
        "none",
        "neither",
        "../x",
    ),
    *(
        [],
        {},
        [[]],
        [1, 2],
        ["a"],
        [{}],
        {"a": 1},
        [{"id": "x"}],
        "<script>",
        "\u202e",
        [["m1", "m2", "m3"]],
        "x" * 100_000,
    ),
)


@pytest.mark.parametrize("seed", range(3))
def test_whatever_a_design_holds_it_is_read_or_refused_in_sentences(study, seed):
    rng = random.Random(seed)
    base = tomllib.loads((study / FILE).read_text(encoding="utf-8"))
    places = list(paths(base))
    refused = 0
    for _ in range(60):
        table = json.loads(json.dumps(base))
        *outer, last = rng.choice(places)
        holder = table
        for key in outer:
            holder = holder[key]
        if rng.random() < 0.25:
            del holder[last]
        else:
            holder[last] = rng.choice(STRANGE)
        (study / FILE).write_text("\n".join(f"{json.dumps(key)} = {spelled(one)}" for key, one in table.items()))
        report = check(study)
        assert all(fault.sentence and len(str(fault)) < 1000 for fault in report.faults)
        refused += bool(report.faults)
        if report.design is not None:
            assert len({one.id for one in screens(report.design, 1)}) == len(screens(report.design, 1))
    assert refused > 30
