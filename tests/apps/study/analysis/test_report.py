"""The report: what it says follows from the numbers, what cannot be computed has its reason, and robots are marked everywhere."""

from __future__ import annotations

import dataclasses
import json
import re
import string
import tomllib
from pathlib import Path

import numpy as np
import pytest
from apps.study.analysis import exports

import ratherthan.apps.study.analysis.words as words_module
from ratherthan.apps.study.analysis.analyse import analysed, written
from ratherthan.apps.study.analysis.data import Data, Measure, Person
from ratherthan.apps.study.analysis.measuring import measured, planned
from ratherthan.apps.study.analysis.preferring import Lacking
from ratherthan.apps.study.analysis.rendering import as_html, as_markdown
from ratherthan.apps.study.analysis.report import report_of, verdicts_of
from ratherthan.apps.study.analysis.results import as_document
from ratherthan.apps.study.analysis.statistics.repeated import Contrast
from ratherthan.apps.study.analysis.tidy import read_tidy
from ratherthan.apps.study.analysis.verdicts import conclusions, measure_verdict, outcome
from ratherthan.apps.study.analysis.words import p_text, say

NO_NUMBER = re.compile(r"\b(nan|NaN|inf|Infinity|None)\b")


@pytest.fixture(autouse=True, scope="module")
def _extra():
    pytest.importorskip("jinja2", reason="needs the extra study")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return analysed(read_tidy(exports.write(exports.observations(100), tmp_path_factory.mktemp("export"))))


def pages(found):
    document = report_of(found)
    return as_html(document), as_markdown(document), json.dumps(as_document(found), allow_nan=False)


def checked(found):
    """Return the pages, on which nothing stands that is no number."""
    made = pages(found)
    for page in made[:2]:
        assert not NO_NUMBER.search(re.sub(r"base64,[\w+/=]+", "", page))
    return made


def test_a_hundred_people_have_the_published_degrees_of_freedom(whole):
    for result in whole.measured:
        assert (result.one_way.between, result.one_way.within) == (6, 2093)
        assert (result.primary.kinds, result.primary.errors) == (6, 594)
        assert len(result.tukey) == 21
        assert len(result.compared) == 10


def test_the_published_numbers_stand_beside_the_new_ones(whole):
    html, markdown, _ = checked(whole)
    for page in (html.replace("\N{NO-BREAK SPACE}", " "), markdown):
        for printed in ("50.39", "2.9967", "211.60", ".0064", "57.7 %", "26.3 %", "28.7 %", "As published", "46.0 %"):
            assert printed in page, printed
        assert "does not increase user understanding as we hypothesized in H1" in page
        assert "contrastive explanations increase understanding" in page


def test_robots_are_marked_in_every_file(whole, tmp_path):
    for path in written(whole, tmp_path):
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".R":
            continue
        assert re.search("simulated", text, re.IGNORECASE), path
    assert (tmp_path / "report.html").read_text(encoding="utf-8").count(say("forms.simulated")) == 2


def test_people_are_marked_nowhere(tmp_path):
    found = analysed(read_tidy(exports.write(exports.observations(9, simulated=False), tmp_path / "x")))
    for path in written(found, tmp_path / "y"):
        if path.suffix not in (".csv", ".json"):
            assert not re.search("simulated|robots? were", path.read_text(encoding="utf-8"), re.IGNORECASE), path


def test_the_same_answers_give_the_same_bytes(tmp_path):
    folder = exports.write(exports.observations(8), tmp_path / "export")
    files = [written(analysed(read_tidy(folder)), tmp_path / name) for name in ("a", "b")]
    assert [path.read_bytes() for path in files[0]] == [path.read_bytes() for path in files[1]]


@pytest.mark.parametrize(
    ("people", "kinds"),
    [
        (1, exports.KINDS),
        (2, exports.KINDS),
        (5, ("none",)),
        (3, ("none", "contrastive")),
        (4, ("naive-path", "selective", "naive-state")),
    ],
)
def test_few_people_or_kinds_still_give_a_report(people, kinds, tmp_path):
    rows = exports.observations(people, kinds=kinds, maps=2)
    found = analysed(read_tidy(exports.write(rows, tmp_path)))
    html, _, _ = checked(found)
    if people == 1 or len(kinds) == 1:
        assert all(isinstance(result.primary, Lacking) for result in found.measured)
        assert "Not computed." in html


def test_constant_answers_still_give_a_report(tmp_path):
    rows = exports.observations(10)
    for row in rows:
        if row["item"] in ("understanding", "trust"):
            row["value"] = "4"
        elif row["item"] == "time":
            row["value"] = "12.5"
        elif row["item"] == "preferred":
            row["value"] = row["options"].split("|")[0]
    found = analysed(read_tidy(exports.write(rows, tmp_path)))
    checked(found)
    for result in found.measured:
        assert isinstance(result.one_way, Lacking)
        assert isinstance(result.primary, Lacking)
        assert isinstance(result.mixed, Lacking)
        assert isinstance(result.ordinal, Lacking)
        assert {(summary.low, summary.high) for summary in result.summaries} == {(None, None)}
    text = " ".join(verdict.text for verdict in verdicts_of(found))
    assert "cannot be compared" in text
    assert "supported for responsibility" not in text


