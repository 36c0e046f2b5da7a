"""A path formula enters as a tree; its bounds as whole numbers, its normal form, and its opposite leave.

A path formula is a state formula, or made of path formulas with ``F G X U W R``, ``!``, ``&``, ``|``, ``=>``, ``<=>`` and
``?:``. The value of a temporal term is its bound as text: ``"<=9"``, ``">=2"``, ``"[2,9]"`` (None where there is none).
It bounds the steps: with the window [l, h], ``a U b`` demands b after j steps with l ≤ j ≤ h, and a after every i < j.

In *positive normal form* negations stand inside of state formulas only, which is done by the dualities
¬X a = X ¬a, ¬F a = G ¬a, ¬(a U b) = ¬a R ¬b, and a W b = ¬(a & ¬b U ¬a & ¬b), all with the same window; with the window
[0, h] that is b R (a | b). A formula is
*co-safe* where each run that satisfies it has done so after finitely many steps. That is so for each formula whose
positive normal form has ``G`` and ``R`` with an upper bound only [1]_.

References
----------
.. [1] Kupferman, O. and Vardi, M. Y. (2001). Model checking of safety properties. Formal Methods in System Design 19,
   291-314.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping

from ratherthan.errors import PropertyError
from ratherthan.model.formula import constant, resolved
from ratherthan.model.syntax import TEMPORAL, Term, joined, negated, parse_formula, text_of

__all__ = [
    "bounded_steps",
    "forever",
    "is_temporal",
    "plain_until",
    "positive",
    "settled",
    "state_formulas",
    "window",
    "without_bounds_on_rewards",
]

_LARGEST_BOUND = 10**9
_LIMIT = re.compile(r"\s*(<=|<|>=|>|=)\s*(.*\S)\s*", re.DOTALL)
_INTERVAL = re.compile(r"\s*\[([^,]*),(.*)\]\s*", re.DOTALL)


def is_temporal(term: Term) -> bool:
    """Whether a temporal operator stands anywhere in a term."""
    return term.op in TEMPORAL or any(map(is_temporal, term.args))


def state_formulas(term: Term) -> Iterator[Term]:
    """Yield the largest parts of a path formula that speak of one state only."""
    if not is_temporal(term):
        yield term
        return
    for arg in term.args:
        yield from state_formulas(arg)


def without_bounds_on_rewards(term: Term) -> Term:
    """Return a path formula as it was read, without the bounds on rewards (``Frew{"cost"}<=5``, ``F^{…}``) in it."""
    args = tuple(map(without_bounds_on_rewards, term.args))
    on_reward = term.op in TEMPORAL and str(term.value or "").startswith(("^", "{", "rew"))
    return Term(term.op, args, None if on_reward else term.value)


def settled(term: Term, definitions: Mapping[str, str], variables: Collection[str] = ()) -> Term:
    """Return a path formula with the definitions put in, and its bounds as whole numbers of steps.

    Parameters
    ----------
    term : Term
        As it was read, without bounds on rewards.
    definitions : mapping of str to str
        Constants and formulas of the source.
    variables : collection of str
        Names that stand for themselves.

    Returns
    -------
    Term

    Raises
    ------
    PropertyError
        For bounds that are no whole numbers from 0 on, windows without a step, and temporal operators
        where a number must stand.
    """
    if not is_temporal(term):
        return resolved(term, definitions, variables)
    if term.op not in (*TEMPORAL, "!", "&", "|", "=>", "<=>", "?:"):
        raise PropertyError(
            f"A temporal operator must stand in a truth value, but '{text_of(term)}' computes with one. "
            "Compare numbers inside of its operands."
        )
    args = tuple(settled(arg, definitions, variables) for arg in term.args)
    if term.op in "&|":
        return joined(term.op, args)
    if term.op not in TEMPORAL:
        return Term(term.op, args)
    bound = _settled_bound(term, definitions)
    if term.op == "U" and args[0] == Term("truth", value=True):
        return Term("F", args[1:], bound)
    return Term(term.op, args, bound)


def _settled_bound(term: Term, definitions: Mapping[str, str]) -> str | None:
    """Return the canonical text of a bound that may be spelt in many ways, None for no bound."""
    if term.value is None:
        return None
    said = str(term.value)
    shown = f"{term.op}{said}"
    raw = re.sub("^(steps|time)", "", said)
    interval, limit = _INTERVAL.fullmatch(raw), _LIMIT.fullmatch(raw)
    if term.op == "X":
        raise PropertyError(f"X must have no bound, got '{shown}'. After k steps: F[k,k].")
    if interval:
        low, high = (_whole(text, definitions, shown) for text in interval.groups())
    elif limit:
        amount = _whole(limit[2], definitions, shown)
        low = {">=": amount, ">": amount + 1, "=": amount}.get(limit[1], 0)
        high = {"<=": amount, "<": amount - 1, "=": amount}.get(limit[1], -1)
        if limit[1] == "<" and amount == 0:
            raise PropertyError(f"A bound on steps must leave at least step 0, got '{shown}'. Say {term.op}<=0.")
    else:
        raise PropertyError(f"A bound on steps must be said, as in {term.op}<=10, got '{shown}'.")
    if interval and high < low:
        raise PropertyError(f"A bound on steps must not end before it begins, got '{shown}'.")
    return _bound_text(low, None if high < 0 else high)


def _whole(text: str, definitions: Mapping[str, str], shown: str) -> int:
    """Return the number of steps that an expression gives."""
    amount = constant(resolved(parse_formula(text.strip(), f"bound of {shown}"), definitions))
    if not (0 <= amount <= _LARGEST_BOUND and amount == int(amount)):
        raise PropertyError(
            f"A bound on steps must be a whole number from 0 to {_LARGEST_BOUND}, got {amount:.15g} in '{shown}'."
        )
    return int(amount)


def _bound_text(low: int, high: int | None) -> str | None:
    """Return the canonical text of a window."""
    if high is None:
        return f">={low}" if low else None
    return f"[{low},{high}]" if low else f"<={high}"


def window(term: Term) -> tuple[int, int | None]:
    """Return the first and the last step at which a temporal operator's operand counts, None for no last one."""
    if term.value is None:
        return 0, None
    text = str(term.value)
    if text.startswith(">="):
        return int(text[2:]), None
    if text.startswith("<="):
        return 0, int(text[2:])
    low, high = text[1:-1].split(",")
    return int(low), int(high)


