"""Words enter, English forms leave: the rules of the language that a template cannot hold."""

from __future__ import annotations

import re
from collections.abc import Sequence

__all__ = ["counted", "gerund", "joined", "names_several_cells", "qualified", "shortened", "verb_phrase_after"]

_AS_IT_IS = ("be", "see", "flee", "agree", "free", "dye", "eye", "hoe", "shoe", "toe", "canoe", "singe", "tinge")
_DOUBLED = ("begin", "forget", "reset", "admit", "permit", "commit", "submit", "transfer", "refer", "prefer", "quit")


def gerund(phrase: str) -> str:
    """Return a verb phrase as a gerund: "move east" → "moving east", "stop" → "stopping", "lie down" → "lying down".

    Examples
    --------
    >>> [gerund(phrase) for phrase in ("move east", "pick up the parcel", "stop", "lie down", "wait")]
    ['moving east', 'picking up the parcel', 'stopping', 'lying down', 'waiting']
    """
    verb, space, rest = phrase.partition(" ")
    return _gerund_of(verb) + space + rest


def _gerund_of(verb: str) -> str:
    if verb.endswith("ie"):
        return verb[:-2] + "ying"
    if verb.endswith("e") and verb not in _AS_IT_IS:
        return verb[:-1] + "ing"
    if verb in _DOUBLED or re.fullmatch(r"[^aeiou]+[aeiou][bdgmnpt]", verb):
        return verb + verb[-1] + "ing"
    return verb + "ing"


def joined(parts: Sequence[str], word: str = "and") -> str:
    """Return a list in words: "a", "a and b", "a, b and c".

    Examples
    --------
    >>> joined(["grid 1", "grid 2", "grid 3"])
    'grid 1, grid 2 and grid 3'
    """
    if len(parts) < 2:
        return "".join(parts)
    return ", ".join(parts[:-1]) + f" {word} " + parts[-1]


def names_several_cells(place: str) -> bool:
    """Return whether a place is several cells of the file, so that a count of cells would not say of which.

    Examples
    --------
    >>> names_several_cells("cell (2, 3)"), names_several_cells("the crossing, cells (2, 4) to (3, 5)")
    (False, True)
    """
    return re.search(r"\bcells \(", place) is not None


def qualified(noun: str, adjective: str) -> str:
    """Return a noun phrase with an adjective in its place: "critical grid 10", "the critical crossing".

    Examples
    --------
    >>> qualified("grid 10", "critical"), qualified("the crossing", "critical"), qualified("(1.2 m, 3 m)", "critical")
    ('critical grid 10', 'the critical crossing', 'the critical point (1.2 m, 3 m)')
    """
    if noun.startswith("("):
        return f"the {adjective} point {noun}"
    article, _, rest = noun.partition(" ")
    if rest and article.lower() in ("the", "a", "an", "our", "your"):
        return f"{'a' if article.lower() == 'an' else article} {adjective} {rest}"
    return f"{adjective} {noun}"


def verb_phrase_after(foil: str, fact: str) -> str:
    """Return the foil without the verb it shares with the fact: "move east rather than (move) south".

    Examples
    --------
    >>> verb_phrase_after("move south", "move east"), verb_phrase_after("wait", "move east")
    ('south', 'wait')
    """
    verb, _, rest = foil.partition(" ")
    return rest if rest and fact.partition(" ")[0] == verb else foil


def shortened(phrase: str) -> str:
    """Return a phrase about a route for a sentence that has named a route before.

    Examples
    --------
    >>> [shortened(phrase) for phrase in ("a safer route", "the safest route", "one of the safest routes", "a detour")]
    ['a safer one', 'the safest', 'one of the safest', 'a detour']
    """
    if phrase.endswith(" routes"):
        return phrase.removesuffix(" routes")
    if not phrase.endswith(" route"):
        return phrase
    kept = phrase.removesuffix(" route")
    return kept if kept.startswith("the ") else f"{kept} one"


def counted(phrase: str) -> str:
    """Return a number with a noun in the plural as it is said: "1 steps" → "1 step".

    Examples
    --------
    >>> [counted(phrase) for phrase in ("1 steps", "11 steps", "a risk of 1")]
    ['1 step', '11 steps', 'a risk of 1']
    """
    return phrase.removesuffix("s") if re.fullmatch(r"1 ([^ ]+ )*[^ ]+s", phrase) else phrase
