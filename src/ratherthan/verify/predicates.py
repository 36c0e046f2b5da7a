"""How a choice stands to its alternatives enters, whether a claim holds leaves: true, false, or None where that is open.

Each claim is a predicate over relations ("better", "worse", "equal", "open" as seen from the choice taken), over counts, or
over what infinite numbers mean. It is applied twice: to what the evidence says and to what the re-checker knows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from ratherthan.verify.interval import Bounds, Interval

__all__ = [
    "ABOUT_COUNTS",
    "CONTRAST",
    "COUNTED",
    "FLEXIBLE",
    "FLEXIBLE_CONTRAST",
    "IMPOSSIBLE",
    "OPTIMAL",
    "PREDICATES",
    "STEPWISE",
    "WITH_SUCCESSORS",
    "Decision",
    "Seen",
]

Relations = Mapping[int, str]
Decision = bool | None

OPTIMAL = ("best", "among the best", "right start only", "not best", "hopeless", "avoids", "only way on")
STEPWISE = ("better step", "equal step", "worse step", "hopeless", "avoids", "only way on")
FLEXIBLE = ("most flexible", "equally flexible")
CONTRAST = ("better", "worse", "equal")
FLEXIBLE_CONTRAST = ("more flexible", "less flexible", "as flexible")
ABOUT_COUNTS = FLEXIBLE + FLEXIBLE_CONTRAST
WITH_SUCCESSORS = ("best", "among the best", "right start only", "better")


def _all(decisions: Sequence[Decision]) -> Decision:
    return False if False in decisions else None if None in decisions else True


def _any(decisions: Sequence[Decision]) -> Decision:
    return True if True in decisions else None if None in decisions else False


def _is(relation: str, *wanted: str) -> Decision:
    return None if relation == "open" else relation in wanted


class Seen(NamedTuple):
    """What a claim is judged by: the relations to the alternatives, the infinite rows, ρ^π against ρ at the successors."""

    relations: Relations
    fates: Mapping[int, str | None]
    numbers: Sequence[Interval]
    own: Interval
    own_fate: str | None
    keeps: Sequence[Decision]


def _top(seen: Seen) -> Decision:
    return _all([_is(relation, "better", "equal") for relation in seen.relations.values()])


def _alone(seen: Seen) -> Decision:
    return _all([_is(relation, "better") for relation in seen.relations.values()])


def _shared(seen: Seen) -> Decision:
    return _all([_top(seen), _any([_is(relation, "equal") for relation in seen.relations.values()])])


def _finite(number: Interval) -> Decision:
    bounds = Bounds(number.lower, number.upper)
    return True if bounds.finite else False if bounds.infinite else None


PREDICATES: dict[str, Callable[[Seen], Decision]] = {
    "best": lambda seen: _all([_alone(seen), *seen.keeps]),
    "among the best": lambda seen: _all([_shared(seen), *seen.keeps]),
    "right start only": lambda seen: _all([_top(seen), _any([None if k is None else not k for k in seen.keeps])]),
    "not best": lambda seen: _all([_is(relation, "worse") for relation in seen.relations.values()]),
    "worse step": lambda seen: _all([_is(relation, "worse") for relation in seen.relations.values()]),
    "better step": _alone,
    "equal step": _shared,
    "avoids": lambda seen: _all([_finite(seen.own), all(fate is not None for fate in seen.fates.values())]),
    "only way on": lambda _: True,
    "better": lambda seen: _all([_is(relation, "better") for relation in seen.relations.values()]),
    "worse": lambda seen: _all([_is(relation, "worse") for relation in seen.relations.values()]),
    "equal": lambda seen: _all([_is(relation, "equal") for relation in seen.relations.values()]),
}

COUNTED: dict[str, Callable[[Interval, Interval], bool]] = {
    "most flexible": lambda own, other: own.lower > other.upper,
    "more flexible": lambda own, other: own.lower > other.upper,
    "less flexible": lambda own, other: own.upper < other.lower,
    "equally flexible": lambda own, other: own.lower == own.upper == other.lower == other.upper,
    "as flexible": lambda own, other: own.lower == own.upper == other.lower == other.upper,
}
IMPOSSIBLE: dict[str, Callable[[Interval, Interval], bool]] = {
    "most flexible": lambda own, other: own.upper <= other.lower,
    "more flexible": lambda own, other: own.upper <= other.lower,
    "less flexible": lambda own, other: own.lower >= other.upper,
    "equally flexible": lambda own, other: own.upper < other.lower or own.lower > other.upper,
    "as flexible": lambda own, other: own.upper < other.lower or own.lower > other.upper,
}
