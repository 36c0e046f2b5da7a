"""Cells of text enter, a measure of numbers leaves; what is no number is left out and said."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from ratherthan.apps.study.analysis.data import Measure
from ratherthan.apps.study.analysis.tables import number_in
from ratherthan.apps.study.analysis.words import say

__all__ = ["measure_of"]

KNOWN = ("understanding", "trust")


def measure_of(
    name: str,
    entries: list[tuple[int, int, int, str]],
    notes: list[str],
    *,
    time: bool,
    options: Sequence[tuple[float | None, str]] = (),
    labels: Collection[tuple[float | None, str]] | None = None,
) -> Measure | None:
    """Return a measure; None where no cell holds a number.

    Parameters
    ----------
    name : str
    entries : list of (person, kind, map, cell)
    notes : list of str
        Is added to: what was left out.
    time : bool
    options : sequence of (value, label)
        The values of the scale, where they are known.
    labels : collection of (value, label), optional
        Labels that were met, where the scale is to be guessed from the answers; None: then it has none.
    """
    title = say("measures.time") if time else say(f"measures.{name}") if name in KNOWN else name[:1].upper() + name[1:]
    good = _numbers(title, entries, notes, time=time)
    if not good:
        return None
    people, kinds, places, values = zip(*good, strict=True)
    allowed = {value: words for value, words in options if value is not None and math.isfinite(value)}
    if not allowed and labels is not None and not time:
        met = {value: words for value, words in labels if value is not None}
        allowed = {value: met.get(value, "") for value in _guessed(values)}
    scale = tuple(sorted(allowed))
    if len(scale) < 2 or not set(values) <= set(scale):
        scale = ()
    return Measure(
        name=name,
        label=title,
        unit="s" if time else None,
        time=time,
        person=np.array(people, dtype=np.int64),
        kind=np.array(kinds, dtype=np.int64),
        place=np.array(places, dtype=np.int64),
        value=np.array(values, dtype=np.float64),
        scale=scale or None,
        ends=(allowed[scale[0]], allowed[scale[-1]]) if scale and allowed[scale[0]] and allowed[scale[-1]] else None,
    )


def _numbers(
    title: str, entries: list[tuple[int, int, int, str]], notes: list[str], *, time: bool
) -> list[tuple[int, int, int, float]]:
    """Return the cells that hold numbers, and say how many do not."""
    good, missing, strange, beyond = [], 0, [], 0
    for person, kind, place, cell in entries:
        value = number_in(cell)
        if value is None:
            missing += 1
        elif math.isnan(value):
            strange.append(cell)
        elif time and value <= 0:
            beyond += 1
        else:
            good.append((person, kind, place, value))
    if missing:
        notes.append(say("notes.missing", item=title, count=missing))
    if strange:
        notes.append(say("notes.strange", item=title, count=len(strange), example=strange[0][:40]))
    if beyond:
        notes.append(say("notes.no_time", count=beyond))
    return good


def _guessed(values: tuple[float, ...]) -> tuple[float, ...]:
    """Return the whole numbers from 1 that ratings seem to be of; nothing where they are something else."""
    if all(value.is_integer() and 1 <= value <= 11 for value in values):
        return tuple(float(value) for value in range(1, int(max(5.0, *values)) + 1))
    return ()
