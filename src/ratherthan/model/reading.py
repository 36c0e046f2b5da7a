"""The text of a PRISM formula or property enters, its tree leaves; or the sentence that says where it goes wrong, and how.

What may be written stands in two grammars beside this file, ``formula.lark`` and ``property.lark``, which adds paths and
queries to the first. lark makes LALR(1) tables of them [1]_: the text is read from left to right, one word ahead, without
recursion. The words that the tables allow at a place are what a message asks for there. The tables are built once and kept
in the user's cache, where one can be written. Loading lark takes time: this module is imported where something is read.

References
----------
.. [1] DeRemer, F. and Pennello, T. (1982). Efficient computation of LALR(1) look-ahead sets. ACM TOPLAS 4(4), 615-649.
"""

from __future__ import annotations

import re
import sys
from functools import cache, partial
from itertools import groupby
from typing import Any

from lark import Lark, Token, Transformer
from lark.exceptions import UnexpectedInput
from lark.visitors import merge_transformers

from ratherthan.errors import PropertyError
from ratherthan.model.syntax import FUNCTIONS, Term, joined
from ratherthan.model.temporal import REFUSED, Statement, refusal

__all__ = ["read"]

_DEEPEST = 2000  # how many parts may be begun and not yet ended, as brackets within brackets
_LONGEST_NUMBER, _LONGEST_SHOWN, _NEARBY = 40, 400, 60
_FOREIGN = {"<->": "<=>", "==": "=", "&&": "&", "||": "|", "->": "=>", "~": "!"}
_FOREIGN_SIGN = re.compile("|".join(map(re.escape, _FOREIGN)))
_SIGNS = {
    "COMMA": ",", "RPAR": ")", "LSQB": "[", "RSQB": "]", "RBRACE": "}", "COLON": ":", "QUERY": "=", "_EXPECTED": "exp",
}  # fmt: skip


class _MisreadError(Exception):
    """A word that the grammar allows must not stand where it does."""

    def __init__(self, message: str, word: Token) -> None:
        super().__init__(message)
        self.at = word.start_pos or 0


class _Formulas(Transformer[Token, Any]):
    """Makes the trees of formulas: a method for each name behind an arrow in the grammar."""

    def number(self, parts: list[Token]) -> Term:
        """Return a number, whole or not."""
        word = parts[0]
        if len(word) > _LONGEST_NUMBER or (not word.isdigit() and float(word) == float("inf")):
            raise _MisreadError(
                f"Every number must be a number that a computer can hold, got '{word[:_LONGEST_NUMBER]}'", word
            )
        return Term("number", value=int(word) if word.isdigit() else float(word))

    def truth(self, parts: list[Token]) -> Term:
        """Return ``true`` or ``false``."""
        return Term("truth", value=parts[0] == "true")

    def label(self, parts: list[Token]) -> Term:
        """Return a label, without its quotation marks."""
        return Term("label", value=parts[0][1:-1])

    def name(self, parts: list[Token]) -> Term:
        """Return the name of a variable, constant or formula."""
        return Term("name", value=str(parts[0]))

    def minus(self, parts: list[Term]) -> Term:
        """Return an operand with a minus before it."""
        return Term("neg", (parts[0],))

    def negation(self, parts: list[Any]) -> Term:
        """Return the opposite of an operand."""
        return Term("!", (parts[1],))

    def choice(self, parts: list[Term]) -> Term:
        """Return ``test ? yes : no``."""
        return Term("?:", tuple(parts))

    def chain(self, parts: list[Any]) -> Term:
        """Return operands with operators of one level between them, grouped to the left."""
        left: Term = parts[0]
        for sign, run in groupby(zip(parts[1::2], parts[2::2], strict=True), key=lambda pair: str(pair[0])):
            left = joined(sign, [left, *(right for _, right in run)])
        return left

    def call(self, parts: list[Any]) -> Term:
        """Return a function with its arguments."""
        word, *args = parts
        name = str(word)
        if name == "func" and args[0].op == "name" and len(args) > 1:  # func(min, a, b), as in old PRISM
            name = args.pop(0).value
        if name not in FUNCTIONS:
            raise _MisreadError(f"A function must be one of {', '.join(FUNCTIONS)}, got '{name}'", word)
        least, most = FUNCTIONS[name]
        if len(args) < least or (most is not None and len(args) > most):
            raise _MisreadError(
                f"The function {name} must have {most} argument{'s' * (most != 1)}, got {len(args)}", word
            )
        return Term("call", tuple(args), name)


