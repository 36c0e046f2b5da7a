"""What is told of each state enters, one mapping a state; state variables and names of actions leave."""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.io._gym_entries import Numbers
from ratherthan.io._gym_explore import SKIPPED
from ratherthan.model.mdp import Bools

__all__ = ["action_names", "columns_of", "plain_facts"]

LONGEST = 4
NONE = "none"


def plain_facts(environment: Any, ignored: Sequence[str] = ()) -> Mapping[str, Any]:
    """Return the attributes of an environment that a person can read: numbers, words, and short lists of these."""
    found = {}
    for name, value in vars(environment).items():
        plain = _plain(value)
        if plain is not None and name not in SKIPPED and name not in ignored and name.strip("_").isidentifier():
            found[name.strip("_")] = plain
    return found


def _plain(value: Any) -> bool | int | float | str | None:
    """Return a value as a state variable holds it, None where it is too much for one."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple) and 0 < len(value) <= LONGEST:
        parts = [_plain(item) for item in value]
        if all(isinstance(part, bool | int | float | str) for part in parts):
            return f"({' '.join(map(str, parts))})"  # no comma: it separates the variables of a name
    return None


def columns_of(told: Sequence[Mapping[str, Any]], origin: Numbers, ended: Bools) -> dict[str, npt.NDArray[np.generic]]:
    """Return the state variables that differ between states.

    Parameters
    ----------
    told : sequence of mapping
        What is told of each state, before states were added.
    origin : array of int, ``[S]``
        The one of these that each state stands for.
    ended : array of bool, ``[S]``
        Whether an episode is over there; a variable of its own where all else leaves it open.
    """
    columns: dict[str, npt.NDArray[np.generic]] = {}
    for name in dict.fromkeys(key for facts in told for key in facts):
        values = [_plain(facts.get(name)) for facts in told]
        if len(set(map(repr, values))) > 1:
            columns[name] = _column(values)[origin]
    if columns and _rows(columns, ended, with_end=True) > _rows(columns, ended, with_end=False):
        columns["ended"] = ended
    return columns


def _column(values: list[bool | int | float | str | None]) -> npt.NDArray[np.generic]:
    """Return one variable: truth values, whole numbers or numbers, where all are, else words."""
    kinds = {type(value) for value in values}
    if kinds == {bool}:
        return np.array(values, dtype=np.bool_)
    if kinds == {int} and all(abs(value) < 2**62 for value in values if isinstance(value, int)):
        return np.array(values, dtype=np.int64)
    if kinds <= {int, float} and kinds:
        return np.array(values, dtype=np.float64)
    return np.array([NONE if value is None else str(value) for value in values])


def _rows(columns: Mapping[str, npt.NDArray[np.generic]], ended: Bools, *, with_end: bool) -> int:
    """Return how many states the variables tell apart."""
    numbers = [np.unique(column, return_inverse=True)[1] for column in columns.values()]
    if with_end:
        numbers.append(ended.astype(np.int64))
    return int(np.unique(np.stack(numbers), axis=1).shape[1])


def action_names(environment: Any, count: int) -> tuple[str, ...]:
    """Return the names of actions: those of an enumeration `actions` of the environment, else numbered ones."""
    listed = getattr(environment, "actions", None)
    if isinstance(listed, type) and issubclass(listed, enum.Enum):
        by_number = {member.value: member.name.lower() for member in listed}
        if set(by_number) == set(range(count)):
            return tuple(by_number[number] for number in range(count))
    return tuple(f"a{number}" for number in range(count))
