"""Whatever is wrong with what a person gives: one sentence that says so, exit code 2, nothing on standard output."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

import ratherthan as rt

PAPER = "example:paper-5x5"


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["no-such-command"], "No such command 'no-such-command'"),
        (["explian", PAPER], "No such command 'explian'"),
        (["explain"], "Missing argument 'SOURCE'"),
        (["explain", PAPER, "more"], "unexpected extra argument"),
        (["explain", PAPER, "--kin", "none"], "Did you mean '--kind'"),
        (["explain", PAPER, "--kind"], "requires an argument"),
        (["explain", PAPER, "--kind", "contrasting"], "'contrastive'"),
        (["explain", PAPER, "--kind", "none", "--scope", "route"], "Give either a kind or scope and factors"),
        (["explain", PAPER, "--kind", "selective", "--rather-than", "south"], "leave kind and scope out"),
        (["explain", PAPER, "--scope", "map"], "'map'"),
        (["explain", PAPER, "--factors", "selectiveness,beauty"], "'beauty'"),
        (["explain", PAPER, "--alpha", "-0.5"], "from 0 on, got -0.5"),
        (["explain", PAPER, "--alpha", "nan"], "got nan"),
        (["explain", PAPER, "--alpha", "inf"], "got inf"),
        (["explain", PAPER, "--alpha", "much"], "'much' is not a valid float"),
        (["explain", PAPER, "--horizon", "-1"], "not in the range"),
        (["explain", PAPER, "--impact", "theta"], "'theta'"),
        (["explain", PAPER, "--values", "best"], "'best'"),
        (["explain", PAPER, "--state", "25"], "0 … 24, got 25"),
        (["explain", PAPER, "--state", "-1"], "0 … 24, got -1"),
        (["explain", PAPER, "--state", "the crossing"], "got 'the crossing'"),
        (["explain", PAPER, "--state", ""], "exact name"),
        (["explain", PAPER, "--start", "99"], "0 … 24, got 99"),
        (["explain", PAPER, "--rather-than", "up"], "one of south, north; got 'up'"),
        (["explain", PAPER, "--rather-than", "south"], "another action than the one taken"),
        (["explain", PAPER, "--rather-than", "west", "--state", "4"], "Nothing is left to decide"),
        (["explain", PAPER, "-p", 'Rmin=? [F "destination"]', "-p", 'Rmin=? [F "destination"]'], "must differ"),
        (["explain", PAPER, "-p", 'R{"distance"}min=? [F "distenation"]'], "'distenation'"),
        (["explain", PAPER, "-p", 'R{"time"}min=? [F "destination"]'], "'time'"),
        (["explain", PAPER, "-p", "Rmin=? [F x=3]"], "'x'"),
        (["explain", PAPER, "-p", "Rmin=? [F"], "column"),
        (["explain", PAPER, "-p", ""], "property"),
        (["explain", PAPER, "-p", 'P>=0.5 [F "destination"]'], "Ask for 'Pmin=? "),
        (["factors", PAPER, "-p", 'P>=0.5 [F "destination"]'], "Ask for 'Pmin=? "),
        (["solve", PAPER, "-p", 'P>=1.5 [F "destination"]'], "between 0 and 1"),
        (["explain", PAPER, "--constants", "N=5"], "constants"),
        (["explain", PAPER, "--minimise-q"], "--policy FILE"),
        (["explain", PAPER, "--policy", "nowhere.json"], "nowhere.json"),
        (["explain", PAPER, "--lexicon", "nowhere.toml"], "nowhere.toml"),
        (["explain", PAPER, "--output", "no/such/folder/route.txt"], "no/such/folder/route.txt"),
        (["explain", PAPER, "--output", "."], "folder"),
        (["explain", PAPER, "--format", "csv"], "'csv'"),
        (["explain", "example:paper"], "Did you mean 'paper-5x5'"),
        (["explain", "example:"], "must be one of"),
        (["explain", "nowhere.umb"], "there is no 'nowhere.umb'"),
        (["explain", ""], "''"),
        (["explain", "."], "folder"),
        (["explain", "a\0b"], "a"),
        (["solve", "nowhere.prism"], "nowhere.prism"),
        (["factors", PAPER, "--state", "77"], "0 … 24, got 77"),
        (["factors", PAPER, "--constrictiveness", "some"], "'some'"),
        (["info", "nowhere.npz"], "nowhere.npz"),
        (["convert", PAPER, "town.xml"], ".umb"),
        (["convert", PAPER, "no/such/folder/town.umb"], "no/such/folder/town.umb"),
        (["verify", "nowhere.json", PAPER], "nowhere.json"),
        (["completion", "tcsh"], "'tcsh'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_it_is_refused_in_one_sentence(refused, words, part):
    assert part in refused(*words)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.umb", b""),
        ("short.umb", b"\x1f\x8b\x08\x00"),
        ("text.npz", b"not an archive"),
        ("noise.bin", bytes(range(256))),
        ("half.roadmap", b"map = '''\nS.D\n"),
        ("latin.roadmap", "title = \"Straße\"\nmap = '''\nS.D\n'''".encode("latin-1")),
        ("wrong.roadmap", b"map = 3\n"),
        ("prose.txt", b"Once upon a time there was a robot.\n"),
        ("broken.jani", b'{"jani-version": 1, "name": '),
    ],
)
def test_a_damaged_model_is_refused(refused, tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert name in refused("explain", tmp_path / name)


def test_a_truncated_archive_is_refused(refused, fork, tmp_path):
    whole = Path(fork).read_bytes()
    for part in (1, len(whole) // 3, len(whole) // 2, len(whole) - 1):
        (tmp_path / "cut.umb").write_bytes(whole[:part])
        refused("explain", tmp_path / "cut.umb")


def test_where_it_is_not_plain_what_is_wanted_there_is_a_list_of_what_there_is(refused, unlabelled):
    sentence = refused("explain", unlabelled)
    for part in ("toll", "time", "goal", "trap", "--property"):
        assert part in sentence


@pytest.mark.parametrize(
    ("content", "part"),
    [
        ('{"home": "up"}', "'up'"),
        ('{"nowhere": "left"}', "nowhere"),
        ('{"home": "rest"}', "rest"),
        ('{"home": "left", "0": "right"}', "twice"),
        ('{"home": {"left": 0.5, "right": 0.4}}', "sum to 1"),
        ('{"home": {"left": -1, "right": 2}}', "between 0 and 1"),
        ('{"home": NaN}', "home"),
        ('{"home": ', "JSON"),
        ("[1, 2]", "table"),
        ("{}", "home"),
        ('{"bridge": "left"}', "home"),
    ],
)
def test_a_policy_that_does_not_fit_is_refused(refused, fork, tmp_path, content, part):
    (tmp_path / "policy.json").write_text(content)
    assert part in refused("explain", fork, "--policy", tmp_path / "policy.json")


def test_a_table_of_another_shape_is_refused(refused, fork, tmp_path):
    np.save(tmp_path / "q.npy", np.zeros((4, 2)))
    assert "(4, 3)" in refused("explain", fork, "--policy", tmp_path / "q.npy")


def test_a_negative_cost_is_refused_with_its_place(refused, fork_with, tmp_path):
    rewards = {"toll": rt.Reward(choice=np.array([1.0, 1.0, -2.0, 1.0, 0.0, 0.0]))}
    rt.write(rt.Problem(mdp=fork_with(rewards=rewards)), tmp_path / "negative.umb")
    sentence = refused("explain", tmp_path / "negative.umb")
    assert "-2" in sentence
    assert "bridge" in sentence


def test_a_table_without_a_property_name_is_not_guessed(refused, fork):
    assert "goals" in refused("explain", fork, "-p", 'R{"toll"}min=? [F "goals"]')


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ('action = {east = "go"}', "Did you mean 'actions'"),
        ('actions = "go"', "must be a table"),
        ("[actions]\neast = 3", "'actions.east' must be a text"),
        ('[objectives.distance]\nbst = "x"', "Did you mean 'best'"),
        ('state = "a\\nb"', "one line"),
        ("state = ", "TOML"),
        ('language = "xx"', "'xx'"),
    ],
)
def test_words_that_are_none_are_refused(refused, tmp_path, text, part):
    (tmp_path / "words.toml").write_text(text)
    assert part in refused("explain", PAPER, "--lexicon", tmp_path / "words.toml")


def test_words_that_are_no_text_are_refused(refused, tmp_path):
    (tmp_path / "words.toml").write_bytes(b'state = "\xff"')
    assert "UTF-8" in refused("explain", PAPER, "--lexicon", tmp_path / "words.toml")


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="needs a person whom files can be kept from")
def test_a_file_that_may_not_be_read_is_refused(refused, fork):
    Path(fork).chmod(0)
    assert "Permission denied" in refused("explain", fork)


def test_a_failed_answer_leaves_an_old_file_as_it_was(refused, tmp_path):
    (tmp_path / "route.json").write_text("old")
    refused("explain", PAPER, "--state", "99", "--output", tmp_path / "route.json")
    assert (tmp_path / "route.json").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["route.json"]


def test_an_undefined_constant_is_named(refused, said, tmp_path):
    pytest.importorskip("stormpy")
    (tmp_path / "walk.prism").write_text(
        "mdp\nconst int N;\nmodule walk\n  x : [0..N] init 0;\n  [go] x<N -> 0.9:(x'=x+1) + 0.1:true;\n"
        '  [rest] x=N -> true;\nendmodule\nrewards "steps"\n  true : 1;\nendrewards\nlabel "goal" = x=N;\n'
    )
    assert "N" in refused("explain", tmp_path / "walk.prism")
    assert "M" in refused("explain", tmp_path / "walk.prism", "--constants", "N=2,M=3")
    assert "two" in refused("explain", tmp_path / "walk.prism", "--constants", "N=two")
    assert said("solve", tmp_path / "walk.prism", "--constants", "N=2")


def test_a_changed_explanation_is_refused(ask, said, tmp_path):
    said("explain", PAPER, "--output", tmp_path / "route.json")
    stored = json.loads((tmp_path / "route.json").read_text(encoding="utf-8"))
    stored["steps"][0]["action"] = "north"
    (tmp_path / "route.json").write_text(json.dumps(stored), encoding="utf-8")
    result = ask("verify", tmp_path / "route.json", PAPER)
    assert result.exit_code == 2
    assert result.stderr.startswith("ratherthan: ")