def test_with_nobody_left_everything_is_computed_from_all(tmp_path):
    rows = exports.observations(6)
    for row in rows:
        row["state"] = "dropped-out"
    found = analysed(read_tidy(exports.write(rows, tmp_path)))
    html, _, _ = checked(found)
    assert "nobody is left after the exclusions" in html
    assert found.measured[0].persons == 6


def test_only_ratings_or_only_choices_are_enough(tmp_path):
    rows = exports.observations(6)
    for name, phase in (("a", "trial"), ("b", "grouping")):
        checked(analysed(read_tidy(exports.write([row for row in rows if row["phase"] == phase], tmp_path / name))))


def test_a_script_in_a_label_is_text(tmp_path):
    script = "<script>alert(1)</script>|`*_[x](y)"
    study = {
        "title": script,
        "simulated": True,
        "kinds": [{"id": kind, "label": f"{kind} {script}", "kind": kind} for kind in exports.KINDS],
    }
    rows = exports.observations(5)
    for row in rows:
        row["label"] = script
    found = analysed(read_tidy(exports.write(rows, tmp_path, study=study)))
    html, markdown, _ = checked(found)
    assert "<script" not in html
    assert "<script" not in markdown
    assert "&lt;script&gt;" in html
    for path in written(found, tmp_path / "out"):
        if path.suffix == ".svg":
            assert "<script" not in path.read_text(encoding="utf-8")


def a_study(differences, persons=40, spread=0.5, seed=0, name="understanding"):
    """Ratings of all seven kinds with given means, one map, as data."""
    random = np.random.default_rng(seed)
    kinds = exports.KINDS
    means = np.array([3.0 + differences.get(kind, 0.0) for kind in kinds])
    noise = random.normal(0, spread, (persons, len(kinds)))
    value = means + noise - noise.mean(axis=0) * 1.0  # the means come out as stated
    p, k = (x.ravel() for x in np.meshgrid(range(persons), range(len(kinds)), indexing="ij"))
    measure = Measure(
        name=name, label=name.capitalize(), person=p, kind=k, place=np.zeros_like(p), value=value.ravel(), time=False
    )
    labels = {kind: say(f"kinds.{kind}") for kind in kinds}
    return Data(
        source="",
        title="t",
        kinds=kinds,
        maps=("m",),
        labels=labels,
        cores={kind: kind for kind in kinds},
        persons=tuple(Person(name=str(i)) for i in range(persons)),
        measures=(measure,),
    )


def paragraph(differences, **more):
    data = a_study(differences, **more)
    result = measured(data, data.measures[0], planned(data))
    return measure_verdict(data, result, None)


def test_effects_as_hypothesised_support_the_hypothesis():
    verdict = paragraph({"none": -1, "responsibility": 1, "constrictive": 1, "selective": 1, "contrastive": 1})
    assert (
        verdict.short
        == "H1, understanding: supported for responsibility, constrictiveness, selectiveness and all three together."
    )
    assert "contradicted" not in verdict.text
    assert "Open means" not in verdict.text


def test_effects_the_other_way_contradict_it():
    verdict = paragraph({"responsibility": -1, "constrictive": -1, "selective": -1, "contrastive": -1}, name="trust")
    assert (
        verdict.short
        == "H2, trust: contradicted for responsibility, constrictiveness, selectiveness and all three together."
    )
    assert "Trust was lower with Selective than with Naive (whole route)" in verdict.text
    assert "supported" not in verdict.text


def test_no_effects_leave_it_open_and_claim_no_equality():
    verdict = paragraph({})
    assert verdict.short.endswith("open for responsibility, constrictiveness, selectiveness and all three together.")
    assert "neither a difference nor its absence was shown" in verdict.text
    assert "was not shown" in verdict.text


def test_both_directions_stand_beside_each_other():
    verdict = paragraph({"responsibility": 1, "selective": -1})
    assert (
        "supported for responsibility; contradicted for selectiveness; open for constrictiveness and all three together"
        in verdict.short
    )


def test_a_difference_that_many_comparisons_blur_is_told_as_such():
    text = paragraph({"responsibility": 0.3}, persons=40, spread=0.6).text
    data = a_study({"responsibility": 0.3}, persons=40, spread=0.6)
    result = measured(data, data.measures[0], planned(data))
    alone = [c for c in result.compared if c.contrast.p < 0.05 <= c.corrected]
    assert len(alone) >= 1
    assert ("leaves 0 out" in text) == any(data.kinds[c.second] != "none" for c in alone)


def test_outcomes_are_decided_at_the_level():
    assert outcome(1.0, 0.0499999) == "higher"
    assert outcome(1.0, 0.05) == "open"
    assert outcome(-1.0, 0.01) == "lower"
    assert outcome(1.0, None) == "open"


