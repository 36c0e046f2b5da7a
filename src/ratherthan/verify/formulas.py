"""The text of a mission enters as a formula, a tree of tuples; what is left of it after a letter leaves.

A letter tells of every state formula whether it holds. ``a U[l,h] b`` leaves ``a' & (a U[l-1,h-1] b)`` while l > 0, then
``b' | a' & (a U[0,h-1] b)``, where a' and b' are what is left of a and b; ``a R b``, the opposite of ``!a U !b``, leaves the dual;
``X a`` leaves a. In sets of & and | nothing is kept that follows from the rest by its form, so that the formulas stay few.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

from ratherthan.errors import ExplanationError
from ratherthan.model.syntax import TEMPORAL, Term, negated

__all__ = ["FALSE", "TRUE", "Formula", "Letter", "Tree", "left_after", "only_a_deadline", "read_mission"]


Formula = tuple[Any, ...]
"""("true",), ("false",), ("atom", number), ("&" or "|", frozenset), ("X", f), ("U" or "R", f, g, low, high or None)."""
Letter = tuple[bool, ...]

TRUE: Formula = ("true",)
FALSE: Formula = ("false",)
_BOUND = re.compile(r"(?P<op><=|<|>=|>|=)\s*(?P<one>\d+)|\[(?P<low>\d+),\s*(?P<high>\d+)\]")


def read_mission(formula: str) -> Term:
    """Return the path formula of a mission as it is written."""
    from ratherthan.model.reading import read

    path: Term = read("property", f"Pmax=? [{formula}]", "mission").path
    return path


def _is_temporal(term: Term) -> bool:
    return term.op in TEMPORAL or any(map(_is_temporal, term.args))


def only_a_deadline(formula: str) -> bool:
    """Return whether a mission asks for a set of states within some steps, and for nothing else."""
    term = read_mission(formula)
    return term.op == "F" and str(term.value or "").startswith("<") and not _is_temporal(term.args[0])


def _window(term: Term) -> tuple[int, int | None]:
    """Return the least and the largest number of steps that a bound allows."""
    if term.value is None:
        return 0, None
    found = _BOUND.fullmatch(str(term.value).strip())
    if found is None:
        raise ExplanationError(f"The bounds of a mission must be numbers of steps, got '{term.op}{term.value}'.")
    if found["op"] is None:
        return int(found["low"]), int(found["high"])
    one = int(found["one"])
    return {"<=": (0, one), "<": (0, one - 1), ">=": (one, None), ">": (one + 1, None), "=": (one, one)}[found["op"]]


class Tree:
    """Reads terms as formulas, and collects their atoms."""

    def __init__(self) -> None:
        self.atoms: list[Term] = []

    def of(self, term: Term, *, holds: bool = True) -> Formula:
        """Return a term, or its opposite, as a formula."""
        if not _is_temporal(term):
            return self._atom(term if holds else negated(term))
        args = term.args
        if term.op == "!":
            return self.of(args[0], holds=not holds)
        if term.op in "&|":
            parts = [self.of(arg, holds=holds) for arg in args]
            return _both(parts) if (term.op == "&") == holds else _either(parts)
        if term.op in ("=>", "<=>", "?:"):
            return self._derived(term, holds)
        if term.op == "X":
            return ("X", self.of(args[0], holds=holds))
        return self._until(term, holds)

    def _atom(self, term: Term) -> Formula:
        if term.op == "truth":
            return TRUE if term.value else FALSE
        if term not in self.atoms:
            self.atoms.append(term)
        return ("atom", self.atoms.index(term))

    def _derived(self, term: Term, holds: bool) -> Formula:
        yes = [self.of(arg) for arg in term.args]
        no = [self.of(arg, holds=False) for arg in term.args]
        if term.op == "=>":
            return _either([no[0], yes[1]]) if holds else _both([yes[0], no[1]])
        if term.op == "<=>":
            second = (yes[1], no[1]) if holds else (no[1], yes[1])
            return _either([_both([yes[0], second[0]]), _both([no[0], second[1]])])
        then = yes if holds else no
        return _either([_both([yes[0], then[1]]), _both([no[0], then[2]])])

    def _until(self, term: Term, holds: bool) -> Formula:
        low, high = _window(term)
        args, last = term.args, term.args[-1]
        if term.op == "W":  # a W b is the opposite of (a & !b) U (!a & !b)
            yes = [self.of(arg) for arg in args]
            no = [self.of(arg, holds=False) for arg in args]
            if holds:
                return ("R", _either([no[0], yes[1]]), _either([yes[0], yes[1]]), low, high)
            return ("U", _both([yes[0], no[1]]), _both([no[0], no[1]]), low, high)
        first = self.of(args[0], holds=holds) if len(args) > 1 else TRUE if (term.op == "F") == holds else FALSE
        reaches = (term.op in ("F", "U")) == holds
        return ("U" if reaches else "R", first, self.of(last, holds=holds), low, high)


@lru_cache(maxsize=200_000)
def _follows(x: Formula, y: Formula) -> bool:
    """Return whether y follows from x by its form (never wrongly, not always)."""
    if x in (y, FALSE) or y == TRUE:
        return True
    if x[0] == "|":
        return all(_follows(part, y) for part in x[1])
    if y[0] == "&":
        return all(_follows(x, part) for part in y[1])
    if (x[0] == "&" and any(_follows(part, y) for part in x[1])) or (
        y[0] == "|" and any(_follows(x, part) for part in y[1])
    ):
        return True
    if x[0] == y[0] == "X":
        return _follows(x[1], y[1])
    if x[0] == y[0] and x[0] in ("U", "R"):
        return _includes(x, y) if x[0] == "U" else _includes(y, x, opposite=True)
    sooner = y[0] == "U" and y[3] == 0 and _follows(x, y[2])
    return sooner or (x[0] == "R" and x[3] == 0 and _follows(x[2], y))


def _includes(x: Formula, y: Formula, *, opposite: bool = False) -> bool:
    """Return whether the window of y includes that of x, and its parts follow; of two releases, the other way round."""
    free = FALSE if opposite else TRUE
    wider = y[3] <= x[3] if x[1] == free == y[1] else y[3] == x[3]
    longer = y[4] is None or (x[4] is not None and x[4] <= y[4])
    pairs = [(y[i], x[i]) if opposite else (x[i], y[i]) for i in (1, 2)]
    return wider and longer and all(_follows(*pair) for pair in pairs)


def _joined(op: str, parts: list[Formula]) -> Formula:
    """Return a conjunction or a disjunction in which no part follows from the others."""
    flat: set[Formula] = set()
    for part in parts:
        flat |= part[1] if part[0] == op else {part}
    weaker = _follows if op == "&" else (lambda x, y: _follows(y, x))
    kept: list[Formula] = []
    for part in flat:
        if any(weaker(other, part) for other in kept):
            continue
        kept = [other for other in kept if not weaker(part, other)] + [part]
    return kept[0] if len(kept) == 1 else (op, frozenset(kept))


def _both(parts: list[Formula]) -> Formula:
    if FALSE in parts:
        return FALSE
    left = [part for part in parts if part != TRUE]
    return _joined("&", left) if left else TRUE


def _either(parts: list[Formula]) -> Formula:
    if TRUE in parts:
        return TRUE
    left = [part for part in parts if part != FALSE]
    return _joined("|", left) if left else FALSE


def _later(f: Formula) -> Formula | None:
    """Return an until or release with one step less to go, None where its window is over."""
    kind, first, second, low, high = f
    if high == 0:
        return None
    return (kind, first, second, max(low - 1, 0), None if high is None else high - 1)


def left_after(f: Formula, letter: Letter, known: dict[Formula, Formula]) -> Formula:
    """Return what is left of a formula after a letter."""
    if f not in known:
        known[f] = _rewritten(f, letter, known)
    return known[f]


def _rewritten(f: Formula, letter: Letter, known: dict[Formula, Formula]) -> Formula:
    kind = f[0]
    if kind in ("true", "false"):
        return f
    if kind == "atom":
        return TRUE if letter[f[1]] else FALSE
    if kind in "&|":
        parts = [left_after(part, letter, known) for part in f[1]]
        return _both(parts) if kind == "&" else _either(parts)
    if kind == "X":
        following: Formula = f[1]
        return following
    first, later = left_after(f[1], letter, known), _later(f)
    if kind == "U":
        onward = FALSE if later is None else _both([first, later])
        return onward if f[3] > 0 else _either([left_after(f[2], letter, known), onward])
    onward = TRUE if later is None else _either([first, later])
    return onward if f[3] > 0 else _both([left_after(f[2], letter, known), onward])
