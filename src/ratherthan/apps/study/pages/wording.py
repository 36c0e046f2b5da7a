"""A language's tag enters, the words of the interface in that language leave: from words/*.toml, and the design's own.

A language is found by its tag, else by the first part of it (``pt-BR``, then ``pt``), else it is English; so a study in
a language that nobody has written the buttons for still has buttons, and its design can bring their words along.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path

__all__ = ["FALLBACK", "for_participants", "in_browser", "languages", "spoken", "words"]

FALLBACK = "en"
FOLDER = Path(__file__).parent / "words"
# Sections whose words the browser's own modules say; the rest is said by the server alone.
BROWSERS = ("study", "ending", "faults", "withdrawal")
PARTICIPANTS = (*BROWSERS, "messages")


@cache
def languages() -> dict[str, str]:
    """Return the languages that the interface speaks: tag to its own name.

    Returns
    -------
    dict of str to str
        Such as ``{"de": "Deutsch", "en": "English"}``.
    """
    return {path.stem: _read(path.stem)["language"] for path in sorted(FOLDER.glob("*.toml"))}


def spoken(language: str) -> str:
    """Return the tag of the words that a study in `language` gets.

    Parameters
    ----------
    language : str
        An IETF tag, such as ``"de-AT"``.

    Returns
    -------
    str
        The tag itself, the first part of it, or English, whichever there is first.
    """
    short = language.strip().lower().partition("-")[0]
    known = {tag.lower(): tag for tag in languages()}
    return known.get(language.strip().lower(), known.get(short, FALLBACK))


def words(language: str, own: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return the words of the interface, key to text.

    Parameters
    ----------
    language : str
        An IETF tag.
    own : mapping of str to str, optional
        Words that take the place of those of the same key; other keys are left out.

    Returns
    -------
    dict of str to str
        All keys that English has.
    """
    found = {**_read(FALLBACK), **_read(spoken(language))}
    found.update((key, text) for key, text in (own or {}).items() if key in found)
    return found


@cache
def in_browser() -> tuple[str, ...]:
    """Return the keys of the words that the browser's own modules say."""
    return tuple(key for section in BROWSERS for key in _tables(FALLBACK)[section])


@cache
def for_participants() -> tuple[str, ...]:
    """Return the keys of the words that participants meet; the rest is for researchers."""
    return tuple(key for section in PARTICIPANTS for key in _tables(FALLBACK)[section])


@cache
def _read(tag: str) -> dict[str, str]:
    """Return the words of one file, without the sections that group them."""
    return {key: text for table in _tables(tag).values() for key, text in table.items()}


@cache
def _tables(tag: str) -> dict[str, dict[str, str]]:
    """Return the words of one file, in its sections."""
    return tomllib.loads((FOLDER / f"{tag}.toml").read_text(encoding="utf-8"))
