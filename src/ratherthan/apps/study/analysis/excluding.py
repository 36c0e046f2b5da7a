"""A study's answers and the rules enter, whose answers count leaves, with how many were left out by each rule."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.data import FINISHED, Data

__all__ = ["REASONS", "Exclusion", "Rules", "excluded"]

REASONS = ("state", "checks", "fast", "empty")
"""In the order in which they are looked at: each person is counted once, under the first that applies."""


@dataclass(frozen=True, kw_only=True)
class Rules:
    """Who is left out.

    Parameters
    ----------
    failed_checks : int
        So many attention checks may fail: more leave a person out.
    fastest : float
        Seconds: a median time of a trial below this leaves a person out.
    unfinished : bool
        Whether those count, too, who did not finish.
    """

    failed_checks: int = 1
    fastest: float = 2.0
    unfinished: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Exclusion:
    """Whose answers count.

    Parameters
    ----------
    keep : array of bool, ``[persons]``
    counts : dict of str to int
        How many were left out, by reason.
    states : dict of str to int
        How many ended in which state.
    """

    keep: npt.NDArray[np.bool_]
    counts: dict[str, int]
    states: dict[str, int]


def excluded(data: Data, rules: Rules) -> Exclusion:
    """Return whose answers count by the rules."""
    answered = np.zeros(len(data.persons), dtype=bool)
    for person_of in (*(m.person for m in data.measures), *(c.person for c in data.choices)):
        answered[person_of] = True
    keep = np.zeros(len(data.persons), dtype=bool)
    counts = dict.fromkeys(REASONS, 0)
    states: dict[str, int] = {}
    for i, person in enumerate(data.persons):
        states[person.state] = states.get(person.state, 0) + 1
        if person.state != FINISHED and not rules.unfinished:
            counts["state"] += 1
        elif (person.failed_checks or 0) > rules.failed_checks:
            counts["checks"] += 1
        elif person.seconds is not None and person.seconds < rules.fastest:
            counts["fast"] += 1
        elif not answered[i]:
            counts["empty"] += 1
        else:
            keep[i] = True
    return Exclusion(keep=keep, counts=counts, states=dict(sorted(states.items())))
