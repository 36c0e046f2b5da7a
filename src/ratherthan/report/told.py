"""An Explanation enters, its sentences leave as a page shows them: those about steps with their numbers, then the rest."""

from __future__ import annotations

from dataclasses import dataclass

from ratherthan.explain.explanation import Explanation
from ratherthan.narrate import sentences

__all__ = ["Told", "told_of"]


@dataclass(frozen=True, kw_only=True)
class Told:
    """The text of an explanation, taken apart.

    Parameters
    ----------
    numbered : tuple of (int, str, tuple of int)
        A number, a sentence, and the steps that it tells.
    closing : tuple of str
        What is said besides.
    """

    numbered: tuple[tuple[int, str, tuple[int, ...]], ...]
    closing: tuple[str, ...]


def told_of(explanation: Explanation) -> Told:
    """Return the sentences of an explanation.

    Parameters
    ----------
    explanation : Explanation
    """
    said = sentences(explanation)
    return Told(
        numbered=tuple((one.number, one.text, one.steps) for one in said if one.number is not None),
        closing=tuple(one.text for one in said if one.number is None),
    )
