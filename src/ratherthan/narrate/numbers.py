"""Numbers enter, their words leave: at most two decimals, as many as make them differ."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

__all__ = ["at_most", "contrasted", "percent", "plain"]


def plain(value: float, words: Mapping[str, str], *, chance: bool = False) -> str:
    """Return one number in words: one decimal, two where one would turn something into nothing (or all).

    Parameters
    ----------
    value : float
    words : mapping
        The table ``[numbers]`` of the templates.
    chance : bool
        Whether it is a probability: then a number below 1 is not shown as 1.
    """
    return _spell(value, 1 if _faithful(value, 1, chance) else 2, words, chance)


def contrasted(
    own: float, others: Sequence[float], words: Mapping[str, str], *, chance: bool = False
) -> tuple[str, list[str]] | None:
    """Return `own` and `others` in words that differ, or None where two decimals cannot tell them apart."""
    numbers = [own, *others]
    for digits in (1, 2):
        texts = [_spell(value, digits, words, chance, signed=min(numbers) < 0) for value in numbers]
        faithful = digits == 2 or all(_faithful(value, digits, chance) for value in numbers)
        if faithful and all(text != texts[0] for text in texts[1:]):
            return texts[0], texts[1:]
    return None


def _faithful(value: float, digits: int, chance: bool) -> bool:
    if math.isinf(value):
        return True
    rounded = round(value, digits)
    return not (rounded == 0 != value or (chance and rounded == 1 != value))


def _spell(value: float, digits: int, words: Mapping[str, str], chance: bool, *, signed: bool = False) -> str:
    if math.isinf(value):
        return words["infinite" if value > 0 else "infinite_negative"]
    if not _faithful(value, digits, chance) and digits == 2:
        if value < 0:
            return words["tiny_negative"]
        return words["nearly_one"] if chance and value > 0.5 else words["tiny_positive" if signed else "tiny"]
    text = f"{value + 0.0:.{digits}f}"
    return text.rstrip("0").rstrip(".")


def percent(share: float) -> str:
    """Return a share as a percentage, with as many decimals as keep it off 0, 50 and 100 where it is not there.

    Examples
    --------
    >>> percent(0.41), percent(0.6), percent(0.001), percent(1e-9)
    ('41 %', '60 %', '0.1 %', 'less than 0.01 %')
    """
    for digits in (0, 1, 2):
        rounded = round(100 * share, digits)
        if rounded not in (0, 50, 100) or rounded == 100 * share:
            return f"{rounded:.{digits}f} %"
    if share < 0.25:
        return "less than 0.01 %"
    return f"{round(100 * share, 2):g} %" if share < 0.75 else "more than 99.99 %"


def at_most(value: float) -> str:
    """Return a number in two decimals at most, rounded up, so that "at most" stays true.

    Examples
    --------
    >>> at_most(4.0000000001), at_most(2.341), at_most(4e-7)
    ('4', '2.35', '0.01')
    """
    near = round(value, 2)
    if abs(near - value) > 1e-6 * abs(value):  # the width of certified bounds, never so much as to make it nothing
        near = math.ceil(value * 100) / 100
    return f"{near:.2f}".rstrip("0").rstrip(".")
