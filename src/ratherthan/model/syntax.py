"""A PRISM state formula as a tree, and the way back: a tree enters, its canonical text leaves.

From weak to strong: ``?:``, ``=>``, ``<=>``, ``|``, ``&``, ``!``, ``= !=``, ``< <= > >=``, ``+ -``, ``* /``, unary ``-``;
binary operators group to the left, as PRISM's grammar has it (so ``!x = 1`` is ``!(x = 1)``). The way from text to tree is
the grammar in ``formula.lark``, which has one rule for each of these levels; the table here is for printing.

The canonical text has one blank around binary operators and brackets only where the levels need them, so that reading it
again gives the same tree. A temporal operator inside another or inside a formula stands in brackets, as do its operands
unless they are single words: ``F<=9 ("a" & (F "b"))``. ``&`` and ``|`` are associative and kept flat, whatever the brackets; so are ``+`` and ``*`` where
they group to the left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce

__all__ = ["FUNCTIONS", "TEMPORAL", "Term", "joined", "negated", "parse_formula", "text_of"]


@dataclass(frozen=True, slots=True)
class Term:
    """One node of a formula: an operator with its operands, or a leaf with its value.

    `op` is ``number``, ``truth``, ``label``, ``name``, ``call`` (value: the function), ``neg`` (unary minus), ``!``, ``?:``
    or a binary operator as it is written; or a temporal operator of a path (value: its bound as text).
    """

    op: str
    args: tuple[Term, ...] = ()
    value: int | float | bool | str | None = None


FUNCTIONS = {
    "min": (1, None), "max": (1, None), "floor": (1, 1), "ceil": (1, 1), "round": (1, 1),
    "pow": (2, 2), "mod": (2, 2), "log": (2, 2),
}  # fmt: skip
"""The functions, with the least and the largest number of arguments."""

TEMPORAL = ("F", "G", "X", "U", "W", "R")
"""The operators of paths, see path.py."""

_LEVELS = {
    "F": 0, "G": 0, "X": 0, "U": 0, "W": 0, "R": 0, "?:": 1, "=>": 2, "<=>": 3, "|": 4, "&": 5, "!": 6, "=": 7, "!=": 7,
    "<": 8, "<=": 8, ">": 8, ">=": 8, "+": 9, "-": 9, "*": 10, "/": 10, "neg": 11,
}  # fmt: skip
_LEAF = 12
_FLAT = ("&", "|", "+", "*")
_TERNARY, _MINUS = _LEVELS["?:"], _LEVELS["neg"]


def joined(op: str, parts: Sequence[Term]) -> Term:
    """Return ``parts[0] op parts[1] op …``, grouped to the left.

    Flat are ``&`` and ``|``, whatever the brackets, and ``+`` and ``*`` where they group to the left.
    """
    if op not in _FLAT:
        return reduce(lambda left, right: Term(op, (left, right)), parts)
    args: list[Term] = []
    for place, part in enumerate(parts):
        args += part.args if part.op == op and (op in "&|" or place == 0) else (part,)
    return Term(op, tuple(args))


@lru_cache(maxsize=1024)
def parse_formula(text: str, what: str = "formula") -> Term:
    """Read a whole formula.

    Parameters
    ----------
    text : str
        A PRISM expression.
    what : str
        What it is, for messages.

    Returns
    -------
    Term

    Raises
    ------
    PropertyError
        Where the text is no expression, with the column.
    """
    from ratherthan.model.reading import read

    term: Term = read("formula", text, what)
    return term


def negated(term: Term) -> Term:
    """Return the opposite of a state formula."""
    return term.args[0] if term.op == "!" else Term("!", (term,))


def text_of(term: Term) -> str:
    """Return the canonical text of a formula.

    Parameters
    ----------
    term : Term

    Returns
    -------
    str
        Reading it gives `term` again, up to the nesting of ``&`` and of ``|``.
    """
    leaf = _leaf_text(term)
    if leaf is not None:
        return leaf
    if term.op == "neg":
        return "-" + _text_at(term.args[0], _MINUS)
    if term.op == "!":
        inner = term.args[0]  # !(x = 1) needs no brackets here, but people and other tools read it better with them
        return "!" + (text_of(inner) if inner.op == "!" else _text_at(inner, _LEAF))
    if term.op == "?:":
        test, yes, no = term.args
        return f"{_text_at(test, _TERNARY + 1)} ? {_text_at(yes, _TERNARY + 1)} : {_text_at(no, _TERNARY)}"
    level = _LEVELS[term.op]
    if level == 0:
        *left, last = (_operand_text(arg) for arg in term.args)
        return " ".join([*left, f"{term.op}{term.value or ''}", last])
    if term.op in "&|":
        return f" {term.op} ".join(_text_at(arg, level + (arg.op != term.op)) for arg in term.args)
    return f" {term.op} ".join(_text_at(arg, level + (place > 0)) for place, arg in enumerate(term.args))


def _leaf_text(term: Term) -> str | None:
    """Return the text of a leaf or a function, None for an operator."""
    match term.op:
        case "number":
            return repr(term.value)
        case "truth":
            return "true" if term.value else "false"
        case "label":
            return f'"{term.value}"'
        case "name":
            return str(term.value)
        case "call":
            return f"{term.value}({', '.join(map(text_of, term.args))})"
    return None


def _operand_text(term: Term) -> str:
    """Return the text of a temporal operator's operand."""
    plain = term.args[0] if term.op == "!" else term
    return text_of(term) if plain.op in ("truth", "label", "name") else f"({text_of(term)})"


def _text_at(term: Term, level: int) -> str:
    """Return the text of an operand, in brackets if it binds weaker than `level`."""
    text = text_of(term)
    return text if _LEVELS.get(term.op, _LEAF) >= level else f"({text})"
