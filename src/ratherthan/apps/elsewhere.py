"""A property that this package cannot explain enters, with the reason; Storm's answer leaves, or a better reason."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ratherthan.apps.waiting import waiting

if TYPE_CHECKING:
    from ratherthan.errors import PropertyError
    from ratherthan.io.storm import StormAnswer
    from ratherthan.model.problem import Problem

__all__ = ["asked_of_storm", "storm_document"]


_UNREAD = ("at line", "Could not parse", "must be", "must have")
"""Some of these words stand in what Storm, or we before it, say of a property that cannot be read at all."""


def asked_of_storm(problem: Problem, text: str | None, reason: PropertyError, policy: str | None) -> StormAnswer:
    """Return Storm's answer to the one property that is wanted.

    Parameters
    ----------
    problem : Problem
    text : str, optional
        The property, or the name that it has in the source; None where not one alone is wanted.
    reason : PropertyError
        Why it is not answered here.
    policy : str, optional
        Where a policy is to be judged there is no answer: Storm would look for the best one.

    Raises
    ------
    PropertyError
        The reason itself where the property is wrong or is no property at all; else with what Storm says, too.
    MissingExtraError
        Where Storm could answer, but is not installed.
    """
    from ratherthan.errors import MissingExtraError, NotExplainableError, PropertyError
    from ratherthan.io.storm import ask_storm, storm_is_there

    known = isinstance(reason, NotExplainableError)
    unread = "column" in reason.place and storm_is_there()  # of another syntax than ours, perhaps Storm's
    if text is None or not (known or unread):
        raise reason
    if policy is not None:
        if not known:
            raise reason
        raise PropertyError(
            f"{reason.message} Storm can give its best value, but not that of a given policy: leave --policy out.",
            **reason.place,
        )
    if not storm_is_there():
        raise MissingExtraError(
            f'{reason.message} Storm could give its value, but is not installed: pip install "ratherthan[storm]".'
        )
    text = problem.others.get(text.strip().strip('"'), text)
    try:
        with waiting("Asking Storm"):
            return ask_storm(problem, text)
    except PropertyError as refusal:
        if not known and any(words in refusal.message for words in _UNREAD):
            raise reason from refusal
        raise PropertyError(f"{reason.message} {refusal.message}", **reason.place) from refusal


def storm_document(answer: StormAnswer, problem: Problem) -> dict[str, Any]:
    """Return Storm's answer as the document of a value; nothing was proved, so there are no bounds."""
    from ratherthan.explain.record import number

    mdp = problem.mdp
    return {
        "value": answer.value if isinstance(answer.value, bool) else number(answer.value),
        "lower": None,
        "upper": None,
        "states": mdp.states,
        "choices": mdp.choices,
        "branches": mdp.branches,
        "outcome": "uncertified",
        "message": answer.message,
        "engine": answer.engine,
    }
