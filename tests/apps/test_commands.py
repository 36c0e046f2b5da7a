"""Each command on other models than the paper's: what goes in by its options comes out in its answer."""

from __future__ import annotations

import csv
import io
import json
import sys

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.apps.columns import KEYS
from ratherthan.io.examples import example_names


def test_without_a_property_one_reward_and_one_goal_are_enough(document, fork):
    assert document("explain", fork)["property"] == 'R{"toll"}min=? [F "goal"]'


def test_a_property_is_taken_by_text_and_by_name(document, said):
    by_name = document("explain", "example:delivery", "-p", "fastest")
    assert by_name["property"] == 'R{"time"}min=? [F "delivered"]'
    assert document("explain", "example:delivery", "--property", by_name["property"])["text"] == by_name["text"]


def test_a_state_is_taken_by_number_and_by_name(said, fork):
    assert said("explain", fork, "--state", "bridge", "--kind", "naive-state") == "We take left at bridge.\n"
    assert said("explain", fork, "--state", "1", "--kind", "naive-state") == "We take left at bridge.\n"
    assert said("explain", fork, "--start", "bridge", "--kind", "naive-path") == "We take left at bridge.\n"


def test_a_number_wins_over_a_name(said, tmp_path, fork_with):
    names = rt.StateNames(count=4, strings=["1", "0", "market", "ditch"])
    rt.write(rt.Problem(mdp=fork_with(names=names)), tmp_path / "numbers.npz")
    assert "at state 1 (0)." in said("explain", tmp_path / "numbers.npz", "--state", "1", "--kind", "naive-state")


def test_one_of_several_initial_states_is_picked(document, refused, two_starts):
    assert "--start STATE" in refused("explain", two_starts)
    assert "0 ('home')" in refused("solve", two_starts)
    assert "--start" in refused("factors", two_starts)
    assert document("explain", two_starts, "--start", "bridge")["start"] == 1
    assert document("explain", two_starts, "--state", "bridge")["start"] == 1
    assert document("info", two_starts)["initial_states"] == 2


def test_a_given_policy_is_explained(document, said, fork, tmp_path):
    (tmp_path / "right.json").write_text(json.dumps({"home": "right", "1": "left", "ditch": "rest"}))
    text = said("explain", fork, "--policy", tmp_path / "right.json", "--state", "home", "--kind", "responsibility")
    assert text == "We take right at home although it may fail to arrive and taking left would be sure to (6).\n"
    assert document("explain", fork, "--policy", tmp_path / "right.json")["policy"]["given"] is True


def test_a_table_of_action_values_is_a_policy(said, tmp_path, fork):
    table = np.array([[1.0, 2.0, np.nan], [1.0, 2.0, np.nan], [np.nan, np.nan, 0.0], [np.nan, np.nan, 0.0]])
    np.save(tmp_path / "q.npy", table)
    options = ("explain", fork, "--policy", tmp_path / "q.npy", "--kind", "naive-state")
    assert said(*options) == "We take right at home.\n"
    assert said(*options, "--minimise-q") == "We take left at home.\n"


def test_solve_tells_the_value_of_a_given_policy(document, fork, tmp_path):
    (tmp_path / "left.csv").write_text("state,action\nhome,left\nbridge,right\n")
    assert document("solve", fork, "--policy", tmp_path / "left.csv")["value"] == pytest.approx(6)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ('Pmax>=0.9 [F "goal"]', True),
        ('P>=0.9 [F "goal"]', False),
        ('Pmax>1 [F "goal"]', False),
        ('R{"toll"}min<=6.5 [F "goal"]', True),
        ('R{"toll"}min<5.5 [F "goal"]', False),
    ],
)
def test_a_yes_or_no_property_has_the_value_true_or_false(document, said, fork, text, value):
    answer = document("solve", fork, "-p", text)
    assert answer["value"] is value
    assert answer["lower"] <= answer["upper"]
    assert ("value     " + str(value).lower()) in said("solve", fork, "-p", text)


def test_a_yes_or_no_property_that_the_bounds_do_not_decide_is_null():
    from ratherthan.apps.answers import decided

    wish = rt.Threshold(objective=rt.ReachAvoid(goal='"goal"'), relation=">=", bound=0.5)
    assert decided(wish, 0.4999, 0.5001) is None
    assert decided(wish, 0.5, 0.5) is True
    assert decided(wish, 0.4, 0.4999) is False
    below = rt.Threshold(objective=rt.ReachAvoid(goal='"goal"'), relation="<", bound=0.5)
    assert decided(below, 0.5, 0.5) is False
    assert decided(below, 0.4, 0.5) is None


def test_an_infinite_value_is_a_word(document):
    answer = document("solve", "example:paper-5x5", "--start", "13")
    assert (answer["value"], answer["lower"], answer["upper"]) == ("inf", "inf", "inf")


