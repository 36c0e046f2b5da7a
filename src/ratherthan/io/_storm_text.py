"""A property in PRISM's syntax and a problem enter; the same property leaves in words that Storm can read, with their meaning.

Storm is handed the bare model: it knows no state variables, constants, formulas and no names with blanks. So every state
formula in the property is evaluated here and becomes a label (``s0``, ``s1``, …), every reward becomes ``r0``, ``r1``, …,
and every bound a number. What stands around them, operators of probability, of paths and of several objectives, is left to
Storm. The text is read from left to right as words; at each place where an operand can begin, the longest state formula that
begins there is taken, up to the next bracket or operator that is none of a state formula.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ratherthan.errors import PropertyError
from ratherthan.io._storm_words import CLOSED, OPEN, words_of
from ratherthan.model.formula import constant, resolved, states_of
from ratherthan.model.mdp import Bools, Reward
from ratherthan.model.problem import Problem
from ratherthan.model.syntax import Term, parse_formula
from ratherthan.model.valuation import one_of
from ratherthan.model.weights import reward_of

__all__ = ["Translated", "translated"]

_HEAD = re.compile(r"(P|R|T|S|LRA)(min|max)?")
_BEFORE = re.compile(r"[FGX](steps|time|rew)?")
_BETWEEN = re.compile(r"[UWR](steps|time|rew)?")
_GAIN = re.compile(r"C(steps|time|rew|discount)?|I|LRA|S")
_RELATIONS = ("<=", "<", ">=", ">", "=")
_ARITHMETIC = ("+", "-", "*", "/")
_FUNCTIONS = ("min", "max", "floor", "ceil", "round", "pow", "mod", "log")
_CONNECTIVES = ("&", "|", "=>", "<=>", "&&")
_MOST_WORDS, _LARGEST = 20_000, 2.0**53


@dataclass(kw_only=True)
class Translated:
    """A property for Storm, and what its words stand for.

    Parameters
    ----------
    text : str
    labels : dict of str to array of bool, ``[S]``
    rewards : dict of str to Reward
    chosen : bool
        Whether it says min or max anywhere, or asks for several objectives: then there must be decisions.
    from_zero : bool
        Whether a reward adds up without a bound on steps, or bounds a path: then none may be negative.
    averaged : bool
        Whether it asks for the mean of a reward in the long run.
    """

    text: str = ""
    labels: dict[str, Bools] = field(default_factory=dict)
    rewards: dict[str, Reward] = field(default_factory=dict)
    chosen: bool = False
    from_zero: bool = False
    averaged: bool = False


def translated(text: str, problem: Problem) -> Translated:
    """Return a property in Storm's words.

    Parameters
    ----------
    text : str
    problem : Problem

    Returns
    -------
    Translated

    Raises
    ------
    PropertyError
        Where a state formula, a reward or a bound in it cannot be read on this model. What else may be wrong Storm says.
    """
    words = words_of(text)
    if len(words) > _MOST_WORDS:
        raise PropertyError(f"A property must have at most {_MOST_WORDS} words, got {len(words)}.")
    reader = _Reader(words, problem)
    reader.read()
    reader.found.text = " ".join(reader.said)
    return reader.found


class _Reader:
    """Reads the words of a property from left to right."""

    def __init__(self, words: Sequence[str], problem: Problem) -> None:
        self.words = [*words, "", "", "", ""]  # no need to look whether there is a next one
        self.count = len(words)
        self.problem = problem
        self.variables = problem.mdp.names.variables
        self.found = Translated()
        self.said: list[str] = []
        self.at = 0
        self.unknowns: set[str] = set()  # the names whose value a quantile asks for

    def read(self) -> None:
        """Read to the end."""
        operand = True  # whether an operand may begin here
        while self.at < self.count:
            operand = self._operand() if operand else self._behind()

    def _take(self, count: int = 1) -> None:
        self.said += self.words[self.at : self.at + count]
        self.at += count

    def _operand(self) -> bool:
        """Read what begins an operand; return whether another may begin behind it."""
        word, following = self.words[self.at], self.words[self.at + 1]
        if self._head():
            return not self._gain()
        if word in ("multi", "quantile") and following == "(":
            self.found.chosen = True
            self._take(2)
            if word == "quantile":
                self._asked_names()
            return True
        if _BEFORE.fullmatch(word) and self._is_before():
            self._take()
            self._bound()
            return True
        if self._piece():
            return False
        self._take()
        return word in ("(", "!", "<", "[", "{", ",")

    def _behind(self) -> bool:
        """Read what stands behind an operand; return whether an operand may begin behind it."""
        word = self.words[self.at]
        self._take()
        if _BETWEEN.fullmatch(word):
            self._bound()
        return word not in (")", "]", "}")

    def _begins(self, at: int) -> bool:
        """Whether an operand can begin with the word at a place."""
        word = self.words[at]
        if _BETWEEN.fullmatch(word) and self.words[at + 1] != "{":  # R{"r"}… begins an operand, too
            return False
        return word[:1] in ('"', "(", "!", "-", ".", "_") or word[:1].isalnum()

    def _is_before(self) -> bool:
        """Whether the word here is a temporal operator, by what stands behind it."""
        if self.words[self.at + 1] in ("^", "{") or (self.words[self.at + 1] == "[" and self.words[self.at] != "X"):
            return True
        if self.words[self.at + 1] in _RELATIONS:
            behind = self._amount(self.at + 2)
            return behind > self.at + 2 and self._begins(behind)
        return self.words[self.at + 1] not in _ARITHMETIC and self._begins(self.at + 1)

    # Heads: P, R, T, S and LRA with what is asked.

    def _head(self) -> bool:
        """Take ``Rmax{"r"}=? [`` in Storm's order if it stands here."""
        match = _HEAD.fullmatch(self.words[self.at])
        if match is None:
            return False
        at, reward, way = self.at + 1, None, match[2] or ""
        if self.words[at : at + 3] == ["[", "exp", "]"]:
            at += 3
        if self.words[at] == "{" and self.words[at + 2] == "}":
            reward, at = self.words[at + 1], at + 3
        if not way and self.words[at] in ("min", "max"):
            way, at = self.words[at], at + 1
        asked = self.words[at]
        end = at + 1 if asked == "=?" else self._amount(at + 1) if asked in _RELATIONS[:4] else at
        if end == at or self.words[end] != "[":
            return False
        if asked != "=?":
            asked += self._number(at + 1, end, *((None, None) if match[1] in "RT" else (0, 1)))
        name = f'{{"{self._reward(reward)}"}}' if match[1] == "R" else ""
        self.found.chosen |= bool(way)
        self.said.append(f"{match[1]}{name}{way}{asked} [")
        self.at = end + 1
        return True

    def _reward(self, said: str | None) -> str:
        """Return Storm's name for a reward, ``"name"`` or None for the only one."""
        rewards = self.problem.mdp.rewards
        name = said.strip('"') if said is not None else next(iter(rewards)) if len(rewards) == 1 else None
        found = None if name is None else reward_of(self.problem.mdp, name)
        if found is None:
            listed = one_of(name or "", rewards) if rewards else "but it has none"
            came = f"got '{name}'" if name is not None else "and a property must name it"
            raise PropertyError(f"A reward must be one of the model's: {listed}; {came}.", reward=name)
        for own, reward in self.found.rewards.items():
            if reward is found:
                return own
        own = f"r{len(self.found.rewards)}"
        self.found.rewards[own] = found
        return own

    def _gain(self) -> bool:
        """Take what a reward may ask in place of a path, such as ``C<=5``, if it stands here."""
        word = self.words[self.at]
        after_reward = self.said[-1][0] == "R"
        if not after_reward:
            return False
        if not _GAIN.fullmatch(word) or self.words[self.at + 1] not in ("]", "{", "[", *_RELATIONS):
            self.found.from_zero = True
            return False
        self.found.from_zero |= word.startswith("C") and self.words[self.at + 1] == "]"
        self.found.averaged |= word in ("S", "LRA")
        self._take()
        self._bound()
        return True

    def _asked_names(self) -> None:
        """Take the names whose values a quantile asks for."""
        while True:
            at = self.at + (self.words[self.at] in ("min", "max"))
            if self.words[at + 1] != "," or not self.words[at].isidentifier():
                return
            self.unknowns.add(self.words[at])
            self.said += [self.words[at], ","]
            self.at = at + 2

    # Bounds on steps, time and rewards, with every constant in its number; glued to the word before (Storm reads I=3, not I =3).

    def _bound(self) -> None:
        """Take the bounds behind a temporal operator, if there are any."""
        if self.words[self.at] == "^":
            self.at += 1
        braces = self.words[self.at] == "{" and self.words[self.at + 2] != "}"  # PRISM's F^{rew{"r"}<=5,steps<=3}
        self.at += braces
        while self._one_bound() and self.words[self.at] == ",":
            self._take()
        if braces and self.words[self.at] == "}":
            self.at += 1

    def _one_bound(self) -> bool:
        if self.words[self.at] in ("rew", "steps", "time"):
            self.said[-1] += self.words[self.at].removeprefix("rew")
            self.at += 1
        if self.words[self.at] == "{" and self.words[self.at + 2] == "}":
            self.said[-1] += f'{{"{self._reward(self.words[self.at + 1])}"}}'
            self.found.from_zero = True
            self.at += 3
        if self.words[self.at] in _RELATIONS:
            relation, end = self.words[self.at], self._amount(self.at + 1)
            self.said[-1] += relation + self._number(self.at + 1, end, 0)
            self.at = end
            return True
        if self.words[self.at] == "[":
            middle = self._amount(self.at + 1)
            end = self._amount(middle + 1)
            if self.words[middle] == "," and self.words[end] == "]":
                self.said[-1] += f"[{self._number(self.at + 1, middle, 0)},{self._number(middle + 1, end, 0)}]"
                self.at = end + 1
                return True
        return False

    def _amount(self, at: int) -> int:
        """Return the place behind an amount that begins at a place: numbers, names and brackets, with signs between."""
        while True:
            start = at
            at += self.words[at] == "-"
            if self.words[at] == "(" or (self.words[at] in _FUNCTIONS and self.words[at + 1] == "("):
                at = self._closed(at + (self.words[at] != "("))
            elif re.match(r"[\w.]", self.words[at]) and self.words[at] not in _FUNCTIONS:
                at += 1
            else:
                return start
            if self.words[at] not in _ARITHMETIC:
                return at
            at += 1

    def _closed(self, at: int) -> int:
        """Return the place behind the bracket that closes the one at a place."""
        depth = 0
        for i in range(at, self.count):
            depth += (self.words[i] in OPEN) - (self.words[i] in CLOSED)
            if depth == 0:
                return i + 1
        return self.count

    def _number(self, begin: int, end: int, least: float | None = None, most: float | None = None) -> str:
        """Return the number that words mean, in its range; the words themselves where a quantile asks for it."""
        words = self.words[begin:end]
        if self.unknowns.intersection(words):
            return " ".join(words)
        value = constant(resolved(parse_formula(" ".join(words), "bound"), self.problem.definitions))
        if not abs(value) < _LARGEST or (least is not None and value < least) or (most is not None and value > most):
            wanted = "a number" if least is None else "a number from 0 on" if most is None else "a number from 0 to 1"
            raise PropertyError(f"The bound must be {wanted} here, got {value:g} for '{' '.join(words)}'.")
        return repr(int(value)) if value == int(value) else repr(value)

    # State formulas.

    def _piece(self) -> bool:
        """Take the longest state formula that begins here, as a label, if there is one."""
        whole = self._ends(self.at)
        for end in dict.fromkeys((whole, self._ends(self.at, at_connectives=True))):
            term = _formula(" ".join(self.words[self.at : end]))
            if term is not None:
                self.said.append(str(term.value).lower() if term.op == "truth" else f'"{self._label(term)}"')
                self.at = end
                return True
        return False

    def _label(self, term: Term) -> str:
        mask = states_of(self.problem.mdp, resolved(term, self.problem.definitions, self.variables))
        for own, other in self.found.labels.items():
            if np.array_equal(other, mask):
                return own
        own = f"s{len(self.found.labels)}"
        self.found.labels[own] = mask
        return own

    def _ends(self, at: int, *, at_connectives: bool = False) -> int:
        """Return where a state formula that begins at a place must end: at its bracket, a comma, ``U`` or ``||``."""
        depth = 0
        for i in range(at, self.count):
            word = self.words[i]
            depth += (word in OPEN) - (word in CLOSED)
            if depth < 0 or (depth == 0 and word in (",", ";", "||", "")):
                return i
            if depth == 0 and i > at:
                if at_connectives and word in _CONNECTIVES:
                    return i
                operand_before = self.words[i - 1][-1:] in ('"', ")") or self.words[i - 1][-1:].isalnum()
                if _BETWEEN.fullmatch(word) and operand_before:
                    return i
        return self.count


def _formula(text: str) -> Term | None:
    """Return the tree of a state formula, None where the text is none."""
    if not text:
        return None
    try:
        return parse_formula(text)
    except PropertyError:
        return None
