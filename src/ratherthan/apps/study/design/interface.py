"""The section ``[words]`` of a design enters, words of the interface leave: buttons, and what is said while an answer is saved.

The words come with the program in some languages. A design can bring its own, for another language or instead of these. What holds
of the program's holds of them: no other keys, and the same gaps, such as ``{number}``, which are filled in when a page is shown.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib import resources

from ratherthan.apps.study.design.cursor import Cursor, near
from ratherthan.apps.study.design.storing import same_language
from ratherthan.apps.study.pages.wording import FALLBACK, for_participants, spoken, words

__all__ = ["english_texts", "left_in_english", "own_words"]

GAP = re.compile(r"\{[^{}]*\}")
QUOTED = re.compile(r'"([^"\\\n]*)"')
MOST = 600
"""The most characters of one of them."""
DIRECTION = "direction"
NOT_TO_BE_SAID = ("language",)
"""What the files of words say about themselves."""


def own_words(at: Cursor) -> dict[str, str]:
    """Return ``[words]``.

    Parameters
    ----------
    at : Cursor
        At the design itself; the section may be missing.
    """
    if "words" not in at:
        at.get("words")
        return {}
    table, found = at.below("words"), {}
    known = {key: text for key, text in words(FALLBACK).items() if key not in NOT_TO_BE_SAID}
    for key in table.table:
        if key not in known:
            table.get(key)
            hint = (
                near(key, known) or " 'ratherthan study new FOLDER --language TAG' writes a design that has them all."
            )
            table.fail(key, f"The interface has no such word.{hint}")
        elif key == DIRECTION:
            found[key] = table.one_of(key, ("ltr", "rtl"))
        else:
            found[key] = table.text(key, most=MOST)
            _check_gaps(table, key, found[key], known[key])
    return found


def _check_gaps(table: Cursor, key: str, text: str, model: str) -> None:
    """Note gaps that are missing, and those that nothing would fill."""
    wanted, given = set(GAP.findall(model)), set(GAP.findall(text))
    if text and wanted - given:
        lacking = ", ".join(sorted(wanted - given))
        table.fail(
            key,
            f"What is filled in when the page is shown must occur here, to the letter: {lacking}. In English: “{model}”",
        )
    elif given - wanted:
        extra = min(given - wanted)
        known = f"here only {', '.join(sorted(wanted))} is" if wanted else "here nothing is"
        table.fail(key, f"Nothing fills in {extra[:40]}: {known} filled in. In English: “{model}”")


def left_in_english(language: str, own: Mapping[str, str] | None = None) -> tuple[str, ...]:
    """Return the keys of the words that participants of a study in a language meet in English.

    Parameters
    ----------
    language : str
        Of the design.
    own : mapping of str to str, optional
        Its own words. Where one is the English one to the letter, it counts as not translated, unless it is but a mark or a gap.
    """
    if same_language(spoken(language), language):
        return ()
    english, given = words(FALLBACK), own or {}
    return tuple(
        key
        for key in for_participants()
        if given.get(key, english[key]) == english[key] and any(map(str.isalpha, GAP.sub("", english[key])))
    )


@cache
def english_texts() -> frozenset[str]:
    """Return the texts of a new design in English, of two words and more: those that are translated are no longer among them."""
    text = (resources.files(__package__) / "material" / f"design.{FALLBACK}.toml").read_text(encoding="utf-8")
    return frozenset(found for found in QUOTED.findall(text) if " " in found)
