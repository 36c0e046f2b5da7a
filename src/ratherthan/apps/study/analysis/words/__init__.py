"""A key enters, the sentence for it leaves: all prose of the report lies in ``en.toml`` beside this file."""

from __future__ import annotations

import functools
import re
import tomllib
from pathlib import Path
from typing import Any

__all__ = ["listed", "number", "p_text", "percent", "say"]


@functools.cache
def _words() -> dict[str, Any]:
    return tomllib.loads((Path(__file__).parent / "en.toml").read_text(encoding="utf-8"))


def say(key: str, **values: object) -> str:
    """Return the text at a key such as "notes.twice", its places filled in, and what is counted in the singular where it is one.

    Examples
    --------
    >>> say("tables.kind")
    'Explanation'
    >>> say("tests.sign_value", first=1, count=1), say("tests.sign_value", first=1, count=21)
    ('1 of 1 person', '1 of 21 persons')
    """
    found: Any = _words()
    for part in key.split("."):
        found = found[part]
    if not isinstance(found, str):
        raise KeyError(f"no text at {key}")
    return _one().sub(lambda hit: _words()["singular"][hit[1]], " ".join(found.format(**values).split()))


@functools.cache
def _one() -> re.Pattern[str]:
    """Return what finds "persons" after a one that is no part of a number."""
    plurals = "|".join(_words()["singular"])
    return re.compile(rf"(?<=(?<![\d.,−-])1 )({plurals})\b")


def listed(parts: list[str] | tuple[str, ...]) -> str:
    """Return parts as a list in a sentence.

    Examples
    --------
    >>> listed(["a"]), listed(["a", "b"]), listed(["a", "b", "c"])
    ('a', 'a and b', 'a, b and c')
    """
    if len(parts) < 2:
        return "".join(parts)
    return say("forms.list", first=", ".join(parts[:-1]), last=parts[-1])


def number(value: float | None, digits: int = 2) -> str:
    """Return a number as the report has it; very large and small ones by powers of ten.

    Examples
    --------
    >>> number(3.14159), number(-0.0001), number(1234567.0), number(None)
    ('3.14', '0.00', '1.23e+06', '–')
    """
    if value is None:
        return "–"
    if abs(value) >= 1e5:
        return f"{value:.{digits}e}"
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text.replace("-", "−")


def p_text(p: float | None) -> str:
    """Return a p value, never rounded across the levels that people look at.

    Examples
    --------
    >>> p_text(0.0064), p_text(0.2), p_text(0.04999), p_text(0.0501), p_text(1e-9)
    ('= .0064', '= .20', '= .0499', '= .0501', '< .0001')
    """
    if p is None:
        return "–"
    if p < 0.0001:
        return "< .0001"
    if p >= 0.995:
        return "> .99"
    digits = 2 if p >= 0.1 else 3 if p >= 0.01 else 4
    if abs(p - 0.05) < 0.002:
        digits = 4
        cut = int(p * 10**digits) / 10**digits  # cut, not rounded: 0.04999 is below 0.05 and must look so
        return "= " + f"{cut:.{digits}f}".removeprefix("0") if p < 0.05 else _above(p)
    return "= " + f"{p:.{digits}f}".removeprefix("0")


def _above(p: float) -> str:
    text = f"{p:.4f}".removeprefix("0")
    return f"= {text}"


def percent(share: float | None, digits: int = 0) -> str:
    """Return a share in per cent.

    Examples
    --------
    >>> percent(0.463), percent(0.577, 1)
    ('46 %', '57.7 %')
    """
    return "–" if share is None else f"{100 * share:.{digits}f} %"
