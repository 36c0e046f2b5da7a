"""Tables spelled block by block say what the libraries for JSON and CSV say of every row."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ratherthan as rt
from ratherthan.apps import spelling, tables
from ratherthan.apps.columns import Column

TEXTS = st.text(alphabet=st.characters(codec="utf-8"), max_size=6) | st.sampled_from(
    ['a "b"', "c, d", "", "e\nf", "\r", "ü\x00"]
)


def json_value(value: object) -> object:
    """What JSON holds of a value."""
    if isinstance(value, float) and np.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


def plain_json(columns: dict[str, Column]) -> str:
    """The same table, row by row."""
    count = len(columns["state"].values)
    encode = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode
    rows = [
        encode({key: json_value(column.rows(row, row + 1)[0]) for key, column in columns.items()})
        for row in range(count)
    ]
    return '{"rows": [\n  ' + ",\n  ".join(rows) + "\n]}\n"


def plain_csv(columns: dict[str, Column]) -> str:
    """The same table, row by row."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\r\n")  # so that a carriage return is in quotation marks as well
    shown = {True: "true", False: "false"}
    writer.writerow(columns)
    for row in range(len(columns["state"].values)):
        values = [column.rows(row, row + 1)[0] for column in columns.values()]
        writer.writerow([shown[value] if isinstance(value, bool) else value for value in values])
    return buffer.getvalue()


@st.composite
def tables_of_columns(draw: st.DrawFn) -> dict[str, Column]:
    """Columns of every kind."""
    states, rows = draw(st.integers(1, 5)), draw(st.integers(1, 12))
    state = np.array(draw(st.lists(st.integers(0, states - 1), min_size=rows, max_size=rows)))
    values = st.sampled_from([0.1, 0.0, -0.0, 1e-9, 1e22, 123.456, np.inf, -np.inf, 2531.8636474288805])
    some = st.lists(st.booleans(), min_size=rows, max_size=rows).map(np.array)
    words = draw(st.lists(TEXTS, min_size=1, max_size=80))
    variables = {
        "x": np.array(draw(st.lists(st.integers(-3, 3), min_size=states, max_size=states))),
        'say "y"': np.array(draw(st.lists(TEXTS, min_size=states, max_size=states)), dtype=object),
    }
    kept = draw(st.lists(st.sampled_from(sorted(variables)), unique=True))
    strings = draw(st.none() | st.lists(TEXTS, min_size=states, max_size=states))
    names = rt.StateNames(
        count=states, strings=strings, variables={} if strings is not None else {key: variables[key] for key in kept}
    )
    return {
        "state": Column(values=state),
        "state_name": Column(values=state, names=names),
        "action": Column(
            values=np.array(draw(st.lists(st.integers(0, len(words) - 1), min_size=rows, max_size=rows))), words=words
        ),
        'a "value", %s': Column(
            values=np.array(draw(st.lists(values, min_size=rows, max_size=rows))), null=draw(st.none() | some)
        ),
        "constrictiveness": Column(
            values=np.array(draw(st.lists(st.integers(0, 10**6), min_size=rows, max_size=rows))), null=draw(some)
        ),
        "critical": Column(values=draw(some), null=draw(some)),
    }


@given(tables_of_columns(), st.sampled_from([1, 3, 1 << 14]), st.sampled_from([4, 1 << 26]))
def test_all_rows_are_spelled_as_one_by_one(columns, rows, room):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(spelling, "ROWS", rows)
        patch.setattr(spelling, "ROOM", room)
        assert b"".join(spelling.json_parts(columns)).decode() == plain_json(columns)
        found = b"".join(spelling.csv_parts(columns)).decode()
    rows_of = lambda text: list(csv.reader(io.StringIO(text, newline="")))  # noqa: E731 - said twice
    assert rows_of(found) == rows_of(plain_csv(columns))
    assert len(found) == len(plain_csv(columns)) - len(columns["state"].values) - 1  # no longer than it must be


def test_a_lone_surrogate_stays_an_escape():
    column = Column(values=np.array([0]), words=["\ud800"])
    assert b"\\ud800" in b"".join(spelling.json_parts({"state": Column(values=np.array([0])), "action": column}))


@pytest.mark.parametrize("parts", [spelling.json_parts, spelling.csv_parts])
def test_not_a_number_is_refused(parts):
    with pytest.raises(ValueError, match="Not a number"):
        list(parts({"state": Column(values=np.array([np.nan]))}))


@given(tables_of_columns())
def test_parquet_holds_the_same_rows(columns):
    parquet = pytest.importorskip("pyarrow.parquet")
    columns["impact"] = columns.pop('a "value", %s')
    data = b"".join(tables.parquet_parts(columns))
    found = parquet.read_table(io.BytesIO(data)).to_pydict()
    for key, column in columns.items():
        assert found[key] == column.rows(0, len(column.values)), key
