"""A state as a person gives it, a number or a name, enters; its number leaves."""

from __future__ import annotations

import operator
import re

from ratherthan.errors import QuestionError
from ratherthan.model.mdp import MDP

__all__ = ["start_of", "state_number"]

MOST_LISTED = 5


def state_number(mdp: MDP, given: str | int) -> int:
    """Return the number of a state that is given by its number or its exact name; the number wins.

    Parameters
    ----------
    mdp : MDP
    given : int or str
        ``12`` or ``"12"``, counted from 0; else a name as the model's `names` has it.

    Returns
    -------
    int

    Raises
    ------
    QuestionError
        Where there is no such state, or a name fits several.
    """
    if isinstance(given, str):
        number = int(given) if re.fullmatch(r"\s*[+-]?[0-9]{1,18}\s*", given) else None
    else:
        try:
            number = None if isinstance(given, bool) else operator.index(given)
        except TypeError:
            number = None
        if number is None:
            raise QuestionError(f"A state must be a whole number or a name, got {given!r}.", state=given)
    if number is not None and 0 <= number < mdp.states:
        return number
    if isinstance(given, str) and (number is None or mdp.names.strings is not None):
        return mdp.names.find(given)
    raise QuestionError(
        f"A state's number must lie in 0 … {mdp.states - 1}, got {number}. Numbers are counted from 0.", state=given
    )


def start_of(mdp: MDP) -> int:
    """Return the one initial state.

    Parameters
    ----------
    mdp : MDP

    Raises
    ------
    QuestionError
        Where there are several; it lists some.
    """
    if len(mdp.initial) == 1:
        return int(mdp.initial[0])
    some = [f"{s} ('{mdp.names[s]}')" if mdp.names.named else str(s) for s in map(int, mdp.initial[:MOST_LISTED])]
    more = ", …" if len(mdp.initial) > MOST_LISTED else ""
    raise QuestionError(
        f"It must be clear where to start, but the model has {len(mdp.initial)} initial states: {', '.join(some)}{more}. "
        "Choose one with --start STATE."
    )
