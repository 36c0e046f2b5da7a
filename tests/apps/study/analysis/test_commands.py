"""The commands: what they print, what they write, and how they end."""

from __future__ import annotations

import csv
import io
import json

import pytest
from apps.study.analysis import exports
from click.testing import CliRunner

from ratherthan.apps.cli import main


def run(*words, code=0):
    result = CliRunner().invoke(main, ["study", *map(str, words)])
    assert result.exit_code == code, result.output + str(result.exception)
    return result.output


@pytest.fixture(autouse=True)
def _extra():
    for name in ("jinja2", "sqlalchemy", "alembic", "pyarrow", "argon2"):
        pytest.importorskip(name, reason="needs the extra study")


def test_analyse_tells_the_hypotheses_and_writes_a_report(tmp_path):
    folder = exports.write(exports.observations(12), tmp_path / "export")
    said = run("analyse", folder, "-o", tmp_path / "report")
    assert said.startswith("SIMULATED")
    assert "H1, understanding:" in said
    assert "H3, preference:" in said
    names = {path.name for path in (tmp_path / "report").iterdir()}
    assert names == {"report.html", "report.md", "results.json", "ratings.csv", "clmm.R", "figures"}


def test_analyse_takes_tables_of_others(tmp_path):
    (tmp_path / "a.csv").write_text(
        "who,arm,x\n" + "".join(f"{i},{'ab'[i % 2]},{i % 7}\n" for i in range(40)), encoding="utf-8"
    )
    said = run(
        "analyse",
        tmp_path / "a.csv",
        "--columns",
        "participant=who,kind=arm",
        "--ratings",
        "score=x",
        "--labels",
        "b=New,a=Old",
        "-o",
        tmp_path / "r",
    )
    assert "New" in said
    assert "published" not in (tmp_path / "r" / "report.md").read_text(encoding="utf-8")
    results = json.loads((tmp_path / "r" / "results.json").read_text(encoding="utf-8"))
    assert [kind["label"] for kind in results["kinds"]] == ["New", "Old"]


def test_analyse_ends_with_2_where_the_input_is_wrong(tmp_path):
    assert "does not exist" in run("analyse", tmp_path / "nowhere", code=2)
    folder = exports.write(exports.observations(3), tmp_path / "export")
    (tmp_path / "file").write_text("x", encoding="utf-8")
    assert "cannot be made" in run("analyse", folder, "-o", tmp_path / "file", code=2)


@pytest.mark.parametrize("number", ["nan", "-nan", "inf"])
def test_numbers_that_are_none_are_refused(number, tmp_path):
    folder = exports.write(exports.observations(3), tmp_path / "export")
    for words in (
        ("analyse", folder, "-o", tmp_path / "out", "--fastest"),
        ("simulate", folder, "-o", tmp_path / "out", "--factor"),
        ("power", "--factor"),
        ("power", "--power"),
        ("power", "--lost"),
    ):
        assert f"'{words[-1]}'" in run(*words, number, code=2)
    assert not (tmp_path / "out").exists()


def test_power_is_told_as_text_csv_and_json(tmp_path):
    few = ("--samples", 100, "--people", 60, "--item", "trust")
    text = run("power", *few)
    assert "made up" in text
    assert "responsibility − naive-state" in text
    rows = list(csv.DictReader(io.StringIO(run("power", *few, "--format", "csv"))))
    assert len(rows) == 10
    assert {row["simulated"] for row in rows} == {"true"}
    document = json.loads(run("power", *few, "--format", "json"))
    assert document["simulated"] is True
    assert len(document["items"][0]["comparisons"][0]["power"]) == 61
    assert "alike in the model" in run("power", *few, "--factor", 0)
    assert "A kind is one of" in run("power", "--kinds", "poetic", code=2)
    assert "The model knows" in run("power", "--item", "joy", code=2)
