"""The words of several objectives and their properties enter; words that tell the objectives apart leave.

Two objectives may share their words: the chance to arrive safely and the risk both have "a safer route". Then whatever is
said of either carries the name of what it is about, in numbers ("0.01 instead of 0.1, the risk") and without ("a safer route
(the risk)"). A chance to reach another goal than the plan's is called by its goal: "arrive" is said of the plan's goal alone.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

__all__ = ["goal_of", "goals_in_words", "told_apart"]

_GOAL = re.compile(r"\[\s*(?:(?:F|Fsure)\s+|[^\[\]]*?\sU\s+)(?P<goal>[^\[\]]+)\]\s*$")
_QUOTED = re.compile(r'"[^"]*"')
_NAMED_ALONE = ("best", "best_flexible", "among", "equal", "best_one", "among_one")


def goal_of(text: str) -> str | None:
    """Return the state formula at which a property ends, in its syntax; None where it has none, or more than one part.

    Examples
    --------
    >>> goal_of('R{"risk"}min=? [F "at home"]'), goal_of('Pmax=? [!"wet" U "home"]'), goal_of('R{"risk"}min=? [C]')
    ('"at home"', '"home"', None)
    """
    masked = _QUOTED.sub(lambda quoted: "q" * len(quoted[0]), text)
    found = _GOAL.search(masked)
    return None if found is None else text[found.start("goal") : found.end("goal")].strip()


def goals_in_words(properties: Sequence[str], phrases: Mapping[str, str]) -> list[str | None]:
    """Return the goal of each property in words: "home", "home or parking lot"; None where it has none."""
    found = [goal_of(text) for text in properties]
    return [None if goal is None else _in_words(goal, phrases) for goal in found]


def _in_words(goal: str, phrases: Mapping[str, str]) -> str:
    words = re.sub(r"\s*\|\s*", phrases["or"], goal)
    words = re.sub(r"\s*&\s*", phrases["and"], words)
    words = re.sub(r"!(?!=)", phrases["not"], words)
    return words.replace('"', "").replace("_", " ")


def told_apart(
    words: Sequence[Mapping[str, str]],
    properties: Sequence[str],
    goals: Sequence[str | None],
    phrases: Mapping[str, str],
) -> list[dict[str, str]]:
    """Let what is said carry the name of its objective where two objectives have the same words.

    Parameters
    ----------
    words : sequence of mapping
        The words of each objective.
    properties, goals : sequence of str
        Its text, and its goal in words.
    phrases : mapping
        The table ``[phrases]`` of the templates.
    """
    told = []
    for i, own in enumerate(words):
        rivals = [other for j, other in enumerate(words) if j != i]
        namesakes = [j for j, other in enumerate(words) if other["noun"] == own["noun"]]
        same, what, which = len(namesakes) > 1, own["noun"], properties[i]
        ends = {goals[j] for j in namesakes}
        if same:
            if None not in ends and len(ends) == len(namesakes):
                what = " ".join((what, own["up_to"].replace("{goal}", goals[i] or "")))
                which = own["up_to_short"].replace("{goal}", goals[i] or "")
            else:
                what = which
        named = {"named": "", "which": ""}
        if any({own["better"], own["worse"]} & {other["better"], other["worse"]} for other in rivals):
            named["named"] = phrases["named"].replace("{what}", what)
        if any(own["better"] == other["better"] for other in rivals):
            named["which"] = phrases["which"].replace("{what}", what)
            named |= {key: own[key] + named["which"] for key in _NAMED_ALONE}
        if same:
            named["amount"] = own["amount"] + phrases["which"].replace("{what}", which)
        told.append({**own, **named})
    return told
