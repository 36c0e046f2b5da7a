"""Robots answer as their model says; power is what whole studies drawn from it show; a simulated study runs through the real server."""

from __future__ import annotations

import csv
import json
from collections import Counter

import numpy as np
import pytest

from ratherthan.apps.study.analysis.statistics.corrections import holm
from ratherthan.apps.study.analysis.statistics.repeated import paired
from ratherthan.apps.study.analysis.tidy import KINDS
from ratherthan.apps.study.robots.drawing import drawn_ratings, drawn_times, rounded
from ratherthan.apps.study.robots.model import read_model
from ratherthan.apps.study.robots.power import Setting, _critical, _rejected, needed, powers, recruited
from ratherthan.errors import QuestionError, SourceError


def test_ratings_are_about_their_means():
    model = read_model()
    drawn = drawn_ratings(model.item("understanding"), KINDS, (20, 100, 3), np.random.default_rng(0))
    assert set(np.unique(drawn)) == {1.0, 2.0, 3.0, 4.0, 5.0}
    centres = model.item("understanding").centres(KINDS)
    assert drawn.mean(axis=(0, 1, 3)) == pytest.approx(centres, abs=0.12)
    assert np.ptp(model.item("trust").centres(KINDS, 0.0)) == pytest.approx(0.0)
    assert np.ptp(model.item("trust").centres(KINDS, 2.0)) == pytest.approx(
        2 * np.ptp(model.item("trust").centres(KINDS))
    )


def test_times_are_about_their_medians():
    model = read_model()
    drawn = drawn_times(model, KINDS, (20, 100, 3), np.random.default_rng(0))
    expected = [model.time.centre(model.time.words[kind]) for kind in KINDS]
    assert np.median(drawn, axis=(0, 1, 3)) == pytest.approx(expected, rel=0.08)


def test_scales_of_other_lengths_keep_their_ends():
    assert list(rounded(np.array([-3.0, 1.0, 3.0, 5.0, 9.0]), 7)) == [1.0, 1.0, 4.0, 7.0, 7.0]


def test_the_rejections_are_those_of_the_contrasts_one_by_one():
    random = np.random.default_rng(4)
    setting = Setting(kinds=KINDS, most=12)
    differences = random.normal(0.5, 1, (6, 12, 4))
    found = _rejected(differences, _critical(4, setting))
    for study in range(6):
        for n in (4, 7, 12):
            own = differences[study, :n]
            ps = [paired(own[:, c], np.zeros(n)).p for c in range(4)]
            assert list(found[study, n - 1]) == [p < 0.05 for p in holm(ps)]
    assert not found[:, :3].any()


def test_without_differences_hardly_anything_is_found():
    found = powers(read_model(), "trust", Setting(kinds=KINDS, most=40, samples=1500, factor=0.0))
    assert found.any_found[-1] < 0.07
    assert all(plan.enough is None and not plan.differs for plan in found.plans)


def test_larger_effects_need_fewer_people():
    numbers = []
    for factor in (1.0, 2.0):
        found = powers(read_model(), "trust", Setting(kinds=KINDS, most=120, samples=300, factor=factor))
        numbers.append({(plan.first, plan.second): plan.enough for plan in found.plans})
    pair = ("responsibility", "naive-state")
    assert numbers[1][pair] < numbers[0][pair]


def test_power_is_that_of_the_usual_formula_where_it_fits():
    from scipy.stats import nct, t

    kinds = ("naive-path", "selective")  # one comparison: no correction
    found = powers(read_model(), "time", Setting(kinds=kinds, most=80, samples=3000))
    size = found.plans[0].size
    for n in (20, 50):
        reach = t.ppf(0.975, n - 1)
        expected = nct.sf(reach, n - 1, abs(size) * np.sqrt(n)) + nct.cdf(-reach, n - 1, abs(size) * np.sqrt(n))
        assert found.curve[n, 0] == pytest.approx(expected, abs=0.03)


def test_the_same_seed_gives_the_same_numbers():
    setting = Setting(kinds=KINDS, most=30, samples=200, seed=9)
    one, other = (powers(read_model(), "trust", setting) for _ in range(2))
    assert np.array_equal(one.curve, other.curve)


def test_enough_means_from_there_on():
    setting = Setting(kinds=KINDS, samples=1000, wanted=0.8)
    curve = np.array([0.0, 0.5, 0.82, 0.79, 0.81, 0.9, 0.99])
    found = needed(curve, setting)
    assert found["enough"] == 4
    assert found["low"] <= 4 <= found["high"]
    assert needed(np.full(5, 0.5), setting) == {"enough": None, "low": None, "high": None}
    assert recruited(85, 0.0, 42) == 126
    assert recruited(84, 0.0, 42) == 84


def test_what_has_no_planned_comparison_is_refused():
    with pytest.raises(QuestionError, match="planned"):
        powers(read_model(), "trust", Setting(kinds=("contrastive", "responsibility")))
    with pytest.raises(QuestionError, match="or more"):
        powers(read_model(), "trust", Setting(kinds=KINDS, most=2))


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("person = 0.6", 'person = "much"', "must be a number"),
        ("person = 0.6", "person = -1", "from 0"),
        ("declines = 0.02", "declines = 2", "from 0 to 1"),
        ("[ratings.any]", "[ratings.other]", r"\[ratings.any\]"),
        ("[time]", "[tome]", r"\[time\]"),
        ('name = "default"', 'name = "', "TOML"),
        ("base = 9.0", "base = nan", "must be a number"),
    ],
)
def test_a_broken_model_says_where(tmp_path, old, new, match):
    from ratherthan.apps.study.robots import model

    text = model.DEFAULT.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "model.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(SourceError, match=match):
        read_model(path)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    pytest.importorskip("sqlalchemy", reason="needs the extra study")
    from ratherthan.apps.study.design.reading import read_design
    from ratherthan.apps.study.design.writing import New, new_study

    folder = tmp_path_factory.mktemp("design") / "study"
    new_study(folder, New())
    return read_design(folder)


@pytest.mark.slow
def test_a_simulated_study_runs_through_the_real_server(study, tmp_path):
    pytest.importorskip("httpx", reason="needs the extra study")
    from ratherthan.apps.study.robots.simulating import Run, simulated

    found = simulated(study, read_model(), Run(people=6, seed=3), tmp_path / "run")
    assert found.ends["finished"] == 6
    told = json.loads((found.export / "study.json").read_text(encoding="utf-8"))
    assert told["simulated"] is True
    with (found.export / "observations.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["simulated"] for row in rows} == {"true"}
    done = [row for row in rows if row["state"] == "finished"]
    assert len({row["participant"] for row in done}) == 6
    trust = Counter(row["participant"] for row in done if row["item"] == "trust")
    assert set(trust.values()) == {21}
    assert json.loads((found.export / "simulation.json").read_text(encoding="utf-8"))["ends"]["finished"] == 6
    from ratherthan.apps.study.analysis.analyse import analysed, read_answers

    results = analysed(read_answers(found.export))
    assert results.data.simulated
    assert results.measured[0].one_way.within == 6 * 21 - 7
    assert len(results.preferences.groups) == 4
    from ratherthan.errors import InputError

    with pytest.raises(InputError, match="holds one already"):
        simulated(study, read_model(), Run(people=6), tmp_path / "run")
