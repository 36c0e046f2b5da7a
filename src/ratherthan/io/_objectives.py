"""An objective or threshold enters, its JSON object leaves; and the way back.

=================== ==========================================
``"kind"``          further members
=================== ==========================================
``expected-cost``   ``goal``, ``reward``, ``maximise``
``expected-reward`` ``goal``, ``reward``, ``maximise``
``reach-avoid``     ``goal``, ``through``, ``maximise``
``discounted``      ``reward``, ``discount``, ``maximise``
``mission``         ``formula``, ``maximise``
``lexicographic``   ``levels``, a list of such objects
``threshold``       ``objective``, ``relation``, ``bound``
=================== ==========================================

``reward`` and ``through`` may be null.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict
from typing import Any, NoReturn

from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Level,
    Lexicographic,
    Mission,
    Objective,
    ReachAvoid,
    Threshold,
)

__all__ = ["read_objective", "read_property", "spelled"]

Fail = Callable[[str, object], NoReturn]

_KINDS: dict[str, type[Level]] = {
    "expected-cost": ExpectedCost,
    "expected-reward": ExpectedReward,
    "reach-avoid": ReachAvoid,
    "discounted": Discounted,
    "mission": Mission,
}
_NAMES = {kind: name for name, kind in _KINDS.items()}
_RELATIONS = (">=", ">", "<=", "<")


def spelled(item: Objective | Threshold) -> dict[str, Any]:
    """Return an objective or a threshold as a JSON object."""
    if isinstance(item, Threshold):
        return {"kind": "threshold"} | asdict(item) | {"objective": spelled(item.objective)}
    if isinstance(item, Lexicographic):
        return {"kind": "lexicographic", "levels": [spelled(level) for level in item.levels]}
    return {"kind": _NAMES[type(item)]} | asdict(item)


def read_property(value: Any, fail: Fail) -> Objective | Threshold:
    """Return an objective or a threshold out of its JSON object.

    Parameters
    ----------
    value : object
    fail : callable
        Raises the error for what must be there, and what came.
    """
    if not isinstance(value, dict):
        fail("an object for a property", value)
    if value.get("kind") != "threshold":
        return read_objective(value, fail)
    relation, bound = value.get("relation"), value.get("bound")
    if relation not in _RELATIONS:
        fail(f"one of {', '.join(_RELATIONS)} at 'relation'", relation)
    if isinstance(bound, bool) or not isinstance(bound, int | float) or bound != bound:
        fail("a number at 'bound'", bound)
    return Threshold(objective=_level(value.get("objective"), fail), relation=relation, bound=float(bound))


def read_objective(value: Any, fail: Fail) -> Objective:
    """Return an objective out of its JSON object; parameters as `read_property`."""
    if isinstance(value, dict) and value.get("kind") == "lexicographic":
        levels = value.get("levels")
        if not isinstance(levels, list) or len(levels) < 2:
            fail("a list of at least two objectives at 'levels'", levels)
        return Lexicographic(levels=tuple(_level(level, fail) for level in levels))
    return _level(value, fail)


def _level(value: Any, fail: Fail) -> Level:
    if not isinstance(value, dict):
        fail("an object for an objective", value)
    kind = value.get("kind")
    if not isinstance(kind, str) or kind not in _KINDS:
        fail(f"one of {', '.join(_KINDS)} as the kind of an objective", kind)
    made: dict[str, Any] = {}
    for name in _KINDS[kind].__dataclass_fields__:
        made[name] = _member(name, value.get(name), fail)
    return _KINDS[kind](**made)


def _member(name: str, value: Any, fail: Fail) -> Any:
    if name == "maximise":
        if not isinstance(value, bool):
            fail("true or false at 'maximise'", value)
    elif name == "discount":
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < 1 or math.isnan(value):
            fail("a number between 0 and 1 at 'discount'", value)
        return float(value)
    elif not isinstance(value, str) and not (value is None and name in ("reward", "through")):
        fail(f"a string at '{name}'", value)
    return value
