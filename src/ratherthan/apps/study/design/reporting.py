"""What was found about a design enters, the lines that a person reads leave; or a document for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from ratherthan.apps.study.design.checking import MEASURES, Report
from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.design.orders import rounds
from ratherthan.apps.study.design.screens import screens
from ratherthan.apps.study.design.timing import Duration

__all__ = ["document", "lines"]

HEADS = {
    "moves": "moves",
    "critical": "decisions that matter",
    "both": "with both reasons",
    "responsibility": "responsibility alone",
    "constrictiveness": "constrictiveness alone",
    "neither": "without a reason",
}
WIDE = 72


def lines(report: Report) -> Iterator[str]:
    """Yield the report as text, a line each."""
    design = report.design
    yield from _found("Faults", report.faults)
    if design is None or report.duration is None:
        return
    yield from _found("Warnings", report.warnings)
    yield from _shape(design)
    yield from _time(report.duration)
    yield ""
    yield "The maps"
    rows = [["map", "title", *(HEADS[key] for key in MEASURES)]]
    titles = {one.id: one.title for one in design.maps}
    rows += [[name, titles[name], *(str(found[key]) for key in MEASURES)] for name, found in report.measures.items()]
    yield from _table(rows)
    yield ""
    yield "The explanations: words / sentences / moves told, by map"
    yield from _table([["kind", *titles], *(_sizes(design, kind.id) for kind in design.kinds)])
    yield ""
    yield "What is recorded of each participant"
    rows = [["item", "times", "type", "unit", "allowed", "asked"]]
    rows += [
        [e.item, str(e.times), e.type, e.unit or "-", _cut(e.allowed) or "any", _cut(e.label)] for e in report.codebook
    ]
    yield from _table(rows)


def _found(title: str, faults: Sequence[Any]) -> Iterator[str]:
    yield f"{title}: {len(faults) or 'none'}"
    yield from (f"  {one}" for one in faults)


def _shape(design: Design) -> Iterator[str]:
    """Yield what the study is."""
    size, shown = rounds(design), screens(design, 0)
    trials = len(design.maps) * len(design.kinds)
    yield ""
    yield f"{design.title} (language {design.language}, version {design.version}, fingerprint {design.fingerprint})"
    yield f"  {_counted(len(design.maps), 'map')} x {_counted(len(design.kinds), 'kind')} = {trials} explanations, {_counted(len(design.items), 'item')} after each"
    yield (
        f"  {_counted(len(design.groupings), 'grouping')} for each map, {_counted(len(design.attention), 'attention check')}; "
        f"{len(shown)} pages in all"
    )
    full, rest = divmod(design.quota, size)
    more = f" and {rest} more" if rest else ""
    yield f"  {design.quota} participants; the plan is balanced over every {size}: {_counted(full, 'full round')}{more}"


def _counted(number: int, name: str) -> str:
    return f"{number} {name}{'' if number == 1 else 's'}"


def _time(taken: Duration) -> Iterator[str]:
    """Yield how long it takes."""
    usual, fast, slow = taken.speeds
    yield ""
    yield f"A participant needs about {taken.usual:.0f} minutes ({taken.fast:.0f} to {taken.slow:.0f})"
    yield f"  reading {usual} words a minute ({fast} to {slow}): {taken.source}"
    yield "  and, by assumption, seconds for each page, map and answer"
    rows = [["phase", "pages", "words", "minutes", "minutes a page"]]
    rows += [
        [one.phase, str(one.pages), str(one.words), f"{one.minutes:.1f}", f"{one.minutes / one.pages:.1f}"]
        for one in taken.phases
    ]
    yield from _table(rows)


def _sizes(design: Design, kind: str) -> list[str]:
    found = (design.stimuli[one.id, kind] for one in design.maps)
    return [kind, *(f"{s.words} / {s.sentences} / {s.steps}{' (by hand)' if s.by_hand else ''}" for s in found)]


def _cut(text: str) -> str:
    return text if len(text) <= WIDE else f"{text[: WIDE - 1]}…"


def _table(rows: list[list[str]]) -> Iterator[str]:
    """Yield rows in columns."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        yield "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def document(report: Report) -> dict[str, Any]:
    """Return the report as a JSON object."""
    design = report.design
    found: dict[str, Any] = {
        "faults": [asdict(one) for one in report.faults],
        "warnings": [asdict(one) for one in report.warnings],
    }
    if design is None or report.duration is None:
        return found
    return found | {
        "title": design.title,
        "fingerprint": design.fingerprint,
        "round": rounds(design),
        "quota": design.quota,
        "minutes": asdict(report.duration),
        "maps": report.measures,
        "explanations": [asdict(one) for one in design.stimuli.values()],
        "codebook": [asdict(one) | {"allowed": one.allowed} for one in report.codebook],
    }
