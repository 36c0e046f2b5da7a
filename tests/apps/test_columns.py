"""Columns made for all rows at once agree with the plain functions that make one."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ratherthan as rt
from ratherthan.apps import tables
from ratherthan.apps.columns import Column, action_words, blocks, state_names

ACTIONS = ("go", "", "choice 1", "stay", "go (2)")


def rows_of(choices: list[int], **parts: object) -> rt.MDP:
    """A model in which every choice stays where it is, with so many choices per state."""
    total = sum(choices)
    offsets = np.concatenate([[0], np.cumsum(choices)])
    return rt.MDP(
        state_to_choices=offsets,
        choice_to_branches=np.arange(total + 1),
        branch_to_target=np.repeat(np.arange(len(choices)), choices),
        branch_to_probability=np.ones(total),
        initial=np.array([0]),
        **parts,
    )


def shown_actions(mdp: rt.MDP) -> list[str]:
    """The names that the columns hold."""
    codes, words = action_words(mdp)
    return [words[code] for code in codes.tolist()]


@given(st.lists(st.lists(st.integers(-1, len(ACTIONS) - 1), min_size=1, max_size=6), min_size=1, max_size=6))
def test_action_names_of_all_choices_are_those_of_each(actions):
    mdp = rows_of(
        [len(own) for own in actions], choice_to_action=np.array([a for own in actions for a in own]), actions=ACTIONS
    )
    assert shown_actions(mdp) == [mdp.action_name(choice) for choice in range(mdp.choices)]


def test_action_names_without_any_names_are_positions():
    mdp = rows_of([2, 1])
    assert shown_actions(mdp) == ["choice 0", "choice 1", "choice 0"]


VARIABLES = {
    "x": np.array([3, -1, 0]),
    "busy": np.array([True, False, True]),
    "load": np.array([0.5, 1e-9, 3.0]),
    "where": np.array(["hall", "", "a, b"], dtype=object),
}


@pytest.mark.parametrize(
    "names",
    [
        rt.StateNames(count=3),
        rt.StateNames(count=3, strings=["a", "b, c", "ü"]),
        rt.StateNames(count=3, variables=VARIABLES),
        rt.StateNames(count=3, variables={"x": VARIABLES["x"]}),
    ],
)
def test_state_names_of_many_are_those_of_each(names):
    states = np.array([2, 0, 0, 1])
    assert state_names(names, states) == [names[int(state)] for state in states]
    assert state_names(names, states[:0]) == []


def test_blocks_cover_every_row_once():
    for count in (0, 1, 5, 6, 7):
        covered = [row for first, last in blocks(count, 3) for row in range(first, last)]
        assert covered == list(range(count))


@pytest.fixture
def columns():
    """The columns of a few thousand rows: more than one block."""
    problem = rt.Problem(
        mdp=rows_of(
            [2] * 3000,
            labels={"goal": np.arange(3000) == 7},
            rewards={"cost": rt.Reward(choice=np.linspace(0, 1, 6000))},
        ),
    )
    from ratherthan.apps.columns import factor_columns

    solution = rt.solve(problem)
    return factor_columns(
        rt.Factors(solution=solution, asked=rt.Question(kind="x", scope="route", factors=frozenset())), [7]
    )


def test_every_form_of_a_long_table_has_every_row(columns):
    rows = json.loads(b"".join(tables.json_parts(columns)))["rows"]
    assert [row["choice"] for row in rows] == list(range(6000))
    assert b"".join(tables.csv_parts(columns)).count(b"\n") == 6001
    assert "".join(tables.table_parts(columns)).count("\n") == 6001


def test_null_is_null_and_open_where_criticality_is():
    column = Column(values=np.array([True, False, False]), null=np.array([False, False, True]))
    assert column.rows(0, 3) == [True, False, None]
    assert [tables.shown(value, "critical") for value in column.rows(0, 3)] == ["yes", "no", "open"]
    assert tables.shown(None, "constrictiveness") == ""
