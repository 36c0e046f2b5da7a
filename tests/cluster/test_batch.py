"""What must hold of a table of missions, whoever answers them, and however often they are interrupted."""

from __future__ import annotations

import csv
import json
import signal
from pathlib import Path

import pytest

import ratherthan as rt
from ratherthan.cluster import answering, explain_many
from ratherthan.errors import MissingExtraError, SourceError
from ratherthan.model.watch import Limits

ROWS = [
    {"id": "route", "source": "example:paper-5x5", "tag_team": "red"},
    {"id": "why not", "source": "example:paper-5x5", "state": "10", "rather_than": "south"},
    {"id": "wrong action", "source": "example:paper-5x5", "state": "10", "rather_than": "west"},
    {"id": "no model", "source": "example:nowhere"},
    {"id": "further", "source": "example:pedestrians", "state": "24", "rather_than": "north", "also": "risk"},
    {"id": "start", "source": "example:paper-5x5", "start": "15", "kind": "selective"},
    {
        "id": "two levels",
        "source": "example:delivery",
        "property": '["safest", "R{\\"time\\"}min=? [F \\"delivered\\"]"]',
    },
    {"id": "no file", "source": "missing.umb"},
]


@pytest.fixture
def table(tmp_path, monkeypatch):
    """Write rows as a table and return its name."""
    monkeypatch.chdir(tmp_path)

    def write(rows=ROWS, name="missions.csv"):
        path = tmp_path / name
        if name.endswith(".csv"):
            columns = list(dict.fromkeys(column for row in rows for column in row))
            with path.open("w", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, columns)
                writer.writeheader()
                writer.writerows(rows)
        else:
            path.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
        return str(path)

    return write


def without_times(path):
    """Return the rows of a table of results without how long they took."""
    with Path(path).open(newline="", encoding="utf-8") as file:
        return [{key: cell for key, cell in row.items() if key != "seconds"} for row in csv.DictReader(file)]


MAP = """type octile
height 3
width 9
map
.........
.@@@@@@@.
.........
"""


def test_rows_drive_on_maps_as_explain_does(table, tmp_path):
    (tmp_path / "yard.map").write_text(MAP, encoding="ascii")
    rows = [
        {
            "id": "far",
            "source": "yard.map",
            "start": "0,1",
            "goal": "8,1",
            "slip": "0",
            "at_most": "1",
            "rank": "place",
        },
        {"id": "near", "source": "yard.map", "start": "7,0", "goal": "8,1", "slip": "0"},
        {"id": "four", "source": "yard.map", "start": "7,0", "goal": "8,1", "slip": "0", "directions": "4"},
        {"id": "no map", "source": "example:paper-5x5", "goal": "8,1"},
    ]
    found = explain_many(table(rows), workers=1)
    far, near, four, stranger = found.rows
    problem = rt.read("yard.map", start="0,1", goal="8,1", slip=0.0)
    asked = rt.explain(rt.solve(problem), at_most=1, ranking="place")
    assert far["text"] == rt.narrate(asked)
    assert far["value"] == pytest.approx(10.0)
    assert near["value"] == pytest.approx(2.0)  # no corner is cut
    assert four["value"] == pytest.approx(2.0)
    assert stranger["status"] == "failed"
    assert "Only a map of cells" in stranger["error"]


def test_a_row_that_reaches_a_limit_fails_alone(table, monkeypatch):
    rows = [
        {"id": "quick", "source": "example:paper-5x5"},
        {"id": "fine", "source": "example:paper-5x5", "precision": 2},
    ]
    limited = explain_many(table(rows), workers=1, limits=Limits(seconds=1e-6))
    assert [row["status"] for row in limited.rows] == ["failed", "failed"]
    assert "time limit" in limited.rows[0]["error"]
    assert limited.faults >= 1
    free = explain_many(table(rows), workers=1, limits=Limits(seconds=3600.0))
    assert [row["status"] for row in free.rows] == ["answered", "failed"]
    assert "precision must lie between 0 and 1" in free.rows[1]["error"]


def test_a_row_says_what_the_package_says(table, tmp_path):
    found = explain_many(table(), tmp_path / "results.csv", workers=1)
    rows = {row["id"]: row for row in found.rows}
    solution = rt.solve(rt.read("example:paper-5x5"))
    assert rows["route"]["text"] == rt.narrate(rt.explain(solution))
    assert rows["why not"]["text"] == rt.narrate(rt.explain(solution, state=10, rather_than="south"))
    assert rows["start"]["text"] == rt.narrate(rt.explain(solution, "selective", state=15))
    town = rt.solve(rt.read("example:pedestrians"))
    assert rows["further"]["text"] == rt.narrate(rt.explain(town, state=24, rather_than="north", also="risk"))
    assert rows["route"]["tag_team"] == "red"
    assert rows["route"]["lower"] <= rows["route"]["value"] <= rows["route"]["upper"]
    assert rows["route"]["outcome"] == "certified"


