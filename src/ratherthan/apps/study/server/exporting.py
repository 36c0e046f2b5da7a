"""A database enters, tidy tables leave: a row per observation, a row per participant, and the codebook of both.

Everything comes from the database, which holds the design as it was served. The numbers of participants are drawn by lot when they enter:
they stay the same from export to export, and tell nothing of who came when. What a platform calls a person is never exported.
"""

from __future__ import annotations

import csv
import datetime as dt
import io
import json
import re
import tomllib
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Row, func, select

from ratherthan.apps.study.cells import safe_cell
from ratherthan.apps.study.design.codebook import codebook
from ratherthan.apps.study.design.nouns import Design, Record, Screen
from ratherthan.apps.study.server.course import Course, Way
from ratherthan.apps.study.server.monitor import state_now
from ratherthan.apps.study.server.places import RUNNING
from ratherthan.apps.study.server.sessions import gap, milliseconds
from ratherthan.apps.study.server.tables import ANSWER, ATTEMPT, PARTICIPANT, STUDY
from ratherthan.apps.study.server.values import all_correct

__all__ = ["FILES", "packed", "tables_of", "written"]

Table = dict[str, list[Any]]


@cache
def _columns() -> dict[str, Any]:
    """Return the columns of both tables with what each is."""
    return tomllib.loads((Path(__file__).parent / "columns.toml").read_text(encoding="utf-8"))


FILES: Mapping[str, str] = _columns()["files"]
"""The files of an export, and what each is."""


def tables_of(connection: Connection, design: Design) -> tuple[Table, Table, dict[str, Any]]:
    """Return (observations, participants, what the export is of).

    Parameters
    ----------
    connection : Connection
        In one consistent state.
    design : Design
        As the database has it.
    """
    about = connection.execute(select(STUDY)).one()
    course = Course(design)
    before = milliseconds() - gap(course)
    people = connection.execute(select(PARTICIPANT).order_by(PARTICIPANT.c.number)).all()
    answers: dict[int, list[Row[Any]]] = {}
    for row in connection.execute(select(ANSWER).order_by(ANSWER.c.participant, ANSWER.c.place, ANSWER.c.turn)):
        answers.setdefault(row.participant, []).append(row)
    spent = _spent(connection)
    same = {"study": design.title, "design": design.fingerprint, "simulated": about.simulated}
    observed, known = _empty("observations"), _empty("participants")
    for who in people:
        own = answers.get(who.id, [])
        state = state_now(who._asdict(), before)
        shared = {**same, "participant": f"P{who.number:04d}", "state": state}
        _add(known, {**shared, **_about(who, len(own), course)})
        way = course.way(who.slot)
        for answer in own:
            for seen in _observations(answer, way, design, spent):
                _add(observed, {**shared, "slot": who.slot, **seen})
    facts = {
        "format": 1,
        "title": design.title,
        "version": design.version,
        "design": design.fingerprint,
        "simulated": about.simulated,
        "language": design.language,
        "participants": len(people),
        "observations": len(observed["item"]),
        "running": sum(state_now(who._asdict(), before) == RUNNING for who in people),
        "exported": dt.datetime.now(dt.UTC).isoformat(timespec="seconds"),
        "program": version("ratherthan"),
        "kinds": [{"id": kind.id, "label": kind.label, "kind": kind.kind} for kind in design.kinds],
        "maps": [{"id": one.id, "title": one.title} for one in design.maps],
        "items": [_item(record) for record in design.items],
        "groupings": [
            {"id": one.id, "kinds": list(one.kinds), "neither": one.neither is not None} for one in design.groupings
        ],
    }
    return observed, known, facts


