"""Policies: every form says the same, and what does not fit the model is told with its place."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.errors import InputError, PolicyError, SourceError
from ratherthan.io.policies import read_policy
from ratherthan.model.mdp import MDP
from ratherthan.model.names import StateNames
from ratherthan.model.policy import Policy


def model(**changes: object) -> MDP:
    """Three states: in the first all of north, east, south; in the second south, north; in the third a loop."""
    fields = {
        "state_to_choices": np.array([0, 3, 5, 6]),
        "choice_to_branches": np.arange(7),
        "branch_to_target": np.array([1, 2, 0, 0, 2, 2]),
        "branch_to_probability": np.ones(6),
        "choice_to_action": np.array([0, 1, 2, 2, 0, -1]),
        "actions": ("north", "east", "south"),
        "initial": np.array([0]),
        "names": StateNames(count=3, strings=["start", "mid, way", "end"]),
    }
    return MDP(**fields | changes)


@pytest.fixture
def mdp() -> MDP:
    return model()


@pytest.fixture
def file(tmp_path: Path):
    """``file(name, text)`` writes a file and returns its path."""

    def make(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return make


def refusal(source: object, mdp: MDP, **options: bool) -> str:
    with pytest.raises(InputError) as caught:
        read_policy(source, mdp, **options)
    assert "\n" not in caught.value.message
    return caught.value.message


# what is read


@pytest.mark.parametrize(
    "text",
    [
        '{"0": "east", "1": "north", "2": "choice 0"}',
        '{"start": "east", "mid, way": "north", "end": 0}',
        '{"0": 1, "1": "1", "2": {"choice 0": 1}}',
        '\ufeff{"0": {"east": 1.0, "south": 0}, "1": 1, "2": 0}',
    ],
)
def test_json_names_states_and_actions_by_number_or_name(file, mdp, text):
    for name in ("policy.json", "policy.txt", "policy"):
        policy = read_policy(file(name, text), mdp)
        assert policy.choice.tolist() == [1, 4, 5]
        assert policy.chance is None


@pytest.mark.parametrize(
    "text",
    [
        "state,action\n0,east\n1,north\n2,0\n",
        "0,east\n1,north\n2,choice 0\n",
        'State, Action\r\nstart, east\r\n\r\n"mid, way", north\r\nend, 0\r\n',
        "action,state\neast,0\nnorth,1\n0,2",
        "probability,action,state\n1,east,0\n1,north,1\n1.0,0,2\n0,south,0\n",
        "\ufeff0,east,1\n1,north,1\n2,0,1\n",
    ],
)
def test_csv_is_read_with_or_without_its_first_line(file, mdp, text):
    policy = read_policy(file("policy.csv", text), mdp)
    assert policy.choice.tolist() == [1, 4, 5]
    assert policy.chance is None


def test_every_form_says_the_same(file, tmp_path, mdp):
    q = np.array([[0.0, 2.0, 1.0], [5.0, 9.0, 4.0], [np.nan, np.nan, np.nan]])
    two = model(choice_to_action=np.array([0, 1, 2, 2, 0, 1]))
    q[2, 1] = -7
    np.save(tmp_path / "q.npy", q)
    np.save(tmp_path / "actions.npy", np.array([1, 0, 1], dtype=np.uint8))
    forms = [
        {"0": "east", "1": "north", "2": "east"},
        {0: 1, 1: 1, 2: 0},
        {"start": "east", "mid, way": {"north": 1}, "end": {"east": 1.0}},
        file("p.json", json.dumps({"0": "east", "1": "north", "2": "east"})),
        file("p.csv", "0,east\n1,north\n2,east"),
        q,
        tmp_path / "q.npy",
        str(tmp_path / "q.npy"),
        np.array([1, 0, 1]),
        tmp_path / "actions.npy",
        Policy(choice=np.array([1, 4, 5])),
    ]
    for form in forms:
        assert read_policy(form, two).choice.tolist() == [1, 4, 5]


def test_states_that_are_not_listed_stay_open(mdp):
    assert read_policy({"1": "south"}, mdp).choice.tolist() == [-1, 3, -1]
    assert read_policy({}, mdp).choice.tolist() == [-1, -1, -1]
    assert read_policy(np.array([-1, 2, -1]), mdp).choice.tolist() == [-1, 3, -1]


def test_a_randomised_policy_has_a_chance_per_choice(file, mdp):
    said = {"0": {"east": 0.6, "south": 0.4}, "1": "north"}
    rows = "state,action,probability\nstart,east,0.6\n0,south,0.4\n1,north,1\n"
    for policy in (read_policy(said, mdp), read_policy(file("p.csv", rows), mdp)):
        assert policy.chance.tolist() == [0, 0.6, 0.4, 0, 1, 0]
        assert policy.choice.tolist() == [-1, 4, -1]


def test_probabilities_that_nearly_sum_to_1_are_rescaled(mdp):
    policy = read_policy({"0": {"north": 0.33333333, "east": 0.33333333, "south": 0.33333333}}, mdp)
    assert policy.chance[:3].sum() == pytest.approx(1, abs=1e-15)


def test_the_name_of_an_action_wins_over_its_position():
    mdp = model(actions=("1", "0", "2"))
    assert read_policy({"0": 1, "1": "0"}, mdp).choice.tolist() == [0, 3, -1]


def test_equal_names_in_a_state_are_told_apart_as_they_are_shown():
    mdp = model(choice_to_action=np.array([0, 1, 1, 2, 0, -1]))
    assert read_policy({"0": "east", "1": "south"}, mdp).choice.tolist() == [1, 3, -1]
    assert read_policy({"0": "east (2)"}, mdp).choice.tolist() == [2, -1, -1]


def test_variables_name_states():
    mdp = model(names=StateNames(count=3, variables={"x": np.array([0, 1, 1]), "ok": np.array([True, True, False])}))
    assert read_policy({"x=0, ok=true": "east", "ok=false": 0}, mdp).choice.tolist() == [1, -1, 5]


def test_many_states_are_found_by_their_names():
    count = 3000
    mdp = MDP(
        state_to_choices=np.arange(count + 1),
        choice_to_branches=np.arange(count + 1),
        branch_to_target=np.arange(count),
        branch_to_probability=np.ones(count),
        choice_to_action=np.zeros(count, dtype=int),
        actions=("stay",),
        initial=np.array([0]),
        names=StateNames(count=count, variables={"x": np.arange(count) % 50, "y": np.arange(count) // 50}),
    )
    said = {f"x={i % 50}, y={i // 50}": "stay" for i in range(0, count, 2)} | {"y=1, x=1": "stay"}
    policy = read_policy(said, mdp)
    expected = np.where(np.arange(count) % 2 == 0, np.arange(count), -1)
    expected[51] = 51
    assert policy.choice.tolist() == expected.tolist()


# Q tables


def test_the_largest_or_the_smallest_number_of_a_row_is_taken(mdp):
    q = np.array([[1.0, 3.0, 2.0], [1.0, 99.0, 2.0], [0, 0, 0]])
    loops = model(choice_to_action=np.array([0, 1, 2, 2, 0, 1]))
    assert read_policy(q, loops).choice.tolist() == [1, 3, 5]
    assert read_policy(q, loops, minimise_q=True).choice.tolist() == [0, 4, 5]


@given(st.lists(st.sampled_from([0.0, 1.0, 2.0, np.nan, -np.inf]), min_size=6, max_size=6), st.booleans())
def test_a_q_table_agrees_with_the_plainest_loop(values, minimise):
    mdp = model(choice_to_action=np.array([2, 0, 1, 1, 2, 0]))
    q = np.array([[values[1], values[2], values[0]], [7.0, values[3], values[4]], [values[5], 8.0, 9.0]])
    expected = []
    for own in ([0, 1, 2], [3, 4], [5]):
        allowed = [choice for choice in own if not (np.isnan(values[choice]) or values[choice] == -np.inf)]
        best = (min if minimise else max)((values[choice] for choice in allowed), default=None)
        expected.append(next((choice for choice in allowed if values[choice] == best), -1))
    if expected == [-1, -1, -1]:
        assert "must have a finite number for some enabled action" in refusal(q, mdp, minimise_q=minimise)
    else:
        assert read_policy(q, mdp, minimise_q=minimise).choice.tolist() == expected


def test_infinite_costs_are_smallest_only_where_all_are(mdp):
    loops = model(choice_to_action=np.array([0, 1, 2, 2, 0, 1]))
    q = np.array([[np.inf, 3.0, np.inf], [np.inf, 0, np.inf], [0, 0, 0]])
    assert read_policy(q, loops, minimise_q=True).choice.tolist() == [1, 3, 5]


def test_without_action_names_columns_are_positions():
    mdp = model(actions=(), choice_to_action=np.full(6, -1))
    q = np.array([[0, 1, 2], [0, 1, 99], [5, 6, 7]])
    assert read_policy(q, mdp).choice.tolist() == [2, 4, 5]
    assert read_policy(np.array([2, 1, 0]), mdp).choice.tolist() == [2, 4, 5]
    assert "choice 0" in refusal(np.array([2, 2, 0]), mdp)


# what is refused


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"9": "east"}, ["from 0 to 2", "9"]),
        ({"nowhere": "east"}, ["'nowhere'", "'start'"]),
        ({"0": "fly"}, ["'north', 'east', 'south'", "'fly' is no action of the model", "state 0 ('start')"]),
        ({"1": "east"}, ["'south', 'north'", "'east' is not enabled there", "mid, way"]),
        ({"0": 3}, ["'north', 'east', 'south'", "3"]),
        ({"0": -1}, ["-1"]),
        ({"0": True}, ["True"]),
        ({"0": None}, ["None"]),
        ({"0": 1.0}, ["1.0"]),
        ({"0": ["east"]}, ["['east']"]),
        ({True: "east"}, ["True"]),
        ({None: "east"}, ["None"]),
        ({"0": {}}, ["must give an action", "'0'"]),
        ({"0": {"east": 0.5}}, ["sum to 1", "0.5", "state 0"]),
        ({"0": {"east": 0.7, "north": 0.7}}, ["sum to 1", "1.4"]),
        ({"0": {"east": 0, "north": 0}}, ["sum to 1", "got 0 "]),
        ({"0": {"east": -0.5, "north": 1.5}}, ["between 0 and 1", "-0.5"]),
        ({"0": {"east": float("nan")}}, ["between 0 and 1", "nan"]),
        ({"0": {"east": "1"}}, ["between 0 and 1", "'1'"]),
        ({"0": {"east": True}}, ["between 0 and 1", "True"]),
        ({"0": {"east": 0.5, "1": 0.5}}, ["state 0 ('start') is there twice"]),
        ({"0": "east", "start": "north"}, ["state 0 ('start') is there twice"]),
        ({"0": "east", 0: "east"}, ["twice"]),
        ({"0": {"east": 1}, "start": "north"}, ["twice"]),
    ],
)
def test_what_does_not_fit_is_told_with_its_place(mdp, said, words):
    message = refusal(said, mdp)
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("p.json", "{", ["JSON"]),
        ("p.json", '["east"]', ["list"]),
        ("p.json", "5", ["int"]),
        ("p.json", "[" * 100_000, ["JSON"]),
        ("p.json", '{"0": "east", "0": "east"}', ["'0' is there twice"]),
        ("p.json", '{"0": {"east": 0.5, "east": 0.5}}', ["'east' is there twice"]),
        ("p.csv", "state,action\n", ["lists none"]),
        ("p.csv", "\n\n", ["lists none"]),
        ("p.csv", "0\n1\n", ["line 1", "1 cells"]),
        ("p.csv", "0,east,1,2\n", ["4 cells"]),
        ("p.csv", "0,east\n1\n", ["line 2", "1"]),
        ("p.csv", "0,east\n1,north,1\n", ["line 2", "2 cells"]),
        ("p.csv", "state,action,colour\n0,east,red\n", ["colour"]),
        ("p.csv", "state,action,state\n0,east,1\n", ["state, action, state"]),
        ("p.csv", "0,east,much\n", ["line 1", "much"]),
        ("p.csv", "0,east,nan\n", ["line 1", "nan"]),
        ("p.csv", "0,east,2\n", ["line 1", "2"]),
        ("p.csv", "0,east,\n", ["line 1", "number"]),
        ("p.csv", '0,"east\n', ["CSV"]),
        ("p.csv", "0,east\n0,east\n", ["twice"]),
        ("p.csv", "0,east\n0,north\n", ["twice"]),
        ("p.csv", "0,east,0.5\n0,east,0.5\n", ["twice"]),
        ("p.csv", "0,east,0.5\n0,north,0.4\n", ["sum to 1", "0.9"]),
        ("p.csv", "0,east\n1,fly\n", ["'fly'", "'south', 'north'"]),
        ("p.npy", "hello", [".npy"]),
        ("p.txt", "hello", ["1 cells"]),
    ],
)
def test_a_broken_file_is_one_sentence_with_its_name(file, mdp, name, text, words):
    path = file(name, text)
    message = refusal(path, mdp)
    for word in [*words, str(path)]:
        assert word in message


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros((3, 2)), ["(3, 3)", "(3, 2)"]),
        (np.zeros((2, 3)), ["(3, 3)", "(2, 3)"]),
        (np.zeros((3, 3, 1)), ["(3, 3, 1)"]),
        (np.zeros(3), ["(3,)"]),
        (np.zeros(()), ["()"]),
        (np.zeros(4, dtype=int), ["(4,)"]),
        (np.zeros((3, 3), dtype=complex), ["complex"]),
        (np.zeros((3, 3), dtype=bool), ["bool"]),
        (np.array([["a"] * 3] * 3), ["U1"]),
        (np.array([{}] * 3), ["object"]),
        (np.array([0, 1, 0]), ["'south', 'north'", "'east' is not enabled there"]),
        (np.array([3, 0, 0]), ["0 … 2", "3"]),
        (np.array([-2, 0, 0]), ["-2"]),
        (np.array([2**64 - 1, 0, 0], dtype=np.uint64), ["18446744073709551615"]),
        (np.full((3, 3), np.nan), ["all of them are NaN, -inf or inf", "columns"]),
        (np.full((3, 3), np.inf), ["must have a finite number", "columns"]),
    ],
)
def test_an_array_that_does_not_fit_is_told(array, words):
    loops = model(choice_to_action=np.array([0, 1, 2, 2, 0, 1]))
    message = refusal(array, loops)
    for word in words:
        assert word in message


def test_a_choice_without_a_name_has_no_column(mdp):
    assert read_policy(np.zeros((3, 3)), mdp).choice.tolist() == [0, 3, -1]


def test_a_row_without_numbers_leaves_its_state_unsaid():
    mdp = model(choice_to_action=np.array([2, 0, 1, 1, 2, 0]))
    q = np.array([[1.0, 2.0, 3.0], [np.nan] * 3, [1.0, 2.0, 3.0]])
    assert read_policy(q, mdp).choice.tolist() == [0, -1, 5]


def test_a_pickle_is_refused(tmp_path, mdp):
    np.save(tmp_path / "p.npy", np.array([{}], dtype=object), allow_pickle=True)
    assert "pickled objects" in refusal(tmp_path / "p.npy", mdp)


def test_damaged_and_missing_files_are_told(tmp_path, mdp):
    np.save(tmp_path / "p.npy", np.zeros((3, 3)))
    whole = (tmp_path / "p.npy").read_bytes()
    for content in (whole[:-1], whole + b"x", whole[:20], whole[:6], b"\x93NUMPY\x09\x00" + whole[8:]):
        (tmp_path / "p.npy").write_bytes(content)
        assert str(tmp_path / "p.npy") in refusal(tmp_path / "p.npy", mdp)
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    assert "UTF-8" in refusal(tmp_path / "binary.csv", mdp)
    (tmp_path / "zeros.json").write_bytes(b"\x00" * 10)
    assert "binary" in refusal(tmp_path / "zeros.json", mdp)
    with pytest.raises(SourceError, match="A policy must be a file"):
        read_policy(tmp_path, mdp)
    with pytest.raises(SourceError, match="there is no"):
        read_policy(tmp_path / "none.json", mdp)
    (tmp_path / "empty.json").write_bytes(b"")
    with pytest.raises(SourceError, match="A policy must not be empty"):
        read_policy(tmp_path / "empty.json", mdp)


def test_things_that_are_no_policy_are_refused(mdp):
    for source in (None, 5, ["east"], object()):
        with pytest.raises(PolicyError):
            read_policy(source, mdp)
    with pytest.raises(PolicyError):
        read_policy(Policy(choice=np.array([5, 4, 5])), mdp)


def test_many_states_are_found_by_the_values_of_their_variables_in_any_spelling():
    count = 3000
    x, half = np.arange(count) % 50, np.arange(count) // 50 / 3
    mdp = MDP(
        state_to_choices=np.arange(count + 1),
        choice_to_branches=np.arange(count + 1),
        branch_to_target=np.arange(count),
        branch_to_probability=np.ones(count),
        choice_to_action=np.zeros(count, dtype=int),
        actions=("stay",),
        initial=np.array([0]),
        names=StateNames(count=count, variables={"x": x, "half": half}),
    )
    said = {f"(half={half[i]:g},x={x[i]})": "stay" for i in range(0, count, 3)}
    said |= {mdp.names[i]: 0 for i in range(1, count, 3)}
    assert np.flatnonzero(read_policy(said, mdp).choice < 0).tolist() == list(range(2, count, 3))
    assert "fits" in refusal({"x=1": 0}, mdp)
    assert "'(x=1,half=77)'" in refusal({"(x=1,half=77)": 0}, mdp)
    assert "'(x=1,z=0)'" in refusal({"(x=1,z=0)": 0}, mdp)
