"""Steps with the numbers of their alternatives enter, what these would cost leaves, rounded so that what is said stays true.

A difference is known to lie between two bounds. It is said as it is where both agree with a number of two decimals up to a millionth;
else with two figures and "about", where all that the bounds allow rounds to that; else as a range. Where the sign is open nothing is
said. Of a run, the least and the largest difference are said, rounded outwards: they are true of each of its steps.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ratherthan.explain.explanation import Measured, Step
from ratherthan.factors import Comparison, compare
from ratherthan.narrate.evidence import claims_at
from ratherthan.narrate.words import Vocabulary

__all__ = ["details", "rounded", "run_details"]

NEAR = 1e-6
"""What agrees with a round number up to this share of it is said as that number."""
EXACT = 1e-9
"""The same for an end of a range that has more than two figures."""
LEAST = 0.01
FATES = ("dead end", "may fail")


class _Difference(NamedTuple):
    """By how much an alternative's number is larger, at a level: bounds; `fate` where it is infinite; None of these where it is open."""

    level: int
    bounds: tuple[float, float] | None
    fate: str | None


def details(words: Vocabulary, step: Step) -> str:
    """Return what the alternatives of a step would lead to, if it was asked for."""
    if not words.explanation.question.detail:
        return ""
    table, on = words.table("details"), _on(words)
    parts = [str(table["only_way"])] * sum(claim.claim == "only way on" for claim in step.claims)
    for claim in step.claims:
        for fate in FATES:
            rows = claim.evidence.others if claim.claim == "avoids" else ()
            actions = [row.action for row in rows if isinstance(row, Measured) and row.fate == fate]
            if actions:
                parts.append(str(table[_fate(fate, on)]).format(others=words.alternatives(actions)))
    groups: dict[str, list[str]] = {}
    differences = _differences(words, step)
    if "avoids" not in claims_at(step, 0):  # which was said above
        for fate, actions in _lost(differences).items():
            parts.append(str(table[_fate(fate, on)]).format(others=words.alternatives(actions)))
    for action, found in differences.items():
        said = "" if found.bounds is None else _said(words, found.level, *found.bounds)
        if said:
            groups.setdefault(said, []).append(action)
    for said, actions in groups.items():
        parts.append(str(table["instead"]).format(others=words.alternatives(actions), what=said) + on)
    return "".join(parts)


def run_details(words: Vocabulary, steps: Sequence[Step]) -> str:
    """Return what any other action would cost at least and at most along a run, if it was asked for."""
    if not words.explanation.question.detail:
        return ""
    table, on = words.table("details"), _on(words)
    if "only way on" in claims_at(steps[0], 0):
        return str(table["only_way"])
    known = [found for step in steps for found in _differences(words, step).values()]
    finite = [found for found in known if found.bounds is not None]
    fates = {found.fate for found in known if found.bounds is None}
    if None in fates or len({found.level for found in known}) != 1:
        return ""
    if not finite:
        return (
            str(table["run_" + _fate("dead end" if fates == {"dead end"} else "may fail", on)])
            if not known[0].level
            else ""
        )
    level = finite[0].level
    turned = words.objectives[level].record.maximise
    ends = [(-b[1], -b[0]) if turned else b for b in (found.bounds for found in finite) if b is not None]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    unsure = len(finite) < len(known)
    if low < 0.0 or high == 0.0 or (unsure and low == 0.0):
        return ""
    said = _along(words, level, low, math.inf if unsure else high)
    template = str(words.table("differences")[_key(words, level, more=not turned)])
    what = template.format(by=said, **words.objectives[level].words)
    key = ("run_unsure_step" if on else "run_unsure") if unsure else "run"
    return str(table[key]).format(what=what) + on


def _lost(differences: Mapping[str, _Difference]) -> dict[str, list[str]]:
    """Return the actions with which the first objective may not be reached, by what becomes of it."""
    found: dict[str, list[str]] = {}
    for fate in FATES:
        actions = [action for action, one in differences.items() if one.fate == fate and one.level == 0]
        if actions:
            found[fate] = actions
    return found


def _fate(fate: str, on: str) -> str:
    """Return which template says what becomes of it."""
    return "dead_end" if fate == "dead end" else "may_fail_step" if on else "may_fail"


def _along(words: Vocabulary, level: int, low: float, high: float) -> str:
    """Return the least and the largest difference along a run in words."""
    table, scale = words.table("differences"), _scale(words, level)
    least, most = _outwards(low * scale, up=False), _outwards(high * scale, up=True)
    if math.isinf(high):
        return str(table["at_least"]).format(by=_with_unit(words, level, least))
    if low == 0.0 or least == "0":
        return str(table["at_most"]).format(by=_with_unit(words, level, most))
    if least == most:
        return _with_unit(words, level, least)
    return str(table["range"]).format(low=least, high=_with_unit(words, level, most))


def _on(words: Vocabulary) -> str:
    """Return "as we go on" where single steps are judged by what the policy does after them."""
    return str(words.table("details")["on"]) if words.explanation.question.policy_values else ""


