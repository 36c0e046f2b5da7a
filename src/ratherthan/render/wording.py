"""A language and names enter, the words of pictures leave: tables of templates, and what a state is called."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources

from ratherthan.errors import InputError
from ratherthan.explain.explanation import Explanation
from ratherthan.model.lexicon import Lexicon

__all__ = ["amount", "place_of", "state_words", "words"]

Tables = Mapping[str, Mapping[str, str]]


@cache
def words(language: str) -> Tables:
    """Return the tables of words of a language.

    Raises
    ------
    InputError
        If there are none.
    """
    if language != "en":
        raise InputError(f"The language must be one of: en; got '{language}'.", language=language)
    text = resources.files("ratherthan.render").joinpath("words", "en.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def state_words(lexicon: Lexicon, state: int, name: str, *, named: bool) -> str:
    """Return what a state is called.

    Examples
    --------
    >>> state_words(Lexicon(state="grid {number}"), 3, "s3", named=True), state_words(Lexicon(), 3, "3", named=False)
    ('grid 3', 'state 3')
    """
    single = lexicon.states.get(name) or lexicon.states.get(str(state))
    if single:
        return single
    template = lexicon.state or ("{name}" if named else words(lexicon.language)["map"]["state"])
    return template.replace("{number}", str(state)).replace("{name}", name)


def place_of(explanation: Explanation, state: int) -> str:
    """Return what a state of an explanation is called."""
    record = explanation.states.get(state)
    name, named = (str(state), False) if record is None else (record.name, record.named)
    return state_words(explanation.lexicon, state, name, named=named)


def amount(value: float) -> str:
    """Return a number as it stands beside a mark: about three figures.

    Examples
    --------
    >>> amount(6.66667), amount(1234.6), amount(0.00012), amount(float("inf")), amount(4.0)
    ('6.67', '1235', '0.00012', '∞', '4')
    """
    if value in (float("inf"), float("-inf")):
        return "∞" if value > 0 else "−∞"
    if abs(value) >= 1e6 or (value and abs(value) < 1e-4):
        return f"{value:.2e}"
    said = f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
    return said.replace("-", "−")
