"""Text enters with the steps that it tells, a Sentence leaves."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Sentence"]


@dataclass(frozen=True, kw_only=True)
class Sentence:
    """One sentence of an explanation.

    Parameters
    ----------
    text : str
    steps : tuple of int
        The indices of the steps of the explanation that it tells; none where it speaks of the whole.
    number : int, optional
        Counted from 1 among the sentences that tell steps: the number of the mark in pictures.
    """

    text: str
    steps: tuple[int, ...] = ()
    number: int | None = None
