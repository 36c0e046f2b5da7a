"""``ratherthan verify`` confirms what was said, finds what was changed, and tells it by its exit code."""

from __future__ import annotations

import json

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.explain.record import digest

PAPER = "example:paper-5x5"
QUESTIONS = [
    ("--kind", "none"),
    ("--kind", "naive-state", "--state", "10"),
    ("--kind", "constrictive", "--state", "10"),
    ("--kind", "naive-path"),
    ("--kind", "selective", "--alpha", "3"),
    ("--kind", "contrastive"),
    ("--state", "10", "--rather-than", "south"),
    ("--start", "13"),
    ("--start", "4"),
    ("--impact", "omega", "--horizon", "3"),
    ("--values", "policy", "--toward", "goal", "--detail"),
    ("-p", 'Pmax=? [F "destination"]'),
    ("-p", 'Tmin=? [F "destination"]'),
]


@pytest.mark.parametrize("options", QUESTIONS, ids=" ".join)
def test_what_was_said_is_confirmed(said, options, tmp_path):
    said("explain", PAPER, *options, "--output", tmp_path / "said.json")
    begun = options if "--start" in options else ()
    text = said("verify", tmp_path / "said.json", PAPER, *begun)
    assert text.splitlines()[-1].endswith("contradicted: 0, undecided: 0")


@pytest.mark.parametrize("name", ["city-1", "delivery", "office"])
def test_the_examples_are_confirmed(said, name, tmp_path):
    said("explain", f"example:{name}", "--output", tmp_path / "said.json")
    assert "contradicted: 0, undecided: 0" in said("verify", tmp_path / "said.json", f"example:{name}")


def test_a_given_policy_and_given_words_are_confirmed(said, fork, tmp_path):
    (tmp_path / "policy.json").write_text(
        json.dumps({"home": {"left": 0.5, "right": 0.5}, "1": "left", "ditch": "rest"})
    )
    (tmp_path / "words.toml").write_text('[actions]\nleft = "turn left"\n')
    options = ("--policy", tmp_path / "policy.json", "--lexicon", tmp_path / "words.toml")
    said("explain", fork, *options, "--output", tmp_path / "said.json")
    same = ("--lexicon", tmp_path / "words.toml")
    assert "contradicted: 0, undecided: 0" in said("verify", tmp_path / "said.json", fork, *same)
    assert "contradicted: 0, undecided: 1" in said("verify", tmp_path / "said.json", fork)


def test_a_start_that_was_picked_is_confirmed(said, two_starts, tmp_path):
    said("explain", two_starts, "--start", "bridge", "--output", tmp_path / "said.json")
    assert "contradicted: 0, undecided: 0" in said("verify", tmp_path / "said.json", two_starts)
    assert "contradicted: 0, undecided: 0" in said("verify", tmp_path / "said.json", two_starts, "--start", "bridge")


def test_another_start_than_the_one_told_of_is_found(ask, said, tmp_path):
    said("explain", PAPER, "--start", "10", "--output", tmp_path / "said.json")
    result = ask("verify", tmp_path / "said.json", PAPER)
    assert result.exit_code == 2
    assert "start" in result.stdout


def test_there_is_a_line_for_every_check_and_json_has_the_same(said, document, tmp_path):
    said("explain", PAPER, "--output", tmp_path / "said.json")
    lines = said("verify", tmp_path / "said.json", PAPER).splitlines()
    answer = document("verify", tmp_path / "said.json", PAPER)
    assert answer["holds"] is True
    assert answer["fails"] is False
    assert len(lines) == len(answer["checks"]) + 1
    assert lines[-1] == answer["summary"]
    for line, check in zip(lines, answer["checks"], strict=False):
        assert line.split()[0] == check["verdict"] == "holds"
        assert check["what"] in line


def test_another_model_contradicts_it(ask, said, fork_with, tmp_path):
    rt.write(rt.Problem(mdp=fork_with()), tmp_path / "before.umb")
    rewards = {"toll": rt.Reward(choice=np.array([3.0, 1.0, 9.0, 0.5, 0.0, 0.0]))}
    rt.write(rt.Problem(mdp=fork_with(rewards=rewards)), tmp_path / "after.umb")
    said("explain", tmp_path / "before.umb", "--start", "bridge", "--output", tmp_path / "said.json")
    result = ask("verify", tmp_path / "said.json", tmp_path / "after.umb", "--start", "bridge")
    assert result.exit_code == 2
    assert "fails" in result.stdout
    assert result.stderr == ""


def test_what_was_changed_is_refused_and_forged_evidence_fails(ask, said, refused, tmp_path):
    path = tmp_path / "said.json"
    said("explain", PAPER, "--output", path)
    stored = json.loads(path.read_text(encoding="utf-8"))
    stored["steps"][1]["claims"][0]["evidence"]["taken"]["value"] = 6.5
    path.write_text(json.dumps(stored), encoding="utf-8")
    refused("verify", path, PAPER)
    stored["digest"] = digest(stored)
    path.write_text(json.dumps(stored), encoding="utf-8")
    result = ask("verify", path, PAPER)
    assert result.exit_code == 2


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b"null", b"{}", b'{"version": "0"}', b"\xff\xfe", b'{"version": NaN}', b"[" * 100_000]
)
def test_what_is_no_explanation_is_refused(refused, tmp_path, content):
    (tmp_path / "said.json").write_bytes(content)
    refused("verify", tmp_path / "said.json", PAPER)


def test_a_folder_is_no_explanation(refused, tmp_path):
    refused("verify", tmp_path, PAPER)