def test_alpha_horizon_impact_values_and_toward_arrive_in_the_question(document):
    options = (
        "--alpha",
        "2.5",
        "--horizon",
        "3",
        "--impact",
        "omega",
        "--values",
        "policy",
        "--toward",
        "goal",
        "--detail",
    )
    answer = document("explain", "example:paper-5x5", *options)
    assert (answer["alpha"], answer["impact"], answer["values"], answer["detail"]) == (2.5, "omega", "policy", True)
    assert answer["search"] == {"horizon": 3, "toward_goal": True}


def test_a_large_alpha_leaves_fewer_decisions(said):
    text = said("explain", "example:paper-5x5", "--alpha", "5", "--kind", "selective")
    assert "grid 10" not in text
    assert "critical grid 5" in text


def test_an_answer_goes_to_a_file_by_the_format_of_its_suffix(said, tmp_path):
    assert said("explain", "example:paper-5x5", "--output", tmp_path / "route.json") == ""
    assert json.loads((tmp_path / "route.json").read_text(encoding="utf-8"))["version"]
    assert said("explain", "example:paper-5x5", "--kind", "naive-state", "-o", tmp_path / "route.txt") == ""
    assert (tmp_path / "route.txt").read_bytes() == b"We move south at grid 5.\n"
    assert said("factors", "example:paper-5x5", "-o", "-", "--format", "csv").startswith("state,")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["route.json", "route.txt"]


def test_csv_has_the_same_rows_as_json(said, document, fork):
    rows = list(csv.DictReader(io.StringIO(said("factors", fork, "--format", "csv"))))
    expected = document("factors", fork)["rows"]
    assert list(rows[0]) == list(KEYS)
    for row, other in zip(rows, expected, strict=True):
        for key in KEYS:
            assert same(row[key], other[key]), (key, row[key], other[key])


def same(text: str, value: object) -> bool:
    if value is None:
        return text == ""
    if isinstance(value, bool):
        return text == str(value).lower()
    return text == value if isinstance(value, str) and value not in ("inf", "-inf") else float(text) == float(value)


def test_parquet_has_the_same_rows_as_json(said, document, fork, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    said("factors", fork, "--output", tmp_path / "factors.parquet")
    table = parquet.read_table(tmp_path / "factors.parquet")
    assert table.column_names == list(KEYS)
    for row, other in zip(table.to_pylist(), document("factors", fork)["rows"], strict=True):
        infinite = {key: float(value) for key, value in other.items() if value in ("inf", "-inf")}
        assert row == {**other, **infinite}


def test_without_pyarrow_parquet_says_what_to_install(refused, fork, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "pip install 'ratherthan[parquet]'" in refused("factors", fork, "--output", tmp_path / "factors.parquet")
    assert not (tmp_path / "factors.parquet").exists()


def test_the_table_for_people_shows_names_and_no_more_than_six_digits(said, fork):
    lines = said("factors", fork).splitlines()
    assert lines[0].split() == [key for key in KEYS if key not in ("choice_index", "lower", "upper")]
    assert len({line.index("left") for line in lines[1:] if "left" in line}) == 1
    assert lines[1].split()[:4] == ["0", "home", "0", "left"]
    assert lines[1].split()[5] == "6"


def test_a_converted_model_is_explained_alike(said, document, tmp_path):
    for suffix in (".umb", ".npz"):
        target = tmp_path / f"town{suffix}"
        assert said("convert", "example:paper-5x5", target) == ""
        assert said("explain", target) == said("explain", "example:paper-5x5")
    assert said("convert", "example:paper-5x5", tmp_path / "late.umb", "--start", "10") == ""
    assert document("explain", tmp_path / "late.umb")["start"] == 10


def test_info_tells_what_is_in_a_model(document, said, fork):
    answer = document("info", fork)
    assert (answer["states"], answer["choices"], answer["branches"]) == (4, 6, 9)
    assert answer["labels"] == {"goal": 1, "trap": 1}
    assert answer["rewards"] == {"toll": ["choice"]}
    assert answer["actions"] == ["left", "right", "rest"]
    assert answer["initial"] == [{"state": 0, "state_name": "home"}]
    assert answer["objective"] == 'R{"toll"}min=? [F "goal"]'
    assert "reconstruction" in said("info", "example:paper-5x5")
    assert 'safest: Pmax=? [!"fallen" U "delivered"]' in said("info", "example:delivery")


def test_info_says_where_a_property_must_be_given(document, said, unlabelled):
    assert document("info", unlabelled)["objective"] is None
    assert "give --property" in said("info", unlabelled)


def test_examples_lists_every_example(said, document):
    lines = said("examples").splitlines()
    assert [line.split()[0] for line in lines] == [f"example:{name}" for name in example_names()]
    for entry in document("examples")["examples"]:
        assert entry["states"] > 0
        assert entry["properties"]


@pytest.mark.parametrize("name", example_names())
def test_every_example_is_explained(said, name):
    text = said("explain", f"example:{name}")
    assert text.endswith(".\n")
    assert text.count("\n") == 1


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script(said, shell):
    assert "_RATHERTHAN_COMPLETE" in said("completion", shell)


def test_the_version_is_the_packages(said):
    assert said("--version") == f"ratherthan {rt.__version__}\n"


def test_no_words_print_the_help(said):
    assert said() == said("--help") == said("-h")
