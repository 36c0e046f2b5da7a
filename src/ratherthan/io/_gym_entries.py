"""A transition table as Gymnasium has it enters, its entries leave as arrays; every number in it is checked.

The table says for every state and action ``[[probability, next state, reward, terminated], …]``, in lists or in mappings
numbered from 0; where an action has one outcome, the four alone will do. N is the number of entries.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.model.mdp import Bools, Floats

__all__ = ["Numbers", "Table", "table_from"]

Numbers = npt.NDArray[np.int64]
FIELDS = 4
MOST = 2**53
FORM = "[[probability, next state, reward, terminated], …]"


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """Entries in the order of state and action; an entry of probability 0 is none.

    Parameters
    ----------
    states, actions : int
        How many there are.
    state, action, target : array of int, ``[N]``
    probability, reward : array of float, ``[N]``
    terminated : array of bool, ``[N]``
        Whether the episode ends with this entry.
    """

    states: int
    actions: int
    state: Numbers  # [N]
    action: Numbers  # [N]
    target: Numbers  # [N]
    probability: Floats  # [N]
    reward: Floats  # [N]
    terminated: Bools  # [N]

    def taken(self, kept: Any) -> Table:
        """Return the entries that a mask or an index picks."""
        return Table(
            states=self.states,
            actions=self.actions,
            state=self.state[kept],
            action=self.action[kept],
            target=self.target[kept],
            probability=self.probability[kept],
            reward=self.reward[kept],
            terminated=self.terminated[kept],
        )


def table_from(given: Any, shown: str, *, states: int | None = None, actions: int | None = None) -> Table:
    """Check a table and return its entries, without those of probability 0.

    Parameters
    ----------
    given : sequence or mapping
        By state, then by action.
    shown : str
        How the source is called in errors.
    states, actions : int, optional
        How many there must be.

    Raises
    ------
    SourceError
        At the first place where the table is not as it must be.
    """
    rows = _numbered(given, "The table", shown)
    if not rows:
        raise SourceError(f"A table must have at least one state, but '{shown}' has none.", path=shown)
    _same("a row per state", states, len(rows), shown)
    most = 0
    entries: list[tuple[int, int, Any]] = []
    for state, row in enumerate(rows):
        own = _numbered(row, f"State {state} of the table", shown)
        _same(f"a list per action at state {state}", actions, len(own), shown)
        most = max(most, len(own))
        for action, outcomes in enumerate(own):
            entries += [(state, action, entry) for entry in _outcomes(outcomes, state, action, shown)]
    if most == 0:
        raise SourceError(f"A table must have at least one action, but '{shown}' has none.", path=shown)
    columns = list(zip(*(_checked(*entry, len(rows), shown) for entry in entries), strict=True)) or [()] * FIELDS
    table = Table(
        states=len(rows),
        actions=most,
        state=np.array([state for state, _, _ in entries], dtype=np.int64),
        action=np.array([action for _, action, _ in entries], dtype=np.int64),
        probability=np.array(columns[0], dtype=np.float64),
        target=np.array(columns[1], dtype=np.int64),
        reward=np.array(columns[2], dtype=np.float64),
        terminated=np.array(columns[3], dtype=np.bool_),
    )
    return table.taken(table.probability != 0)


def _same(what: str, wanted: int | None, came: int, shown: str) -> None:
    if wanted is not None and wanted != came:
        raise SourceError(f"A table must have {what} ({wanted}), but '{shown}' has {came}.", path=shown)


def _numbered(given: Any, what: str, shown: str) -> Sequence[Any]:
    """Return the parts of a list, or of a mapping whose keys are the numbers from 0 on."""
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, list | tuple):
        return given
    if not isinstance(given, Mapping):
        raise SourceError(
            f"{what} must be a list or a mapping numbered from 0, but in '{shown}' it is {_brief(given)}.", path=shown
        )
    try:
        by_number = {int(key): value for key, value in given.items() if not isinstance(key, float | bool)}
    except (TypeError, ValueError):
        by_number = {}
    if len(by_number) != len(given) or set(by_number) != set(range(len(given))):
        raise SourceError(
            f"{what} must be numbered 0 … {len(given) - 1}, but in '{shown}' the keys are {_brief(list(given))}.",
            path=shown,
        )
    return [by_number[number] for number in range(len(given))]


def _outcomes(given: Any, state: int, action: int, shown: str) -> Iterator[Any]:
    """Yield the entries of one action: of a list of them, or the one that stands alone."""
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if not isinstance(given, list | tuple):
        _refuse(given, "be a list", state, action, shown)
    alone = len(given) == FIELDS and not isinstance(given[0], list | tuple | np.ndarray)
    yield from (given,) if alone else given


def _checked(state: int, action: int, entry: Any, states: int, shown: str) -> tuple[float, int, float, bool]:
    """Return one entry, every field of the right kind."""
    if not isinstance(entry, list | tuple) or len(entry) != FIELDS:
        _refuse(entry, f"have {FIELDS} fields", state, action, shown)
    probability, target, reward, terminated = entry
    for number, what in ((probability, "a probability"), (reward, "a reward")):
        if not _is_finite(number):
            _refuse(entry, f"have {what} that is a finite number", state, action, shown)
    if isinstance(target, bool | np.bool_) or not isinstance(target, Integral) or not 0 <= int(target) < states:
        _refuse(entry, f"have a next state in 0 … {states - 1}", state, action, shown)
    if not isinstance(terminated, bool | np.bool_):
        _refuse(entry, "say terminated by true or false", state, action, shown)
    return float(probability), int(target), float(reward), bool(terminated)


def _is_finite(number: Any) -> bool:
    real = isinstance(number, Real) and not isinstance(number, bool | np.bool_)
    return real and bool(abs(number) < MOST)


def _refuse(came: Any, must: str, state: int, action: int, shown: str) -> NoReturn:
    raise SourceError(
        f"An entry of a table, {FORM}, must {must}, but in '{shown}' state {state}, action {action} has {_brief(came)}.",
        path=shown,
        state=state,
        action=action,
    )


def _brief(given: Any) -> str:
    text = repr(given)
    return text if len(text) <= 60 else text[:57] + "…"
