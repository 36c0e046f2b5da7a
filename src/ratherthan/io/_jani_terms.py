"""Expressions of a JANI model enter as JSON trees over its variables, state formulas leave."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

from ratherthan.errors import PropertyError
from ratherthan.model.mdp import Reward
from ratherthan.model.syntax import Term, parse_formula

__all__ = ["BINARY", "Vocabulary", "cannot", "term_of"]

BINARY = {
    "∨": "|", "∧": "&", "⇒": "=>", "=": "=", "≠": "!=", "<": "<", "≤": "<=", ">": ">", "≥": ">=",
    "+": "+", "-": "-", "*": "*", "/": "/",
}  # fmt: skip
_CALLS = {"min": "min", "max": "max", "pow": "pow", "log": "log", "%": "mod"}
_ROUNDED = ("floor", "ceil")


@dataclass(frozen=True, kw_only=True)
class Vocabulary:
    """What the names of a model stand for.

    Parameters
    ----------
    labels : collection of str
        Truth values that only hold in a state, each a label of the built model.
    hidden : collection of str
        Other variables without a value in the states of the built model.
    rewards : mapping of str to Reward
    """

    labels: Collection[str]
    hidden: Collection[str]
    rewards: Mapping[str, Reward]


def cannot(what: str) -> NoReturn:
    """Raise the error that names what has no words in PRISM's syntax."""
    raise PropertyError(f"{what} cannot be explained here.")


def term_of(tree: Any, words: Vocabulary) -> Term:
    """Return a JANI expression as a formula.

    Parameters
    ----------
    tree : JSON
    words : Vocabulary

    Raises
    ------
    PropertyError
        For functions, arrays, constants such as π, and names that are none in PRISM.
    """
    if isinstance(tree, bool):
        return Term("truth", value=tree)
    if isinstance(tree, int | float):
        number = Term("number", value=abs(tree))
        return Term("neg", (number,)) if tree < 0 else number
    if isinstance(tree, str):
        return _name(tree, words)
    if not isinstance(tree, dict) or not isinstance(tree.get("op"), str):
        cannot(f"The expression {str(tree)[:60]!r}")
    op = tree["op"]
    if op in BINARY or op in _CALLS:
        parts = tuple(term_of(tree.get(side), words) for side in ("left", "right"))
        return Term(BINARY[op], parts) if op in BINARY else Term("call", parts, _CALLS[op])
    if op in _ROUNDED:
        return Term("call", (term_of(tree.get("exp"), words),), op)
    if op == "¬":
        return Term("!", (term_of(tree.get("exp"), words),))
    if op == "ite":
        return Term("?:", tuple(term_of(tree.get(part), words) for part in ("if", "then", "else")))
    if op in ("initial", "deadlock"):
        return Term("label", value=op.removesuffix("ial"))
    cannot(f"The operator '{op}'")


def _name(name: str, words: Vocabulary) -> Term:
    if name in words.labels:
        return Term("label", value=name)
    if name in words.hidden:
        cannot(f"The variable '{name}', which has no value in a state,")
    try:
        term = parse_formula(name)
    except PropertyError:
        cannot(f"The name '{name}'")
    if term != Term("name", value=name):
        cannot(f"The name '{name}'")
    return term
