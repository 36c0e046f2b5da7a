"""A table of missions enters, a table of explanations leaves: in parallel, durable row by row, the same whoever computed it.

Rows of one model make a group, which a worker reads and solves once and then answers row after row. Where there are more
workers than groups, large groups are cut into parts. A finished row goes into the journal (`journal`) at once; when all are done
they are written in the order of the missions. A worker that dies costs the time of its group, and a row that fails is a result.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ratherthan.cluster.answering import answer_some, answers
from ratherthan.cluster.journal import Journal
from ratherthan.cluster.missions import Mission, missions_of, model_of
from ratherthan.cluster.tables import form_of, need, read_rows, write_rows
from ratherthan.errors import SourceError
from ratherthan.io._files import write_atomically
from ratherthan.model.watch import Limits, look

__all__ = ["RESULTS", "Explained", "explain_many"]

RESULTS: Mapping[str, type] = {
    "source": str,
    "property": str,
    "state": int,
    "status": str,
    "value": float,
    "lower": float,
    "upper": float,
    "outcome": str,
    "text": str,
    "document": str,
    "error": str,
    "seconds": float,
}
"""What the columns hold that follow those of the missions' own names and tags."""
NUMBERS = [name for name, kind in RESULTS.items() if kind is float]
LEAST_PART = 50
"""A group is not cut into parts of fewer rows: each part solves the model anew."""
QUICK = 0.2
"""Seconds up to which a worker may be given twice as many rows at once."""
MOST_AT_ONCE = 64


@dataclass(frozen=True, kw_only=True, eq=False)
class Explained:
    """What came of a table of missions.

    Parameters
    ----------
    rows : list of dict
        In the order of the missions, with the columns of the table of results.
    columns : mapping
        What each column holds, in order.
    failed : list of dict
        The rows that failed.
    faults : int
        How many of them failed by no fault of the input.
    """

    rows: list[dict[str, Any]]
    columns: Mapping[str, type]
    failed: list[dict[str, Any]]
    faults: int


@dataclass(frozen=True, kw_only=True)
class _How:
    """What holds for all rows."""

    documents: bool
    limits: Limits


@dataclass(eq=False)
class _Part:
    """Rows of one group that one worker answers, one piece after the other."""

    missions: list[Mission]
    at: str | None = None
    size: int = 1  # how many rows are given at once
    given: list[Mission] = field(default_factory=list)
    since: float = 0.0