def _differences(words: Vocabulary, step: Step) -> dict[str, _Difference]:
    """Return by how much the number of each alternative differs, at the first level where it does."""
    if not step.numbers:
        return {}
    own, *others = zip(*step.numbers, strict=True)
    return {row[0].action: _against(words, own, row) for row in others}


def _against(words: Vocabulary, own: Sequence[Measured], row: Sequence[Measured]) -> _Difference:
    tolerance, last = words.explanation.question.tolerance, len(row) - 1
    for level, (mine, its) in enumerate(zip(own, row, strict=True)):
        order = compare(its.number, mine.number, tolerance)
        if order is Comparison.EQUAL and level < last and mine.number.finite:
            continue
        if not (mine.number.finite and its.number.finite):
            return _Difference(level, None, its.fate if mine.number.finite else None)
        if order is Comparison.EQUAL:
            return _Difference(level, (0.0, 0.0), None)
        low, high = its.number.lower - mine.number.upper, its.number.upper - mine.number.lower
        return _Difference(level, None if order is Comparison.OPEN else (low, high), None)
    return _Difference(last, None, None)


def _said(words: Vocabulary, level: int, low: float, high: float) -> str:
    """Return a difference in words; nothing where the bounds leave its sign open."""
    table, phrases = words.table("differences"), words.objectives[level].words
    if low == high == 0.0:
        return str(table["none"]).format(**phrases)
    if low <= 0.0 <= high:
        return ""
    more, scale = low > 0.0, _scale(words, level)
    least, most = sorted((abs(low) * scale, abs(high) * scale))
    text, about = rounded(least, most)
    if text == "":
        amount = str(table["tiny"]).format(by=_with_unit(words, level, f"{LEAST:g}"))
    elif about and " " in text:
        first, second = text.split(" ")
        amount = str(table["range"]).format(low=first, high=_with_unit(words, level, second))
    else:
        amount = _with_unit(words, level, text)
        amount = str(table["about"]).format(by=amount) if about else amount
    return str(table[_key(words, level, more=more)]).format(by=amount, **phrases)


def rounded(low: float, high: float) -> tuple[str, bool]:
    """Return a positive number between two bounds as a person would say it, and whether that is only about right.

    Returns
    -------
    text : str
        One number; two with a blank between them where one is not enough; "" where it is less than 0.01.
    about : bool

    Examples
    --------
    >>> (
    ...     rounded(3.9999999, 4.0000001),
    ...     rounded(0.41421, 0.41422),
    ...     rounded(127.3, 127.4),
    ...     rounded(3.2, 4.9),
    ...     rounded(0.001, 0.002),
    ... )
    (('4', False), ('0.41', True), ('130', True), ('3.2 4.9', True), ('', True))
    """
    if high < LEAST:
        return "", True
    middle = (low + high) / 2
    exact = round(middle, 2)
    if exact > 0.0 and max(abs(low - exact), abs(high - exact)) <= NEAR * exact:
        return _plain(exact), False
    digits = _decimals(middle)
    said, half = round(middle, digits), 0.5 * 10.0**-digits
    if said - half <= low and high <= said + half and said > 0.0:
        return _plain(said), True
    return f"{_outwards(low, up=False)} {_outwards(high, up=True)}", True


def _decimals(value: float) -> int:
    """Return how many decimals two figures have, at most two; negative for tens and hundreds."""
    return min(2, 1 - math.floor(math.log10(value)))


def _outwards(value: float, *, up: bool) -> str:
    """Return a number of two figures that is not smaller (not larger); what is one of two decimals is said as it is."""
    if value <= 0.0 or math.isinf(value):
        return "0"
    digits = _decimals(value)
    near = round(value, 2)
    if abs(value - near) <= (NEAR if round(near, digits) == near else EXACT) * value:
        return _plain(near)
    step = 10.0**-digits
    return _plain(round((math.ceil(value / step) if up else math.floor(value / step)) * step, 2))


def _plain(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _scale(words: Vocabulary, level: int) -> float:
    """Return by what numbers are multiplied to be said: probabilities are said in hundredths."""
    return 100.0 if words.objectives[level].record.chance else 1.0


def _key(words: Vocabulary, level: int, *, more: bool) -> str:
    record, unit = words.objectives[level].record, _unit(words, level)
    kind = "chance" if record.chance else "unit" if unit else "plain"
    if kind == "unit" and record.reward is not None and unit.strip() == record.reward.replace("_", " ") != "steps":
        kind = "count"
    return f"{kind}_{'more' if more else 'less'}"


def _unit(words: Vocabulary, level: int) -> str:
    """Return the unit of a level's numbers, with the blank before it: of what is counted, its name; "" where it has none."""
    wanted: Mapping[str, str] = words.objectives[level].words
    amount = wanted.get("amount", "")
    return wanted["unit"] or (amount.removeprefix("{value}") if amount.startswith("{value} ") else "")


def _with_unit(words: Vocabulary, level: int, number: str) -> str:
    chance = words.objectives[level].record.chance
    unit = str(words.table("differences")["points"]) if chance else _unit(words, level)
    return words.language.counted(number + unit)
