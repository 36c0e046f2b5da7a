"""Objectives enter, records of what kind they are leave: what words need to know of them."""

from __future__ import annotations

import re

from ratherthan.explain.explanation import ObjectiveRecord
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, Level, ReachAvoid

__all__ = ["endless", "objective_record"]

_QUOTED = re.compile(r'"[^"]*"')
_DEADLINE = re.compile(r"\s*F\s*<=?\s*\d+\s+(?P<rest>.*)|\s*F\s*<=?\s*\d+(?P<bracket>\(.*)", re.DOTALL)
_TEMPORAL = re.compile(r"\b[FGUWXR]\b")


def objective_record(objective: Level) -> ObjectiveRecord:
    """Return the kind of an objective, as `ObjectiveRecord` tells them apart."""
    if isinstance(objective, ExpectedCost):
        return ObjectiveRecord(kind="cost", reward=objective.reward, maximise=objective.maximise)
    if isinstance(objective, ExpectedReward):
        return ObjectiveRecord(kind="reward", reward=objective.reward, maximise=objective.maximise)
    if isinstance(objective, Discounted):
        return ObjectiveRecord(
            kind="discounted", reward=objective.reward, maximise=objective.maximise, discount=objective.discount
        )
    if isinstance(objective, ReachAvoid):
        plain, kind, formula = objective.through is None, "safety", f"{objective.through} U {objective.goal}"
    else:
        plain, kind, formula = _only_a_deadline(objective.formula), "mission", objective.formula
    if objective.maximise:
        likely = "probability" if isinstance(objective, ReachAvoid) else "deadline"
        return ObjectiveRecord(kind=likely if plain else kind, maximise=True)
    return ObjectiveRecord(kind="risk") if plain else ObjectiveRecord(kind="event", formula=formula)


def _only_a_deadline(formula: str) -> bool:
    """Return whether a formula asks for a set of states within some steps, and for nothing else."""
    found = _DEADLINE.fullmatch(formula)
    rest = "" if found is None else found["rest"] or found["bracket"]
    return bool(rest) and _TEMPORAL.search(_QUOTED.sub("", rest)) is None


def endless(objective: Level) -> bool:
    """Return whether an objective has no goal to arrive at: a sum without end, or a probability to be kept small."""
    if isinstance(objective, Discounted):
        return True
    return not isinstance(objective, ExpectedCost | ExpectedReward) and not objective.maximise
