"""Several objectives on the command line: in order, side by side, and unfolded with what must be remembered."""

from __future__ import annotations

import csv
import io
import json

import pytest

from ratherthan.apps.columns import KEYS

SAFEST, FASTEST = 'Pmax=? [!"fallen" U "delivered"]', 'R{"time"}min=? [F "delivered"]'
FURTHER = ("impact", "action_value", "lower", "upper", "compared", "lambda_min", "lambda_max", "responsibility")


def test_a_plan_is_judged_under_further_objectives(said, document):
    text = said("explain", "example:pedestrians", "--also", "risk")
    assert "though moving north would lead to a safer one (0.4 instead of 2)" in text
    assert text.endswith("On this plan we expect a distance of 8.8 and a risk of 2.\n")
    told = document("explain", "example:pedestrians", "--also", "risk")
    assert told["also"][0]["property"] == 'R{"risk"}min=? [F "destination"]'
    assert [total["value"] for total in told["totals"]] == pytest.approx([8.75, 2.0])
    trade = told["steps"][0]["trades"][0]
    assert (trade["claim"], trade["against"]) == ("trade", ["north"])
    assert [one["relation"] for one in trade["judged"]] == ["better", "worse"]


def test_a_further_objective_can_be_named_in_three_ways(said):
    plain = said("explain", "example:delivery", "--also", "time")
    assert plain == said("explain", "example:delivery", "--also", FASTEST)
    assert plain == said("explain", "example:delivery", "--also", "fastest")
    both = said("explain", "example:delivery", "--also", "time", "--also", "safest")
    assert "a time of 26.7 and a chance of 1 to arrive safely" in both


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ("energy", "must differ from the plan's own"),
        ("speed", "one of the source's own: 'fastest', 'safest'"),
        ('Pmax>=0.5 [F "delivered"]', "must ask for one best value"),
        ('Pmax=? [F<=3 "delivered"]', "must be told without memory"),
        ('R{"time"}min=? [F "nowhere"]', "nowhere"),
    ],
)
def test_what_cannot_be_a_further_objective_is_refused(refused, wish, message):
    assert message in refused("explain", "example:delivery", "--also", wish)


def test_two_properties_are_wanted_in_order(said, document):
    told = document("explain", "example:delivery", "-p", "safest", "-p", "fastest", "--state", "1")
    assert told["property"] == f"{SAFEST} then {FASTEST}"
    assert [level["kind"] for level in told["levels"]] == ["safety", "cost"]
    assert {claim["level"] for claim in told["steps"][0]["claims"]} == {0, 1}
    assert said("explain", "example:delivery", "-p", f"{SAFEST} then {FASTEST}") == said(
        "explain", "example:delivery", "-p", "safest", "-p", "fastest"
    )


def test_factors_have_columns_for_every_level(said, document, tmp_path):
    rows = document("factors", "example:delivery", "-p", "safest", "-p", "fastest")["rows"]
    keys = [*KEYS, *(f"{name}_2" for name in FURTHER)]
    assert all(list(row) == keys for row in rows)
    by_action = {row["action"]: row for row in rows}
    assert by_action["stairs"]["compared_2"] is False
    assert by_action["stairs"]["responsibility_2"] is None
    assert by_action["street"]["lambda_max_2"] - by_action["street"]["lambda_min_2"] == pytest.approx(
        by_action["lawn"]["action_value_2"] - by_action["street"]["action_value_2"]
    )
    table = list(
        csv.DictReader(
            io.StringIO(said("factors", "example:delivery", "-p", "safest", "-p", "fastest", "--format", "csv"))
        )
    )
    assert list(table[0]) == keys
    assert [row["compared_2"] for row in table] == [str(row["compared_2"]).lower() for row in rows]
    assert "compared_2" in said("factors", "example:delivery", "-p", "safest", "-p", "fastest").splitlines()[0]


def test_parquet_has_the_further_columns(said, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    said("factors", "example:delivery", "-p", "safest", "-p", "fastest", "--output", tmp_path / "factors.parquet")
    table = parquet.read_table(tmp_path / "factors.parquet")
    assert table.column_names == [*KEYS, *(f"{name}_2" for name in FURTHER)]
    assert table.column("compared_2").to_pylist()[:2] == [True, True]


def test_a_mission_is_asked_about_by_what_must_be_remembered(said, document):
    wanted = ("explain", "example:paper-5x5", "-p", 'Pmax=? [F<=9 "destination"]')
    text = said(*wanted, "--state", "grid 10, 8 steps left", "--rather-than", "south")
    assert text.startswith(
        "We move east rather than south at grid 10, 8 steps left, because it leads to a route more likely"
    )
    told = document(*wanted)
    assert told["unfolded"]["states"] == 25
    assert told["unfolded"]["memories"] >= 10
    assert told["model"]["states"] > 25
    by_number = document(*wanted, "--state", told["route"][1], "--kind", "naive-state")
    assert by_number["steps"][0]["state_name"].endswith("8 steps left")


def test_a_policy_of_the_model_is_followed_through_a_mission(said, tmp_path):
    policy = {str(state): "south" for state in (5, 10)} | {"15": "south", "20": "east", "21": "east", "22": "east"}
    (tmp_path / "policy.json").write_text(
        json.dumps(policy | {"23": "east", "24": "north", "19": "north", "14": "north", "9": "north"})
    )
    text = said(
        "explain",
        "example:paper-5x5",
        "-p",
        'Pmax=? [F<=9 "destination"]',
        "--policy",
        tmp_path / "policy.json",
        "--kind",
        "responsibility",
    )
    assert text.startswith("We move south at grid 5, 9 steps left, ")


def test_a_discounted_plan_has_no_goal(said):
    text = said("explain", "example:paper-5x5", "-p", 'R{"distance"}min=? [C]', "--discount", "0.9")
    assert "arrive" not in text
    assert text.endswith(".\n")
