"""An Explanation enters, the steps that its sentences tell leave, a group for each sentence: sentences and pictures number them alike."""

from __future__ import annotations

from ratherthan.explain.explanation import Explanation

__all__ = ["told_groups"]


def told_groups(explanation: Explanation) -> tuple[tuple[int, ...], ...]:
    """Return the indices of the steps that each sentence about steps tells, in the order of the sentences.

    Parameters
    ----------
    explanation : Explanation
    """
    selective = explanation.question.scope == "route" and "selectiveness" in explanation.question.factors
    return tuple(
        (place,)
        for place, step in enumerate(explanation.steps)
        if step.told and (not selective or step.critical is not False)
    )
