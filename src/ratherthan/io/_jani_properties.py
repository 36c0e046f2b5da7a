"""A property of a JANI model enters as a JSON tree, its text in PRISM's property syntax leaves.

Those that PRISM's syntax can say with the same meaning are turned into its text, whether they can be explained or not; every
other is refused by name. A reward counts on both sides the same only if the property adds up all that the reward gives: what
is assigned on edges (``"steps"``) and what states give when they are left (``"exit"``).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from ratherthan.io._jani_terms import BINARY, Vocabulary, cannot, term_of
from ratherthan.model.syntax import text_of

__all__ = ["property_text"]

_TURNED = {"≤": ">=", "<": ">", "≥": "<=", ">": "<"}
_PREFIXES, _BETWEEN = ("F", "G", "X"), ("U", "W", "R")
_FILTERS = ("min", "max", "avg", "sum", "values", "∀", "∃")
_INSTANTS = ("time-instant", "reward-instants")


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
        cannot("A property without a filter")
    states = tree.get("states")
    if tree.get("fun") not in _FILTERS or not isinstance(states, dict) or states.get("op") != "initial":
        cannot("A filter over other than the initial states")
    values = tree.get("values")
    op = _operator(values)
    if isinstance(values, dict) and op in _TURNED:
        left, right = values.get("left"), values.get("right")
        if isinstance(left, dict):
            return _query(left, BINARY[op] + text_of(term_of(right, words)), words)
        return _query(right, _TURNED[op] + text_of(term_of(left, words)), words)
    return _query(values, "=?", words)


def _operator(tree: Any) -> str:
    return str(tree.get("op", "")) if isinstance(tree, dict) else ""


def _query(tree: Any, asked: str, words: Vocabulary) -> str:
    """Return ``Pmax=? […]`` or ``R{"r"}min=? [F …]``; `asked` is what stands behind the operator."""
    op = _operator(tree)
    if op in ("Pmin", "Pmax"):
        return f"{op}{asked} [{_path(tree.get('exp'), words)}]"
    if op not in ("Emin", "Emax", "Smin", "Smax"):
        cannot(f"The operator '{op}'" if op else "A property that is no probability and no expected value")
    accumulated = tree.get("accumulate")
    counted = accumulated if isinstance(accumulated, list) else []
    if op[0] == "S":
        if counted:
            return f"{_reward(tree.get('exp'), counted, words)}{op[1:]}{asked} [LRA]"
        return f"LRA{op[1:]}{asked} [{text_of(term_of(tree.get('exp'), words))}]"
    return f"{_reward(tree.get('exp'), counted, words)}{op[1:]}{asked} [{_gain(tree, counted, words)}]"


def _gain(tree: dict[str, Any], counted: Collection[str], words: Vocabulary) -> str:
    """Return until when an expected value adds up: a goal, a number of steps, or for ever."""
    instant, goal = tree.get("step-instant"), tree.get("reach")
    if any(key in tree for key in _INSTANTS) or (instant is not None and goal is not None):
        cannot("An expected value until a time or until a reward")
    if goal is not None:
        return f"F {text_of(term_of(goal, words))}"
    if instant is None:
        return "C"
    if not counted:
        cannot("The value of an expression at one step")
    return f"C<={text_of(term_of(instant, words))}"


def _path(tree: Any, words: Vocabulary, *, inner: bool = False) -> str:
    """Return a path formula; an inner one with brackets around it."""
    op = _operator(tree)
    if not _is_temporal(tree):
        if not inner:
            cannot("A path formula that is no until, eventually or always")
        return text_of(term_of(tree, words))
    sides = [_path(tree.get(side), words, inner=True) for side in ("left", "right", "exp") if side in tree]
    if op in _PREFIXES and len(sides) == 1:
        text = f"{op}{_bounds(tree, words)} {sides[0]}"
    elif op in _BETWEEN and len(sides) == 2:
        text = f"{sides[0]} {op}{_bounds(tree, words)} {sides[1]}"
    elif op == "¬" and len(sides) == 1:
        text = f"!({sides[0]})"
    elif op in ("∧", "∨", "⇒") and len(sides) == 2:
        text = f"({sides[0]}) {BINARY[op]} ({sides[1]})"
    else:
        cannot(f"A path formula with the operator '{op}'")
    return f"({text})" if inner else text


def _is_temporal(tree: Any) -> bool:
    """Whether a temporal operator stands anywhere in a tree."""
    trees = [tree]
    while trees:
        tree = trees.pop()
        if isinstance(tree, dict):
            if tree.get("op") in (*_PREFIXES, *_BETWEEN):
                return True
            trees += [value for key, value in tree.items() if key != "op"]
    return False


def _bounds(tree: dict[str, Any], words: Vocabulary) -> str:
    """Return the bound behind a temporal operator, ``<=5`` or ``{"r"}<=5``; "" where there is none."""
    if tree.get("time-bounds"):
        cannot("A bound on time")
    steps, rewards = tree.get("step-bounds"), tree.get("reward-bounds")
    rewards = [] if rewards is None else rewards
    if not isinstance(rewards, list) or len(rewards) + bool(steps) > 1:
        cannot("A path formula with several bounds")
    if steps:
        return _interval(steps, words)
    for item in rewards:
        if not isinstance(item, dict):
            cannot("A bound on a reward that is no object")
        counted = item.get("accumulate")
        reward = _reward(item.get("exp"), counted if isinstance(counted, list) else [], words)
        return ("" if reward == "T" else reward[1:]) + _interval(item.get("bounds"), words)
    return ""


def _interval(bounds: Any, words: Vocabulary) -> str:
    if not isinstance(bounds, dict) or not {"lower", "upper"} & bounds.keys():
        cannot("A bound without a lower and an upper end")
    lower, upper = (
        None if bounds.get(end) is None else text_of(term_of(bounds[end], words)) for end in ("lower", "upper")
    )
    if lower is not None and upper is not None:
        if bounds.get("lower-exclusive") or bounds.get("upper-exclusive"):
            cannot("A bound whose two ends do not both belong to it")
        return f"[{lower},{upper}]"
    if lower is not None:
        return f">{'' if bounds.get('lower-exclusive') else '='}{_bracketed(lower)}"
    return f"<{'' if bounds.get('upper-exclusive') else '='}{_bracketed(str(upper))}"


def _bracketed(text: str) -> str:
    return text if text.replace(".", "").replace("_", "").isalnum() else f"({text})"


def _reward(value: Any, accumulated: Collection[str], words: Vocabulary) -> str:
    """Return ``R{"name"}`` or, for 1 per step, ``T``; refuse rewards of which only a part counts."""
    if value == 1 and not isinstance(value, bool) and "steps" in accumulated:
        return "T"
    reward = words.rewards.get(value) if isinstance(value, str) else None
    if reward is None:
        cannot("A reward that is more than one variable")
    parts = {part for part, values in reward.parts() if values.any()}
    if ("state" in parts and "exit" not in accumulated) or (parts - {"state"} and "steps" not in accumulated):
        cannot(f"A part only of the reward '{value}'")
    return f'R{{"{value}"}}'