def positive(term: Term, *, negate: bool = False) -> Term:
    """Return the positive normal form of a settled path formula, of its opposite with `negate`.

    Left are the operators ``F G X U R``, ``&`` and ``|`` over state formulas; neighbouring state formulas are one.

    Parameters
    ----------
    term : Term
    negate : bool

    Returns
    -------
    Term
    """
    if not is_temporal(term):
        return negated(term) if negate else term
    if term.op in "&|":
        parts = [positive(arg, negate=negate) for arg in term.args]
        return _gathered(term.op if not negate else _DUAL[term.op], parts)
    rules: dict[str, Callable[[Term, bool], Term]] = {
        "!": lambda t, no: positive(t.args[0], negate=not no),
        "=>": lambda t, no: positive(Term("|", (negated(t.args[0]), t.args[1])), negate=no),
        "<=>": _both_or_neither,
        "?:": _either,
        "W": _weak_until,
    }
    if term.op in rules:
        return rules[term.op](term, negate)
    args = tuple(positive(arg, negate=negate) for arg in term.args)
    return Term(_DUAL[term.op] if negate else term.op, args, term.value)


_DUAL = {"F": "G", "G": "F", "X": "X", "U": "R", "R": "U", "&": "|", "|": "&"}


def _both_or_neither(term: Term, negate: bool) -> Term:
    left, right = term.args
    both = Term("&", (left, right)), Term("&", (negated(left), negated(right)))
    return positive(Term("|", both), negate=negate)


def _either(term: Term, negate: bool) -> Term:
    test, yes, no = term.args
    return positive(Term("|", (Term("&", (test, yes)), Term("&", (negated(test), no)))), negate=negate)


def _weak_until(term: Term, negate: bool) -> Term:
    left, right = term.args
    if window(term)[0] == 0 and not (negate and not is_temporal(left)):  # no need to know where a fails: b R (a | b)
        return positive(Term("R", (right, Term("|", (left, right))), term.value), negate=negate)
    fails = Term("U", (Term("&", (left, negated(right))), Term("&", (negated(left), negated(right)))), term.value)
    return positive(fails, negate=not negate)


def _gathered(op: str, parts: list[Term]) -> Term:
    """Return a conjunction or disjunction whose state formulas are gathered into one."""
    flat = joined(op, parts).args
    still = [part for part in flat if not is_temporal(part)]
    moving = [part for part in flat if is_temporal(part)]
    gathered = [joined(op, still)] if len(still) > 1 else still
    return Term(op, (*gathered, *moving)) if len(gathered) + len(moving) > 1 else moving[0]


def forever(term: Term) -> Iterator[Term]:
    """Yield the parts of a positive normal form that can never be told to have been satisfied: G and R without a bound."""
    if term.op in ("G", "R") and window(term)[1] is None:
        yield term
    for arg in term.args:
        yield from forever(arg)


def bounded_steps(term: Term, *, negate: bool = False, steps: int = 100) -> Term:
    """Return a settled path formula with a bound on steps wherever it says "for ever": it is co-safe.

    Parameters
    ----------
    term : Term
    negate : bool
        Whether it is the opposite of the term that is to be co-safe.
    steps : int
        The bound.
    """
    if not is_temporal(term):
        return term
    if term.op in ("<=>", "?:") or (
        term.op == "W" and window(term)[0] > 0
    ):  # its parts stand for themselves and for their opposites
        inner = bounded_steps(positive(term, negate=negate), steps=steps)
        return negated(inner) if negate else inner
    turned = (0,) if term.op in ("!", "=>") else ()
    args = tuple(bounded_steps(arg, negate=negate != (i in turned), steps=steps) for i, arg in enumerate(term.args))
    endless = term.op in (("F", "U") if negate else ("G", "R", "W")) and window(term)[1] is None
    return Term(term.op, args, _bound_text(window(term)[0], window(term)[0] + steps) if endless else term.value)


def plain_until(term: Term) -> tuple[Term | None, Term] | None:
    """Return what may hold until then and the goal, where a positive normal form needs no memory; else None.

    Such are ``a U b`` and ``F b`` over state formulas, and what is the same as ``F b``: ``F (F b)``, ``(F b) | (F c)``.
    """
    if term.op == "U" and term.value is None and not any(map(is_temporal, term.args)):
        return (None if term.args[0] == Term("truth", value=True) else term.args[0]), term.args[1]
    parts = term.args if term.op == "|" else (term,)
    if not all(part.op == "F" and part.value is None for part in parts):
        return None
    goals = [goal for part in parts for goal in _goals(part.args[0])]
    if None in goals:
        return None
    known = [goal for goal in goals if goal is not None]
    return None, joined("|", known) if len(known) > 1 else known[0]


def _goals(term: Term) -> Iterator[Term | None]:
    """Yield the state formulas one of which must come some day, so that F of this term is satisfied; None for others."""
    if not is_temporal(term):
        yield term
    elif term.op == "|":
        for arg in term.args:
            yield from _goals(arg)
    elif term.op == "F" and term.value is None:
        yield from _goals(term.args[0])
    else:
        yield None