class _Properties(_Formulas):
    """Makes statements of properties, and refuses what cannot be explained."""

    def __init__(self) -> None:
        super().__init__()
        for what in REFUSED.keys() - {"total"}:
            setattr(self, what, partial(_refuse, what))

    def start(self, parts: list[Any]) -> Statement:
        """Return the statement, without the name before it."""
        statement: Statement = parts[-1]
        return statement

    def query(self, parts: list[Any]) -> Statement:
        """Return a statement of its head, what is asked and the path."""
        (operator, reward, way), (relation, bound), path = parts
        return Statement(operator, reward, way, relation, bound, path)

    def chance(self, parts: list[Any]) -> tuple[str, None, str]:
        """Return the head of a property with P or T."""
        return str(parts[0]), None, str(parts[1] or "")

    def reward(self, parts: list[Any]) -> tuple[str, str | None, str]:
        """Return the head ``R{"name"}min``."""
        return str(parts[0]), parts[1], str(parts[2] or "")

    def reward_behind(self, parts: list[Any]) -> tuple[str, str | None, str]:
        """Return the head ``Rmin{"name"}``."""
        return self.reward([parts[0], parts[2], parts[1]])

    def index(self, parts: list[Token]) -> str | None:
        """Return the name of a reward, None where it is not said."""
        return parts[-1][1:-1] if parts else None

    def best(self, _: list[Token]) -> tuple[None, None]:
        """Return what ``=?`` asks."""
        return None, None

    def limit(self, parts: list[Any]) -> tuple[str, Term]:
        """Return a relation and a bound."""
        return str(parts[0]), parts[1]

    def total(self, _: list[Token]) -> Term:
        """Return ``C``: a reward that adds up without end."""
        return Term("C")

    def discounted(self, parts: list[Any]) -> Term:
        """Return ``Cdiscount=0.9``: the same, discounted."""
        return Term("C", (parts[1],))

    def prefix(self, parts: list[Any]) -> Term:
        """Return ``F``, ``G`` or ``X`` with its operand."""
        return _temporal(parts[0], parts[1:])

    def between(self, parts: list[Any]) -> Term:
        """Return ``U``, ``W`` or ``R`` with its operands."""
        return _temporal(parts[1], [parts[0], *parts[2:]])


def _temporal(operator: Token, parts: list[Any]) -> Term:
    """Return a temporal operator with its operands.

    Its value is the text of its bound (``F<=3``: ``"<=3"``, ``Fsteps<=3``: ``"steps<=3"``), ``"sure"`` for ``Fsure``, and
    None where there is nothing of that.
    """
    operands = tuple(part for part in parts if isinstance(part, Term))
    bound = "".join(part for part in parts if not isinstance(part, Term))
    return Term(operator[0], operands, f"{operator[1:]}{bound}" or None)


def _refuse(what: str, _: object) -> Term:
    """Raise the refusal of something that is known."""
    raise refusal(what)


@cache
def _parser(kind: str) -> Lark:
    """Return the parser of one of the two grammars."""
    trees = _Formulas() if kind == "formula" else merge_transformers(_Properties(), formula=_Formulas())
    return Lark.open_from_package(
        "ratherthan.model", f"{kind}.lark", parser="lalr", transformer=trees, cache=_kept(kind)
    )


def _kept(kind: str) -> str | bool:
    """Return the file where lark keeps the tables of a grammar, False where there can be none."""
    from platformdirs import user_cache_path

    folder = user_cache_path("ratherthan") / "grammars"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return str(folder / f"{kind}-{sys.version_info.major}.{sys.version_info.minor}.pickle")


