"""Numbers with bounds enter, their words leave: the number, and between which figures it is proved to lie."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal

from ratherthan.explain.explanation import Measured, Tally
from ratherthan.factors import Interval
from ratherthan.narrate.numbers import plain

__all__ = ["Number", "bounds_in_words", "counted", "in_words", "lost", "measured"]

Number = tuple[str, str]
"""What is written, and how well it is proved; the second may be empty."""
MOST_DIGITS = 6
CLOSE = 1e-6
"""Bounds that are relatively closer than this are not shown apart."""


def measured(rows: Sequence[Measured], said: Mapping[str, str]) -> dict[str, Number]:
    """Return the numbers of actions in words, with as many decimals as tell them apart.

    Parameters
    ----------
    rows : sequence of Measured
    said : mapping
        The table ``[numbers]`` of the page.
    """
    finite = [row.number.value for row in rows if row.fate is None and math.isfinite(row.number.value)]
    digits = apart(finite)
    found = {}
    for row in rows:
        if row.fate is not None:
            found[row.action] = (said["dead" if row.fate == "dead end" else "fail"], "")
        elif row.number.infinite or math.isinf(row.number.value):
            proof = said["exact"] if row.number.infinite else said["unproved"]
            found[row.action] = (said["infinite" if row.number.value > 0 else "minus_infinite"], proof)
        else:
            found[row.action] = (decimal(row.number.value, digits), proof_of(row.number, said))
    return found


def apart(values: Sequence[float]) -> int:
    """Return with how many decimals numbers look different that are, two at least where one is no whole number.

    Examples
    --------
    >>> apart([6.0, 7.0]), apart([6.6667, 10.6667]), apart([23.5806, 23.5811, 23.5806 + 1e-9])
    (0, 2, 4)
    """
    if all(abs(value - round(value)) <= CLOSE * max(1.0, abs(value)) for value in values):
        return 0
    ordered = sorted(values)
    steps = [b - a for a, b in itertools.pairwise(ordered) if b - a > 2 * CLOSE * max(abs(a), abs(b))]
    needed = [math.ceil(-math.log10(step)) for step in steps]
    tiny = [math.ceil(-math.log10(abs(value))) for value in values if value]
    return min(max([2, *needed, *tiny]), MOST_DIGITS)


def decimal(value: float, digits: int) -> str:
    """Return a number with so many decimals; the last of them is rounded."""
    said = f"{value + 0.0:,.{digits}f}"
    return "0" if float(said.replace(",", "")) == 0.0 == value else said.replace("-", "−")


def proof_of(number: Interval, said: Mapping[str, str]) -> str:
    """Return how well a finite number is proved."""
    if math.isinf(number.lower) and math.isinf(number.upper):
        return said["unproved"]
    return bounds_in_words(number, said)


def in_words(number: Interval, said: Mapping[str, str], spelled: Mapping[str, str], *, chance: bool) -> Number:
    """Return a number in words."""
    if number.infinite:
        return said["infinite" if number.lower > 0 else "minus_infinite"], said["exact"]
    return plain(number.value, spelled, chance=chance), proof_of(number, said)


def bounds_in_words(number: Interval, said: Mapping[str, str]) -> str:
    """Return between which figures a number is proved to lie, rounded outwards.

    Examples
    --------
    >>> said = {"between": "{lower} to {upper}", "exact": "proved", "below": "≤ {upper}", "above": "≥ {lower}"}
    >>> bounds_in_words(Interval(value=20 / 3, lower=20 / 3 - 1e-9, upper=20 / 3 + 1e-9), said)
    '6.66666 to 6.66667'
    >>> bounds_in_words(Interval(value=7.0, lower=6.98, upper=7.013), said)
    '6.98 to 7.02'
    >>> bounds_in_words(Interval(value=4.0, lower=4.0, upper=4.0), said)
    'proved'
    """
    low, high = number.lower, number.upper
    if math.isinf(low):
        return said["below"].format(upper=_rounded(high, _digits(number), ROUND_CEILING))
    if math.isinf(high):
        return said["above"].format(lower=_rounded(low, _digits(number), ROUND_FLOOR))
    if low == high and _short(low):
        return said["exact"]
    digits = _digits(number)
    return said["between"].format(lower=_rounded(low, digits, ROUND_FLOOR), upper=_rounded(high, digits, ROUND_CEILING))


def lost(rows: Mapping[str, Interval], least: Interval, said: Mapping[str, str]) -> dict[str, str]:
    """Return how far the numbers of actions are from the smallest: their shares in the outcome."""
    shares = {}
    for action, number in rows.items():
        same = number.infinite and least.infinite and number.lower == least.lower
        endless = (number.infinite or least.infinite) and not same
        near = abs(number.value - least.value) <= 2 * CLOSE * max(abs(number.value), abs(least.value))
        shares[action] = math.inf if endless else 0.0 if same or near else number.value - least.value
    digits = apart([share for share in shares.values() if math.isfinite(share)])
    return {
        action: said["infinite"] if math.isinf(share) else said["zero"] if share == 0.0 else decimal(share, digits)
        for action, share in shares.items()
    }


def counted(row: Tally, said: Mapping[str, str]) -> str:
    """Return a count of decisions in words."""
    if row.lower == row.upper:
        return f"{row.lower:,}"
    return said["count_between"].format(lower=f"{row.lower:,}", upper=f"{row.upper:,}")


def _short(value: float) -> bool:
    return round(value, 2) == value


def _digits(number: Interval) -> int:
    """Return how many decimals tell the bounds apart, or show six figures."""
    finite = [abs(bound) for bound in (number.lower, number.upper) if math.isfinite(bound)]
    width = number.upper - number.lower if len(finite) == 2 else 0.0
    size = max(width, 10 * CLOSE * max(finite), 1e-12)
    return min(max(math.ceil(-math.log10(size)), 0), 2 * MOST_DIGITS) if size < 1 else 0


def _rounded(value: float, digits: int, way: str) -> str:
    said = f"{Decimal(value).quantize(Decimal(1).scaleb(-digits), rounding=way):f}"
    said = said.rstrip("0").rstrip(".") if "." in said else said
    return "0" if said == "-0" else said.replace("-", "−")
