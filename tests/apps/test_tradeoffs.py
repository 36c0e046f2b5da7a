"""``ratherthan tradeoffs``: tables, sentences, documents and files of the plans between which there is a choice."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.model.mdp import Reward

PEDESTRIANS = ("tradeoffs", "example:pedestrians", "-p", "shortest", "--also", "safest")
TABLE = """\
plan  distance  risk  best for least distance + W * risk
1     8.75      2     W up to 2.778
2     13.75     0.2   W from 2.778 to 12.5
3     16.25     0     W from 12.5
1.8 less risk costs 5 more distance: plan 2 rather than plan 1; they part at grid 25: move south rather than east.
0.2 less risk costs 2.5 more distance: plan 3 rather than plan 2; they part at grid 24: move north rather than east.
"""


def test_the_three_plans_are_listed_with_their_weights_and_prices(said):
    assert said(*PEDESTRIANS) == TABLE


def test_without_more_said_each_other_reward_is_wanted_least(said):
    assert said("tradeoffs", "example:pedestrians") == TABLE
    assert said("tradeoffs", "example:pedestrians", "-p", "shortest", "-p", "safest") == TABLE


def test_a_bound_gives_the_best_plan_within_it_and_says_where_it_tosses_a_coin(said):
    lines = said(*PEDESTRIANS, "--at-most", "risk=1").splitlines()
    assert lines[4].split() == ["within", "11.53", "1"]
    assert lines[-2:] == [
        "With risk at most 1, the least distance is 11.53.",
        "At grid 25 it is left to chance: move east 44 % of the time and move south 56 % of the time.",
    ]
    assert (
        said(*PEDESTRIANS, "--at-most", "distance=12")
        .splitlines()[-2]
        .startswith("With distance at most 12, the least risk")
    )


def test_what_is_left_to_chance_at_many_states_is_counted():
    from ratherthan.narrate.tradeoffs import bound_lines

    problem = rt.read("example:pedestrians")
    found = rt.tradeoffs(problem, [problem.properties["shortest"], problem.properties["safest"]], bound={"risk": 1.0})
    many = replace(found, bounded=replace(found.bounded, coins=(1, 2, 3, 4)))
    assert bound_lines(many)[1:] == ["At 4 states it is left to chance."]


def test_what_is_not_proved_to_be_best_is_not_called_so():
    from ratherthan.narrate.tradeoffs import bound_lines

    problem = rt.read("example:pedestrians")
    found = rt.tradeoffs(problem, [problem.properties["shortest"], problem.properties["safest"]], bound={"risk": 1.0})
    unsure = replace(found, bounded=replace(found.bounded, best=11.0))
    assert bound_lines(unsure)[0] == "With risk at most 1, distance can be as little as 11.53, perhaps less."


def test_a_bound_that_no_plan_keeps_is_answered(said, document):
    assert said(*PEDESTRIANS, "--at-most", "distance=8").endswith(
        "No plan has distance at most 8: the least that there can be is 8.75.\n"
    )
    bounded = document(*PEDESTRIANS, "--at-most", "distance=8")["bounded"]
    assert (bounded["plan"], bounded["best"], bounded["coins"]) == (None, "inf", [])
    assert bounded["nearest"] == pytest.approx(8.75)


def test_the_document_has_all_numbers_with_bounds(document):
    found = document(*PEDESTRIANS, "--at-most", "risk=1")
    assert [entry["name"] for entry in found["objectives"]] == ["distance", "risk"]
    assert found["complete"] is True
    assert found["text"][:2] == TABLE.splitlines()[-2:]
    for plan in [*found["plans"], found["bounded"]["plan"]]:
        for values in plan["values"].values():
            assert values["lower"] <= values["value"] <= values["upper"]
            assert values["upper"] - values["lower"] <= 1e-9
    assert found["plans"][2]["weights"]["risk"] == {"from": pytest.approx(12.5), "to": "inf"}
    assert [(trade["from"], trade["to"]) for trade in found["trades"]] == [("1", "2"), ("2", "3")]
    assert [trade["partings"] for trade in found["trades"]] == [
        [{"state": 25, "state_name": "25", "from": "east", "to": "south"}],
        [{"state": 24, "state_name": "24", "from": "east", "to": "north"}],
    ]
    coin = found["bounded"]["coins"][0]
    assert coin["chances"] == {"east": pytest.approx(4 / 9), "south": pytest.approx(5 / 9)}
    assert found["bounded"]["best"] <= found["bounded"]["plan"]["values"]["distance"]["upper"]


def test_the_rows_are_those_of_the_plans(said):
    rows = list(csv.DictReader(io.StringIO(said(*PEDESTRIANS, "--at-most", "risk=1", "--format", "csv"))))
    assert [row["plan"] for row in rows] == ["1", "2", "3", "within"]
    assert [float(row["distance"]) for row in rows] == pytest.approx([8.75, 13.75, 16.25, 11.52777778])
    assert all(float(row["risk_lower"]) <= float(row["risk"]) <= float(row["risk_upper"]) for row in rows)
    assert (rows[2]["weight_risk_to"], rows[3]["weight_risk_to"]) == ("inf", "")


def test_every_plan_is_written_as_a_policy_that_has_the_values_that_were_told(document, said, tmp_path):
    folder = tmp_path / "plans"
    found = document(*PEDESTRIANS, "--at-most", "risk=1", "--policies", folder)
    plans = [*found["plans"], found["bounded"]["plan"]]
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        f"plan-{name}.json" for name in ("1", "2", "3", "within")
    )
    for plan in plans:
        for wish, name in (("shortest", "distance"), ("safest", "risk")):
            told = document("solve", "example:pedestrians", "-p", wish, "--policy", plan["policy"])
            assert told["value"] == pytest.approx(plan["values"][name]["value"], rel=1e-9, abs=1e-12)
    within = found["bounded"]["plan"]["policy"]
    assert "of the time" in said("explain", "example:pedestrians", "--policy", within)


def test_a_reward_to_gather_is_bounded_from_below(said, refused):
    wishes = ("-p", 'R{"distance"}min=? [Cdiscount=0.9]', "--also", 'R{"risk"}max=? [Cdiscount=0.9]')
    lines = said("tradeoffs", "example:pedestrians", *wishes, "--at-least", "risk=1.5").splitlines()
    assert lines[0].endswith("best for least distance - W * risk")
    assert lines[-3].startswith("0.5671 more risk costs 4.024 more distance")
    assert lines[-2].startswith("With risk at least 1.5, the least distance is ")
    assert "bound it with --at-least" in refused("tradeoffs", "example:pedestrians", *wishes, "--at-most", "risk=1")
    assert "bound it with --at-most" in refused("tradeoffs", "example:pedestrians", *wishes, "--at-least", "distance=1")


def test_steps_are_counted_in_words_of_their_own(said):
    wishes = ("-p", "safest", "--also", 'Tmin=? [F "destination"]')
    lines = said("tradeoffs", "example:pedestrians", *wishes, "--at-most", "steps=12").splitlines()
    assert (
        "2.5 fewer steps cost 0.2 more risk: plan 2 rather than plan 1; they part at grid 24: move east rather than north."
        in lines
    )
    assert any(line.startswith("With at most 12 steps, the least risk is ") for line in lines)
    swapped = ("-p", wishes[-1], "--also", "safest")
    assert "With risk at most 0.2, the fewest steps are 13.75." in said(
        "tradeoffs", "example:pedestrians", *swapped, "--at-most", "risk=0.2"
    )
    assert said("tradeoffs", "example:pedestrians", *wishes, "--at-most", "steps=8").endswith(
        "No plan has at most 8 steps: the fewest that there can be are 8.75.\n"
    )


def test_where_one_plan_is_best_in_everything_it_is_said(said):
    wishes = ("-p", "shortest", "--also", 'Tmin=? [F "destination"]')
    lines = said("tradeoffs", "example:pedestrians", *wishes).splitlines()
    assert lines[-1] == "Plan 1 is best in every objective: there is nothing to trade."
    assert lines[1].endswith("every W")


def test_where_no_plan_is_sure_to_arrive_it_is_said(said):
    assert said(*PEDESTRIANS, "--start", "36", "--at-most", "risk=1") == "No plan is sure to arrive from grid 36.\n"


def test_a_discounted_objective_is_traded_for_the_others_discounted_alike(document):
    found = document("tradeoffs", "example:pedestrians", "-p", 'R{"distance"}min=? [C]', "--discount", "0.9")
    assert [entry["property"] for entry in found["objectives"]] == [
        'R{"distance"}min=? [Cdiscount=0.9]',
        'R{"risk"}min=? [Cdiscount=0.9]',
    ]
    assert len(found["plans"]) == 3


def test_of_the_weights_only_what_is_proved_is_said(said):
    lines = said(*PEDESTRIANS, "--most", "2").splitlines()
    assert [line.split(maxsplit=3)[3] for line in lines[1:3]] == ["W = 0", "least risk alone"]
    steps = said(
        "tradeoffs", "example:pedestrians", "-p", "safest", "--also", 'Tmin=? [F "destination"]', "--most", "2"
    )
    assert "fewest steps alone" in steps
    assert "inf" not in steps


def test_a_plan_that_is_best_in_everything_is_found_on_a_map_where_both_ends_are_beaten(said, tmp_path):
    rows = ("S = . .", ". . . w", ". . . D")
    text = """property = 'R{"distance"}min=? [F "destination"]'
