"""``--at-most``, ``--rank`` and ``--detail`` on the command line: few sentences that are verified afterwards."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

WAY = ["........", "........", "@@@@.@@@", "........", "........"]


@pytest.fixture
def hall(tmp_path):
    path = tmp_path / "hall.map"
    path.write_text("type octile\nheight 5\nwidth 8\nmap\n" + "\n".join(WAY) + "\n")
    return path


@pytest.mark.parametrize("rank", ["detour", "spread", "expected", "place"])
def test_few_sentences_are_told_and_verified(said, ask, hall, rank):
    asked = ("--start", "0,0", "--goal", "7,4")
    for at_most in (1, 2, 3):
        text = said("explain", hall, *asked, "--at-most", at_most, "--rank", rank, "--detail")
        assert "We tell " in text
        ask("explain", hall, *asked, "--at-most", at_most, "--rank", rank, "--detail", "--output", "few.json")
        document = json.loads(Path("few.json").read_text(encoding="utf-8"))
        assert (document["at_most"], document["ranking"], document["text"]) == (at_most, rank, text.strip())
        assert "contradicted: 0, undecided: 0" in said("verify", "few.json", hall, *asked)


def test_without_it_nothing_is_said_of_it(said):
    assert "at_most" not in said("explain", "example:paper-5x5", "--format", "json")


@pytest.mark.parametrize(
    "words",
    [
        ("--at-most", "0"),
        ("--at-most", "few"),
        ("--rank", "spread"),
        ("--at-most", "3", "--rank", "beauty"),
        ("--at-most", "3", "--kind", "responsibility"),
        ("--at-most", "3", "--state", "10", "--rather-than", "south"),
    ],
    ids=" ".join,
)
def test_what_makes_no_sense_is_refused_in_one_sentence(ask, words):
    result = ask("explain", "example:paper-5x5", *words)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_very_long_text_comes_with_the_way_to_a_short_one(process, tmp_path):
    yard = tmp_path / "yard.map"
    yard.write_text("type octile\nheight 1\nwidth 60\nmap\n" + "." * 60 + "\n", encoding="ascii")
    words = ("explain", yard, "--start", "0,0", "--goal", "59,0", "--kind", "naive-path")
    long = process(*words)
    assert long.returncode == 0
    assert b"--at-most 7" in long.stderr
    assert b"--at-most" not in long.stdout
    short = process(*words, "--at-most", "3")
    assert short.returncode == 0
    assert short.stderr == b""
    assert len(short.stdout) < len(long.stdout)
