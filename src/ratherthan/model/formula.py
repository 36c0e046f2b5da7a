"""A model and the text of a PRISM state formula enter, the set of states where it holds leaves: a truth value per state.

A formula speaks of labels (``"goal"``), state variables (``x = 3 & !busy``), and of constants and formulas that the source
defines. Every part is evaluated for all states at once. Whole numbers stay whole (and an overflow is an error, not a wrong
number); ``/``, ``log`` and anything with a fraction is floating point, as in PRISM. A part that cannot matter in a state
(the right of ``&`` where the left is false, the other side of ``?:``) may be undefined there, such as ``y / x`` at x = 0;
where it matters, that is an error that names the state.

Two labels need no definition: ``"init"``, the initial states, and ``"deadlock"``, the states whose only choice is a loop to
themselves.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from ratherthan.errors import PropertyError
from ratherthan.model.mdp import MDP, Bools
from ratherthan.model.syntax import Term, parse_formula, text_of
from ratherthan.model.valuation import Evaluator

__all__ = ["canonical", "constant", "resolved", "states_of", "states_where"]

_NO_DEFINITIONS: Mapping[str, str] = {}


def states_where(mdp: MDP, text: str, definitions: Mapping[str, str] = _NO_DEFINITIONS) -> Bools:
    """Return the states where a state formula holds.

    Parameters
    ----------
    mdp : MDP
    text : str
        A PRISM state formula over labels, state variables and `definitions`.
    definitions : mapping of str to str
        Constants and formulas by name, as PRISM expressions that may mention each other.

    Returns
    -------
    array of bool, ``[S]``

    Raises
    ------
    PropertyError
        For text that is no formula, unknown labels and names, a number where a truth value is needed (or the other way
        round), definitions that go in a circle, and values that are not defined where they matter.

    Examples
    --------
    >>> from ratherthan.model.names import StateNames
    >>> row = np.arange(4)
    >>> mdp = MDP(
    ...     state_to_choices=row,
    ...     choice_to_branches=row,
    ...     branch_to_target=np.array([1, 2, 2]),
    ...     branch_to_probability=np.ones(3),
    ...     initial=np.array([0]),
    ...     labels={"goal": np.array([False, False, True])},
    ...     names=StateNames(count=3, variables={"x": np.array([0, 1, 2])}),
    ... )
    >>> states_where(mdp, 'x < N & !"goal"', {"N": "2"})
    array([ True,  True, False])
    """
    term = parse_formula(text)
    try:
        return states_of(mdp, resolved(term, definitions, mdp.names.variables))
    except RecursionError:
        raise PropertyError(f"The formula '{text[:60]} …' is nested too deeply to be evaluated.") from None


def states_of(mdp: MDP, term: Term) -> Bools:
    """Return the states where a resolved formula holds, ``[S]``; PropertyError as `states_where`."""
    values = Evaluator(mdp).truth(term, np.True_, "A state formula")
    return np.array(np.broadcast_to(values, (mdp.states,)))


def canonical(text: str, definitions: Mapping[str, str], variables: Collection[str] = ()) -> str:
    """Return `text` with the definitions put in: it stands on its own over labels and the state `variables`."""
    return text_of(resolved(parse_formula(text), definitions, variables))


def constant(term: Term) -> float:
    """Return the value of an expression without labels and variables; PropertyError where it is no number."""
    try:
        return float(Evaluator(None).number(term, np.True_, "A bound"))
    except RecursionError:
        raise PropertyError("A bound must be a number, but this one is nested too deeply to be evaluated.") from None


def resolved(
    term: Term, definitions: Mapping[str, str], variables: Collection[str] = (), path: tuple[str, ...] = ()
) -> Term:
    """Put the definitions in the place of their names.

    Parameters
    ----------
    term : Term
    definitions : mapping of str to str
    variables : collection of str
        Names that stand for themselves, even if a definition has the same name.
    path : tuple of str
        The definitions that led here.

    Returns
    -------
    Term

    Raises
    ------
    PropertyError
        If the definitions go in a circle, or one is no expression.
    """
    name = str(term.value)
    if term.op == "name" and name in definitions and name not in variables:
        if name in path:
            circle = " → ".join((*path[path.index(name) :], name))
            raise PropertyError(f"A definition must not lead back to itself, got {circle}. Change one of them.")
        inner = parse_formula(definitions[name], f"definition of '{name}'")
        return resolved(inner, definitions, variables, (*path, name))
    if not term.args:
        return term
    args = tuple(resolved(arg, definitions, variables, path) for arg in term.args)
    if term.op in "&|":  # stays flat when a definition brings its own conjunction
        args = tuple(part for arg in args for part in (arg.args if arg.op == term.op else (arg,)))
    return Term(term.op, args, term.value)