def packed(connection: Connection, design: Design) -> bytes:
    """Return an export as one archive.

    Parameters
    ----------
    connection : Connection
    design : Design
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in _contents(connection, design):
            archive.writestr(name, content)
    return buffer.getvalue()


def written(connection: Connection, design: Design, folder: Path) -> dict[str, Any]:
    """Write an export into a folder, which is made; return what it is of.

    Parameters
    ----------
    connection : Connection
    design : Design
    folder : Path

    Returns
    -------
    dict
        What study.json says.
    """
    contents = dict(_contents(connection, design))
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in contents.items():  # whole files only: an export that stops half way leaves the old ones
        half = folder / f".{name}.part"
        try:
            half.write_bytes(content)
            half.replace(folder / name)
        finally:
            half.unlink(missing_ok=True)
    facts: dict[str, Any] = json.loads(contents["study.json"])
    return facts


def _contents(connection: Connection, design: Design) -> Iterator[tuple[str, bytes]]:
    """Yield the files of an export."""
    observed, known, facts = tables_of(connection, design)
    for name, table in (("observations", observed), ("participants", known)):
        yield f"{name}.csv", _csv(list(table), zip(*table.values(), strict=True))
        yield f"{name}.parquet", _parquet(name, table)
    heads, rows = _book(design)
    yield "codebook.csv", _csv(heads, rows)
    yield "codebook.md", _markdown(design, facts, heads, rows).encode()
    yield "study.json", (json.dumps(facts, ensure_ascii=False, indent=2) + "\n").encode()


def _empty(name: str) -> Table:
    return {column["name"]: [] for column in _columns()[name]}


def _add(table: Table, row: Mapping[str, Any]) -> None:
    for name, cells in table.items():
        cells.append(row.get(name))


def _about(who: Row[Any], answered: int, course: Course) -> dict[str, Any]:
    """Return what is told of a participant beside their answers."""
    return {
        "platform": who.platform,
        "slot": who.slot,
        "screens_answered": who.answered,
        "answers": answered,
        "comprehension_tries": who.tries + (who.answered > course.way(who.slot).places.get("comprehension", 10**6)),
        "attention_failed": who.failed,
        "repeated": who.repeated,
        "entered": dt.datetime.fromtimestamp(who.entered / 1000, dt.UTC).date().isoformat(),
        "minutes": round(max(0, (who.ended or who.seen) - who.entered) / 60_000, 2),
    }


def _observations(
    answer: Row[Any], way: Way, design: Design, spent: Mapping[tuple[int, str], tuple[int, float, float]]
) -> Iterator[dict[str, Any]]:
    """Yield the rows of one answered screen: what it records, then its times."""
    index = way.places.get(answer.screen)
    if index is None:
        return
    screen = way.screens[index]
    values = json.loads(answer.content)
    attempts, visible, hidden = spent.get((answer.participant, answer.screen), (1, 0.0, 0.0))
    stimulus = design.stimuli.get((screen.map or "", screen.kind or ""))
    earlier = screen.phase == "comprehension" and not all_correct(screen, values)
    shared = {
        "screen": f"{screen.id}-try-{answer.turn}" if earlier else screen.id,
        "phase": screen.phase,
        "number": answer.place,
        "map": screen.map,
        "map_place": screen.map_place,
        "kind": screen.kind,
        "kind_place": screen.kind_place,
        "grouping": screen.grouping,
        "attempts": attempts,
        "words": None if stimulus is None else stimulus.words,
        "sentences": None if stimulus is None else stimulus.sentences,
    }
    for record in screen.records:
        yield {**shared, **_observed(screen, record, values.get(record.name))}
    if not earlier:
        yield {**shared, "item": "time", "type": "number", "unit": "s", "value": f"{visible:.3f}"}
        yield {**shared, "item": "hidden_time", "type": "number", "unit": "s", "value": f"{hidden:.3f}"}


def _observed(screen: Screen, record: Record, value: Any) -> dict[str, Any]:
    """Return what is told of one recorded value."""
    label = next((option.label for option in record.options if option.value == value), None)
    right = None if record.correct is None or value is None else value == record.correct
    text = None if value is None else ("true" if value else "false") if isinstance(value, bool) else str(value)
    return {
        "item": record.name,
        "type": record.type,
        "value": text,
        "label": None if screen.cards else label,
        "correct": right,
        "unit": record.unit,
        "options": "|".join(str(option.value) for option in record.options) if screen.cards else None,
    }


def _spent(connection: Connection) -> dict[tuple[int, str], tuple[int, float, float]]:
    """Return (attempts, visible seconds, hidden seconds) of each participant at each screen."""
    rows = connection.execute(
        select(
            ATTEMPT.c.participant,
            ATTEMPT.c.screen,
            func.count().label("attempts"),
            func.sum(ATTEMPT.c.visible).label("visible"),
            func.sum(ATTEMPT.c.hidden).label("hidden"),
        ).group_by(ATTEMPT.c.participant, ATTEMPT.c.screen)
    )
    return {
        (row.participant, row.screen): (row.attempts, float(row.visible) / 1000, float(row.hidden) / 1000)
        for row in rows
    }


def _csv(heads: Sequence[str], rows: Any) -> bytes:
    """Return a table as CSV, in UTF-8 with lines as RFC 4180 has them."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(heads)
    writer.writerows([safe_cell(cell) for cell in row] for row in rows)
    return text.getvalue().encode()


def _parquet(name: str, table: Table) -> bytes:
    """Return a table as Parquet, its columns typed as the codebook says."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    kinds = {"text": pa.string(), "whole": pa.int64(), "number": pa.float64(), "flag": pa.bool_()}
    columns = _columns()[name]
    schema = pa.schema([(column["name"], kinds[column["type"]]) for column in columns])
    buffer = io.BytesIO()
    pq.write_table(pa.Table.from_pydict(table, schema=schema), buffer)
    return buffer.getvalue()


def _book(design: Design) -> tuple[list[str], list[list[str]]]:
    """Return the codebook: the columns of both tables, then the items of the design."""
    heads = ["table", "name", "type", "unit", "values", "about"]
    rows = []
    for table in ("observations", "participants"):
        for one in _columns()[table]:
            rows.append([table, one["name"], one["type"], one.get("unit", ""), one.get("values", ""), one["about"]])
    for entry in codebook(design):
        phases = ", ".join(entry.phases)
        correct = f"; correct: {entry.correct}" if entry.correct else ""
        rows.append(["item", entry.item, entry.type, entry.unit, entry.allowed, f"{entry.label} ({phases}{correct})"])
    return heads, rows


def _markdown(design: Design, facts: Mapping[str, Any], heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return the codebook as a page."""
    words = _columns()["words"]
    parts = [f"# {words['title'].format(study=_cell(design.title))}\n"]
    if facts["simulated"]:
        parts.append(f"**{words['simulated']}**\n")
    parts.append(words["about"].format(**{name: facts[name] for name in ("design", "version", "program")}) + "\n")
    parts.append(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    parts.extend(f"| {' | '.join(_cell(cell) for cell in row)} |" for row in rows)
    return "\n".join(parts) + "\n"


def _cell(text: str) -> str:
    """Return text that stays within a cell of Markdown."""
    return " ".join(re.sub(r"([\\|`*_<>\[\]])", r"\\\1", text).split())


def _item(record: Record) -> dict[str, Any]:
    """Return an item that is rated, as an analysis needs it."""
    return {
        "name": record.name,
        "label": record.label,
        "type": record.type,
        "unit": record.unit,
        "options": [{"value": option.value, "label": option.label} for option in record.options],
    }
