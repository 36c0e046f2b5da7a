"""The paper's map through the command line: its sentences to the letter, its numbers to the digit printed."""

from __future__ import annotations

import pytest

from ratherthan.apps.columns import KEYS

SOURCE = "example:paper-5x5"
TEXTS = {
    ("--kind", "none"): "",
    ("--kind", "naive-state", "--state", "10"): "We move east at grid 10.",
    ("--kind", "responsibility", "--state", "10"): ("We move east at grid 10 because it leads to the shortest route."),
    ("--kind", "constrictive", "--state", "10"): (
        "We move east at grid 10 because it leads to the most flexible future route."
    ),
    ("--kind", "naive-path"): (
        "First, we move south at grid 5. Next, we move east at grid 10. Then, we move east at grid 11. "
        "Next, we move north at grid 12. Then, we move east at grid 7. Next, we move north at grid 8. "
        "Finally, we move east at grid 3."
    ),
    ("--kind", "selective"): (
        "First, we move south at critical grid 5. Then, we move east at critical grid 10. "
        "Next, we move north at critical grid 12. Finally, we move east at critical grid 7. "
        "All other decisions result in equivalent routes."
    ),
    ("--kind", "contrastive"): (
        "First, we move south at critical grid 5 because it leads to the shortest and most flexible future route. "
        "Then, we move east at critical grid 10 because it leads to the shortest and most flexible future route. "
        "Next, we move north at critical grid 12 because it leads to the shortest route. "
        "Finally, we move east at critical grid 7 because it leads to the shortest route. "
        "All other decisions result in equivalent routes."
    ),
    ("--rather-than", "south", "--state", "10"): (
        "We move east rather than south at grid 10 because it leads to a shorter route (6.7 instead of 10.7) "
        "and leaves more decisions open (4 instead of 2)."
    ),
}
TEXTS[()] = TEXTS["--kind", "contrastive"]
TEXTS["--scope", "route", "--factors", "selectiveness"] = TEXTS["--kind", "selective"]
TEXTS["--scope", "state", "--factors", "", "--state", "10"] = TEXTS["--kind", "naive-state", "--state", "10"]


@pytest.mark.parametrize("options", TEXTS, ids=" ".join)
def test_every_sentence_of_the_paper_comes_out_to_the_letter(said, options):
    text = TEXTS[options]
    assert said("explain", SOURCE, *options) == (text + "\n" if text else "")


@pytest.mark.parametrize("options", TEXTS, ids=" ".join)
def test_the_json_document_carries_the_same_text(document, options):
    assert document("explain", SOURCE, *options)["text"] == TEXTS[options]


@pytest.fixture
def rows(document):
    table = document("factors", SOURCE, "--constrictiveness", "all")["rows"]
    return {(row["state"], row["action"]): row for row in table}


def test_the_table_has_a_row_per_choice_in_the_models_order_and_keys_in_theirs(document):
    table = document("factors", SOURCE)["rows"]
    assert len(table) == 31
    assert [row["choice"] for row in table] == list(range(31))
    assert all(tuple(row) == KEYS for row in table)
    states = [row["state"] for row in table]
    assert states == sorted(states)
    assert [(row["state"], row["action"]) for row in table if row["state"] in (7, 10, 14)] == [
        *((7, "east"), (7, "north")),
        *((10, "east"), (10, "south")),
        *((14, "north"), (14, "west")),
    ]


def test_values_impacts_and_counts_are_the_papers(rows):
    for state, action, impact, value in [(10, "east", 5.667, 6.667), (10, "south", 9.667, 10.667)]:
        assert rows[state, action]["impact"] == pytest.approx(impact, abs=5e-4)
        assert rows[state, action]["action_value"] == pytest.approx(value, abs=5e-4)
    for state, value in [(10, 6.667), (11, 5.556), (15, 10.0)]:
        least = min(row["action_value"] for (s, _), row in rows.items() if s == state)
        assert least == pytest.approx(value, abs=5e-4)
    counts = {(10, "south"): 2, (10, "east"): 4, (5, "south"): 8, (12, "north"): 2, (12, "south"): 2, (7, "east"): 0}
    assert {key: rows[key]["constrictiveness"] for key in counts} == counts
    assert rows[10, "south"]["responsibility"] == pytest.approx(4, abs=1e-9)
    assert rows[10, "east"]["responsibility"] == 0
    assert {s for (s, _), row in rows.items() if row["critical"]} == {5, 7, 10, 12, 14}


def test_infinities_are_words_in_json(rows):
    for key in [(5, "north"), (7, "north"), (14, "west")]:
        row = rows[key]
        assert [row[name] for name in ("action_value", "lower", "upper", "lambda_max")] == ["inf"] * 4
        assert row["critical"] is True
    assert rows[0, "stay"]["responsibility"] == 0


def test_bounds_hold_the_action_value_and_are_tight(rows):
    for row in rows.values():
        if row["action_value"] != "inf":
            assert row["lower"] <= row["action_value"] <= row["upper"]
            assert row["upper"] - row["lower"] <= 1e-9 * max(1, row["upper"])


def test_taken_is_the_policy(rows):
    for state in range(25):
        assert sum(row["taken"] for (s, _), row in rows.items() if s == state) == 1
    assert rows[5, "south"]["taken"]
    assert not rows[5, "north"]["taken"]


def test_constrictiveness_is_given_on_the_route_and_where_it_is_asked_for_and_null_elsewhere(document):
    def counted(*options):
        table = document("factors", SOURCE, *options)["rows"]
        return {row["state"] for row in table if row["constrictiveness"] is not None}

    route = {5, 10, 11, 12, 7, 8, 3, 4}
    assert counted() == route
    assert counted("--state", "14", "--state", "15") == route | {14, 15}
    assert counted("--constrictiveness", "all") == set(range(25))


def test_the_value_is_solved_with_bounds(document):
    answer = document("solve", SOURCE, "--start", "10")
    assert list(answer) == [
        *("value", "lower", "upper", "states", "choices", "branches", "outcome", "message", "engine")
    ]
    assert answer["value"] == pytest.approx(20 / 3)
    assert answer["lower"] <= 20 / 3 <= answer["upper"]
    assert (answer["states"], answer["choices"], answer["branches"]) == (25, 31, 56)
    assert answer["outcome"] == "certified"


def test_the_explanation_lists_its_steps_and_its_closing(document):
    answer = document("explain", SOURCE)
    assert answer["route"] == [5, 10, 11, 12, 7, 8, 3, 4]
    assert answer["start"] == 5
    assert [step["state"] for step in answer["steps"] if step["critical"]] == [5, 10, 12, 7]
    assert answer["route_probability"] == 1
    assert answer["arrival_probability"] == 1
    assert answer["closing"] == {"printed": True, "largest_difference": 0, "off_route": 0, "off_route_open": 0}
    assert {"version", "source", "property", "kind", "alpha"} <= set(answer)


def test_other_starts_have_the_papers_routes(document, said):
    assert len(document("explain", SOURCE, "--state", "15")["steps"]) == 9
    assert said("explain", SOURCE, "--start", "4") == "We are already there.\n"
    assert said("explain", SOURCE, "--start", "13").startswith("There is no way to arrive")