def explain_many(
    missions: str | os.PathLike[str] | Iterable[Mapping[str, Any]],
    output: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    resume: bool = False,
    documents: str | os.PathLike[str] | None = None,
    limits: Limits | None = None,
    tell: Callable[[str], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> Explained:
    """Explain many missions.

    Parameters
    ----------
    missions : path or iterable of mappings
        A table, ``.csv``, ``.jsonl`` or ``.parquet``; or its rows, see `ratherthan.cluster.missions`.
    output : path, optional
        Where the results go, by the same suffixes. With it an interrupted run can go on.
    workers : int, optional
        How many local processes; by default as many as the machine has processors, and parts the work has. 1 is this process.
    cluster : str, optional
        The address of a scheduler, whose workers do it instead.
    resume : bool
        Go on with what an interrupted run left beside `output`.
    documents : path, optional
        A folder that gets every explanation as a document, ``000001.json`` and so on.
    limits : Limits, optional
        How much each row may take: the time that its answer takes, and the memory of the process that answers it.
    tell, note : callable, optional
        Take a short text: how far it is; and a sentence that a person should read.

    Returns
    -------
    Explained
        Rows that failed are among its rows.

    Raises
    ------
    SourceError
        Where the table cannot be read or the results cannot be written.
    MissingExtraError
        Where a library is not installed.
    """
    read = missions_of(*_rows(missions))
    if output is not None:
        need(form_of(output))
        _check_apart(missions, output)
    if documents is not None:
        _make_folder(documents)
    note = note or _nobody
    with ExitStack() as stack:
        journal = None if output is None else stack.enter_context(Journal(output, read, resume=resume))
        done = {} if journal is None else {number: _loaded(row) for number, row in journal.done.items()}
        # What failed is tried again: whoever goes on may have mended it.
        done = {number: row for number, row in done.items() if row["status"] == "answered"}
        if resume and journal is not None:
            note(f"{len(done)} of {len(read)} missions are done already.")
        left = [mission for mission in read if mission.number not in done]
        how = _How(documents=documents is not None, limits=limits or Limits())
        for row in _computed(_parts(left, workers, cluster), how, workers, cluster, note):
            _keep_document(row, documents)
            if journal is not None:
                journal.add(_stored(row))
            done[row["row"]] = row
            _tell(tell, done, len(read))
        explained = _explained(read, done)
        if journal is not None:
            assert output is not None
            write_rows(explained.rows, explained.columns, output)
            journal.remove()
    return explained


def _rows(missions: str | os.PathLike[str] | Iterable[Mapping[str, Any]]) -> tuple[Iterable[Mapping[str, Any]], str]:
    if isinstance(missions, str | os.PathLike):
        return read_rows(missions), os.fspath(missions)
    return missions, "the missions"


def _check_apart(missions: object, output: str | os.PathLike[str]) -> None:
    """Raise SourceError where the results would be written over the missions."""
    same = False
    if isinstance(missions, str | os.PathLike):
        with suppress(OSError, ValueError):  # a file that is not there is not the same
            same = os.path.samefile(missions, output)  # noqa: PTH121 - of names that may be none
    if same:
        raise SourceError(
            f"Results must go to another file than the missions come from, but '{os.fspath(output)}' is both. "
            "Give another name.",
            path=os.fspath(output),
        )


def _nobody(_: str) -> None:
    """Tell nobody."""


def _make_folder(path: str | os.PathLike[str]) -> None:
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SourceError(
            f"Documents must go to a folder, but '{os.fspath(path)}' is none and cannot be made: {error.strerror or error}.",
            path=os.fspath(path),
        ) from error


def _tell(tell: Callable[[str], None] | None, done: Mapping[int, Mapping[str, Any]], count: int) -> None:
    failed = sum(row["status"] != "answered" for row in done.values()) if tell is not None else 0
    text = f"{len(done)} of {count} missions" + (f", {failed} failed" if failed else "")
    if tell is not None:
        tell(text)
    look(text)


def _parts(missions: Sequence[Mission], workers: int | None, cluster: str | None) -> list[_Part]:
    """Return the groups of missions, in the order of their first rows; large ones cut where workers would have nothing."""
    groups: dict[tuple[Any, ...], list[Mission]] = {}
    for mission in missions:
        groups.setdefault(model_of(mission), []).append(mission)
    wanted = workers or (os.cpu_count() or 1)
    if cluster is None and wanted == 1:
        return [_Part(group) for group in groups.values()]
    parts = []
    for group in groups.values():
        pieces = max(1, min(wanted // max(len(groups), 1), len(group) // LEAST_PART))
        parts += [_Part(group[k * len(group) // pieces : (k + 1) * len(group) // pieces]) for k in range(pieces)]
    return parts


def _computed(
    parts: list[_Part], how: _How, workers: int | None, cluster: str | None, note: Callable[[str], None]
) -> Iterator[dict[str, Any]]:
    """Yield the row of every mission as soon as it is there."""
    if not parts:
        return
    count = min(workers or (os.cpu_count() or 1), len(parts))
    if cluster is None and count > 1:
        from ratherthan.cluster.engine import is_there

        if not is_there():
            note(
                "Several processes need the extra 'cluster' (pip install 'ratherthan[cluster]'); this one does it alone."
            )
            count = 1
    if cluster is None and count == 1:
        for part in parts:
            yield from answers(part.missions, documents=how.documents, limits=how.limits)
        return
    yield from _spread(parts, how, count, cluster)


def _spread(parts: list[_Part], how: _How, workers: int, cluster: str | None) -> Iterator[dict[str, Any]]:
    """Yield the rows that workers answer: each has one part at a time, and gets its rows in small pieces."""
    from ratherthan.cluster.engine import WorkerLostError, engine

    folder = os.getcwd()  # noqa: PTH109 - sent as text
    with engine(cluster, workers=workers) as pool:
        waiting, running = list(reversed(parts)), dict[Any, _Part]()

        def begin(part: _Part) -> None:
            part.given, part.since = part.missions[: part.size], time.monotonic()
            running[pool.submit(_answered_here, part.given, folder, how, at=part.at)] = part

        def fill() -> None:
            there = pool.workers()
            while waiting and len(running) < max(len(there), 1):
                part = waiting.pop()
                busy = [other.at for other in running.values()]
                part.at = min(there, key=busy.count, default=None)
                begin(part)

        fill()
        while running:
            for future in pool.first_of(running, look):
                part = running.pop(future)
                try:
                    part.at, rows = pool.result(future)
                except WorkerLostError as error:
                    if len(part.given) > 1:
                        part.size = 1
                        begin(part)
                        continue
                    rows = [_lost(part.given[0], error)]
                if time.monotonic() - part.since < QUICK and len(part.given) == part.size:
                    part.size = min(2 * part.size, MOST_AT_ONCE)
                part.missions = part.missions[len(part.given) :]
                if part.missions:
                    begin(part)
                yield from rows
            fill()


def _answered_here(missions: list[Mission], folder: str, how: _How) -> tuple[str, list[dict[str, Any]]]:
    """Answer some missions on a worker; return which one that is, too."""
    from ratherthan.cluster.engine import here

    return here(), answer_some(missions, folder, documents=how.documents, limits=how.limits)


def _lost(mission: Mission, error: Exception) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(RESULTS)
    return row | {"row": mission.number, "status": "failed", "error": str(error), "fault": True, "seconds": 0.0}


def _keep_document(row: dict[str, Any], folder: str | os.PathLike[str] | None) -> None:
    """Write the document of a row; the row keeps its name."""
    if folder is None or row["document"] is None:
        return
    path = Path(folder) / f"{row['row']:06d}.json"
    with write_atomically(path) as file:
        file.write(row["document"].encode("utf-8", "backslashreplace"))
    row["document"] = os.fspath(path)


def _stored(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row as JSON can hold it."""
    return {
        name: str(value) if isinstance(value, float) and name in NUMBERS and name != "seconds" else value
        for name, value in row.items()
    }


def _loaded(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row that `_stored` stored."""
    return {name: float(value) if name in NUMBERS and value is not None else value for name, value in row.items()}


def _explained(missions: Sequence[Mission], done: Mapping[int, Mapping[str, Any]]) -> Explained:
    """Return the rows in the order of the missions, each with the mission's name and what was carried along."""
    tags = list(dict.fromkeys(name for mission in missions for name, _ in mission.tags))
    columns: dict[str, type] = {"row": int, "id": str, **dict.fromkeys(tags, str), **RESULTS}
    rows = []
    for mission in missions:
        row = done[mission.number]
        carried = dict.fromkeys(tags, "") | dict(mission.tags)
        own = {name: row.get(name) for name in RESULTS} | {"source": mission.source}
        rows.append({"row": mission.number, "id": mission.id, **carried, **own})
    failed = [row for row in rows if row["status"] != "answered"]
    faults = sum(bool(row.get("fault")) for row in done.values() if row["status"] != "answered")
    return Explained(rows=rows, columns=columns, failed=failed, faults=faults)
