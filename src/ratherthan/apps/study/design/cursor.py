"""A value of a TOML file and its place enter; a checked text, number, list or table leaves, or a fault is noted.

A reader of a design asks a cursor for what it needs and gets something of the right type in any case, so that one run finds all
faults. Which keys were asked for is remembered: `Cursor.done` notes those that nobody reads, with the nearest that somebody does.
"""

from __future__ import annotations

import difflib
import math
import re
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ratherthan.apps.study.design.faults import Faults

__all__ = ["ID", "LONG", "LONGEST_ID", "MOST_ROWS", "SHORT", "Cursor", "near", "shown", "strange"]

ID = re.compile(r"[a-z0-9][a-z0-9_-]*", re.ASCII)
LONGEST_ID = 40
SHORT = 300
"""The most characters of a title or label."""
LONG = 4000
"""The most characters of a paragraph."""
MOST_ROWS = 60
"""The most maps, kinds, items, options, paragraphs …"""
STEERING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\ufeff")


def near(word: str, known: Iterable[str]) -> str:
    """Return ``" Did you mean 'x'?"`` where a known word is near, else nothing."""
    found = difflib.get_close_matches(word[:100], list(known), n=1, cutoff=0.5)
    return f" Did you mean '{found[0]}'?" if found else ""


def shown(value: Any) -> str:
    """Return a value as its author would recognise it, cut where it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, int) and abs(value) > 10**20:
        return "a very long number"
    plain = "".join(c if c.isprintable() else "�" for c in str(value))
    plain = plain if len(plain) <= 60 else plain[:60] + "…"
    return f"'{plain}'" if isinstance(value, str) else plain


def strange(text: str) -> str | None:
    """Return the first character that no text may hold, as U+0000: one that controls a terminal, a database or the way of writing."""
    for character in text:
        if unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp") or character in STEERING:
            return f"U+{ord(character):04X}"
    return None


@dataclass
class Cursor:
    """A table of a TOML file, and where it stands.

    Parameters
    ----------
    table : mapping
    keys : tuple of str or int
        Where the table stands; numbers count from 1.
    faults : Faults
    """

    table: Mapping[str, Any]
    keys: tuple[str | int, ...]
    faults: Faults
    asked: set[str] = field(default_factory=set)

    def __contains__(self, key: str) -> bool:
        """Whether the key is given."""
        return key in self.table

    def fail(self, key: str | None, sentence: str) -> None:
        """Note a fault at a key, or at the table itself."""
        self.faults.add(self.keys if key is None else (*self.keys, key), sentence)

    def get(self, key: str) -> Any:
        """Return a value as it is, None where there is none."""
        self.asked.add(key)
        return self.table.get(key)

    def done(self) -> None:
        """Note every key that nobody asked for."""
        for key in self.table:
            if key not in self.asked:
                self.fail(
                    key,
                    f"This key is not known here; known are {', '.join(sorted(self.asked))}.{near(key, self.asked)}",
                )

    def text(self, key: str, default: str | None = None, *, most: int = SHORT) -> str:
        """Return a text on one line; one is required where there is no default."""
        value = self.get(key)
        if value is None:
            if default is None:
                self.fail(key, f'A text is missing: write {key} = "…".')
            return default or ""
        return self._line(key, value, most, empty=default == "")

    def optional(self, key: str, *, most: int = SHORT) -> str | None:
        """Return a text on one line, None where none is given."""
        value = self.get(key)
        return None if value is None else self._line(key, value, most, empty=False) or None

    def _line(self, key: str, value: Any, most: int, *, empty: bool) -> str:
        if not isinstance(value, str):
            self.fail(key, f"This must be a text in quotes, got {shown(value)}.")
            return ""
        found = strange(value)
        if found:
            self.fail(key, f"A text must be one line without control characters, got {found}.")
        elif len(value) > most:
            self.fail(key, f"A text must have at most {most} characters here, got {len(value)}.")
        elif not value.strip() and not empty:
            self.fail(key, "The text is empty: write one, or leave the key out where it is optional.")
        else:
            return value.strip()
        return ""

    def paragraphs(self, key: str = "paragraphs", *, needed: bool = True) -> tuple[str, ...]:
        """Return paragraphs: of a list of texts, or of one text with blank lines between."""
        value = self.get(key)
        if value is None:
            if needed:
                self.fail(key, f'Paragraphs are missing: write {key} = ["…", "…"].')
            return ()
        if isinstance(value, str):
            value = [" ".join(part.split()) for part in re.split(r"\n\s*\n", value) if part.strip()]
        return self._lines(key, value, LONG)

    def texts(self, key: str) -> tuple[str, ...]:
        """Return a list of short texts, which must not be empty."""
        value = self.get(key)
        if value is None:
            self.fail(key, f'A list is missing: write {key} = ["…", "…"].')
            return ()
        found = self._lines(key, value, SHORT)
        if value == []:
            self.fail(key, "The list is empty: it must have at least one text.")
        return found

    def _lines(self, key: str, value: Any, most: int) -> tuple[str, ...]:
        if not isinstance(value, list):
            self.fail(key, f'This must be a list of texts, ["…", "…"], got {shown(value)}.')
            return ()
        if len(value) > MOST_ROWS:
            self.fail(key, f"A list must have at most {MOST_ROWS} entries, got {len(value)}.")
            return ()
        return tuple(self._line(f"{key}[{number}]", one, most, empty=False) for number, one in enumerate(value, 1))

    def name(self, key: str = "id") -> str:
        """Return an id: small letters, digits, - and _."""
        value = self.get(key)
        if value is None:
            self.fail(key, f"An id is missing: write {key} = \"…\", of small letters, digits and '-'.")
            return ""
        if not isinstance(value, str) or not ID.fullmatch(value) or len(value) > LONGEST_ID:
            self.fail(
                key,
                f"An id must begin with a small letter (a-z) or digit and have only these, '-' and '_', at most {LONGEST_ID}; got {shown(value)}.",
            )
            return ""
        return value

    def whole(self, key: str, default: int | None, *, least: int = 0, most: int = 1_000_000) -> int:
        """Return a whole number between bounds; it is required where there is no default."""
        value = self.get(key)
        if value is None and default is not None:
            return default
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            self.fail(
                key,
                f"This must be a whole number from {least} to {most}, got {'nothing' if value is None else shown(value)}.",
            )
            return default if default is not None else least
        return value

    def number(self, key: str, default: float | None = None) -> float | None:
        """Return a finite number, or the default."""
        value = self.get(key)
        if value is None:
            return default
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not math.isfinite(value)
            or abs(value) > 1e15
        ):
            self.fail(key, f"This must be a number, got {shown(value)}.")
            return default
        return float(value)

    def flag(self, key: str, *, default: bool) -> bool:
        """Return true or false."""
        value = self.get(key)
        if value is None:
            return default
        if not isinstance(value, bool):
            self.fail(key, f"This must be true or false, without quotes, got {shown(value)}.")
            return default
        return value

    def one_of(self, key: str, known: Collection[str], default: str | None = None) -> str:
        """Return one of some words."""
        value = self.get(key)
        if value is None and default is not None:
            return default
        if not isinstance(value, str) or value not in known:
            hint = near(value, known) if isinstance(value, str) else ""
            came = "nothing" if value is None else shown(value)
            self.fail(key, f"This must be one of {', '.join(known)}; got {came}.{hint}")
            return default or ""
        return value

    def below(self, key: str) -> Cursor:
        """Return a table under a key, an empty one (and a fault) where there is none."""
        value, keys = self.get(key), (*self.keys, key)
        if isinstance(value, dict):
            return Cursor(table=value, keys=keys, faults=self.faults)
        section = ".".join(str(part) for part in keys)
        missing = f"A section is missing: [{section}]."
        self.fail(key, missing if value is None else f"This must be a section, [{section}], got {shown(value)}.")
        return Cursor(table={}, keys=keys, faults=Faults(""))  # one fault is told, not each key that is not there

    def rows(self, key: str, *, least: int = 1) -> list[Cursor]:
        """Return the tables of a list ``[[key]]``."""
        value, name = self.get(key), ".".join(str(part) for part in (*self.keys, key))
        if value is None:
            value = []
        if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
            self.fail(key, f"This must be sections [[{name}]], got {shown(value)}.")
            return []
        if not least <= len(value) <= MOST_ROWS:
            self.fail(key, f"There must be {least} to {MOST_ROWS} sections [[{name}]], got {len(value)}.")
            return []
        return [
            Cursor(table=one, keys=(*self.keys, key, number), faults=self.faults) for number, one in enumerate(value, 1)
        ]
