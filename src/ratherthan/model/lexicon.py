"""Names enter, words leave: how actions, states and objectives are called in sentences. Words are data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

__all__ = ["OBJECTIVE_WORDS", "Lexicon"]

OBJECTIVE_WORDS = (
    *("best", "best_flexible", "among", "better", "worse", "equal", "noun"),
    *(
        "best_one",
        "among_one",
        "better_one",
        "worse_one",
        "endless",
        "unit",
        "amount",
        "arrive",
        "arrive_at_all",
        "there",
    ),
)
"""The words that an objective has; the templates say what each is for."""


@dataclass(frozen=True, kw_only=True)
class Lexicon:
    """The words of one model, user or language.

    Parameters
    ----------
    language : str
        Which templates speak, ``"en"``.
    actions : mapping of str to str
        A verb phrase per action name: ``{"east": "move east", "get": "pick up the parcel"}``.
    gerunds : mapping of str to str
        The same as a gerund, only where the language's rule would fail: ``{"get": "picking up the parcel"}``.
    state : str
        A noun phrase with ``{number}`` and ``{name}`` in it, such as ``"grid {number}"``; empty for the default.
    states : mapping of str to str
        A noun phrase for single states, by name or number: ``{"12": "the crossing"}``.
    objectives : mapping of str to mapping
        Words for an objective by its reward's name (``"distance"``, ``"steps"``), else by its kind (``"probability"``,
        ``"safety"``, ``"risk"``, ``"deadline"``, ``"mission"``, ``"event"``, ``"discounted"``): ``best`` ("the shortest route")
        and so on, those of `OBJECTIVE_WORDS`.
    """

    language: str = "en"
    actions: Mapping[str, str] = field(default_factory=dict)
    gerunds: Mapping[str, str] = field(default_factory=dict)
    state: str = ""
    states: Mapping[str, str] = field(default_factory=dict)
    objectives: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
