"""An export of ``ratherthan study export`` enters, the study's answers leave; what is wrong in it is said and the rest kept.

A row is an observation: who, on which screen, for which map and kind of explanation, which item, and its value.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from ratherthan.apps.study.analysis.data import FINISHED, Choices, Data, Measure, Person
from ratherthan.apps.study.analysis.gathering import measure_of
from ratherthan.apps.study.analysis.tables import Table, number_in, read_table
from ratherthan.apps.study.analysis.words import listed, say
from ratherthan.errors import SourceError

__all__ = ["KINDS", "is_tidy", "read_tidy", "simulated_in", "tidy_file", "truth"]

KINDS = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")
NEEDED = ("participant", "phase", "kind", "item", "value")
GONE = ("withdrawn", "no-consent")
TIME, HIDDEN, PREFERRED = "time", "hidden_time", "preferred"
Row = dict[str, str]


def tidy_file(path: Path) -> Path:
    """Return the table of observations at `path`, which is that file or its folder.

    Raises
    ------
    SourceError
        If there is none.
    """
    if not path.is_dir():
        return path
    for name in ("observations.csv", "observations.parquet"):
        if (path / name).is_file():
            return path / name
    raise SourceError(
        f"An export must hold observations.csv or observations.parquet, and '{path}' does not. "
        "Give the folder that 'ratherthan study export' wrote.",
        path=path,
    )


def is_tidy(table: Table) -> bool:
    """Whether a table has the columns of an export of ours."""
    return all(name in table for name in NEEDED)


def truth(cell: str) -> bool | None:
    """Return what a cell of true and false says; None where it says neither."""
    return {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}.get(cell.lower())


def read_tidy(path: Path, table: Table | None = None) -> Data:
    """Return the answers in an export.

    Parameters
    ----------
    path : Path
        The folder of the export, or its table of observations.
    table : Table, optional
        The table itself, where it was read already.

    Raises
    ------
    SourceError
        If it is no export, or holds answers of people and of robots.
    """
    file = tidy_file(path)
    table = read_table(file) if table is None else table
    if not is_tidy(table):
        lacking = [name for name in NEEDED if name not in table]
        raise SourceError(
            f"An export must have the columns {listed(NEEDED)}; '{file.name}' lacks {listed(lacking)}. "
            "Tables of other studies are read with --columns.",
            path=file,
        )
    told = _study(file.parent / "study.json")
    simulated = simulated_in(table, file)
    notes: list[str] = []
    rows = list(_without_repeats(table, notes))
    states = _states(file, rows)
    rows = _without_withdrawn(rows, states, notes)
    designs = sorted({row["design"] for row in rows if row.get("design")})
    if len(designs) > 1:
        notes.append(say("notes.designs", count=len(designs)))
    names = sorted(states)
    kinds = _ordered({row["kind"] for row in rows if row["kind"] and row["phase"] == "trial"}, told, notes)
    maps = tuple(sorted({row["map"] for row in rows if row.get("map")})) or ("",)
    trials = [row for row in rows if row["phase"] == "trial" and row["kind"]]
    codes = _Codes(persons={name: i for i, name in enumerate(names)}, kinds=kinds, maps=maps)
    return Data(
        source=str(path),
        title=str(told.get("title") or next((row["study"] for row in rows if row.get("study")), file.parent.name)),
        design=designs[0] if designs else "",
        simulated=simulated,
        kinds=kinds,
        maps=maps,
        labels=_labels(kinds, told),
        cores=_cores(kinds, told),
        persons=tuple(_persons(rows, states)),
        measures=tuple(_measures(trials, codes, told, notes)),
        choices=tuple(_choices(rows, codes, notes)),
        about=_about(rows),
        words=_words_shown(trials, kinds),
        notes=tuple(notes),
    )


def _study(path: Path) -> dict[str, Any]:
    """Return what the export tells of the study; nothing where it does not."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise SourceError(
            f"'{path}' must be JSON, but cannot be read as it: {error}. Export the study anew.", path=path
        ) from error
    return told if isinstance(told, dict) else {}


def simulated_in(table: Table, file: Path) -> bool:
    """Return whether robots answered.

    Parameters
    ----------
    table : Table
    file : Path
        Where it comes from: what is told of the study lies beside it.

    Raises
    ------
    SourceError
        If people and robots did.
    """
    told = _study(file.parent / "study.json")
    said = {truth(cell) for cell in table.get("simulated", []) if cell}
    if isinstance(told.get("simulated"), bool):
        said.add(told["simulated"])
    if None in said:
        raise SourceError(
            f"The column 'simulated' of '{file.name}' must say true or false, and says something else. Export the study anew.",
            path=file,
        )
    if len(said) > 1:
        raise SourceError(
            f"'{file.name}' holds answers of people and of simulated participants, which are never analysed together. "
            "Export each study by itself.",
            path=file,
        )
    return said == {True}


