"""Linear temporal logic by its definition, on words of the form u·vvv…: an obvious twin of what automata are made of."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from ratherthan.model.path import is_temporal, window
from ratherthan.model.syntax import Term, text_of

Letter = frozenset[str]  # the labels that hold


class Lasso:
    """The infinite word ``before`` + ``round`` + ``round`` + …"""

    def __init__(self, before: Sequence[Letter], again: Sequence[Letter]) -> None:
        self.letters = [*before, *again]
        self.back = len(before)
        self._known: dict[tuple[Term, int], bool] = {}

    def place(self, at: int) -> int:
        """Where in `letters` the instant `at` lies."""
        return at if at < self.back else self.back + (at - self.back) % (len(self.letters) - self.back)

    def holds(self, term: Term, at: int = 0) -> bool:
        """Whether a path formula holds from an instant on, by the definition of its operator."""
        at = self.place(at)
        if (term, at) not in self._known:
            self._known[term, at] = self._defined(term, at)
        return self._known[term, at]

    def _defined(self, term: Term, at: int) -> bool:
        args = term.args
        match term.op:
            case "truth":
                return bool(term.value)
            case "label":
                return term.value in self.letters[at]
            case "!":
                return not self.holds(args[0], at)
            case "&":
                return all(self.holds(arg, at) for arg in args)
            case "|":
                return any(self.holds(arg, at) for arg in args)
            case "=>":
                return not self.holds(args[0], at) or self.holds(args[1], at)
            case "<=>":
                return self.holds(args[0], at) == self.holds(args[1], at)
            case "?:":
                return self.holds(args[1] if self.holds(args[0], at) else args[2], at)
            case "X":
                return self.holds(args[0], at + 1)
        low, high = window(term)
        # Behind the last instant nothing new comes: the word goes round.
        last = at + (low + 2 * len(self.letters) if high is None else high)
        instants = range(at + low, last + 1)

        def until(left: Term, right: Term, *, no: bool = False) -> bool:
            return any(
                self.holds(right, j) != no and all(self.holds(left, i) != no for i in range(at, j)) for j in instants
            )

        match term.op:
            case "F":
                return any(self.holds(args[0], j) for j in instants)
            case "G":
                return all(self.holds(args[0], j) for j in instants)
            case "U":
                return until(*args)
            case "R":
                return not until(*args, no=True)
            case "W":  # not: b fails, and a before it or with it, before b has held
                fails = Term("&", (args[0], Term("!", (args[1],)))), Term("&", tuple(Term("!", (arg,)) for arg in args))
                return not until(*fails)
        raise AssertionError(term.op)


def random_path(random: Random, labels: Sequence[str], depth: int = 3) -> Term:
    """A random path formula, of any kind."""
    if depth == 0 or random.random() < 0.15:
        label = Term("label", value=random.choice(labels))
        return random.choice([label, label, Term("!", (label,))])
    op = random.choice(["F", "F", "F", "U", "U", "X", "&", "&", "|", "!", "=>", "G", "W", "R", "<=>", "?:"])
    count = {"U": 2, "W": 2, "R": 2, "&": random.choice([2, 3]), "|": 2, "=>": 2, "<=>": 2, "?:": 3}.get(op, 1)
    args = tuple(random_path(random, labels, depth - 1) for _ in range(count))
    bound = None
    if op in "FGUWR" and random.random() < (0.4 if op in "FU" else 0.95):
        low = random.choice([0, 0, 0, 1, 2])
        high = low + random.randrange(4)
        bound = random.choice([f"<={high}", f"[{low},{high}]", f">={low}" if op in "FU" else f"<={high}"])
    return Term(op, args, bound)


def random_word(random: Random, labels: Sequence[str], length: int) -> list[Letter]:
    """A random word."""
    return [frozenset(label for label in labels if random.random() < 0.4) for _ in range(length)]


def longest(term: Term) -> int | None:
    """After how many steps it is known at the latest whether a formula holds; None if that may never be."""
    below = [longest(arg) for arg in term.args] or [0]
    if None in below:
        return None
    most = max(step for step in below if step is not None)
    if not is_temporal(term):
        return 0
    if term.op == "X":
        return most + 1
    if term.op not in ("F", "G", "U", "W", "R"):
        return most
    high = window(term)[1]
    return None if high is None else most + high


def property_of(term: Term, *, way: str = "max") -> str:
    """The property that asks for a formula's chance."""
    return f"P{way}=? [{text_of(term)}]"
