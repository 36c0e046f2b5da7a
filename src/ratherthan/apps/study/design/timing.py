"""The screens of a participant enter, the minutes that they take leave: words by the speed of reading, and seconds for each thing to do."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from ratherthan.apps.study.design.nouns import PHASES, Record, Screen

__all__ = ["Duration", "PhaseTime", "duration"]


@dataclass(frozen=True, kw_only=True)
class PhaseTime:
    """What the pages of one phase take: `pages`, `words`, and `minutes` at the usual speed."""

    phase: str
    pages: int
    words: int
    minutes: float


@dataclass(frozen=True, kw_only=True)
class Duration:
    """How long a participant needs.

    Parameters
    ----------
    usual, fast, slow : float
        Minutes of a usual, a fast and a slow reader.
    phases : tuple of PhaseTime
    source : str
        Where the speed of reading comes from.
    speeds : tuple of int
        Words a minute: usual, fast, slow.
    """

    usual: float
    fast: float
    slow: float
    phases: tuple[PhaseTime, ...]
    source: str
    speeds: tuple[int, int, int]


def duration(shown: Sequence[Screen]) -> Duration:
    """Return how long some screens take.

    Parameters
    ----------
    shown : sequence of Screen
        All of one participant, in order.
    """
    reading, seen = _timing()["reading"], set[str]()
    words, doing = [_words(screen) for screen in shown], [_seconds(screen, seen) for screen in shown]

    def minutes(speed: float, phase: str | None = None) -> float:
        return sum(
            count / speed + seconds / 60.0
            for screen, count, seconds in zip(shown, words, doing, strict=True)
            if phase in (None, screen.phase)
        )

    phases = [
        PhaseTime(
            phase=phase,
            pages=sum(screen.phase == phase for screen in shown),
            words=sum(count for screen, count in zip(shown, words, strict=True) if screen.phase == phase),
            minutes=minutes(reading["usual"], phase),
        )
        for phase in PHASES
    ]
    return Duration(
        usual=minutes(reading["usual"]),
        fast=minutes(reading["fast"]),
        slow=minutes(reading["slow"]),
        phases=tuple(one for one in phases if one.pages),
        source=reading["source"],
        speeds=(reading["usual"], reading["fast"], reading["slow"]),
    )


@cache
def _timing() -> dict[str, Any]:
    text = (
        resources.files("ratherthan.apps.study.design").joinpath("material", "timing.toml").read_text(encoding="utf-8")
    )
    return tomllib.loads(text)


def _words(screen: Screen) -> int:
    """Return how many words a page has. The scale of an item that comes again and again is read with its label only."""
    texts = [screen.title, *screen.paragraphs, screen.explanation or "", *(card.text for card in screen.cards)]
    texts += [record.label for record in screen.records]
    if screen.phase not in ("trial", "grouping"):
        texts += [option.label for record in screen.records for option in record.options]
    return sum(len(text.split()) for text in texts)


def _seconds(screen: Screen, seen: set[str]) -> float:
    """Return what a page takes beside reading; `seen` are the maps looked at so far."""
    seconds = _timing()["seconds"]
    total = float(seconds["page"])
    if screen.map is not None:
        total += seconds["again" if screen.map in seen else "map"]
        seen.add(screen.map)
    return total + sum(_answering(record, seconds) for record in screen.records)


def _answering(record: Record, seconds: dict[str, float]) -> float:
    return seconds["optional"] if record.type == "text" and not record.required else seconds[record.type]