def _without_repeats(table: Table, notes: list[str]) -> Iterator[Row]:
    """Yield the rows, each observation once."""
    seen: dict[tuple[str, ...], str] = {}
    same = other = nobody = 0
    names = list(table)
    for cells in zip(*table.values(), strict=True):
        row = dict(zip(names, cells, strict=True))
        if not row["participant"]:
            nobody += 1
            continue
        key = tuple(row.get(name, "") for name in ("participant", "phase", "screen", "map", "kind", "grouping", "item"))
        if key in seen:
            same, other = same + (seen[key] == row["value"]), other + (seen[key] != row["value"])
            continue
        seen[key] = row["value"]
        yield row
    for note, count in (("nobody", nobody), ("twice", same), ("contrary", other)):
        if count:
            notes.append(say(f"notes.{note}", count=count))


def _ordered(found: set[str], told: Mapping[str, Any], notes: list[str]) -> tuple[str, ...]:
    """Return the kinds in the order of the design, else in that of the paper, the others behind."""
    known = [str(kind["id"]) for kind in _entries(told, "kinds") if kind.get("id")]
    order = known or list(KINDS)
    strangers = sorted(found - set(order))
    if known and strangers:
        notes.append(say("notes.strangers", kinds=listed([f"'{kind}'" for kind in strangers])))
    return tuple(kind for kind in order if kind in found) + tuple(strangers)


