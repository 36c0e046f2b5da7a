"""A table of somebody else's study and what its columns mean enter, the study's answers leave.

Two shapes of tables are taken, and mixtures of them:

* *long*: a row holds one answer or several of one person for one kind. Columns say who and which kind: ``participant=PID,kind=condition``,
  perhaps ``map=…``. Answers stand in columns of their own (``--ratings trust=trust_score``) or all in one, named by another
  (``item=question,value=answer``).
* *wide*: a row holds a person, and a column each kind: ``--ratings "trust=trust_{kind}"``, or with maps ``"trust=trust_{kind}_{map}"``.

Without a column for persons every row is a person of its own. Times are given like ratings, with ``--times``; choices are named by
what there was to choose from: ``--choices "naive-path|selective|neither=preferred"``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ratherthan.apps.study.analysis.data import Choices, Data, Measure, Person
from ratherthan.apps.study.analysis.gathering import measure_of
from ratherthan.apps.study.analysis.meaning import Meaning
from ratherthan.apps.study.analysis.tables import Table, read_table
from ratherthan.apps.study.analysis.tidy import KINDS, simulated_in
from ratherthan.apps.study.analysis.words import listed, say
from ratherthan.errors import QuestionError

__all__ = ["read_foreign"]

MOST_KINDS, MOST_MAPS = 40, 200
Entry = tuple[int, int, int, str]


@dataclass(kw_only=True)
class _Book:
    """Names that were met, each with its number."""

    numbers: dict[str, int] = field(default_factory=dict)

    def of(self, name: str) -> int:
        return self.numbers.setdefault(name, len(self.numbers))


def read_foreign(path: Path, meaning: Meaning, table: Table | None = None) -> Data:
    """Return the answers in a table of somebody else's study.

    Parameters
    ----------
    path : Path
    meaning : Meaning
    table : Table, optional
        The table itself, where it was read already.

    Raises
    ------
    SourceError
        If the table cannot be read.
    QuestionError
        If it has no such columns, or they hold no kinds or answers.
    """
    table = read_table(path) if table is None else table
    _check_columns(table, meaning)
    notes: list[str] = []
    people, kinds, maps = _Book(), _Book(), _Book()
    rows = len(next(iter(table.values()), []))
    who = (
        table[meaning.roles["participant"]] if "participant" in meaning.roles else [f"row {i + 2}" for i in range(rows)]
    )
    if rows and not all(who):
        notes.append(say("notes.nobody", count=who.count("")))
    person = [people.of(name) if name else -1 for name in who]
    entries: dict[tuple[str, bool], list[Entry]] = {}
    for names, time in ((meaning.ratings, False), (meaning.times, True)):
        for name, column in names.items():
            entries[name, time] = _entries(table, meaning, column, person, (kinds, maps))
    for name, own in _items(table, meaning, person, (kinds, maps)).items():
        entries.setdefault((name, name == "time"), []).extend(own)
    choices = tuple(_choices(table, meaning, person, maps))
    if not kinds.numbers and not choices:
        raise QuestionError(
            "The table must say for which kind each answer is, and no kind was found in it. Name its column: --columns kind=COLUMN."
        )
    if len(kinds.numbers) > MOST_KINDS:
        raise QuestionError(
            f"The column of kinds holds {len(kinds.numbers)} different things, more than {MOST_KINDS}: it seems to be another. "
            "Name the right one: --columns kind=COLUMN."
        )
    if len(maps.numbers) > MOST_MAPS:
        raise QuestionError(
            f"The column of maps holds {len(maps.numbers)} different things, more than {MOST_MAPS}: it seems to be another. "
            "Name the right one, or none: --columns map=COLUMN."
        )
    order = _order(list(kinds.numbers), meaning)
    renumbered = {kinds.numbers[kind]: i for i, kind in enumerate(order)}
    measures: list[Measure] = []
    for (name, time), own in entries.items():
        moved = [(p, renumbered[k], m, cell) for p, k, m, cell in own]
        measure = measure_of(name, moved, notes, time=time, options=meaning.points(name))
        if measure is not None:
            measures.append(measure)
    if not measures and not choices:
        raise QuestionError(f"The table must hold answers that are numbers, and none was found. {' '.join(notes)}")
    known = [kind for kind in order if kind in KINDS]
    known = known if len(known) > 1 else []  # a condition called "none" makes no study of the paper's kinds
    trials = [0] * len(people.numbers)
    for own in entries.values():
        for p, _, _, cell in own:
            trials[p] += bool(cell)
    return Data(
        source=str(path),
        title=path.stem,
        simulated="simulated" in table and simulated_in(table, path),
        kinds=tuple(order),
        maps=tuple(maps.numbers) or ("",),
        labels={kind: meaning.labels.get(kind) or (say(f"kinds.{kind}") if kind in known else kind) for kind in order},
        cores={kind: kind for kind in order if kind in known},
        persons=tuple(Person(name=name, trials=trials[i]) for name, i in people.numbers.items()),
        measures=tuple(measures),
        choices=choices,
        notes=tuple(notes),
    )


def _check_columns(table: Table, meaning: Meaning) -> None:
    """Refuse a mapping to columns that are not there."""
    wanted = [
        *meaning.roles.values(),
        *(c for names in (meaning.ratings, meaning.times, meaning.choices) for c in names.values()),
    ]
    for column in wanted:
        if "{" in column or column in table:
            continue
        raise QuestionError(f"The table has no column '{column}'. Its columns are {_named(table)}.")
    if not (meaning.ratings or meaning.times or meaning.choices or "item" in meaning.roles):
        raise QuestionError("The answers must be named: --ratings NAME=COLUMN, or --columns item=COLUMN,value=COLUMN.")


def _entries(table: Table, meaning: Meaning, column: str, person: list[int], books: tuple[_Book, _Book]) -> list[Entry]:
    """Return the answers in a column, or in the columns of a pattern."""
    kinds, maps = books
    if "{" not in column:
        if "kind" not in meaning.roles:
            raise QuestionError(
                f"The table must say for which kind the answers in '{column}' are: --columns kind=COLUMN, or a pattern as "
                f"--ratings 'name=name_{{kind}}'."
            )
        own = table[meaning.roles["kind"]]
        places = table[meaning.roles["map"]] if "map" in meaning.roles else [""] * len(own)
        return [
            (p, kinds.of(k), maps.of(m), cell)
            for p, k, m, cell in zip(person, own, places, table[column], strict=True)
            if p >= 0 and k
        ]
    found = []
    for name, groups in _matching(table, column):
        kind = groups.get("kind")
        if kind is None:
            if "kind" not in meaning.roles:
                raise QuestionError(
                    f"The pattern '{column}' must hold {{kind}}, unless --columns names a column of kinds."
                )
            own = table[meaning.roles["kind"]]
        else:
            own = [kind] * len(table[name])
        places = table[meaning.roles["map"]] if "map" in meaning.roles else [groups.get("map", "")] * len(own)
        found += [
            (p, kinds.of(k), maps.of(m), cell)
            for p, k, m, cell in zip(person, own, places, table[name], strict=True)
            if p >= 0 and k
        ]
    return found


def _matching(table: Table, pattern: str) -> list[tuple[str, dict[str, str]]]:
    """Return the columns that a pattern stands for, with what its places stand for."""
    shape = re.escape(pattern).replace(r"\{kind\}", "(?P<kind>.+?)").replace(r"\{map\}", "(?P<map>.+?)")
    try:
        matched = [(name, match.groupdict()) for name in table if (match := re.fullmatch(shape, name))]
    except re.error as error:
        raise QuestionError(f"A pattern of columns holds {{kind}} and {{map}} once each, got '{pattern}'.") from error
    if not matched:
        raise QuestionError(f"No column is like '{pattern}'. The columns are {_named(table)}.")
    return matched


def _items(table: Table, meaning: Meaning, person: list[int], books: tuple[_Book, _Book]) -> dict[str, list[Entry]]:
    """Return the answers of a table in which one column names the item and another holds the answer."""
    if "item" not in meaning.roles:
        return {}
    own = _entries(table, meaning, meaning.roles["value"], person, books)
    kinds = table[meaning.roles["kind"]] if "kind" in meaning.roles else []
    items = [item for item, p, k in zip(table[meaning.roles["item"]], person, kinds, strict=True) if p >= 0 and k]
    found: dict[str, list[Entry]] = {}
    for item, entry in zip(items, own, strict=True):
        if item:
            found.setdefault(item, []).append(entry)
    return found


def _choices(table: Table, meaning: Meaning, person: list[int], maps: _Book) -> Iterable[Choices]:
    """Yield the votes in the columns of choices."""
    for what, column in meaning.choices.items():
        options = tuple(option.strip() for option in what.split("|"))
        if len(options) < 2 or len(set(options)) < len(options) or "" in options:
            raise QuestionError(
                f"--choices takes A|B|neither=COLUMN with two or more different things to choose from, got '{what}'."
            )
        votes = []
        places = table[meaning.roles["map"]] if "map" in meaning.roles else [""] * len(person)
        for p, cell, place in zip(person, table[column], places, strict=True):
            if p >= 0 and cell in options:
                votes.append((p, options.index(cell), maps.of(place)))
        if not votes:
            raise QuestionError(
                f"Nobody chose {listed(options)} in the column '{column}'. It holds e.g. '{table[column][0] if table[column] else ''}'."
            )
        people, chosen, where = (np.array(part, dtype=np.int64) for part in zip(*votes, strict=True))
        yield Choices(name=column, options=options, person=people, choice=chosen, place=where)


def _order(kinds: list[str], meaning: Meaning) -> list[str]:
    """Return kinds in the order of the labels, then of the paper, then as they were met."""
    named = list(meaning.labels)

    def place(kind: str) -> tuple[int, int]:
        if kind in named:
            return 0, named.index(kind)
        return (1, KINDS.index(kind)) if kind in KINDS else (2, kinds.index(kind))

    return sorted(kinds, key=place)


def _named(table: Table) -> str:
    """Return the names of the first columns, as a list in a sentence."""
    return listed([f"'{name}'" for name in list(table)[:30]])
