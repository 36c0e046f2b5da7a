"""An export is tidy, complete, safe to open, and names nobody."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import pytest
from apps.study.designs import small_design
from apps.study.server.visitors import in_phase

from ratherthan.apps.study.server.archive import design_of, text_of
from ratherthan.apps.study.server.exporting import tables_of, written
from ratherthan.apps.study.server.opening import existing


def exported(database: str, folder: Any) -> tuple[list[dict[str, str]], list[dict[str, str]], dict[str, Any]]:
    with existing(database) as (connection, design):
        facts = written(connection, design, folder)
    tables = [
        list(csv.DictReader(io.StringIO((folder / f"{name}.csv").read_text(encoding="utf-8"), newline="")))
        for name in ("observations", "participants")
    ]
    return tables[0], tables[1], facts


@pytest.fixture
def several(database, served, visitor, tmp_path):
    """One who finished, one on the way, one who came and went, one who failed the comprehension check at first."""
    design = small_design(tmp_path, maps=1)
    study, address = served(design, database)
    done = visitor(study, address, {"PROLIFIC_PID": "VERYSECRET", "STUDY_ID": "s", "SESSION_ID": "ALSOSECRET"})
    done.walk(in_phase("about"))
    text = next(record["name"] for record in done.told["screen"]["records"] if record["type"] == "text")
    done.told = done.post({**done.values(), text: '=HYPERLINK("http://evil")\nand "more", 漢字'}).json()
    visitor(study, address).walk(in_phase("trial"))
    visitor(study, address).enter()
    wrong = visitor(study, address)
    wrong.walk(in_phase("comprehension"))
    name = wrong.told["screen"]["records"][0]["name"]
    options = [option["value"] for option in wrong.told["screen"]["records"][0]["options"]]
    bad = {**wrong.values(), name: next(one for one in options if one != wrong.right[name])}
    wrong.told = wrong.post(bad).json()
    wrong.step()
    return study, done, text


def test_a_row_per_observation_with_all_that_was_answered(several, database, tmp_path):
    study, done, _ = several
    observed, known, facts = exported(database, tmp_path / "out")
    assert len(known) == 4
    assert sorted(row["state"] for row in known) == ["finished", "running", "running", "running"]
    assert facts["participants"] == 4
    assert facts["observations"] == len(observed)
    (person,) = [row["participant"] for row in known if row["state"] == "finished"]
    own = {(row["screen"], row["item"]): row for row in observed if row["participant"] == person}
    for screen, values in done.acknowledged.items():
        for name, value in values.items():
            assert own[screen, name]["value"] == str(value)
        assert float(own[screen, "time"]["value"]) >= 0.5
    keys = [(row["participant"], row["screen"], row["item"]) for row in observed]
    assert len(set(keys)) == len(keys)
    trials = [row for row in own.values() if row["phase"] == "trial" and row["item"] == "understanding"]
    assert sorted(int(row["kind_place"]) for row in trials) == list(range(1, 8))
    for row in trials:
        stimulus = study.design.stimuli[row["map"], row["kind"]]
        assert (row["words"], row["sentences"]) == (str(stimulus.words), str(stimulus.sentences))
        assert row["label"]
    for row in own.values():
        if row["item"] == "preferred":
            assert row["value"] in row["options"].split("|")


def test_checks_say_whether_they_were_right_and_wrong_tries_are_kept_apart(several, database, tmp_path):
    observed, known, _ = exported(database, tmp_path / "out")
    tries = [row for row in observed if row["screen"] == "comprehension-try-1"]
    assert {row["correct"] for row in tries} == {"true", "false"} or {row["correct"] for row in tries} == {"false"}
    (person,) = {row["participant"] for row in tries}
    again = [row for row in observed if row["screen"] == "comprehension" and row["participant"] == person]
    assert {row["correct"] for row in again if row["correct"]} == {"true"}
    tried = {row["participant"]: row["comprehension_tries"] for row in known}
    assert tried[person] == "2"


def test_an_export_names_nobody(several, database, tmp_path):
    _, done, _ = several
    exported(database, tmp_path / "out")
    held = b"".join(path.read_bytes() for path in (tmp_path / "out").iterdir())
    for secret in ("VERYSECRET", "ALSOSECRET", done.token.split(".")[0], done.told["withdrawal_code"]):
        assert secret.encode() not in held


def test_cells_that_look_like_formulas_are_disarmed_in_csv_alone(several, database, tmp_path):
    import pyarrow.parquet as pq

    _, _, text = several
    observed, _, _ = exported(database, tmp_path / "out")
    (cell,) = [row["value"] for row in observed if row["item"] == text]
    assert cell == '\'=HYPERLINK("http://evil")\nand "more", 漢字'
    table = pq.read_table(tmp_path / "out" / "observations.parquet").to_pylist()
    (plain,) = [row["value"] for row in table if row["item"] == text]
    assert plain == cell[1:]
    assert len(table) == len(observed)
    for row, other in zip(observed, table, strict=True):
        assert row["participant"] == other["participant"]
        assert row["number"] == str(other["number"])


def test_every_column_and_item_is_in_the_codebook(several, database, tmp_path):
    observed, known, _ = exported(database, tmp_path / "out")
    text = (tmp_path / "out" / "codebook.csv").read_text(encoding="utf-8")
    book = list(csv.DictReader(io.StringIO(text, newline="")))
    assert {row["name"] for row in book if row["table"] == "observations"} == set(observed[0])
    assert {row["name"] for row in book if row["table"] == "participants"} == set(known[0])
    assert {row["item"] for row in observed} <= {row["name"] for row in book if row["table"] == "item"}
    page = (tmp_path / "out" / "codebook.md").read_text(encoding="utf-8")
    assert all(row["name"].replace("_", "\\_") in page for row in book)


def test_numbers_of_participants_stay_the_same_from_export_to_export(several, database, tmp_path, visitor):
    study, *_ = several
    first = exported(database, tmp_path / "one")[1]
    with existing(database) as (connection, design):
        again, known, _ = tables_of(connection, design)
    assert known["participant"] == [row["participant"] for row in first]
    assert again["item"]
    del study


def test_an_empty_study_is_exported_as_empty_tables(design, database, served, tmp_path):
    served(design, database)
    observed, known, facts = exported(database, tmp_path / "out")
    assert observed == known == []
    assert facts["observations"] == 0
    assert (tmp_path / "out" / "observations.csv").read_text(encoding="utf-8").startswith("study,design,")


def test_simulated_studies_say_so_everywhere(design, tmp_path, served, visitor):
    database = str(tmp_path / "robots.sqlite3")
    study, address = served(design, database, simulated=True)
    visitor(study, address).walk()
    observed, known, facts = exported(database, tmp_path / "out")
    assert {row["simulated"] for row in (*observed, *known)} == {"true"}
    assert facts["simulated"] is True
    assert "robots" in (tmp_path / "out" / "codebook.md").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "out" / "study.json").read_text(encoding="utf-8"))["simulated"] is True


def test_a_design_survives_the_database(tmp_path):
    design = small_design(tmp_path)
    assert design_of(text_of(design)) == design