def test_a_failed_row_is_told_and_the_others_are_done(table, tmp_path):
    found = explain_many(table(), tmp_path / "results.csv", workers=1)
    assert [row["id"] for row in found.rows] == [row["id"] for row in ROWS]
    failed = {row["id"]: row["error"] for row in found.failed}
    assert set(failed) == {"wrong action", "no model", "no file"}
    assert "one of east, south" in failed["wrong action"]
    assert "missing.umb" in failed["no file"]
    assert found.faults == 0


def test_every_form_of_table_gives_the_same_rows(table, tmp_path):
    explain_many(table(), tmp_path / "a.csv", workers=1)
    explain_many(table(name="missions.jsonl"), tmp_path / "b.csv", workers=1)
    assert without_times(tmp_path / "a.csv") == without_times(tmp_path / "b.csv")
    explain_many(ROWS, tmp_path / "c.jsonl", workers=1)
    lines = [json.loads(line) for line in (tmp_path / "c.jsonl").read_text(encoding="utf-8").splitlines()]
    texts = [line["text"] or "" for line in lines]
    assert texts == [row["text"] for row in without_times(tmp_path / "a.csv")]


def test_parquet_goes_in_and_out(table, tmp_path):
    pa = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    columns = list(dict.fromkeys(column for row in ROWS for column in row))
    parquet.write_table(
        pa.table({column: [row.get(column) for row in ROWS] for column in columns}), tmp_path / "missions.parquet"
    )
    explain_many(tmp_path / "missions.parquet", tmp_path / "results.parquet", workers=1)
    found = parquet.read_table(tmp_path / "results.parquet").to_pylist()
    plain = explain_many(ROWS, workers=1).rows
    assert [row["text"] for row in found] == [row["text"] for row in plain]
    assert [row["value"] for row in found] == [row["value"] for row in plain]


class Interruption(KeyboardInterrupt):
    """Somebody presses Ctrl-C."""


@pytest.mark.parametrize("after", [1, 2, 4, 7])
def test_an_interrupted_run_goes_on_where_it_was(after, table, tmp_path):
    whole, parts = tmp_path / "whole.csv", tmp_path / "parts.csv"
    missions = table()
    explain_many(missions, whole, workers=1)
    told = []

    def interrupt(text):
        told.append(text)
        if len(told) == after:
            raise Interruption

    with pytest.raises(Interruption):
        explain_many(missions, parts, workers=1, tell=interrupt)
    assert not parts.exists()
    with pytest.raises(SourceError, match="--resume"):
        explain_many(missions, parts, workers=1)
    notes, again = [], []
    explain_many(missions, parts, workers=1, resume=True, note=notes.append, tell=again.append)
    assert without_times(whole) == without_times(parts)
    answered = int(notes[0].split()[0])
    assert len(again) == len(ROWS) - answered
    assert not (tmp_path / "parts.csv.journal").exists()


def test_a_line_that_was_cut_off_is_done_again(table, tmp_path):
    missions = table()
    with pytest.raises(Interruption):
        explain_many(missions, tmp_path / "results.csv", workers=1, tell=lambda _: interrupt_at_third())
    journal = tmp_path / "results.csv.journal"
    journal.write_bytes(journal.read_bytes()[:-9])
    explain_many(missions, tmp_path / "results.csv", workers=1, resume=True)
    explain_many(missions, tmp_path / "whole.csv", workers=1)
    assert without_times(tmp_path / "results.csv") == without_times(tmp_path / "whole.csv")


def interrupt_at_third(calls=[]):  # noqa: B006 - counts over calls
    calls.append(0)
    if len(calls) == 3:
        raise Interruption


