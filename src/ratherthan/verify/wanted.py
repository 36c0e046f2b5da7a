"""The properties of an explanation and a model enter; the objectives they mean leave, once their records say the same."""

from __future__ import annotations

from typing import Any, NoReturn

from ratherthan.errors import ExplanationError, PropertyError
from ratherthan.explain.explanation import Explanation, ObjectiveRecord
from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Level,
    Lexicographic,
    Mission,
    Objective,
    Threshold,
    levels_of,
)
from ratherthan.model.problem import Problem
from ratherthan.model.property import parse_property
from ratherthan.verify.formulas import only_a_deadline

__all__ = ["further_of", "objective_of", "record_of", "refuse"]


def refuse(must: str, got: object, **place: Any) -> NoReturn:
    """Raise ExplanationError: what must be, and what came."""
    raise ExplanationError(
        f"{must}, got {got}. The explanation was changed after it was made, or belongs to another model: make it again.",
        **place,
    )


def objective_of(told: Explanation, problem: Problem) -> Objective:
    """Return the objective of an explanation on a model.

    Raises
    ------
    ExplanationError
        If it does not fit the model, or its records say something else.
    """
    wanted = _asked(told.property, problem)
    if wanted.text != told.property:
        refuse(f"The property of an explanation must be in its canonical form, '{wanted.text}'", f"'{told.property}'")
    records = tuple(map(record_of, levels_of(wanted)))
    if told.levels != records:
        refuse(f"The records of the levels must say what the property says, {records}", told.levels)
    if told.objective != records[0]:
        refuse(f"The record of the objective must be that of its first level, {records[0]}", told.objective)
    return wanted


def further_of(told: Explanation, problem: Problem, wanted: Objective) -> tuple[Level, ...]:
    """Return the objectives beside an explanation's own, under which its plan is judged.

    Raises
    ------
    ExplanationError
        If one does not fit the model, its record says something else, or it is none that may stand there.
    """
    found: list[Level] = []
    for further in told.also:
        level = _asked(further.property, problem)
        if isinstance(level, Lexicographic | Mission):
            refuse("A further objective must be told without levels and memory", f"'{further.property}'")
        if level.text != further.property or level in (*levels_of(wanted), *found):
            refuse("Further objectives must differ, each in its canonical form", f"'{further.property}'")
        if further.objective != record_of(level):
            refuse(f"The record of a further objective must be {record_of(level)}", further.objective)
        found.append(level)
    return tuple(found)


def _asked(text: str, problem: Problem) -> Objective:
    try:
        wanted = parse_property(text, problem)
    except PropertyError as error:
        raise ExplanationError(f"The property of an explanation must fit the model: {error}", **error.place) from None
    if isinstance(wanted, Threshold):
        refuse("The property of an explanation must ask for a value", f"'{text}'")
    return wanted


def record_of(level: Level) -> ObjectiveRecord:
    """Return the record of what kind of thing a level wants."""
    if isinstance(level, Discounted):
        return ObjectiveRecord(kind="discounted", reward=level.reward, maximise=level.maximise, discount=level.discount)
    if isinstance(level, ExpectedCost | ExpectedReward):
        kind = "cost" if isinstance(level, ExpectedCost) else "reward"
        return ObjectiveRecord(kind=kind, reward=level.reward, maximise=level.maximise)
    if isinstance(level, Mission):
        plain, likely, formula = only_a_deadline(level.formula), ("deadline", "mission"), level.formula
    else:
        plain, likely = level.through is None, ("probability", "safety")
        formula = f"{level.through} U {level.goal}"
    if level.maximise:
        return ObjectiveRecord(kind=likely[0] if plain else likely[1], maximise=True)
    return ObjectiveRecord(kind="risk") if plain else ObjectiveRecord(kind="event", formula=formula)
