"""A resolved formula and a model enter, its values leave: for all states at once, one array per part of the formula.

Beside the values goes `active`, the states where the value matters: the right of ``&`` matters where the left is true, a side
of ``?:`` where it is taken. What is not defined (0/0, a remainder by 0, a whole number beyond 4.6e18) is an error where it
matters, and nothing where it does not.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection
from functools import reduce
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ratherthan.errors import PropertyError
from ratherthan.model.mdp import MDP, Bools
from ratherthan.model.syntax import TEMPORAL, Term, text_of

__all__ = ["Evaluator", "Values", "deadlocks", "one_of"]

Values = npt.NDArray[Any]
Active = npt.NDArray[np.bool_] | np.bool_
_LARGEST = 2.0**62
_COMPARE: dict[str, Callable[[Any, Any], Any]] = {
    "=": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip
_COMPUTE: dict[str, Callable[[Any, Any], Any]] = {"+": operator.add, "-": operator.sub, "*": operator.mul}
_NAMES_LISTED = 12
_LONGEST = 120


def deadlocks(mdp: MDP) -> Bools:
    """Return the states whose only choice is a loop to themselves, ``[S]``."""
    first = mdp.state_to_choices[:-1]
    branch = mdp.choice_to_branches[first]
    alone = (np.diff(mdp.state_to_choices) == 1) & (np.diff(mdp.choice_to_branches)[first] == 1)
    return np.asarray(alone & (mdp.branch_to_target[branch] == np.arange(mdp.states)))


def one_of(name: str, names: Collection[str]) -> str:
    """Return `names` as a list for a message, the closest to `name` first."""
    import difflib

    close = difflib.get_close_matches(name, list(names), n=3, cutoff=0.5)
    ordered = close + [other for other in names if other not in close]
    more = f" … ({len(ordered)} in all)" if len(ordered) > _NAMES_LISTED else ""
    return (", ".join(f"'{other}'" for other in ordered[:_NAMES_LISTED]) or "none at all") + more


class Evaluator:
    """Evaluates terms on all states of a model; `active` marks the states where the value matters."""

    def __init__(self, mdp: MDP | None) -> None:
        self.mdp = mdp

    def value(self, term: Term, active: Active) -> Values:
        """Return the values of a term: truth values, whole or floating numbers."""
        if term.op in _COMPARE:
            return self._comparison(term, active)
        if term.op in _COMPUTE:
            rule = _COMPUTE[term.op]
            return reduce(lambda a, b: self._computed(rule, (a, b), term, active), self._numbers(term, active))
        rules: dict[str, Callable[[Term, Active], Values]] = {
            "number": self._literal, "truth": self._literal, "label": self._label, "name": self._variable,
            "!": self._connective, "&": self._connective, "|": self._connective, "=>": self._connective,
            "<=>": self._connective, "?:": self._either, "neg": self._minus, "/": self._quotient, "call": self._call,
        }  # fmt: skip
        return rules[term.op](term, active)

    def truth(self, term: Term, active: Active, user: str | Term) -> Values:
        """Return the values of a term that must be true or false; `user` is what needs it, for messages."""
        values = self.value(term, active)
        if values.dtype.kind != "b":
            raise PropertyError(
                f"{_user(user)} must be true or false, but '{_shown(term)}' is {_kind(values)}. "
                f"Compare it, as in '{_shown(term)} > 0'."
            )
        return values

    def number(self, term: Term, active: Active, user: str | Term) -> Values:
        """Return the values of a term that must be a number."""
        values = self.value(term, active)
        if values.dtype.kind not in "if":
            raise PropertyError(f"{_user(user)} must have a number, but '{_shown(term)}' is {_kind(values)}.")
        return values

    def _numbers(self, term: Term, active: Active) -> tuple[Values, ...]:
        return tuple(self.number(arg, active, term) for arg in term.args)

    def _literal(self, term: Term, _: Active) -> Values:
        if isinstance(term.value, int) and abs(term.value) >= _LARGEST:
            return np.asarray(float(term.value))
        return np.asarray(term.value)

    def _minus(self, term: Term, active: Active) -> Values:
        return np.asarray(-self._numbers(term, active)[0])

    def _quotient(self, term: Term, active: Active) -> Values:
        left, right = self._numbers(term, active)
        with np.errstate(all="ignore"):
            return np.asarray(np.true_divide(left, right))

    def _label(self, term: Term, _: Active) -> Values:
        name = str(term.value)
        if self.mdp is None:
            raise PropertyError(f'A bound must be a number, but the label "{name}" stands in it.')
        if name in self.mdp.labels:
            return self.mdp.labels[name]
        if name == "init":
            mask = np.zeros(self.mdp.states, dtype=bool)
            mask[self.mdp.initial] = True
            return mask
        if name == "deadlock":
            return deadlocks(self.mdp)
        raise PropertyError(
            f"A label must be one of the model's: {one_of(name, {**self.mdp.labels, 'init': (), 'deadlock': ()})}; got '{name}'.",
            label=name,
        )

    def _variable(self, term: Term, _: Active) -> Values:
        name = str(term.value)
        if self.mdp is None:
            raise PropertyError(f"A bound must be a number or a constant of the source, got '{name}'.", name=name)
        variables = self.mdp.names.variables
        if name not in variables:
            hint = f' Labels stand in quotation marks: "{name}".' if name in self.mdp.labels else ""
            if name in TEMPORAL:
                hint = f" The operator {name} needs an operand behind it."
            raise PropertyError(
                f"A name must be a state variable, constant or formula of the model; variables are "
                f"{one_of(name, variables)}; got '{name}'.{hint}",
                name=name,
            )
        column: Values = np.asarray(variables[name])
        if column.dtype.kind == "u":
            wide = column.dtype.itemsize == 8 and bool((column > np.uint64(2**62)).any())
            return column.astype(np.float64 if wide else np.int64)
        return column.astype(np.int64) if column.dtype.kind == "i" else column

    def _connective(self, term: Term, active: Active) -> Values:
        values = self.truth(term.args[0], active, term)
        if term.op == "!":
            return np.asarray(~values)
        for arg in term.args[1:]:
            where = active & (~values if term.op == "|" else values) if term.op != "<=>" else active
            other = self.truth(arg, where, term)
            match term.op:
                case "&":
                    values = values & other
                case "|":
                    values = values | other
                case "=>":
                    values = ~values | other
                case _:
                    values = values == other
        return np.asarray(values)

    def _either(self, term: Term, active: Active) -> Values:
        test = self.truth(term.args[0], active, term)
        yes, no = self.value(term.args[1], active & test), self.value(term.args[2], active & ~test)
        if (yes.dtype.kind == "b") != (no.dtype.kind == "b"):
            raise PropertyError(
                f"Both sides of ':' must be numbers or both truth values, but in '{_shown(term)}' the first is {_kind(yes)}, "
                f"the second {_kind(no)}."
            )
        return np.where(test, yes, no)

    def _comparison(self, term: Term, active: Active) -> Values:
        if term.op not in ("=", "!="):
            left, right = self._numbers(term, active)
        else:
            left, right = (self.value(arg, active) for arg in term.args)
            if (left.dtype.kind == "b") != (right.dtype.kind == "b") or not {left.dtype.kind, right.dtype.kind} <= set(
                "bif"
            ):
                raise PropertyError(
                    f"'{term.op}' must compare two numbers or two truth values, but in '{_shown(term)}' the left is "
                    f"{_kind(left)}, the right {_kind(right)}."
                )
        self._defined((left, right), term, active)
        return np.asarray(_COMPARE[term.op](left, right))

    def _defined(self, operands: tuple[Values, ...], term: Term, active: Active) -> None:
        """Refuse what is not a number (0/0, the logarithm of -1) in a state where it matters."""
        for values in operands:
            if values.dtype.kind == "f":
                wrong = np.isnan(values) & active
                if np.any(wrong):
                    self._refuse("every number in it defined", term, wrong)

    def _refuse(self, wanted: str, term: Term, wrong: Values) -> NoReturn:
        if self.mdp is None or not np.ndim(wrong):
            raise PropertyError(f"'{_shown(term)}' must have {wanted}, but has not.")
        state = int(np.argmax(wrong))
        named = f" ('{self.mdp.names[state]}')" if self.mdp.names.named else ""
        where = f" at state {state}{named}"
        raise PropertyError(f"'{_shown(term)}' must have {wanted}, but this fails{where}.", state=state)

    def _computed(
        self, rule: Callable[[Any, Any], Any], operands: tuple[Values, ...], term: Term, active: Active
    ) -> Values:
        """Apply `rule`; on whole numbers, check with floating ones that the result fits."""
        left, right = operands
        with np.errstate(all="ignore"):
            if left.dtype.kind == right.dtype.kind == "i":
                rough = np.abs(np.asarray(rule(left.astype(np.float64), right.astype(np.float64))))
                if np.any(((rough >= _LARGEST) | np.isnan(rough)) & active):
                    self._refuse("whole numbers below 4.6e18", term, np.asarray((rough >= _LARGEST) & active))
            return np.asarray(rule(left, right))

    def _call(self, term: Term, active: Active) -> Values:
        operands = self._numbers(term, active)
        match term.value:
            case "min" | "max":
                self._defined(operands, term, active)
                return np.asarray(
                    (np.minimum if term.value == "min" else np.maximum).reduce(np.broadcast_arrays(*operands))
                )
            case "floor" | "ceil" | "round":
                return self._rounded(str(term.value), operands[0], term, active)
            case "mod":
                return self._modulo(operands, term, active)
            case "pow":
                whole = all(values.dtype.kind == "i" for values in operands) and not np.any(operands[1] < 0)
                base, exponent = operands if whole else (values.astype(np.float64) for values in operands)
                return self._computed(np.power, (np.asarray(base), np.asarray(exponent)), term, active)
        with np.errstate(all="ignore"):
            logarithms = [np.log(values.astype(np.float64)) for values in operands]
            return np.asarray(logarithms[0] / logarithms[1])

    def _rounded(self, name: str, values: Values, term: Term, active: Active) -> Values:
        if values.dtype.kind == "i":
            return values
        with np.errstate(all="ignore"):
            fits = np.abs(values) < _LARGEST  # false for what is not a number
            if np.any(~fits & active):
                self._refuse("a finite number below 4.6e18", term, np.asarray(~fits & active))
            values = np.where(fits, values, 0.0)
            whole = {"floor": np.floor, "ceil": np.ceil}.get(name, lambda x: np.floor(x + 0.5))(values)
        return np.asarray(whole).astype(np.int64)

    def _modulo(self, operands: tuple[Values, ...], term: Term, active: Active) -> Values:
        if any(values.dtype.kind != "i" for values in operands):
            raise PropertyError(f"mod must have whole numbers, but '{_shown(term)}' has a fraction. Use floor(…).")
        dividend, divisor = operands
        if np.any((divisor <= 0) & active):
            self._refuse("a divisor above 0", term, np.asarray((divisor <= 0) & active))
        return np.asarray(dividend % np.where(divisor > 0, divisor, 1))


def _shown(term: Term) -> str:
    text = text_of(term)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + " …"


def _user(user: str | Term) -> str:
    """Say what needs a value of some type."""
    if isinstance(user, str):
        return user
    if user.op == "?:":
        return f"What stands before '?' in '{_shown(user)}'"
    return f"'{({'call': user.value, 'neg': '-'}).get(user.op, user.op)}' in '{_shown(user)}'"


def _kind(values: Values) -> str:
    return {"b": "a truth value", "i": "a number", "f": "a number"}.get(values.dtype.kind, "a word")