def _entries(told: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    entries = told.get(name)
    return [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []


def _labels(kinds: tuple[str, ...], told: Mapping[str, Any]) -> dict[str, str]:
    own = {str(kind.get("id")): str(kind["label"]) for kind in _entries(told, "kinds") if kind.get("label")}
    return {kind: own.get(kind) or (say(f"kinds.{kind}") if kind in KINDS else kind) for kind in kinds}


def _cores(kinds: tuple[str, ...], told: Mapping[str, Any]) -> dict[str, str]:
    own = {str(kind.get("id")): str(kind["kind"]) for kind in _entries(told, "kinds") if kind.get("kind")}
    named = own or {kind: kind for kind in kinds if kind in KINDS}
    return {kind: core for kind, core in named.items() if kind in kinds}


def _states(file: Path, rows: list[Row]) -> dict[str, str]:
    """Return how each participant ended; also of those who answered nothing, where the export's table of participants is there."""
    states: dict[str, str] = {}
    for row in rows:
        states.setdefault(row["participant"], row.get("state") or FINISHED)
    beside = file.with_name(f"participants{file.suffix}")
    if file.stem == "observations" and beside.is_file():
        table = read_table(beside)
        for name, state in zip(table.get("participant", []), table.get("state", []), strict=False):
            if name:
                states.setdefault(name, state or FINISHED)
    return states


def _without_withdrawn(rows: list[Row], states: Mapping[str, str], notes: list[str]) -> list[Row]:
    """Return the rows of those who did not take their consent back: of the others nothing is analysed, not even as a check."""
    gone = {name for name, state in states.items() if state in GONE}
    answered = {row["participant"] for row in rows} & gone
    if answered:
        notes.append(say("notes.withdrawn", count=len(answered)))
    return [row for row in rows if row["participant"] not in gone]


def _persons(rows: list[Row], states: Mapping[str, str]) -> Iterator[Person]:
    """Yield the persons in the order of their names."""
    checks: dict[str, list[bool]] = {}
    seconds: dict[str, list[float]] = {}
    trials: dict[str, set[tuple[str, str]]] = {}
    for row in rows:
        who = row["participant"]
        if row["phase"] == "attention" and (right := truth(row.get("correct", ""))) is not None:
            checks.setdefault(who, []).append(right)
        if row["phase"] == "trial" and row["kind"]:
            value = number_in(row["value"])
            if row["item"] == TIME and value is not None and value > 0:
                seconds.setdefault(who, []).append(value)
            elif row["item"] not in (TIME, HIDDEN):
                trials.setdefault(who, set()).add((row.get("map", ""), row["kind"]))
    for who in sorted(states):
        yield Person(
            name=who,
            state=states[who],
            failed_checks=checks[who].count(False) if who in checks else None,
            seconds=median(seconds[who]) if who in seconds else None,
            trials=len(trials.get(who, ())),
        )


@dataclass(frozen=True, kw_only=True)
class _Codes:
    """The numbers of participants, kinds and maps."""

    persons: Mapping[str, int]
    kinds: tuple[str, ...]
    maps: tuple[str, ...]

    def map(self, row: Row) -> int:
        return self.maps.index(row.get("map", "") or self.maps[0])


def _measures(trials: list[Row], codes: _Codes, told: Mapping[str, Any], notes: list[str]) -> Iterator[Measure]:
    """Yield what was measured at trials, ratings in the order of the design and times last."""
    items = {str(item.get("name")): item for item in _entries(told, "items")}
    found = list(dict.fromkeys(row["item"] for row in trials if row["item"] not in (TIME, HIDDEN)))
    found.sort(key=lambda name: list(items).index(name) if name in items else len(items))
    if any(row["item"] == TIME for row in trials):
        found.append(TIME)
    for name in found:
        own = [row for row in trials if row["item"] == name and row.get("type") != "text"]
        entries = [
            (codes.persons[row["participant"]], codes.kinds.index(row["kind"]), codes.map(row), _cell(row))
            for row in own
        ]
        item = items.get(name, {})
        options = [(number_in(str(o.get("value"))), str(o.get("label", ""))) for o in _entries(item, "options")]
        labels = {(number_in(row["value"]), row.get("label", "")) for row in own if row.get("label")}
        made = measure_of(name, entries, notes, time=name == TIME, options=options, labels=labels)
        if made is not None:
            yield made


def _cell(row: Row) -> str:
    """Return the value of a row; what was ticked is 1, what was not is 0."""
    ticked = truth(row["value"]) if row.get("type") == "flag" else None
    return row["value"] if ticked is None else str(int(ticked))


def _choices(rows: list[Row], codes: _Codes, notes: list[str]) -> Iterator[Choices]:
    """Yield the votes of each grouping."""
    votes: dict[tuple[str, tuple[str, ...]], list[tuple[int, int, int]]] = {}
    outside = 0
    asked = [row for row in rows if row["phase"] == "grouping" and row["item"] == PREFERRED]
    for row in asked:
        options = tuple(part.strip() for part in row.get("options", "").split("|") if part.strip())
        if not options:
            name = row.get("grouping", "")
            options = tuple(
                sorted({other["value"] for other in asked if other.get("grouping", "") == name and other["value"]})
            )
        if not row["value"]:
            continue
        if row["value"] not in options:
            outside += 1
            continue
        key = row.get("grouping", ""), _neither_last(options)
        vote = codes.persons[row["participant"]], key[1].index(row["value"]), codes.map(row)
        votes.setdefault(key, []).append(vote)
    if outside:
        notes.append(say("notes.outside", count=outside))
    for (name, options), entries in sorted(votes.items()):
        people, chosen, places = (np.array(part, dtype=np.int64) for part in zip(*entries, strict=True))
        yield Choices(name=name, options=options, person=people, choice=chosen, place=places)


def _neither_last(options: tuple[str, ...]) -> tuple[str, ...]:
    """Return options in one order whatever order a person saw."""
    kinds = sorted(
        (o for o in options if o != "neither"), key=lambda o: (KINDS.index(o) if o in KINDS else len(KINDS), o)
    )
    return (*kinds, "neither") if "neither" in options else tuple(kinds)


def _words_shown(trials: list[Row], kinds: tuple[str, ...]) -> dict[str, float]:
    """Return the mean number of words of the explanations of each kind, where the export tells it."""
    counts: dict[str, dict[str, float]] = {kind: {} for kind in kinds}
    for row in trials:
        value = number_in(row.get("words", ""))
        if value is not None and not math.isnan(value):
            counts[row["kind"]][row.get("map", "")] = value
    return {kind: sum(by_map.values()) / len(by_map) for kind, by_map in counts.items() if by_map}


def _about(rows: list[Row]) -> dict[str, dict[str, int]]:
    """Return how many persons told what of themselves: choices and numbers, never texts of their own."""
    told: dict[str, Counter[str]] = {}
    numbers: dict[str, list[float]] = {}
    for row in rows:
        if row["phase"] != "about" or row["item"] in (TIME, HIDDEN) or not row["value"] or row.get("type") == "text":
            continue
        if row.get("type") == "number":
            value = number_in(row["value"])
            if value is not None and not math.isnan(value):
                numbers.setdefault(row["item"], []).append(value)
        else:
            told.setdefault(row["item"], Counter())[row.get("label") or row["value"]] += 1
    result = {item: dict(sorted(counter.items())) for item, counter in told.items()}
    for item, values in numbers.items():
        span = say("about.span", median=f"{median(values):g}", least=f"{min(values):g}", most=f"{max(values):g}")
        result[item] = {span: len(values)}
    return result
