"""``ratherthan solve`` with properties that cannot be explained: Storm answers, and says that nothing was proved."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result

PAPER = "example:paper-5x5"
AVERAGE = 'LRAmax=? ["destination"]'


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Storm works in this process."""
    pytest.importorskip("stormpy")
    from ratherthan.io._storm_answer import answer

    def run(folder: Path, patience: float) -> int:
        answer(folder)
        return 0

    monkeypatch.setattr("ratherthan.io.storm._run", run)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("text", "value"),
    [
        (AVERAGE, 1.0),
        ('R{"distance"}min=? [C<=4]', 4.0),
        ("R{\"distance\"}max=? [C]", "inf"),
        ('Pmax>=1 [G !"destination"]', True),
        ('filter(forall, Pmax>=1 [F "destination"])', False),
        ('multi(Pmax=? [F "destination"], P<=0.5 [F<=1 "destination"])', 1.0),
        ('Pmax=? [F "destination" || F "destination"]', 1.0),
    ],
)  # fmt: skip
def test_the_document_of_an_answer_of_storm(document: Callable[..., Any], text: str, value: object) -> None:
    told = document("solve", PAPER, "-p", text)
    assert list(told) == [
        "value", "lower", "upper", "states", "choices", "branches", "outcome", "message", "engine",
    ]  # fmt: skip
    assert told["value"] == (pytest.approx(value, abs=2e-6) if isinstance(value, float) else value)
    assert isinstance(told["value"], bool) == isinstance(value, bool)
    assert (told["lower"], told["upper"], told["outcome"]) == (None, None, "uncertified")
    assert (told["states"], told["choices"], told["branches"]) == (25, 31, 56)
    assert "nothing of it is proved here" in told["message"]
    assert told["engine"].startswith("Storm ")


@pytest.mark.usefixtures("here")
def test_people_read_that_nothing_was_proved(said: Callable[..., str]) -> None:
    lines = dict(line.split(maxsplit=1) for line in said("solve", PAPER, "-p", AVERAGE, "--start", "10").splitlines())
    assert lines["property"] == AVERAGE
    assert lines["value"] == "1.0"
    assert lines["lower"] == lines["upper"] == "not proved"


@pytest.mark.usefixtures("here")
def test_a_property_of_ours_stays_ours(document: Callable[..., Any]) -> None:
    assert document("solve", PAPER, "-p", 'P>=1 [F "destination"]')["lower"] is not None


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["-p", AVERAGE, "--policy", "plan.json"], ["long-run average", "leave --policy out"]),
        (["-p", 'multi(Pmax=? [F "destination"], Pmin=? [F<=9 "destination"])'], ["Several objectives", "curve"]),
        (["-p", 'LRAmax=? ["nowhere"]'], ["long-run average", "got 'nowhere'"]),
        (["-p", "LRAmax=? ["], ["long-run average"]),
        (["-p", 'Pmax=? [F "nowhere"]'], ["A label must be", "got 'nowhere'"]),
        (["-p", "Pmax=? [F"], ["column 10"]),
        (["-p", "nonsense"], ["property"]),
        (["-p", 'Pmax=? [F "destination" || F<=50 "destination"]'], ["column 25", "Storm cannot answer this"]),
        (["-p", 'P>=1.5 [F "destination"]'], ["got 1.5"]),
        (["-p", AVERAGE, "-p", 'Pmax=? [F "destination"]'], ["long-run average"]),
    ],
)
def test_what_nobody_answers_is_refused(refused: Callable[..., str], words: list[str], parts: list[str]) -> None:
    sentence = refused("solve", PAPER, *words)
    for part in parts:
        assert part in sentence


def test_explain_says_who_gives_the_value(refused: Callable[..., str]) -> None:
    sentence = refused("explain", PAPER, "-p", AVERAGE)
    assert "cannot be explained" in sentence
    assert sentence.endswith("ratherthan solve can ask Storm for its value.")


def test_without_storm_the_reason_stays_and_the_extra_is_named(
    refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ratherthan.io.storm.storm_is_there", lambda: False)
    sentence = refused("solve", PAPER, "-p", AVERAGE)
    assert sentence.startswith("A long-run average cannot be explained here.")
    assert sentence.endswith('pip install "ratherthan[storm]".')
    assert "column 10" in refused("solve", PAPER, "-p", "Pmax=? [F")


def test_storm_prints_nothing_of_its_own(process: Callable[..., Any]) -> None:
    pytest.importorskip("stormpy")
    done = process("solve", PAPER, "-p", 'LRAmax=? [!"destination"]', "--format", "json")
    assert (done.returncode, done.stderr) == (0, b"")
    assert json.loads(done.stdout)["value"] == 1.0
    done = process("solve", PAPER, "-p", 'multi(R{"distance"}min=? [F "destination"], P>=0.5 [X true])')
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr.count(b"\n") == 1


def test_files_of_properties_are_read(ask: Callable[..., Result], document: Callable[..., Any]) -> None:
    Path("trip.props").write_text('const int K;\n"far": Pmax=? [F "destination"];\n"soon": R{"distance"}min=? [C<=K];')
    assert document("solve", PAPER, "-p", "trip.props:far", "--constants", "K=3")["value"] == 1.0
    assert ask("explain", PAPER, "-p", "trip.props:far", "--kind", "naive-path").stdout.startswith("First, we move")
    assert "these have none: K (int)" in ask("solve", PAPER, "-p", "trip.props:soon").stderr
    pytest.importorskip("stormpy")
    assert document("solve", PAPER, "-p", "trip.props:soon", "--constants", "K=3")["value"] == 3.0


def test_each_of_several_levels_has_its_value(document: Callable[..., Any], said: Callable[..., str]) -> None:
    words = ("solve", PAPER, "-p", 'Pmax=? [F "destination"]', "-p", 'R{"distance"}min=? [F "destination"]')
    told = document(*words)
    assert told["value"] == 1.0
    assert [level["value"] for level in told["levels"]] == [1.0, pytest.approx(70 / 9)]
    assert told["levels"][1]["lower"] <= 70 / 9 <= told["levels"][1]["upper"]
    assert "level 2   7.77" in said(*words)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs the device that is always full")
def test_an_output_that_is_full_is_named(refused: Callable[..., str]) -> None:
    assert "'/dev/full'" in refused("explain", PAPER, "--output", "/dev/full")


@pytest.mark.usefixtures("here")
def test_what_takes_too_much_memory_is_left_to_storm(
    document: Callable[..., Any], refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ratherthan.model.product.MOST_BRANCHES", 10)
    Path("trip.props").write_text('"soon": Pmax=? [F<=12 "destination"];')
    told = document("solve", PAPER, "-p", "trip.props:soon")
    assert told["engine"].startswith("Storm ")
    assert 0.98 < told["value"] < 1
    sentence = refused("explain", PAPER, "-p", "trip.props:soon")
    assert "at most 10 branches" in sentence
    assert sentence.endswith("ratherthan solve can ask Storm for its value.")
