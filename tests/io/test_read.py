"""One door for all sources: it finds the adapter, says in one sentence what it cannot read, and sets what was asked."""

from __future__ import annotations

import gzip
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ratherthan.errors import InputError, PropertyError, QuestionError, SourceError
from ratherthan.io import read, write
from ratherthan.io.arrays import from_arrays
from ratherthan.io.read import ADAPTERS
from ratherthan.model.mdp import MDP
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem
from ratherthan.model.states import start_of, state_number

TOWN = "map = '''\nS.D\n'''\n"
PRISM = 'mdp\nmodule m\n x : [0..2] init 0;\n [go] x<2 -> (x\'=x+1);\n [stay] x=2 -> true;\nendmodule\nlabel "goal" = x=2;\n'


@pytest.fixture
def problem() -> Problem:
    """Three states in a row; from the second there are two ways."""
    transitions = np.zeros((3, 2, 3))
    transitions[0, 0, 1] = transitions[1, 0, 2] = transitions[1, 1, 0] = transitions[2, 0, 2] = 1
    return from_arrays(
        transitions, actions=["on", "back"], names=["a", "b", "7"], labels={"goal": [2]}, rewards={"steps": [1, 1, 0]}
    )


# finding the adapter


@pytest.mark.parametrize("name", ["model.umb", "model.npz", "MODEL.UMB", "model", "model.bin", "a.b.umb"])
def test_what_is_written_is_read_whatever_its_name(tmp_path, problem, assert_equal, name):
    suffix = ".npz" if "npz" in name else ".umb"
    write(problem, tmp_path / f"whole{suffix}")
    path = tmp_path / name
    path.write_bytes((tmp_path / f"whole{suffix}").read_bytes())
    for given in (path, str(path)):
        assert_equal(read(given), problem)


@pytest.mark.parametrize("suffix", [".umb", ".npz"])
def test_an_archive_is_told_by_its_first_bytes(tmp_path, problem, assert_equal, suffix):
    write(problem, tmp_path / f"whole{suffix}")
    (tmp_path / "model.dat").write_bytes((tmp_path / f"whole{suffix}").read_bytes())
    assert_equal(read(tmp_path / "model.dat"), problem)


@pytest.mark.parametrize("name", ["town.roadmap", "town.txt", "town"])
def test_a_road_map_is_told_by_its_suffix_or_its_drawing(tmp_path, name):
    path = tmp_path / name
    path.write_text(TOWN)
    problem = read(path)
    assert problem.mdp.states == 3
    assert problem.world is not None


@pytest.mark.parametrize("name", ["model.prism", "model.nm", "model.txt"])
def test_a_prism_model_is_told_by_its_suffix_or_its_first_word(tmp_path, name):
    pytest.importorskip("stormpy")
    pytest.importorskip("ratherthan.io.prism")
    path = tmp_path / name
    path.write_text("// a comment: module x\n" + PRISM)
    assert read(path).mdp.states == 3


def test_an_example_is_told_by_its_prefix():
    pytest.importorskip("ratherthan.io.examples")
    problem = read("example:paper-5x5")
    assert (problem.mdp.states, problem.mdp.choices) == (25, 31)
    with pytest.raises(InputError):
        read("example:no-such-example")


def test_a_problem_a_model_and_arrays_pass_through(problem, assert_equal):
    assert read(problem) is problem
    assert read(problem.mdp).mdp is problem.mdp
    eye = [np.eye(2), np.eye(2)[::-1]]
    expected = from_arrays(eye, [1, 2])
    assert_equal(read(eye, rewards=[1, 2]), expected)
    assert_equal(read({"transitions": eye, "rewards": [1, 2]}), expected)
    assert_equal(read(np.array(eye), rewards=[1, 2], order="ASS"), expected)


# what cannot be read