def test_a_run_goes_on_only_with_the_same_missions_and_models(table, tmp_path):
    rt.write(rt.read("example:paper-5x5"), tmp_path / "town.npz")
    rows = [{"source": "town.npz", "state": str(state), "kind": "naive-state"} for state in (5, 10, 11)]
    missions = table(rows)

    def interrupt(_):
        raise Interruption

    with pytest.raises(Interruption):
        explain_many(missions, tmp_path / "results.csv", workers=1, tell=interrupt)
    with pytest.raises(SourceError, match="table has changed"):
        explain_many(table(rows[:2], "other.csv"), tmp_path / "results.csv", workers=1, resume=True)
    rt.write(rt.read("example:office"), tmp_path / "town.npz")
    with pytest.raises(SourceError, match=r"town.npz.*has changed"):
        explain_many(missions, tmp_path / "results.csv", workers=1, resume=True)


def test_documents_can_be_verified(table, tmp_path):
    found = explain_many(table(ROWS[:2]), tmp_path / "results.csv", workers=1, documents=tmp_path / "documents")
    problem = rt.read("example:paper-5x5")
    for row in found.rows:
        explanation = rt.from_json(Path(row["document"]).read_text(encoding="utf-8"))
        assert rt.narrate(explanation) == row["text"]
        assert rt.verify(row["document"], problem).holds


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ({"sorce": "example:office"}, "Did you mean 'source'"),
        ({"source": "example:office", "colour": "red"}, "tag_colour"),
        ({"source": "example:office", "rather-than": "a", "rather_than": "b"}, "two for 'rather_than'"),
        ({"source": "", "state": "3"}, "row 1"),
        ({"source": "example:office", "alpha": "much"}, "a number"),
        ({"source": "example:office", "detail": "perhaps"}, "true or false"),
        ({"source": "example:office", "horizon": "-1"}, "whole number"),
        ({"source": "example:office", "property": "[1, 2]"}, "texts"),
        ({"source": "example:office", "impact": "q"}, "one of action-value, omega"),
    ],
)
def test_a_table_that_cannot_be_meant_is_refused(row, words, table):
    with pytest.raises(SourceError, match=words.replace("[", r"\[")):
        explain_many(table([row]), workers=1)


def test_columns_may_be_spelled_as_options_are(table):
    rows = [{"source": "example:paper-5x5", "--state": 10, "rather-than": "south"}]
    assert explain_many(rows, workers=1).rows[0]["text"].startswith("We move east rather than south")


def test_a_name_may_not_come_twice(table):
    with pytest.raises(SourceError, match="rows 1 and 2"):
        explain_many(table([{"id": "a", "source": "example:office"}] * 2), workers=1)
    with pytest.raises(SourceError, match="must have rows"):
        explain_many([], workers=1)


@pytest.mark.parametrize("text", ["a,a\n1,2\n", "source\n1,2\n", '"source\n'])
def test_a_broken_table_is_refused(text, tmp_path):
    path = tmp_path / "missions.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SourceError):
        explain_many(path, workers=1)


def test_a_model_is_read_and_solved_once_for_all_its_rows(table, monkeypatch):
    calls = []
    solved = answering._solved
    monkeypatch.setattr(answering, "_solved", lambda mission: calls.append(mission.number) or solved(mission))
    answering._opened.clear()
    rows = [
        {"source": f"example:{name}", "state": str(state), "kind": "naive-state"}
        for state in (3, 5, 7)
        for name in ("office", "paper-5x5")
    ]
    explain_many(table(rows), workers=1)
    assert len(calls) == 2


def test_without_the_engine_one_process_does_it(table, monkeypatch):
    monkeypatch.setattr("ratherthan.cluster.engine.is_there", lambda: False)
    notes = []
    found = explain_many(table(), workers=2, note=notes.append)
    assert len(found.rows) == len(ROWS)
    assert "ratherthan[cluster]" in notes[0]
    with pytest.raises(MissingExtraError):
        explain_many(table(), cluster="tcp://127.0.0.1:1")


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="needs limits of the size of files")
def test_a_full_disk_is_told_with_the_file_and_the_run_goes_on_when_there_is_room(table):
    import resource

    answering._opened.clear()
    missions = table([{"source": "example:paper-5x5", "state": "10", "id": str(k)} for k in range(40)])
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    heard = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, before[1]))
    try:
        with pytest.raises(
            SourceError, match=r"results\.csv\.journal' must be writable.*Make room and go on by --resume"
        ):
            explain_many(missions, "results.csv", workers=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, heard)
    assert not Path("results.csv").exists()
    notes = []
    found = explain_many(missions, "results.csv", workers=1, resume=True, note=notes.append)
    assert len(found.rows) == 40
    assert not found.failed
    assert notes[0].endswith(" of 40 missions are done already.")
    assert not notes[0].startswith("0 ")
    assert not Path("results.csv.journal").exists()
