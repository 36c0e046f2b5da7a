"""Expressions and properties of a JANI model enter as JSON, formulas and PRISM's property text leave.

JANI writes properties as trees over the model's variables. Those that PRISM's property syntax can say with the same meaning
are turned into its text; every other is refused by name. A reward counts on both sides the same only if the property adds up
all that the reward gives: what is assigned on edges (``"steps"``) and what states give when they are left (``"exit"``).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

from ratherthan.errors import PropertyError
from ratherthan.model.mdp import Reward
from ratherthan.model.syntax import Term, parse_formula, text_of

__all__ = ["Vocabulary", "property_text", "term_of"]

_BINARY = {
    "∨": "|", "∧": "&", "⇒": "=>", "=": "=", "≠": "!=", "<": "<", "≤": "<=", ">": ">", "≥": ">=",
    "+": "+", "-": "-", "*": "*", "/": "/",
}  # fmt: skip
_CALLS = {"min": "min", "max": "max", "pow": "pow", "log": "log", "%": "mod"}
_ROUNDED = ("floor", "ceil")
_TURNED = {"≤": ">=", "<": ">", "≥": "<=", ">": "<"}
_PATHS = ("U", "W", "R", "F", "G")
_BOUNDS = ("step-bounds", "time-bounds", "reward-bounds")
_INSTANTS = ("step-instant", "time-instant", "reward-instants")
_FILTERS = ("min", "max", "avg", "sum", "values", "∀", "∃")


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


def _cannot(what: str) -> NoReturn:
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
        _cannot(f"The expression {str(tree)[:60]!r}")
    op = tree["op"]
    if op in _BINARY or op in _CALLS:
        parts = tuple(term_of(tree.get(side), words) for side in ("left", "right"))
        return Term(_BINARY[op], parts) if op in _BINARY else Term("call", parts, _CALLS[op])
    if op in _ROUNDED:
        return Term("call", (term_of(tree.get("exp"), words),), op)
    if op == "¬":
        return Term("!", (term_of(tree.get("exp"), words),))
    if op == "ite":
        return Term("?:", tuple(term_of(tree.get(part), words) for part in ("if", "then", "else")))
    if op in ("initial", "deadlock"):
        return Term("label", value=op.removesuffix("ial"))
    _cannot(f"The operator '{op}'")


def _name(name: str, words: Vocabulary) -> Term:
    if name in words.labels:
        return Term("label", value=name)
    if name in words.hidden:
        _cannot(f"The variable '{name}', which has no value in a state,")
    try:
        term = parse_formula(name)
    except PropertyError:
        _cannot(f"The name '{name}'")
    if term != Term("name", value=name):
        _cannot(f"The name '{name}'")
    return term


def property_text(tree: Any, words: Vocabulary) -> str:
    """Return a JANI property in PRISM's property syntax.

    Parameters
    ----------
    tree : JSON
        The ``expression`` of a property.
    words : Vocabulary

    Raises
    ------
    PropertyError
        If PRISM's syntax cannot say the same.
    """
    if not isinstance(tree, dict) or tree.get("op") != "filter":
        _cannot("A property without a filter")
    states = tree.get("states")
    if tree.get("fun") not in _FILTERS or not isinstance(states, dict) or states.get("op") != "initial":
        _cannot("A filter over other than the initial states")
    values = tree.get("values")
    op = _operator(values)
    if isinstance(values, dict) and op in _TURNED:
        left, right = values.get("left"), values.get("right")
        if isinstance(left, dict):
            return _query(left, _BINARY[op] + text_of(term_of(right, words)), words)
        return _query(right, _TURNED[op] + text_of(term_of(left, words)), words)
    return _query(values, "=?", words)


def _operator(tree: Any) -> str:
    return str(tree.get("op", "")) if isinstance(tree, dict) else ""


def _query(tree: Any, asked: str, words: Vocabulary) -> str:
    """Return ``Pmax=? […]`` or ``R{"r"}min=? [F …]``; `asked` is what stands behind the operator."""
    op = _operator(tree)
    if op in ("Pmin", "Pmax"):
        return f"{op}{asked} [{_path(tree.get('exp'), words)}]"
    if op not in ("Emin", "Emax"):
        _cannot(f"The operator '{op}'" if op else "A property that is no probability and no expected value")
    if any(instant in tree for instant in _INSTANTS) or "reach" not in tree:
        _cannot("An expected value other than until a goal")
    accumulated = tree.get("accumulate")
    head = _reward(tree.get("exp"), accumulated if isinstance(accumulated, list) else [], words)
    return f"{head}{op[1:]}{asked} [F {text_of(term_of(tree['reach'], words))}]"


def _path(tree: Any, words: Vocabulary) -> str:
    op = _operator(tree)
    if op not in _PATHS:
        _cannot("A path formula that is no until, eventually or always")
    if any(tree.get(bound) for bound in _BOUNDS):
        op += "<=0"  # whatever the bound: the reader of properties refuses it by name
    if "exp" in tree:
        return f"{op} {text_of(term_of(tree['exp'], words))}"
    return f"{text_of(term_of(tree.get('left'), words))} {op} {text_of(term_of(tree.get('right'), words))}"


def _reward(value: Any, accumulated: Collection[str], words: Vocabulary) -> str:
    """Return ``R{"name"}`` or, for 1 per step, ``T``; refuse rewards of which only a part counts."""
    if value == 1 and not isinstance(value, bool) and "steps" in accumulated:
        return "T"
    reward = words.rewards.get(value) if isinstance(value, str) else None
    if reward is None:
        _cannot("A reward that is more than one variable")
    parts = {part for part, values in reward.parts() if values.any()}
    if ("state" in parts and "exit" not in accumulated) or (parts - {"state"} and "steps" not in accumulated):
        _cannot(f"A part only of the reward '{value}'")
    return f'R{{"{value}"}}'
