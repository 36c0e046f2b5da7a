"""Values of state variables as others spell them enter; the numbers of the states that have them leave.

Tools name a state by the values of its variables: ``(x=1,ok=true)``, ``{"x": 1, "ok": true}``, or just ``(1,true)``, in the
order in which the model declares them. Storm lists truth values before numbers, whatever the order of declaration, and so
does a file that it wrote; within each kind the order is the same. So ``(1,true)`` is read kind by kind.

PRISM numbers states in the order of these tuples, which is not the order in which Storm finds them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import MDP

__all__ = [
    "NONE",
    "SEVERAL",
    "find_valuations",
    "has_value",
    "numeric_columns",
    "parse_tuple",
    "parse_valuation",
    "prism_order",
]

Numbers = npt.NDArray[np.int64]
Valuation = Mapping[str, Any]
NONE, SEVERAL = -1, -2
TRUTH = {"true": True, "false": False}


def parse_valuation(text: str, mdp: MDP) -> dict[str, Any] | None:
    """Return ``(x=1,y=2)`` as values by name, None where it is not of this form or names other variables."""
    found: dict[str, Any] = {}
    for part in text.strip().removeprefix("(").removesuffix(")").split(","):
        name, equals, value = part.partition("=")
        name = name.strip()
        if not equals or name in found or name not in mdp.names.variables:
            return None
        found[name] = value.strip()
    return found


def parse_tuple(text: str, mdp: MDP) -> dict[str, Any] | None:
    """Return ``1,true`` as values by name, None where it has not as many values of each kind as the model has variables."""
    variables = mdp.names.variables
    names: dict[bool, list[str]] = {True: [], False: []}
    for name, column in variables.items():
        names[np.asarray(column).dtype.kind == "b"].append(name)
    values: dict[bool, list[str]] = {True: [], False: []}
    for value in text.split(","):
        values[value.strip() in TRUTH].append(value.strip())
    if not variables or any(len(names[kind]) != len(values[kind]) for kind in names):
        return None
    return {name: value for kind in names for name, value in zip(names[kind], values[kind], strict=True)}


def find_valuations(mdp: MDP, valuations: Sequence[Valuation]) -> Numbers:
    """Return the states that have these values.

    Parameters
    ----------
    mdp : MDP
    valuations : sequence of mapping
        Values by name, as text or as they are; not all variables must be there.

    Returns
    -------
    array of int
        -1 where no state has them (or nothing is given), -2 where several have.
    """
    found = np.full(len(valuations), NONE, dtype=np.int64)
    groups: dict[tuple[str, ...], list[int]] = {}
    for i, valuation in enumerate(valuations):
        groups.setdefault(tuple(sorted(valuation)), []).append(i)
    for names, members in groups.items():
        if not names or not all(name in mdp.names.variables for name in names):
            continue
        columns = [np.asarray(mdp.names.variables[name]) for name in names]
        states: dict[tuple[Any, ...], int] = {}
        for state, values in enumerate(zip(*map(_shown, columns), strict=True)):
            states[values] = SEVERAL if values in states else state
        kinds = [column.dtype.kind for column in columns]
        for i in members:
            key = tuple(_value(valuations[i][name], kind) for name, kind in zip(names, kinds, strict=True))
            found[i] = states.get(key, NONE)
    return found


def _value(given: Any, kind: str) -> Any:
    """Return a value as a column of this kind holds it; None where it cannot be one."""
    if kind == "b":
        return given if isinstance(given, bool) else TRUTH.get(str(given).lower())
    if isinstance(given, bool):
        return None
    if kind not in "iuf":
        return str(given)
    try:
        return float(f"{float(given):g}") if kind == "f" else given if isinstance(given, int | float) else int(given)
    except (ValueError, TypeError, OverflowError):
        return None


def has_value(value: np.generic, given: Any) -> bool:
    """Return whether a variable's value is the one that is given, as text or as it is."""
    column = np.asarray([value])
    return bool(_shown(column)[0] == _value(given, column.dtype.kind))


def _shown(column: npt.NDArray[Any]) -> list[Any]:
    """Return the values of a variable; numbers that are not whole with the digits that names show."""
    return [float(f"{value:g}") for value in column.tolist()] if column.dtype.kind == "f" else column.tolist()


def numeric_columns(mdp: MDP) -> dict[str, npt.NDArray[Any]]:
    """Return the variables that are numbers or truth values."""
    variables = mdp.names.variables if mdp.names.strings is None else {}
    columns = {name: np.asarray(column) for name, column in variables.items()}
    return {name: column for name, column in columns.items() if column.dtype.kind in "biuf"}


def prism_order(mdp: MDP) -> Numbers | None:
    """Return the states in the order in which PRISM numbers them, None where that cannot be known.

    PRISM sorts states by the values of their variables in the order of declaration. A model without variables is taken to
    be numbered by whoever made the policy, too. Where all truth values come before all numbers, the order may be Storm's,
    and how the model declares them is not known; a program in PRISM's language tells it (``in_declared_order``).
    """
    variables = mdp.names.variables
    if mdp.names.strings is not None or not variables:
        return np.arange(mdp.states)
    columns = [np.asarray(column) for column in variables.values()]
    kinds = ["truth" if column.dtype.kind == "b" else "number" for column in columns]
    if any(column.dtype.kind not in "biuf" for column in columns):
        return np.arange(mdp.states)
    declared = getattr(variables, "in_declared_order", False)
    if len(set(kinds)) == 2 and kinds == sorted(kinds, reverse=True) and not declared:
        return None
    return np.lexsort(columns[::-1]).astype(np.int64)
