"""Path formulas in positive normal form enter, numbers that stand for them leave, and what is left of one after a letter.

The *progression* of a formula f by a letter (the truth of every state formula at one instant) is what must hold from the
next instant on, so that f holds now [1]_:

* a state formula becomes true or false; & and | are progressed part by part; ``X a`` becomes a;
* ``a U[l,h] b`` becomes ``a' & (a U[l-1,h-1] b)`` if l > 0, else ``b' | (a' & (a U[0,h-1] b))``; without the last part if
  h = 0 (a', b': the progressions); R likewise with & and | exchanged. ``F b`` is ``true U b``, ``G b`` is ``false R b``.

A word satisfies a co-safe formula exactly if the progression by one of its prefixes is true. Formulas are kept in one
spelling: a disjunction of conjunctions, or a conjunction of disjunctions, of parts that are neither; flat, sorted, and
without parts that follow from others (``b | F b`` is ``F b``). So there are few of them; their number is finite, for the
parts are parts of f with smaller bounds.

References
----------
.. [1] Bacchus, F. and Kabanza, F. (2000). Using temporal logics to express search control knowledge for planning.
   Artificial Intelligence 116, 123-191.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ratherthan.model.path import is_temporal, window
from ratherthan.model.syntax import Term, joined

__all__ = ["FALSE", "TRUE", "Formulas", "TooManyFormsError"]

FALSE, TRUE = 0, 1
MOST_WORK = 5_000_000
"""The most pairs of parts that are looked at, over all formulas: some seconds."""
_NO_END = -1

# A node is (operator, operands, low, high): state formulas ("a", (number,), 0, 0), "&" and "|", "U" and "R" with their
# window (high -1: no end), and "X" with the number of steps in `low`.
_Node = tuple[str, tuple[int, ...], int, int]


class TooManyFormsError(Exception):
    """The parts of a formula combine in too many ways."""


class Formulas:
    """Formulas by number, each in one spelling; 0 is false and 1 is true.

    Parameters
    ----------
    atoms : list of Term
        The state formulas met so far; a letter has a truth value for each.
    """

    def __init__(self) -> None:
        self.atoms: list[Term] = []
        self._atom_of: dict[Term, int] = {}
        self._nodes: list[_Node] = [("false", (), 0, 0), ("true", (), 0, 0)]
        self._numbers: dict[_Node, int] = {node: number for number, node in enumerate(self._nodes)}
        self._follows: dict[tuple[int, int], bool] = {}
        self._progressed: dict[tuple[int, int], int] = {}
        self._joined: dict[tuple[str, frozenset[int]], int] = {}
        self._left_to_spend = MOST_WORK

    def node(self, formula: int) -> _Node:
        """Return the operator of a formula, its operands (atoms for "a"), and its window."""
        return self._nodes[formula]

    def add(self, term: Term) -> int:
        """Return the number of a positive normal form."""
        if not is_temporal(term):
            if term.op == "truth":
                return TRUE if term.value else FALSE
            if term not in self._atom_of:
                self._atom_of[term] = len(self.atoms)
                self.atoms.append(term)
            return self._number(("a", (self._atom_of[term],), 0, 0))
        args = [self.add(arg) for arg in term.args]
        if term.op in "&|":
            return self.join(term.op, args)
        if term.op == "X":
            return self._next(args[0], 1)
        low, high = window(term)
        left = args[0] if len(args) > 1 else TRUE if term.op == "F" else FALSE
        return self._until("U" if term.op in "FU" else "R", left, args[-1], (low, _NO_END if high is None else high))

    def _number(self, node: _Node) -> int:
        number = self._numbers.setdefault(node, len(self._nodes))
        if number == len(self._nodes):
            self._nodes.append(node)
        return number

    def join(self, op: str, parts: Iterable[int]) -> int:
        """Return the conjunction (``op`` is "&") or disjunction of formulas, without parts that follow from others.

        Raises
        ------
        TooManyFormsError
            If it cannot be kept in one of the two forms.
        """
        nothing, everything = (TRUE, FALSE) if op == "&" else (FALSE, TRUE)
        flat: set[int] = set()
        for part in parts:
            node = self._nodes[part]
            flat.update(node[1] if node[0] == op else (part,))
        flat.discard(nothing)
        if everything in flat:
            return everything
        if len(flat) <= 1:
            return next(iter(flat), nothing)
        key = (op, frozenset(flat))
        if key not in self._joined:
            self._joined[key] = self._join(op, flat)
        return self._joined[key]

    def _join(self, op: str, parts: Iterable[int]) -> int:
        outer = "|" if op == "&" else "&"
        inside = (arg for part in parts if self._nodes[part][0] == outer for arg in self._nodes[part][1])
        if any(self._nodes[arg][0] == op for arg in inside):
            return self._turned_out(op, parts)
        kept = self._without_followers(op, parts)
        return kept[0] if len(kept) == 1 else self._number((op, tuple(kept), 0, 0))

    def _without_followers(self, op: str, parts: Iterable[int]) -> list[int]:
        """Return the parts of a conjunction or disjunction, sorted, without those that others make needless."""
        kept = sorted(parts)
        self._spend(len(kept) ** 2)
        for part in list(kept):  # one by one: of two that follow from each other one stays
            others = [other for other in kept if other != part]
            if any(self.follows(*((other, part) if op == "&" else (part, other))) for other in others):
                kept = others
        return kept

    def _turned_out(self, op: str, parts: Iterable[int]) -> int:
        """Return a conjunction with conjunctions deep inside as a disjunction of conjunctions, or the other way round."""
        outer = "|" if op == "&" else "&"
        ways = [self.join(op, ())]
        for part in sorted(parts):
            alternatives = self._nodes[part][1] if self._nodes[part][0] == outer else (part,)
            self._spend(len(ways) * len(alternatives))
            ways = self._without_followers(
                outer, {self.join(op, (way, other)) for way in ways for other in alternatives}
            )
        return self.join(outer, ways)

    def _spend(self, work: int) -> None:
        self._left_to_spend -= work
        if self._left_to_spend < 0:
            raise TooManyFormsError

    def _next(self, formula: int, steps: int) -> int:
        if formula in (FALSE, TRUE):
            return formula
        op, args, more, _ = self._nodes[formula]
        return self._number(("X", args, more + steps, 0) if op == "X" else ("X", (formula,), steps, 0))

    def _until(self, op: str, left: int, right: int, span: tuple[int, int]) -> int:
        """Return ``left op[low,high] right``; `op` is U or R, and "weak" is what R has where U has "strong"."""
        low, high = span
        strong, weak = (TRUE, FALSE) if op == "U" else (FALSE, TRUE)
        if right == weak or (low == 0 and right == strong):
            return right
        if left == weak:  # nothing may come before
            return right if low == 0 else weak
        if span == (0, 0) or (right == strong and left == strong):
            return right
        if left == strong and low == high:
            return self._next(right, low)
        inner = self._nodes[right]
        if inner[0] == op and inner[1][0] == left and (left == strong or (low == 0 and inner[2] == 0)):  # F F b is F b
            end = _NO_END if _NO_END in (high, inner[3]) else high + inner[3]
            right, low, high = inner[1][1], low + inner[2], end
        return self._number((op, (left, right), low, high))

    def follows(self, one: int, other: int) -> bool:
        """Whether `other` is seen to hold wherever `one` does; False may be said of some where it does."""
        if one in (other, FALSE) or other == TRUE:
            return True
        if one == TRUE or other == FALSE:
            return False
        known = self._follows.get((one, other))
        if known is None:
            known = self._follows[one, other] = self._seen_to_follow(one, other)
        return known

    def _seen_to_follow(self, one: int, other: int) -> bool:
        first, second = self._nodes[one], self._nodes[other]
        if first[0] == "|":
            return all(self.follows(part, other) for part in first[1])
        if second[0] == "&":
            return all(self.follows(one, part) for part in second[1])
        if first[0] == "&" and any(self.follows(part, other) for part in first[1]):
            return True
        if second[0] == "|" and any(self.follows(one, part) for part in second[1]):
            return True
        if first[0] == second[0] == "X":
            return first[2] == second[2] and self.follows(first[1][0], second[1][0])
        if first[0] == second[0] and first[0] in ("U", "R"):
            wide, narrow = (second, first) if first[0] == "U" else (first, second)
            within = wide[2] <= narrow[2] and (wide[3] == _NO_END or _NO_END != narrow[3] <= wide[3])
            if within and all(map(self.follows, first[1], second[1])):
                return True
        if second[0] == "U" and second[2] == 0 and self.follows(one, second[1][1]):
            return True
        if first[0] == "U" and first[2:] == (0, _NO_END) == second[2:] and second[0] == "U" and second[1][0] == TRUE:
            return self.follows(first[1][1], other)  # F a follows F b where a does
        return first[0] == "R" and first[2] == 0 and self.follows(first[1][1], other)

    def progressed(self, formula: int, letter: int, truth: Sequence[bool]) -> int:
        """Return what is left of a formula after a letter.

        Parameters
        ----------
        formula : int
        letter : int
            The number of the letter, under which the answer is remembered.
        truth : sequence of bool
            The truth value of each state formula of `atoms`.
        """
        if formula in (FALSE, TRUE):
            return formula
        known = self._progressed.get((formula, letter))
        if known is None:
            known = self._progressed[formula, letter] = self._progress(formula, letter, truth)
        return known

    def _progress(self, formula: int, letter: int, truth: Sequence[bool]) -> int:
        op, args, low, high = self._nodes[formula]
        if op == "a":
            return TRUE if truth[args[0]] else FALSE
        if op in ("&", "|"):
            return self.join(op, [self.progressed(arg, letter, truth) for arg in args])
        if op == "X":
            return args[0] if low == 1 else self._next(args[0], low - 1)
        both, either = ("&", "|") if op == "U" else ("|", "&")
        later = (max(low - 1, 0), high if high == _NO_END else high - 1)
        left = self.progressed(args[0], letter, truth)
        on = self.join(both, [left, self._until(op, args[0], args[1], later)])
        return on if low > 0 else self.join(either, [self.progressed(args[1], letter, truth), on])

    def term(self, formula: int) -> Term:
        """Return a formula as a tree."""
        op, args, low, high = self._nodes[formula]
        if formula in (FALSE, TRUE):
            return Term("truth", value=formula == TRUE)
        if op == "a":
            return self.atoms[args[0]]
        parts = [self.term(arg) for arg in args]
        if op in ("&", "|"):
            return joined(op, parts)
        if op == "X":
            return Term("X", (parts[0],)) if low == 1 else Term("F", (parts[0],), f"[{low},{low}]")
        bound = (f">={low}" if low else None) if high == _NO_END else f"[{low},{high}]" if low else f"<={high}"
        if args[0] == (TRUE if op == "U" else FALSE):
            return Term("F" if op == "U" else "G", (parts[1],), bound)
        return Term(op, tuple(parts), bound)