def sentence_of(source: object, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        read(source, **options)
    assert "\n" not in caught.value.message
    return caught.value.message


@pytest.mark.parametrize("suffix", ["", ".txt", *(suffix for adapter in ADAPTERS for suffix in adapter.suffixes)])
def test_missing_empty_and_binary_files_and_folders_are_one_sentence(tmp_path, suffix):
    missing, empty, folder, binary = (tmp_path / f"{name}{suffix}" for name in ("missing", "empty", "folder", "binary"))
    empty.write_bytes(b"")
    folder.mkdir()
    binary.write_bytes(bytes(range(256)) * 8)
    assert "there is no" in sentence_of(missing)
    assert "no bytes" in sentence_of(empty)
    assert "is a folder" in sentence_of(folder)
    assert str(binary) in sentence_of(binary)


def test_a_device_and_an_unreadable_file_are_one_sentence(tmp_path, monkeypatch):
    assert "ordinary file" in sentence_of("/dev/null")
    secret = tmp_path / "secret.umb"
    secret.write_bytes(b"x")

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    assert "Permission denied" in sentence_of(secret)


@pytest.mark.parametrize("name", ["no\x00name.umb", "x" * 5000])
def test_a_name_that_no_file_can_have_is_one_sentence(name):
    sentence_of(name)


@pytest.mark.parametrize("content", ["just some text\n", "{}", '{"a": [1, 2]}', "x = 5\n", "state,action\n1,go\n"])
def test_an_unknown_kind_of_file_gets_a_list_of_what_can_be_read(tmp_path, content):
    path = tmp_path / "notes.txt"
    path.write_text(content)
    message = sentence_of(path)
    for adapter in ADAPTERS:
        assert adapter.suffixes[0] in message
    assert "example:NAME" in message


def test_objects_of_no_kind_are_one_sentence(problem):
    for source in (None, 5, object(), {"weights": [1]}, [], "", {}):
        sentence_of(source)
    assert "takes no options" in sentence_of(problem, order="ASS")


def test_constants_are_refused_where_there_are_none(tmp_path, problem):
    write(problem, tmp_path / "model.umb")
    (tmp_path / "town.roadmap").write_text(TOWN)
    for source in (tmp_path / "model.umb", tmp_path / "town.roadmap", problem, problem.mdp, [np.eye(2)]):
        assert "constants" in sentence_of(source, constants="N=5")
        assert isinstance(read(source, constants=""), Problem)
    assert "constants" in sentence_of("example:paper-5x5", constants={"N": 5})


# what was asked


def test_the_objective_asked_for_is_set(problem):
    assert read(problem, objective='Pmax=? [F "goal"]').objective.text == 'Pmax=? [F "goal"]'
    assert problem.objective is None
    with pytest.raises(PropertyError):
        read(problem, objective="nonsense")
    with pytest.raises(PropertyError, match="yes-or-no"):
        read(problem, objective='P>=0.5 [F "goal"]')


@pytest.mark.parametrize(("start", "state"), [(1, 1), ("1", 1), ("b", 1), ("7", 2), (np.int64(2), 2), (" 2 ", 2)])
def test_the_start_asked_for_is_the_only_initial_state(problem, start, state):
    started = read(problem, start=start)
    assert started.mdp.initial.tolist() == [state]
    assert start_of(started.mdp) == state
    assert problem.mdp.initial.tolist() == [0, 1, 2]


@pytest.mark.parametrize("start", ["nowhere", "9", 3, -1, "-1", True, 1.0, "", "1.5", "9" * 100])
def test_a_start_that_is_none_is_refused(problem, start):
    with pytest.raises(QuestionError):
        read(problem, start=start)


def test_several_initial_states_need_a_choice(problem):
    with pytest.raises(
        QuestionError, match=r"3 initial states: 0 \('a'\), 1 \('b'\), 2 \('7'\)\. Choose one with --start"
    ):
        start_of(problem.mdp)


def test_a_state_is_found_by_number_or_name_and_the_number_wins():
    mdp = MDP(
        state_to_choices=np.arange(4),
        choice_to_branches=np.arange(4),
        branch_to_target=np.arange(3),
        branch_to_probability=np.ones(3),
        initial=np.array([0]),
        names=StateNames(count=3, strings=["2", "x", "x"]),
    )
    assert state_number(mdp, "2") == 2
    assert state_number(mdp, 0) == 0
    with pytest.raises(QuestionError, match="fits 2 states"):
        state_number(mdp, "x")
    with pytest.raises(QuestionError, match="0 … 2"):
        state_number(mdp, 5)
    unnamed = MDP(
        **{
            name: getattr(mdp, name)
            for name in (
                "state_to_choices",
                "choice_to_branches",
                "branch_to_target",
                "branch_to_probability",
                "initial",
            )
        }
    )
    with pytest.raises(QuestionError, match="0 … 2, got 5"):
        state_number(unnamed, "5")


# writing


@pytest.mark.parametrize("name", ["model", "model.prism", "model.umb.gz"])
def test_only_known_suffixes_are_written(tmp_path, problem, name):
    with pytest.raises(SourceError, match=r"\.umb or \.npz"):
        write(problem, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_options_reach_the_writer(tmp_path, problem):
    write(problem, tmp_path / "model.umb", packing="none")
    with pytest.raises(gzip.BadGzipFile):
        gzip.decompress((tmp_path / "model.umb").read_bytes())


def test_the_door_itself_loads_no_adapter():
    code = (
        "import sys, ratherthan.io; print([m for m in sys.modules if m in ('scipy', 'stormpy', 'numba') or"
        " m.startswith('ratherthan.io.') and m.rpartition('.')[2] in ('umb', 'npz', 'arrays', 'roadmap', 'prism')])"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )
