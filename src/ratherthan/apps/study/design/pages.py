"""What one participant sees and is asked, page by page, as frozen data: a Screen shows texts, a map, cards, and records answers."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["NEITHER", "PHASES", "RECORD_TYPES", "Card", "Option", "Record", "Screen"]

PHASES = ("consent", "instructions", "comprehension", "trial", "attention", "grouping", "about", "thanks")
RECORD_TYPES = ("choice", "number", "text", "flag")
NEITHER = "neither"
"""What is recorded where none of the explanations of a grouping is preferred."""


@dataclass(frozen=True, kw_only=True)
class Option:
    """One allowed value of a record.

    Parameters
    ----------
    value : str or int
        What is stored.
    label : str
        What the person reads.
    """

    value: str | int
    label: str


@dataclass(frozen=True, kw_only=True)
class Record:
    """One thing that a screen records.

    Parameters
    ----------
    name : str
        A column of the codebook: "understanding".
    type : str
        "choice", "number", "text" or "flag" (true or false).
    label : str
        What it is, for the codebook and for the person: the item's text.
    unit : str, optional
        "points", "years".
    options : tuple of Option
        The allowed values, in order; empty: free.
    least, most : float, optional
        Bounds of a number, both allowed themselves.
    longest : int, optional
        The most characters of a text.
    required : bool
        Whether the person has to answer.
    correct : int or str, optional
        The right answer of a comprehension or attention check. NEVER sent to a browser.
    """

    name: str
    type: str
    label: str
    unit: str | None = None
    options: tuple[Option, ...] = ()
    least: float | None = None
    most: float | None = None
    longest: int | None = None
    required: bool = True
    correct: int | str | None = None


@dataclass(frozen=True, kw_only=True)
class Card:
    """One of several explanations to choose from.

    Parameters
    ----------
    value : str
        The id of the kind, or `NEITHER`: what is recorded.
    text : str
        The explanation as stored, or the words for neither.
    language : str, optional
        Of the text, where it is not that of the pages.
    """

    value: str
    text: str
    language: str | None = None


@dataclass(frozen=True, kw_only=True)
class Screen:
    """One page of one participant: what it shows and what it records.

    Parameters
    ----------
    id : str
        Unique and stable within a participant's list: "consent", "instructions-1", "comprehension", "trial-m2-selective",
        "attention-1", "grouping-m1-g3", "about-you", "thanks".
    phase : str
        One of `PHASES`.
    title : str
    paragraphs : tuple of str
        Plain text.
    map : str, optional
        The id of the map that is shown; its picture is ``/media/<map>.svg``.
    kind : str, optional
        The id of the kind of explanation shown, of a trial.
    explanation : str, optional
        The text as stored, of a trial; empty for the kind that says nothing.
    cards : tuple of Card
        Of a grouping, in the order of this participant.
    records : tuple of Record
    map_place, kind_place : int, optional
        From 1: where the map and the kind stand in this participant's order.
    grouping : str, optional
        The id of the grouping.
    language : str, optional
        Of the explanation, where it is not that of the pages.
    """

    id: str
    phase: str
    title: str
    paragraphs: tuple[str, ...]
    map: str | None = None
    kind: str | None = None
    explanation: str | None = None
    cards: tuple[Card, ...] = ()
    records: tuple[Record, ...] = ()
    map_place: int | None = None
    kind_place: int | None = None
    grouping: str | None = None
    language: str | None = None
