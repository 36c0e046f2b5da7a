"""Exports of ours and tables of others: what is wrong in them is said, and the rest is kept."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from apps.study.analysis import exports

from ratherthan.apps.study.analysis.analyse import analysed, read_answers
from ratherthan.apps.study.analysis.excluding import Rules, excluded
from ratherthan.apps.study.analysis.foreign import read_foreign
from ratherthan.apps.study.analysis.meaning import contrasts_in, meaning_of
from ratherthan.apps.study.analysis.measuring import measured, planned
from ratherthan.apps.study.analysis.tables import number_in, read_table
from ratherthan.apps.study.analysis.tidy import read_tidy
from ratherthan.errors import QuestionError, RatherthanError, SourceError


@pytest.fixture
def rows():
    return exports.observations(12)


def table(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_bytes(text.encode(encoding))
    return path


def test_a_whole_export_is_read_without_a_word(rows, tmp_path):
    data = read_tidy(exports.write(rows, tmp_path))
    assert data.notes == ()
    assert data.kinds == exports.KINDS
    assert [m.name for m in data.measures] == ["understanding", "trust", "time"]
    assert [len(m.value) for m in data.measures] == [12 * 21] * 3
    assert data.measures[0].scale == (1.0, 2.0, 3.0, 4.0, 5.0)
    assert data.simulated
    assert len(data.choices) == 4
    assert data.words["contrastive"] == 75


def test_csv_and_parquet_hold_the_same(rows, tmp_path):
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    one = read_tidy(exports.write(rows, tmp_path / "csv"))
    (tmp_path / "parquet").mkdir()
    columns = {name: [row[name] for row in rows] for name in exports.COLUMNS}
    columns["simulated"] = [cell == "true" for cell in columns["simulated"]]
    parquet.write_table(pa.table(columns), tmp_path / "parquet" / "observations.parquet")
    other = read_tidy(tmp_path / "parquet")
    for a, b in zip(one.measures, other.measures, strict=True):
        assert np.array_equal(a.value, b.value)
        assert np.array_equal(a.person, b.person)
    assert one.persons == other.persons


def test_people_and_robots_are_never_mixed(rows, tmp_path):
    rows[5]["simulated"] = "false"
    with pytest.raises(SourceError, match="never analysed together"):
        read_tidy(exports.write(rows, tmp_path / "a"))
    rows[5]["simulated"] = "true"
    with pytest.raises(SourceError, match="never analysed together"):
        read_tidy(exports.write(rows, tmp_path / "b", study={"simulated": False}))
    rows[5]["simulated"] = "perhaps"
    with pytest.raises(SourceError, match="true or false"):
        read_tidy(exports.write(rows, tmp_path / "c"))


@pytest.mark.parametrize(
    "told",
    [
        {
            "kinds": [{"label": "no id"}, {"id": ["none"]}, 3],
            "items": [{"options": [{"value": None}, 3]}],
            "simulated": True,
        },
        {"kinds": 3, "items": "x", "title": {"a": 1}},
    ],
)
def test_what_the_export_tells_of_the_study_may_be_spoiled(told, rows, tmp_path):
    whole = read_tidy(exports.write(rows, tmp_path / "whole"))
    data = read_tidy(exports.write(rows, tmp_path / "spoiled", study=told))
    assert set(data.kinds) == set(whole.kinds)
    assert [len(measure.value) for measure in data.measures] == [len(measure.value) for measure in whole.measures]


def test_rows_twice_count_once_and_contradictions_are_said(rows, tmp_path):
    again = [dict(row) for row in rows[:4]]
    again[0]["value"] = "1" if rows[0]["value"] != "1" else "2"
    data = read_tidy(exports.write(rows + again, tmp_path))
    assert any("3 rows say again" in note for note in data.notes)
    assert any("1 rows contradict" in note for note in data.notes)
    assert len(data.measures[0].value) == 12 * 21
    first = data.measures[0].value[(data.measures[0].person == 0) & (data.measures[0].kind == 0)][0]
    assert first == float(rows[0]["value"])


def test_words_in_place_of_numbers_are_left_out(rows, tmp_path):
    ratings = [row for row in rows if row["item"] == "trust"]
    ratings[0]["value"], ratings[1]["value"], ratings[2]["value"] = "often", "", "1e999"
    data = read_tidy(exports.write(rows, tmp_path))
    assert any("2 cells hold no number that can be computed with (such as “often”)" in note for note in data.notes)
    assert any("1 cells are empty" in note for note in data.notes)
    assert len(next(m for m in data.measures if m.name == "trust").value) == 12 * 21 - 3
    assert analysed(data).measured[1].persons == 12


def test_times_of_nothing_are_left_out(rows, tmp_path):
    for row in [row for row in rows if row["item"] == "time"][:3]:
        row["value"] = "0"
    data = read_tidy(exports.write(rows, tmp_path))
    assert any("3 times" in note for note in data.notes)


def test_whoever_takes_consent_back_is_in_no_analysis(rows, tmp_path):
    for row in rows:
        if row["participant"] == "P0003":
            row["state"] = "withdrawn"
    data = read_tidy(exports.write(rows, tmp_path))
    gone = [person.name for person in data.persons].index("P0003")
    assert all(gone not in measure.person for measure in data.measures)
    assert all(gone not in votes.person for votes in data.choices)
    assert excluded(data, Rules(unfinished=True)).keep.sum() == 11


def test_rules_count_each_person_once(rows, tmp_path):
    for row in rows:
        if row["participant"] == "P0001":
            row["state"] = "dropped-out"
        if row["participant"] in ("P0001", "P0002") and row["phase"] == "attention":
            row["correct"] = "false"
        if row["participant"] in ("P0002", "P0004") and row["item"] == "time":
            row["value"] = "0.4"
    data = read_tidy(exports.write(rows, tmp_path))
    found = excluded(data, Rules())
    assert found.counts == {"state": 1, "checks": 1, "fast": 1, "empty": 0}
    assert found.keep.sum() == 9
    assert excluded(data, Rules(failed_checks=2, fastest=0.0, unfinished=True)).keep.all()
    results = analysed(data)
    assert len(results.everyone) == 3
    assert results.everyone[0].persons == 12


def test_who_answered_nothing_is_counted_too(rows, tmp_path):
    folder = exports.write(rows, tmp_path)
    (folder / "participants.csv").write_text("participant,state\nP0001,finished\nP0099,dropped-out\n", encoding="utf-8")
    data = read_tidy(folder)
    assert len(data.persons) == 13
    assert excluded(data, Rules()).states == {"dropped-out": 1, "finished": 12}


def test_unknown_kinds_are_analysed_beside_the_others(rows, tmp_path):
    for row in rows:
        if row["kind"] == "selective":
            row["kind"] = "poetic"
    study = {"simulated": True, "kinds": [{"id": kind, "label": kind.upper(), "kind": kind} for kind in exports.KINDS]}
    data = read_tidy(exports.write(rows, tmp_path, study=study))
    assert data.kinds[-1] == "poetic"
    assert any("'poetic'" in note for note in data.notes)
    assert data.label("contrastive") == "CONTRASTIVE"
    assert ("selective", "naive-path") not in planned(data)


def test_kinds_are_known_by_what_they_are_not_by_what_they_are_called(rows, tmp_path):
    new = {kind: f"k{i}" for i, kind in enumerate(exports.KINDS)}
    for row in rows:
        row["kind"] = new.get(row["kind"], row["kind"])
    study = {"kinds": [{"id": new[kind], "label": kind, "kind": kind} for kind in exports.KINDS]}
    data = read_tidy(exports.write(rows, tmp_path, study=study))
    assert planned(data)[0] == (new["responsibility"], new["naive-state"])


@pytest.mark.parametrize(
    ("content", "match"),
    [
        ("", "line of column names"),
        ("participant,phase,kind\n1,2,3\n", "is no export"),
        ("participant,phase,kind,item,value,value\n", "stands there twice"),
        ("participant,phase,kind,item,value\na,b,c,d,e,f,g\n", "line 2"),
        ("participant,phase,kind,item,value\n", "holds none yet"),
    ],
)
def test_tables_that_are_none_say_where(tmp_path, content, match):
    with pytest.raises(RatherthanError, match=match):
        read_answers(table(tmp_path / "observations.csv", content))


def test_files_that_are_no_tables_say_so(tmp_path):
    with pytest.raises(SourceError, match="does not exist"):
        read_answers(tmp_path / "nowhere")
    with pytest.raises(SourceError, match=r"observations\.csv"):
        read_answers(tmp_path)
    (tmp_path / "a.csv").write_bytes(b"\xff\x00a,b\n")
    with pytest.raises(SourceError, match="UTF-8"):
        read_table(tmp_path / "a.csv")
    (tmp_path / "a.xlsx").write_bytes(b"PK")
    with pytest.raises(SourceError, match="Save it as CSV"):
        read_table(tmp_path / "a.xlsx")


def test_a_parquet_that_is_none_says_so(tmp_path):
    pytest.importorskip("pyarrow", reason="needs the extra study")
    (tmp_path / "a.parquet").write_bytes(b"PAR1 nothing")
    with pytest.raises(SourceError, match="Parquet"):
        read_table(tmp_path / "a.parquet")


def test_what_was_ticked_is_a_one(rows, tmp_path):
    for row in rows:
        if row["item"] == "trust":
            row["type"], row["value"], row["label"] = "flag", "true" if int(row["value"]) > 3 else "false", ""
    data = read_tidy(exports.write(rows, tmp_path))
    assert set(data.measures[1].value) == {0.0, 1.0}
    assert data.notes == ()


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_tables_of_spreadsheets_are_read(tmp_path, delimiter, encoding):
    text = "\r\n".join(
        delimiter.join(line) for line in (["who", "kind", "x"], ["A", "k", "3"], ["B", "k", ""], ["", "", ""])
    )
    found = read_table(table(tmp_path / "a.csv", text, encoding))
    assert found == {"who": ["A", "B"], "kind": ["k", "k"], "x": ["3", ""]}


def test_cells_guarded_from_spreadsheets_are_unguarded(tmp_path):
    found = read_table(table(tmp_path / "a.csv", "a,b\n'=1+1,'tis\n"))
    assert found == {"a": ["=1+1"], "b": ["'tis"]}


def test_numbers_are_numbers():
    assert [number_in(cell) for cell in ("4", "-1.5e2", "3,5", "", "N/A")] == [4.0, -150.0, 3.5, None, None]
    for strange in ("often", "1_000", "٣", "inf", "1e300", "0x10", "--"):
        value = number_in(strange)
        assert value is not None
        assert np.isnan(value), strange


def wide_and_long(tmp_path):
    random = np.random.default_rng(2)
    values = random.integers(1, 6, (20, 3))
    kinds = ("a", "b", "c")
    long = "pid,condition,score\n" + "".join(
        f"{p},{kind},{values[p, k]}\n" for p in range(20) for k, kind in enumerate(kinds)
    )
    wide = "pid,score_a,score_b,score_c\n" + "".join(f"{p},{','.join(map(str, values[p]))}\n" for p in range(20))
    melted = "pid,condition,question,answer\n" + "".join(
        f"{p},{kind},score,{values[p, k]}\n" for p in range(20) for k, kind in enumerate(kinds)
    )
    return (
        (
            table(tmp_path / "long.csv", long),
            {"columns": ["participant=pid,kind=condition"], "ratings": ["score=score"]},
        ),
        (table(tmp_path / "wide.csv", wide), {"columns": ["participant=pid"], "ratings": ["score=score_{kind}"]}),
        (
            table(tmp_path / "melted.csv", melted),
            {"columns": ["participant=pid,kind=condition,item=question,value=answer"]},
        ),
    )


def test_long_wide_and_molten_tables_give_the_same(tmp_path):
    found = []
    for path, options in wide_and_long(tmp_path):
        data = read_foreign(path, meaning_of(**options))
        result = measured(data, data.measures[0], planned(data))
        found.append((data.kinds, result.within, result.primary.f, [c.contrast.p for c in result.compared]))
    assert found[0] == found[1] == found[2]
    assert found[0][1]


def test_conditions_between_persons_are_compared_as_such(tmp_path):
    path = table(tmp_path / "a.csv", "kind,x\n" + "".join(f"{'ab'[i % 2]},{i % 5 + i % 2}\n" for i in range(30)))
    data = read_foreign(path, meaning_of(columns=["kind=kind"], ratings=["x=x"]))
    result = measured(data, data.measures[0], planned(data))
    assert not result.within
    assert len(data.persons) == 30
    assert result.compared[0].contrast.paired is False


def test_columns_named_by_hand_do_not_hide_robots(rows, tmp_path):
    options = {"columns": ["participant=participant,kind=kind,item=item,value=value"]}
    own = [row for row in rows if row["phase"] == "trial"]
    assert read_answers(exports.write(own, tmp_path / "a"), meaning_of(**options)).simulated
    own[3]["simulated"] = "false"
    with pytest.raises(SourceError, match="never analysed together"):
        read_answers(exports.write(own, tmp_path / "b"), meaning_of(**options))


def test_a_condition_called_none_is_not_the_papers(tmp_path):
    lines = "".join(f"{('none', 'saliency')[i % 2]},{i % 5 + i % 2}\n" for i in range(30))
    data = read_foreign(
        table(tmp_path / "a.csv", f"kind,x\n{lines}"), meaning_of(columns=["kind=kind"], ratings=["x=x"])
    )
    assert data.cores == {}
    assert data.label("none") == "none"
    assert planned(data) == [("saliency", "none")]


def test_one_person_with_two_kinds_makes_no_study_within_persons(tmp_path):
    lines = "".join(f"p{i},{'ab'[i % 2]},{i % 5 + i % 2}\n" for i in range(30)) + "p0,b,4\n"
    data = read_foreign(
        table(tmp_path / "a.csv", f"who,kind,x\n{lines}"),
        meaning_of(columns=["participant=who,kind=kind"], ratings=["x=x"]),
    )
    result = measured(data, data.measures[0], planned(data))
    assert (result.within, result.several) == (False, 1)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"columns": ["kind=nowhere"], "ratings": ["x=x"]}, "no column 'nowhere'"),
        ({"columns": ["sort=kind"]}, "--columns knows"),
        ({"columns": ["kind"]}, "NAME=COLUMN"),
        ({"columns": ["kind=kind,kind=x"]}, "twice"),
        ({"columns": ["item=kind"]}, "both item"),
        ({"columns": ["kind=kind"]}, "must be named"),
        ({"ratings": ["x=x"]}, "for which kind"),
        ({"ratings": ["x=y_{kind}"]}, "No column is like"),
        ({"columns": ["kind=kind"], "ratings": ["x=kind"]}, "must hold answers that are numbers"),
        ({"columns": ["kind=x"], "ratings": ["x=x"], "scales": ["x=a-b"]}, "LEAST-MOST"),
        ({"columns": ["kind=number"], "ratings": ["x=x"]}, "seems to be another"),
        ({"choices": ["a=kind"]}, "two or more"),
        ({"choices": ["p|q=kind"]}, "Nobody chose"),
    ],
)
def test_mappings_that_do_not_fit_say_what_would(tmp_path, options, match):
    path = table(tmp_path / "a.csv", "kind,x,number\n" + "".join(f"{'ab'[i % 2]},{i % 5},{i}\n" for i in range(60)))
    with pytest.raises(QuestionError, match=match):
        read_foreign(path, meaning_of(**options))


def test_comparisons_name_kinds_that_are_there(rows, tmp_path):
    data = read_tidy(exports.write(rows, tmp_path))
    assert contrasts_in("a:b, c:d,a:b") == [("a", "b"), ("c", "d")]
    with pytest.raises(QuestionError, match="A:B"):
        contrasts_in("ab")
    with pytest.raises(QuestionError, match="got 'nobody'"):
        analysed(data, contrasts=[("nobody", "none")])
    with pytest.raises(QuestionError, match="twice"):
        analysed(data, contrasts=[("none", "none")])


def test_studies_of_others_are_read(shared_data):
    from scipy.stats import mannwhitneyu

    path = shared_data / "studies" / "highlights-lrp" / "main_values_retrospection.csv"
    options = {"columns": ["participant=seed,kind=condition"], "ratings": ["score=retroScoreTotal"]}
    data = read_answers(path, meaning_of(**options))
    result = analysed(data, contrasts=[("H", "L")]).measured[0]
    with path.open(newline="", encoding="utf-8") as file:
        known = list(csv.DictReader(file))
    twin = mannwhitneyu(
        *[[float(row["retroScoreTotal"]) for row in known if row["condition"] == kind] for kind in ("H", "L")]
    )
    assert result.persons == len(known) == 128
    assert result.compared[0].ranked.p == pytest.approx(twin.pvalue, rel=1e-9)
