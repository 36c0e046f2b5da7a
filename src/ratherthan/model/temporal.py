"""A path formula enters and comes through if it can be explained; else the name of what it is leaves, as a refusal.

Known are the temporal operators of PRISM and Storm, so that a property outside of what can be explained is refused as what
it is, with the nearest one that can, rather than as a misspelt one. Of rewards only ``F g`` comes through, of chances each
co-safe formula (see path.py): those whose satisfaction shows after finitely many steps.
"""

from __future__ import annotations

from dataclasses import dataclass

from ratherthan.errors import NotExplainableError, PropertyError
from ratherthan.model.path import (
    bounded_steps,
    forever,
    is_temporal,
    plain_until,
    positive,
    settled,
    window,
    without_bounds_on_rewards,
)
from ratherthan.model.problem import Problem
from ratherthan.model.syntax import TEMPORAL, Term, text_of

__all__ = ["REFUSED", "Statement", "chance_of", "refusal", "shown_path", "until_of", "with_example"]

_EXAMPLE = ('R{"cost"}min=?', 'F "goal"')
_ARRIVE, _COST = 'Pmax=? [F "goal"]', f"{_EXAMPLE[0]} [{_EXAMPLE[1]}]"
REFUSED = {
    "total": (
        "C (a reward that adds up without end)",
        "the discounted sum, {head} [Cdiscount=0.95], or the reward until a goal, {head} [{path}]",
    ),
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


def refusal(what: str, nearest: str = "", *, example: tuple[str, str] = _EXAMPLE) -> PropertyError:
    """Return the error that names what cannot be explained, and the nearest property that can.

    Parameters
    ----------
    what : str
        Its name, or without `nearest` its key among those that are known.
    nearest : str
    example : tuple of str
        How a question about the same reward begins, and a path for it.
    """
    if not nearest:
        what, nearest = REFUSED[what]
        nearest = nearest.replace("{head}", example[0]).replace("{path}", example[1])
    return NotExplainableError(
        f"{what[0].upper()}{what[1:]} cannot be explained here. The nearest that can: {nearest}."
    )


def with_example(error: NotExplainableError, example: tuple[str, str]) -> NotExplainableError:
    """Return a refusal with another example of a reward: how a question about it begins, and a path for it."""
    return NotExplainableError(error.message.replace(_COST, f"{example[0]} [{example[1]}]"), **error.place)


def until_of(path: Term, operator: str, *, maximise: bool) -> Term:
    """Return the goal of a path that R or T can ask of; raise NotExplainableError unless it is ``F g`` or ``Fsure g``.

    Parameters
    ----------
    path : Term
    operator : str
        What is asked of the path, as the nearest property shall show it: ``R{"cost"}``, ``T``.
    maximise : bool
        Whether its maximum is asked for.
    """
    head = _heads(operator, maximise=maximise)[0]
    if any(map(is_temporal, path.args)):
        what = "a reward until a formula of linear temporal logic (an operator beside or inside another)"
        raise refusal(what, f'F over a state formula, such as {head} [F "goal"]')
    if not is_temporal(path):
        raise refusal(_NO_OPERATOR, f"the way there, {head} [F {text_of(path)}]")
    goal = path.args[-1]
    if path.op != "F" or path.value not in (None, "sure"):
        raise refusal(f"a reward until anything but F without a bound ({path.op} here)", f"{head} [F {text_of(goal)}]")
    return goal


def chance_of(path: Term, problem: Problem, *, maximise: bool) -> Term:
    """Return a path whose chance can be asked, with definitions put in and bounds as numbers.

    Parameters
    ----------
    path : Term
        As it was read.
    problem : Problem
        Its definitions and state variables are known to the path.
    maximise : bool
        Whether the maximum of the chance is asked for.

    Raises
    ------
    NotExplainableError
        Unless whether the path is satisfied is known after finitely many steps.
    PropertyError
        For bounds that are none.
    """
    head, other = _heads("P", maximise=maximise)
    if not is_temporal(path):
        raise refusal(_NO_OPERATOR, f"the way there, {head} [F {text_of(path)}]")
    if _sure(path):
        nearest = f"the same without it, such as {head} [F {text_of(path.args[-1])}]"
        raise refusal("Fsure (a reward over plans that are sure to arrive) of a chance", nearest)
    free = without_bounds_on_rewards(path)
    if free != path:
        op = next(op for op in TEMPORAL if _bounded_on_reward(path, op))
        raise refusal(f"{op} with a bound on a reward", f"the same without the bound, {head} [{text_of(free)}]")
    path = settled(path, problem.definitions, problem.mdp.names.variables)
    normal = positive(path)
    endless = next(forever(normal), None)
    if endless is None:
        return path
    name = _NAMES[path.op] if path.op in _NAMES and path.value is None else "G, W or R without a bound (for ever)"
    opposite = positive(path, negate=True)
    if next(forever(opposite), None) is None:
        raise refusal(name, f"its opposite, the chance that it fails, {other} [{shown_path(opposite)}]")
    if endless.op == "G" and is_temporal(endless.args[0]):
        nearest = shown_path(_once(normal))
        raise refusal("G over a temporal operator (again and again)", f"once instead, {head} [{nearest}]")
    until = _until_then(normal)
    if until is not None:
        raise refusal(name, f"the same until the goal, {head} [{shown_path(until)}]")
    bounded = text_of(bounded_steps(path))
    raise refusal(name, f"the same for some number of steps, such as {head} [{bounded}]")


def _bounded_on_reward(term: Term, op: str) -> bool:
    """Whether an operator with a bound on a reward stands in a term as it was read."""
    own = term.op == op and without_bounds_on_rewards(term).value != term.value
    return own or any(_bounded_on_reward(arg, op) for arg in term.args)


_NO_OPERATOR = "a property without a temporal operator"
_NAMES = {"G": "G (always)", "W": "W (weak until)", "R": "R (release)"}


def shown_path(path: Term) -> str:
    """Return the text of a path in positive normal form, as the simplest objective that means it has it."""
    plain = plain_until(path)
    if plain is None:
        return text_of(path)
    through, goal = plain
    return f"F {text_of(goal)}" if through is None else f"{text_of(through)} U {text_of(goal)}"


def _heads(operator: str, *, maximise: bool) -> tuple[str, str]:
    """Return the head of a question, and that of the opposite direction."""
    ways = ("max", "min") if maximise else ("min", "max")
    return f"{operator}{ways[0]}=?", f"{operator}{ways[1]}=?"


def _sure(term: Term) -> bool:
    return term.value == "sure" or any(map(_sure, term.args))


def _until_then(term: Term) -> Term | None:
    """Return ``a U b`` for ``(G a) & (F b)`` over state formulas, None for anything else."""
    if term.op != "&" or sorted(part.op for part in term.args) != ["F", "G"]:
        return None
    if any(part.value is not None or is_temporal(part.args[0]) for part in term.args):
        return None
    kept, reached = sorted(term.args, key=lambda part: part.op == "F")
    return Term("U", (kept.args[0], reached.args[0]))


def _once(term: Term) -> Term:
    """Return a positive normal form with each "again and again" replaced by "once", and other "for ever" bounded."""
    if term.op == "G" and window(term)[1] is None and is_temporal(term.args[0]):
        return _once(term.args[0])
    return bounded_steps(Term(term.op, tuple(map(_once, term.args)), term.value))