def test_every_sentence_on_a_comparison_is_true_of_its_numbers():
    for seed in range(6):
        random = np.random.default_rng(seed)
        data = a_study(dict(zip(exports.KINDS, random.normal(0, 0.4, 7), strict=True)), seed=seed)
        result = measured(data, data.measures[0], planned(data))
        text = measure_verdict(data, result, None).text
        for compared in result.compared[:4]:
            first, second = (data.label(data.kinds[k]) for k in (compared.first, compared.second))
            found = conclusions(compared)["primary"]
            contrast = compared.contrast
            assert isinstance(contrast, Contrast)
            if found == "open":
                assert f"Between {first} and {second} no difference" in text
            else:
                assert f"was {found} with {first} than with {second}" in text
                assert (contrast.difference > 0) == (found == "higher")
                assert contrast.low > 0 or contrast.high < 0
                assert compared.corrected < 0.05


def test_p_values_never_cross_a_level_by_rounding():
    for p in np.concatenate([np.linspace(0.0485, 0.0515, 301), np.geomspace(1e-6, 1, 200)]):
        text = p_text(float(p))
        if text.startswith("="):
            shown = float(text.removeprefix("= "))
            assert (shown < 0.05) == (p < 0.05), (p, text)
            assert shown == pytest.approx(p, rel=0.06, abs=6e-5)


def test_every_text_that_the_code_asks_for_is_there():
    folder = Path(words_module.__file__).parent.parent
    texts = tomllib.loads((folder / "words" / "en.toml").read_text(encoding="utf-8"))
    code = "\n".join(
        path.read_text(encoding="utf-8") for place in (folder, folder.parent / "robots") for path in place.rglob("*.py")
    )
    for key in re.findall(r'say\(\s*"([a-z0-9_.-]+)"', code):
        found = texts
        for part in key.split("."):
            found = found[part]
        assert isinstance(found, str), key
    for group in texts.values():
        for text in group.values():
            for _, name, _, _ in string.Formatter().parse(text):
                assert name is None or name.isidentifier(), text


def test_the_ratings_for_r_hold_every_rating(whole, tmp_path):
    written(whole, tmp_path)
    lines = (tmp_path / "ratings.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + 2 * 2100
    assert lines[0] == "simulated,kept,participant,map,kind,kind_order,item,value"
    assert "clmm(" in (tmp_path / "clmm.R").read_text(encoding="utf-8")


def test_results_hold_every_number_as_json(whole):
    document = as_document(whole)
    assert document["simulated"] is True
    assert document["measures"][0]["one_way"]["within"] == 2093
    assert document["measures"][0]["compared"][0]["first"] == "responsibility"
    assert dataclasses.asdict(whole.rules) == document["rules"]
    json.dumps(document, allow_nan=False)


def test_the_report_is_whole_in_a_browser(whole, tmp_path, visit):
    written(whole, tmp_path)
    for width, scheme in ((375, "light"), (1280, "dark")):
        with visit(tmp_path / "report.html", width=width, scheme=scheme) as seen:
            assert seen.axe() == []
            assert seen.overflow() == 0
            assert seen.page.locator("img").count() == 13
            broken = seen.page.evaluate("[...document.images].filter(image => !image.naturalWidth).length")
            assert broken == 0


@pytest.mark.parametrize("sizes", [("1e99", "-1e99", "1e-99"), ("1e29", "-1e29", "3"), ("1e-29", "2e-29", "-1e-29")])
def test_numbers_of_any_size_are_computed_with_or_left_out(sizes, tmp_path):
    random = np.random.default_rng(4)
    rows = exports.observations(4, maps=2)
    for row in rows:
        if row["item"] in ("understanding", "time"):
            row["value"] = str(random.choice(sizes))
    html, markdown, _ = pages(analysed(read_tidy(exports.write(rows, tmp_path))))
    for page in (re.sub(r"base64,[\w+/=]+", "", html), markdown):
        assert not re.search(r"\b(nan|inf)\b", page)


BROKEN = ("", "NaN", "x", "-1", "0", "1e308", "3,5", "=1+1", "none", "\u202e", "5", "2.5", "true", "99999999999")
SPOILED = (
    "value",
    "kind",
    "map",
    "phase",
    "participant",
    "state",
    "correct",
    "options",
    "grouping",
    "label",
    "type",
    "words",
)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_whatever_is_spoiled_the_rest_is_reported_without_a_number_that_is_none(seed, tmp_path):
    random = np.random.default_rng(seed)
    kinds = exports.KINDS[: (7, 3, 2, 7, 1, 7)[seed]]
    rows = exports.observations((5, 3, 2, 1, 6, 4)[seed], seed=seed, maps=1 + seed % 3, kinds=kinds)
    rows = [row for row in rows if random.random() < (1.0, 0.3, 0.9)[seed % 3]]
    for _ in range(60):
        rows[int(random.integers(len(rows)))][SPOILED[int(random.integers(len(SPOILED)))]] = BROKEN[
            int(random.integers(len(BROKEN)))
        ]
    html, markdown, _ = pages(analysed(read_tidy(exports.write(rows, tmp_path))))
    for page in (re.sub(r"base64,[\w+/=]+", "", html), markdown):
        assert not re.search(r"\b(nan|inf)\b", page)
