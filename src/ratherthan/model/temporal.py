"""A path formula enters and comes through if it can be explained; else the name of what it is leaves, as a refusal.

Known are the temporal operators of PRISM and Storm, so that a property outside of what can be explained is refused as what
it is, with the nearest one that can, rather than as a misspelt one. Only ``F g`` and ``a U b`` come through. In a path,
``F``, ``G`` and ``X`` are terms with one operand, ``U``, ``W`` and ``R`` with two; the value of such a term is ``"bounded"``
where a bound on steps, time or reward was given.
"""

from __future__ import annotations

from dataclasses import dataclass

from ratherthan.errors import PropertyError
from ratherthan.model.syntax import Term, negated, text_of

__all__ = ["REFUSED", "Statement", "check_path", "refusal"]

_OPERATORS = ("F", "G", "X", "U", "W", "R")

_ARRIVE, _COST = 'Pmax=? [F "goal"]', 'R{"cost"}min=? [F "goal"]'
REFUSED = {
    "total": ("C (a reward that adds up without end)", f"the reward until a goal, {_COST}"),
    "partial": ("C with a bound (the reward within some steps)", f"the reward until a goal, {_COST}"),
    "instant": ("I (the reward at one instant)", f"the reward until a goal, {_COST}"),
    "average": ("a long-run average", f"the reward until a goal, {_COST}, or the chance to arrive there, {_ARRIVE}"),
    "filter": ("a filter over states", "the property without it; one state is asked for by its number or name"),
    "multi": ("several objectives at once", "each of them alone"),
    "branching": (
        "A or E (a formula on all paths, on some path)",
        'a probability, Pmin>=1 [F "goal"] for all and Pmax>0 [F "goal"] for some',
    ),
    "coalition": ("a property of players", "the same without players"),
    "quantile": ("a quantile", 'a threshold, such as Pmax>=0.9 [F "goal"]'),
    "combination": ("a combination of properties", "each of them alone"),
    "variance": ("a spread rather than an expected reward", f"the expected reward, {_COST}"),
    "ratio": ("a ratio of two rewards", "each reward alone"),
    "nested": ("a property inside a property", f"one whose states are named by labels or variables, such as {_ARRIVE}"),
    "equal": ("a value compared with = or !=", 'a threshold with <=, <, >= or >, such as Pmax>=0.9 [F "goal"]'),
}
"""What is known but cannot be explained: its name in sentences, and the nearest that can. The keys stand in the grammar."""


@dataclass(frozen=True, slots=True)
class Statement:
    """What a property says, before its model is known."""

    operator: str  # P, R or T
    reward: str | None  # None where it is not said
    way: str  # min, max or ""
    relation: str | None  # None: =?
    bound: Term | None
    path: Term


def refusal(what: str, nearest: str = "") -> PropertyError:
    """Return the error that names what cannot be explained, and the nearest property that can."""
    if not nearest:
        what, nearest = REFUSED[what]
    return PropertyError(f"{what[0].upper()}{what[1:]} cannot be explained here. The nearest that can: {nearest}.")


def _temporal(term: Term) -> bool:
    """Whether a temporal operator stands anywhere in a term."""
    return term.op in _OPERATORS or any(map(_temporal, term.args))


def check_path(path: Term, operator: str, *, maximise: bool) -> None:
    """Raise PropertyError unless `path` is ``F g`` or ``a U b`` over state formulas; ``F g`` only for R and T.

    Parameters
    ----------
    path : Term
    operator : str
        What is asked of the path, as the nearest property shall show it: ``P``, ``R{"cost"}``, ``T``.
    maximise : bool
        Whether its maximum is asked for.
    """
    head, opposite = (f"{operator}{way}=?" for way in (("max", "min") if maximise else ("min", "max")))
    if any(map(_temporal, path.args)):
        what = "a formula of linear temporal logic (an operator beside or inside another)"
        raise refusal(what, f'one F or U over state formulas, such as {head} [F "goal"]')
    if not _temporal(path):
        raise refusal("a property without a temporal operator", f"the way there, {head} [F {text_of(path)}]")
    goal = path.args[-1]
    if operator != "P" and (path.op != "F" or path.value):
        raise refusal(f"a reward until anything but F without a bound ({path.op} here)", f"{head} [F {text_of(goal)}]")
    if path.value:
        bounded = f"{path.op} with a bound on steps, time or reward"
        if path.op == "G":
            raise refusal(bounded, f"its opposite without the bound, {opposite} [F {text_of(negated(goal))}]")
        plain = f"F {text_of(goal)}" if path.op in "FX" else f"{text_of(path.args[0])} U {text_of(goal)}"
        raise refusal(bounded, f"the same without the bound, {head} [{plain}]")
    if path.op == "X":
        raise refusal("X (after one step)", f"the same after any number of steps, {head} [F {text_of(goal)}]")
    if path.op in "FU":
        return
    fails = negated(goal)
    if path.op == "G":
        raise refusal("G (always)", f"its opposite, the chance that it fails, {opposite} [F {text_of(fails)}]")
    before = path.args[0]
    if path.op == "W":  # a W b fails where a and b both fail before b held
        through, fails = Term("&", (before, fails)), Term("&", (negated(before), fails))
        raise refusal("W (weak until)", f"its opposite, {opposite} [{text_of(through)} U {text_of(fails)}]")
    raise refusal("R (release)", f"its opposite, {opposite} [{text_of(negated(before))} U {text_of(fails)}]")