map = '''
%s
'''
[kinds]
w = "puddle"
[costs]
distance = {other = 1, highway = 3}
risk = {other = 0, puddle = 1}
"""
    (tmp_path / "map.roadmap").write_text(text % "\n".join(rows))
    lines = said("tradeoffs", tmp_path / "map.roadmap").splitlines()
    assert lines[1].split() == ["1", "5", "0", "every", "W"]
    assert lines[-1] == "Plan 1 is best in every objective: there is nothing to trade."


def test_the_discount_is_for_all_that_is_wanted(said, document, refused):
    distance, risk = 'R{"distance"}min=? [C]', 'R{"risk"}max=? [C]'
    source = ("example:pedestrians", "--discount", "0.9")
    found = document("tradeoffs", *source, "-p", distance, "--also", risk)
    assert [entry["property"] for entry in found["objectives"]] == [
        text.replace("[C]", "[Cdiscount=0.9]") for text in (distance, risk)
    ]
    assert "discounted risk" in said("explain", *source, "-p", distance, "--also", risk)
    assert "discounted risk" in said("explain", *source, "-p", "shortest", "--also", risk)
    for words in (("solve",), ("explain",), ("factors",), ("explain", "--also", "risk"), ("tradeoffs",)):
        assert "sum without end" in refused(words[0], *source, "-p", "shortest", *words[1:])
    assert "ratherthan solve" not in refused("explain", "example:pedestrians", "-p", "shortest", "--also", risk)


def test_when_more_plans_are_left_out_it_is_said(said):
    assert said(*PEDESTRIANS, "--most", "2").endswith(
        "2 less risk costs 7.5 more distance: plan 2 rather than plan 1; they part at grid 24: move north rather than east. "
        "There may be plans in between.\n"
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("tradeoffs", "example:paper-5x5"), "Give others with --also"),
        ((*PEDESTRIANS, "--at-most", "rsik=1"), "distance, risk, got 'rsik'"),
        ((*PEDESTRIANS, "--at-most", "risk"), "NAME=NUMBER"),
        ((*PEDESTRIANS, "--at-most", "risk=nan"), "NAME=NUMBER"),
        ((*PEDESTRIANS, "--at-most", "risk=1", "--at-least", "risk=0"), "--at-most or --at-least"),
        ((*PEDESTRIANS, "--also", "shortest"), "'distance' twice"),
        (("tradeoffs", "example:pedestrians", "-p", 'Pmax=? [F "crowd"]', "--also", "safest"), "totals of rewards"),
        (("tradeoffs", "example:pedestrians", "-p", 'P>=0.5 [F "crowd"]'), "best values"),
    ],
)
def test_what_cannot_be_answered_is_refused(refused, words, message):
    assert message in refused(*words)


def test_plans_go_to_a_folder_and_nowhere_else(refused, tmp_path):
    (tmp_path / "taken").write_text("")
    assert "folder" in refused(*PEDESTRIANS, "--policies", tmp_path / "taken")


def test_a_policy_of_a_model_without_names_is_written_and_read(tmp_path):
    from ratherthan.io.policy_write import write_policy

    mdp = rt.MDP(
        state_to_choices=np.array([0, 3, 4]),
        choice_to_branches=np.array([0, 1, 2, 3, 4]),
        branch_to_target=np.array([1, 1, 1, 1]),
        branch_to_probability=np.ones(4),
        choice_to_action=np.array([0, 0, -1, -1]),
        actions=("go",),
        rewards={"cost": Reward(choice=np.array([3.0, 2.0, 1.0, 0.0]))},
        initial=np.array([0]),
    )
    for chance in ([0, 1, 0, 1], [0.25, 0.25, 0.5, 1], [0, 0, 1, 0]):
        weights = np.array(chance, dtype=float)
        write_policy(rt.Policy(choice=np.array([-1, -1]), chance=weights), mdp, tmp_path / "policy.json")
        assert json.loads((tmp_path / "policy.json").read_text())
        assert rt.read_policy(tmp_path / "policy.json", mdp).weights(mdp).tolist()[:3] == chance[:3]
