"""``--time-limit`` and ``--memory-limit``: sentences, bounds that are true, and nothing half done."""

from __future__ import annotations

import json
import sys

import pytest
from click.testing import CliRunner

from benchmarks.models import slippery_map
from ratherthan.apps.limits import Amount, Duration
from ratherthan.errors import LimitError
from ratherthan.io import write

PAPER = "example:paper-5x5"


@pytest.fixture(scope="module")
def town(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("town") / "town.umb"
    write(slippery_map(60), path)
    return str(path)


@pytest.mark.parametrize(
    ("text", "seconds"), [("10", 10.0), ("10s", 10.0), ("1.5 s", 1.5), ("2m", 120.0), ("1h", 3600.0), ("250ms", 0.25), (".5", 0.5)]
)  # fmt: skip
def test_times_are_read_as_people_write_them(text, seconds):
    assert Duration().convert(text, None, None) == seconds


@pytest.mark.parametrize(
    ("text", "size"), [("4GB", 4 * 2**30), ("500MB", 500 * 2**20), ("1g", 2**30), ("1.5 GiB", 3 * 2**29), ("2000000", 2000000), ("64k", 2**16)]
)  # fmt: skip
def test_sizes_are_read_as_people_write_them(text, size):
    assert Amount().convert(text, None, None) == size


@pytest.mark.parametrize("text", ["", "soon", "0", "-1s", "1e400", "inf", "nan", "10 parsecs", "1s2m", "٣s"])
def test_what_is_no_time_is_refused_in_a_sentence(refused, text):
    assert "A time limit must be a time above 0, such as 10, 10s, 2m or 1h" in refused(
        "solve", PAPER, "--time-limit", text
    )


@pytest.mark.parametrize("text", ["", "much", "0", "-1GB", "1 elephant", "inf"])
def test_what_is_no_size_is_refused_in_a_sentence(refused, text):
    said = refused("solve", PAPER, "--memory-limit", text)
    assert "A memory limit must be a size above 0 with its unit, such as 500MB or 4GB" in said


def test_a_limit_of_thousands_of_years_is_a_limit_like_others(process):
    done = process("solve", PAPER, "--time-limit", "99999999999h")
    assert (done.returncode, done.stderr) == (0, b"")


def test_too_little_memory_for_the_program_itself_is_refused(refused):
    assert "must leave the program room to work, at least" in refused("solve", PAPER, "--memory-limit", "1MB")


@pytest.mark.parametrize(
    "words",
    [("solve",), ("explain",), ("factors",), ("info",), ("explain", "--kind", "selective"), ("tradeoffs", "--also", 'R{"distance"}min=? [F "destination"]')],
)  # fmt: skip
def test_limits_that_are_not_reached_change_nothing(ask, words):
    command, *further = words
    plain = ask(command, PAPER, *further)
    limited = ask(command, PAPER, *further, "--time-limit", "1h", "--memory-limit", "100GB")
    assert (limited.exit_code, limited.stdout) == (plain.exit_code, plain.stdout)


def test_a_limit_in_the_middle_of_solving_gives_the_bounds_so_far(ask, monkeypatch, town):
    whole = json.loads(ask("solve", town, "--format", "json").stdout)
    seen = set()
    for result in stops(ask, monkeypatch, "solve", town, "--format", "json"):
        assert result.exit_code == 1
        if result.stdout:
            document = json.loads(result.stdout)
            assert (document["limit"], document["outcome"]) == ("time", "stopped")
            assert document["message"].startswith("The time limit of ")
            assert document["value"] is None or document["lower"] == document["upper"]
            assert document["lower"] is None or document["lower"] <= whole["upper"]
            assert document["upper"] is None or document["upper"] >= whole["lower"]
        else:
            assert result.stderr.startswith("ratherthan: The time limit of ")
            assert result.stderr.count("\n") == 1
        seen.add(bool(result.stdout))
    assert seen == {True, False}


def test_for_people_what_is_not_known_is_called_so(ask, monkeypatch, town):
    shown = [result.stdout for result in stops(ask, monkeypatch, "solve", town) if result.stdout]
    assert shown
    assert all("value     not known\n" in text or "lower     not proved" not in text for text in shown)


def test_a_limit_while_explaining_claims_nothing(ask, monkeypatch, town):
    said = []
    for result in stops(ask, monkeypatch, "explain", town):
        assert (result.exit_code, result.stdout) == (1, "")
        assert result.stderr.startswith("ratherthan: The time limit of ")
        assert result.stderr.count("\n") == 1
        said.append(result.stderr)
    assert any("Proved so far: " in text and " at the start is at least " in text for text in said)


def test_a_limit_while_counting_tells_the_value_that_was_found(ask, monkeypatch, town):
    def stopped(*_):
        raise LimitError("The time limit of 1 s was reached while counting.", limit="time")

    monkeypatch.setattr("ratherthan.apps.columns.counted_at", stopped)
    result = ask("factors", town)
    assert (result.exit_code, result.stdout) == (1, "")
    assert "while counting. The value at the start was found before: it is between " in result.stderr


def stops(ask, monkeypatch, *words):
    """Yield what a command says where a limit stops it, at one moment after the other."""
    from ratherthan.model import watch

    class Clock:
        now = 0.0

        def monotonic(self) -> float:
            self.now += 1.0
            return self.now

    for moment in (*range(2, 40), *range(40, 4000, 37)):
        with monkeypatch.context() as patched:
            patched.setattr(watch, "time", Clock())
            result = ask(*words, "--time-limit", f"{moment}s")
        if result.exit_code == 0:
            return
        yield result


def test_a_question_that_the_bounds_decide_is_answered_though_the_time_is_over(ask, monkeypatch, town):
    for result in stops(ask, monkeypatch, "solve", town, "-p", 'R{"steps"}>=3 [F "goal"]', "--format", "json"):
        if result.stdout and json.loads(result.stdout)["value"] is True:
            return
    pytest.fail("the least number of steps is known before anything is solved")


@pytest.mark.skipif(sys.platform != "linux", reason="needs limits of memory that the system holds")
def test_a_model_that_the_memory_limit_does_not_hold_is_told_in_a_sentence(process, tmp_path):
    path = tmp_path / "large.npz"
    write(slippery_map(400), path)
    done = process("explain", path, "--memory-limit", "110MB", "-o", tmp_path / "route.txt")
    assert done.returncode == 2, done.stderr
    assert b"Traceback" not in done.stderr
    assert done.stderr.startswith(b"ratherthan: ")
    assert b"the limit of 110 MB leaves" in done.stderr or b"The memory limit of 110 MB was reached" in done.stderr
    assert sorted(file.name for file in tmp_path.iterdir()) == ["large.npz"]


def test_limits_are_on_every_command_that_reads_a_model():
    from ratherthan.apps.cli import COMMANDS, main

    for name in COMMANDS:
        shown = CliRunner().invoke(main, [name, "--help"]).stdout
        if "SOURCE" in shown.split("Options")[0].splitlines()[0]:
            assert "--time-limit" in shown
            assert "--memory-limit" in shown