def read(kind: str, text: str, what: str) -> Any:
    """Read a whole text.

    Parameters
    ----------
    kind : str
        ``"formula"`` or ``"property"``.
    text : str
    what : str
        What it is, for messages: ``"definition of 'N'"``.

    Returns
    -------
    Term or Statement
        A formula's tree, a property's statement.

    Raises
    ------
    PropertyError
        For text that is none, with the column and what must stand there; and for what is known but cannot be explained.
    """
    parse = _parser(kind).parse_interactive(text + "\n")  # something stands behind every word: see _REST
    try:
        for _ in parse.iter_parse():
            if len(parse.parser_state.value_stack) > _DEEPEST:
                raise PropertyError(f"The {what} '{text[:_NEARBY]} …' is nested too deeply to be read.", text=text)
        return parse.feed_eof()
    except _MisreadError as misread:
        where = f"at column {misread.at + 1} of '{_shown(text, misread.at)}'"
        raise PropertyError(f"{misread} {where}.", text=text, column=misread.at + 1) from None
    except UnexpectedInput as error:
        token = getattr(error, "token", None)
        ended = token is not None and token.type == "$END"
        at = len(text) if ended else min(int(error.pos_in_stream or 0), len(text))
        raise _unexpected(text, what, at, parse.accepts()) from None


def _unexpected(text: str, what: str, at: int, possible: set[str]) -> PropertyError:
    """Return the error for what stands at place `at`, where one of the `possible` words must come."""
    if "BETWEEN" not in possible and re.match(r"[UWR](steps|time)?\b", text[at:]) and possible & {"RSQB", "RPAR"}:
        return PropertyError(
            f"U, W and R must stand between two parts: put brackets around one of them, as in a U (b U c), "
            f"at column {at + 1} of '{_shown(text, at)}'.",
            text=text,
            column=at + 1,
        )
    foreign = next((sign for sign in _FOREIGN_SIGN.finditer(text) if sign.start() <= at < sign.end()), None)
    if foreign is None:
        wanted, hint = _wanted(possible, text[at:]), ""
    else:
        at, own = foreign.start(), _FOREIGN[foreign[0]]
        wanted, hint = f"'{own}'", f" PRISM writes '{own}', not '{foreign[0]}'."
    return PropertyError(
        f"The {what} '{_shown(text, at)}' must have {wanted} at column {at + 1}, got {_came(text[at:])}.{hint}",
        text=text,
        column=at + 1,
    )


def _wanted(possible: set[str], came: str) -> str:
    """Say in words what may come, of the words that the grammar allows."""
    if "CHANCE" in possible:
        return 'a property such as Pmax=? [F "goal"] or R{"cost"}min=? [F "goal"]'
    if "NUMBER" in possible:
        if re.match("!(?!=)", came) and "NOT" not in possible:
            return "an operand ('!' binds weaker than what stands before it: put brackets around it)"
        return f"{'F, ' if 'PREFIX' in possible else ''}a number, a name, a \"label\" or '('"
    if "STRING" in possible:
        return 'the name of a reward in quotation marks, as in R{"cost"}min=?'
    signs = [f"'{sign}'" for name, sign in _SIGNS.items() if name in possible]
    if signs:
        return " or ".join(signs)
    return "the end (one property at a time)" if "COMBINED" in possible else "an operator or the end"


def _came(rest: str) -> str:
    """Say in words what came."""
    if not rest:
        return "the end"
    if rest.startswith('"') and not re.match(r'"[^"\n]*"', rest):
        return "a quotation mark that is never closed"
    return f"'{rest[:20]}'"


def _shown(text: str, at: int) -> str:
    """Return the text for a message; of a very long one, what stands around place `at`."""
    if len(text) <= _LONGEST_SHOWN:
        return text.strip()
    first, last = max(at - _NEARBY, 0), at + _NEARBY
    return f"{'… ' * (first > 0)}{' '.join(text[first:last].split())}{' …' * (last < len(text))}"
