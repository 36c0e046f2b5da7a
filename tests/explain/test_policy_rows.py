"""Rows of a policy as columns: they are spelled as the library spells them, and equal what they were made of."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.explain.policy_rows import BLOCK, PolicyRows

WHOLE = st.integers(0, 2**62)
ROWS = st.lists(st.tuples(WHOLE, WHOLE, st.floats(1e-300, 1.0) | st.sampled_from([1.0, 0.5, 1e-5])), max_size=40)


@given(ROWS)
def test_rows_are_spelled_as_the_library_spells_them(rows):
    spelled = PolicyRows.of(rows).spelled()
    assert spelled == json.dumps(rows, separators=(",", ":"))


@given(ROWS)
def test_columns_equal_the_rows_that_they_were_made_of(rows):
    columns = PolicyRows.of(rows)
    assert columns == tuple(rows)
    assert columns == PolicyRows.of(list(columns))
    assert hash(columns) == hash(PolicyRows.of(rows))
    assert len(columns) == len(rows)
    assert [columns[i] for i in range(len(rows))] == rows
    assert columns[1:3] == tuple(rows[1:3])


def test_many_rows_are_spelled_across_blocks():
    count = 2 * BLOCK + 7
    state = np.arange(count) * 37
    rows = PolicyRows(state=state, choice=10**6 - np.arange(count), share=np.where(state % 3 == 0, 1.0, 0.25))
    assert rows.spelled() == json.dumps(list(map(list, rows)), separators=(",", ":"))


def test_other_rows_are_spelled_too():
    rows = PolicyRows(state=np.array([-1]), choice=np.array([3]), share=np.array([1.0]))
    assert rows.spelled() == "[[-1,3,1.0]]"
    assert PolicyRows.of([]).spelled() == "[]"
    with pytest.raises(ValueError, match="not JSON compliant"):
        PolicyRows(state=np.array([1]), choice=np.array([3]), share=np.array([np.nan])).spelled()


@pytest.mark.parametrize("row", [[1.0, 2, 1.0], [1, True, 1.0], [1, 2, "1"], [1, 2, None]])
def test_a_row_of_other_things_is_refused(row):
    with pytest.raises(TypeError):
        PolicyRows.of([[0, 0, 1.0], row])
