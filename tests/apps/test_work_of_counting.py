"""What the command line says where counting everything would be more work than is granted."""

from __future__ import annotations

import json

import pytest

PAPER = "example:paper-5x5"
COUNTED = "constrictiveness"
GUESSED = ("constrictiveness_estimate", "constrictiveness_estimate_error")


def rows_of(result):
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)["rows"]


def asked(ask, *words):
    return ask("factors", PAPER, "--constrictiveness", "all", "--format", "json", *words)


def test_everything_is_counted_and_nothing_is_said_where_the_work_suffices(ask):
    result = asked(ask)
    assert result.stderr == ""
    assert all(row[COUNTED] is not None for row in rows_of(result))
    assert not set(GUESSED) & set(rows_of(result)[0])
    assert rows_of(asked(ask, "--work", "1")) == rows_of(result), "a granted amount that suffices changes no number"


@pytest.mark.parametrize("search", [[], ["--horizon", "2"], ["--toward", "goal"]])
def test_without_work_nothing_is_counted_and_that_is_said(ask, search):
    result = asked(ask, "--work", "0", *search)
    assert all(row[COUNTED] is None for row in rows_of(result))
    assert "0 of 31 choices" in result.stderr
    assert "--work 0" in result.stderr
    others = [{key: value for key, value in row.items() if key != COUNTED} for row in rows_of(result)]
    counted = [{key: value for key, value in row.items() if key != COUNTED} for row in rows_of(asked(ask, *search))]
    assert others == counted, "all other numbers stand"


def test_a_guess_stands_in_a_column_of_its_own_and_only_on_demand(ask):
    exact = rows_of(asked(ask))
    guessed = rows_of(asked(ask, "--work", "0", "--estimate"))
    assert all(row[COUNTED] is None for row in guessed)
    for row, true in zip(guessed, exact, strict=True):
        if row[GUESSED[0]] is not None:
            assert (row[GUESSED[0]], row[GUESSED[1]]) == (true[COUNTED], 0.0), "few decisions are known exactly"
    assert any(row[GUESSED[0]] is not None for row in guessed)
    assert "proves nothing" in asked(ask, "--work", "0", "--estimate").stderr
    needless = rows_of(asked(ask, "--estimate"))
    assert [row[COUNTED] for row in needless] == [row[COUNTED] for row in exact]
    assert all(row[key] is None for row in needless for key in GUESSED)


def test_the_columns_of_guesses_are_numbers_in_every_form(ask, tmp_path):
    table = ask("factors", PAPER, "--constrictiveness", "all", "--work", "0", "--estimate", "--format", "csv")
    assert table.stdout.splitlines()[0].endswith(",".join(GUESSED))
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = tmp_path / "factors.parquet"
    assert (
        ask(*("factors", PAPER, "--constrictiveness", "all", "--work", "0", "--estimate", "-o", str(path))).exit_code
        == 0
    )
    read = parquet.read_table(path)
    assert read.column(COUNTED).null_count == 31
    assert [str(read.schema.field(key).type) for key in GUESSED] == ["double", "double"]


@pytest.mark.parametrize("work", ["-1", "much", "1.5", "nan"])
def test_work_must_be_a_whole_number(ask, work):
    result = asked(ask, "--work", work)
    assert result.exit_code == 2
    assert work in result.stderr
    assert "Traceback" not in result.stderr
