"""What the commands of the cluster say, and with which exit code."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner

import ratherthan as rt
from ratherthan.io.umb_write import write_umb


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run one command in an empty folder."""
    from ratherthan.apps.cli import main

    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(main, list(map(str, words)))


def test_batch_tells_what_failed_by_its_exit_code(run):
    Path("good.csv").write_text("source,state\nexample:paper-5x5,10\n", encoding="utf-8")
    result = run("batch", "good.csv", "-o", "out.csv", "--workers", "1")
    assert (result.exit_code, result.output) == (0, "")
    Path("bad.csv").write_text("id,source\nhere,example:paper-5x5\nthere,example:nowhere\n", encoding="utf-8")
    result = run("batch", "bad.csv", "-o", "out.csv", "--workers", "1")
    assert result.exit_code == 2
    assert "row 2 (there)" in result.stderr
    with Path("out.csv").open(encoding="utf-8", newline="") as file:
        assert [row["status"] for row in csv.DictReader(file)] == ["answered", "failed"]


def test_batch_refuses_a_table_it_cannot_write(run):
    Path("good.csv").write_text("source\nexample:paper-5x5\n", encoding="utf-8")
    assert run("batch", "good.csv", "-o", "out.txt").exit_code == 2
    assert run("batch", "missing.csv", "-o", "out.csv").exit_code == 2
    assert not Path("out.csv.journal").exists()


def test_batch_never_writes_over_its_missions(run):
    table = Path("table.csv")
    table.write_text("source\nexample:paper-5x5\n", encoding="utf-8")
    before = table.read_bytes()
    result = run("batch", "table.csv", "-o", "./table.csv", "--workers", "1")
    assert result.exit_code == 2
    assert "another file than the missions come from, but './table.csv' is both" in result.stderr
    assert (table.read_bytes(), sorted(file.name for file in Path().iterdir())) == (before, ["table.csv"])


@pytest.mark.parametrize("command", ["explain", "solve", "factors"])
def test_an_answer_is_never_written_over_its_model(run, command):
    write_umb(rt.read("example:paper-5x5"), Path("town.umb"))
    before = Path("town.umb").read_bytes()
    result = run(command, "town.umb", "-o", "./town.umb")
    assert result.exit_code == 2
    assert "another file than the model comes from, but './town.umb' is both" in result.stderr
    assert Path("town.umb").read_bytes() == before


def test_a_source_that_can_be_no_file_fails_its_row_alone(run):
    Path("odd.csv").write_text(f"source\n{'x' * 5000}.umb\nexample:paper-5x5\n", encoding="utf-8")
    result = run("batch", "odd.csv", "-o", "out.csv", "--workers", "1")
    assert result.exit_code == 2
    with Path("out.csv").open(encoding="utf-8", newline="") as file:
        assert [row["status"] for row in csv.DictReader(file)] == ["failed", "answered"]


def test_solve_and_explain_in_blocks(run, here):
    here()
    write_umb(rt.read("example:paper-5x5"), Path("town.umb"))
    document = json.loads(run("solve", "town.umb", "--cluster", "--blocks", "2", "--format", "json").stdout)
    assert document["lower"] <= 70 / 9 <= document["upper"]
    assert document["outcome"] == "certified"
    result = run("explain", "town.umb", "--cluster", "--state", "10", "--rather-than", "south")
    assert "rather than south" in result.stdout
    told = json.loads(run("explain", "town.umb", "--cluster", "--state", "10", "--format", "json").stdout)
    assert [row["action"] for row in told["choices"] if row["taken"]] == ["east"]
    route = json.loads(run("explain", "town.umb", "--cluster", "--kind", "naive-path", "--format", "json").stdout)
    assert [step["state"] for step in route["steps"]] == [5, 10, 11, 12, 7, 8, 3]


def test_options_that_mean_nothing_in_blocks_are_refused(run, here):
    here()
    write_umb(rt.read("example:paper-5x5"), Path("town.umb"))
    for words in (("--also", "distance"), ("--policy", "p.json"), ("--kind", "selective"), ("--state", "no")):
        result = run("explain", "town.umb", "--cluster", *words)
        assert result.exit_code == 2, words
    result = run("solve", "town.umb", "--workers", "2")
    assert result.exit_code == 2
    assert "--cluster" in result.stderr


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("explain", "--state", "25"), "a state must be a number in 0 … 24, got '25'"),
        (("explain", "--state", "9" * 6000), "a state must be a number in 0 … 24"),
        (("explain", "--start", "home"), "a state must be a number in 0 … 24, got 'home'"),
        (("explain", "--rather-than", "up"), "must name an action of the model, one of "),
        (("explain", "--kind", "constrictive"), "the kind must be one of naive-state, responsibility"),
        (("solve", "--start", "25"), "a state must be a number in 0 … 24, got '25'"),
        (("solve", "--values-file", "values.txt"), "Values must go to a file .npz"),
        (("solve", "--values-file", "nowhere/values.npz"), "No such file or directory. Check its folder."),
        (("solve", "--output", "nowhere/answer.txt"), "No such file or directory. Check its folder."),
        (("solve", "--output", "."), "'.' is a folder"),
    ],
)
def test_what_cannot_be_answered_is_refused_before_workers_start(run, monkeypatch, words, told):
    from ratherthan.cluster import blockwise

    def no_engine(*_, **__):
        pytest.fail("workers were started")

    monkeypatch.setattr(blockwise, "engine", no_engine)
    write_umb(rt.read("example:paper-5x5"), Path("town.umb"))
    command, *further = words
    result = run(command, "town.umb", "--cluster", *further)
    assert result.exit_code == 2
    assert told in result.stderr
    assert sorted(file.name for file in Path().iterdir()) == ["town.umb"]


@pytest.mark.parametrize(
    "address", ["", "foo", "http://host:80", "tcp://", "tcp://host", "host:0", "host:99999", "host:٣"]
)
def test_what_is_no_address_is_refused_at_once(run, monkeypatch, address):
    distributed = pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    monkeypatch.setattr(distributed, "Client", lambda *_, **__: pytest.fail("somebody was asked"))
    write_umb(rt.read("example:paper-5x5"), Path("town.umb"))
    result = run("solve", "town.umb", "--cluster", address)
    assert result.exit_code == 2
    assert f"such as tcp://host:8786, got '{address}'" in result.stderr
