"""Transitions as dense arrays, lists of matrices or pairs enter; their positive entries, sorted by row, leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import ModelError, SourceError
from ratherthan.io._rows import Rows
from ratherthan.model.mdp import Floats, Reward

__all__ = ["Numbers", "Table", "array_of", "doubles", "offsets_and_targets", "rewards_on", "table_of", "whole_numbers"]

Numbers = npt.NDArray[np.int64]
ORDERS = {"ASS": "[A, S, S]", "SAS": "[S, A, S]"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """Transitions of any form, taken apart: rows (a state with an action) and the entries that are not 0."""

    form: str  # "ASS", "SAS", "list" or "pairs"
    states: int
    actions: int
    row_state: Numbers  # [R], rising
    row_action: Numbers  # [R]
    row_origin: Numbers  # [R]: which row of the source it is; pairs only, else state · A + action
    entry_row: Numbers  # [N], rising
    entry_target: Numbers  # [N]
    entry_value: Floats  # [N]

    def rows(self, rewards: Mapping[str, Reward]) -> Rows:
        """Return the enabled rows as choices, with `rewards` already on states, choices and branches."""
        enabled = self.enabled()
        counts = np.bincount(self.row_state[enabled], minlength=self.states)
        branches = np.bincount(self.entry_row, minlength=len(self.row_state))[enabled]
        return Rows(
            state_to_choices=np.concatenate([[0], np.cumsum(counts)]),
            choice_to_branches=np.concatenate([[0], np.cumsum(branches)]),
            branch_to_target=self.entry_target,
            branch_to_probability=self.entry_value,
            choice_to_action=self.row_action[enabled],
            rewards=rewards,
        )

    def enabled(self) -> Numbers:
        """Return the rows that have an entry, in their order."""
        return np.flatnonzero(np.bincount(self.entry_row, minlength=len(self.row_state)))


def array_of(value: Any, what: str) -> npt.NDArray[Any]:
    """Return something as an array of numbers or truth values.

    Raises
    ------
    SourceError
        Where it is none: ragged lists, strings, objects.
    """
    try:
        array = np.asarray(value)
    except (ValueError, TypeError) as error:
        raise SourceError(f"{what} must be an array of numbers, but it is none: {str(error).rstrip('.')}.") from error
    if array.dtype.kind not in "biuf":
        raise SourceError(f"{what} must be an array of numbers, got {array.dtype} of shape {array.shape}.")
    return array


def settled(array: npt.NDArray[Any]) -> bool:
    """Return whether nobody can change an array any more, so that a model may take it over without a copy."""
    base: Any = array
    while isinstance(base, np.ndarray):
        if base.flags.writeable:
            return False
        base = base.base
    return base is None or memoryview(base).readonly


def doubles(array: npt.NDArray[Any]) -> Floats:
    """Return an array as doubles of its own, or as it is where it is settled."""
    return array if array.dtype == np.float64 and settled(array) else array.astype(np.float64)


def offsets_and_targets(array: npt.NDArray[Any], what: str) -> npt.NDArray[Any]:
    """Return whole numbers of 32 bits as they are where they are settled, all others as `whole_numbers` does."""
    return array if array.dtype == np.int32 and settled(array) else whole_numbers(array, what)


def whole_numbers(array: npt.NDArray[Any], what: str) -> Numbers:
    """Return an array of whole numbers as int64.

    Raises
    ------
    SourceError
        Where there are others among them.
    """
    if array.size == 0:
        return array.astype(np.int64)
    if array.dtype.kind not in "iu" or (array.dtype.kind == "u" and int(array.max()) >= 2**63):
        raise SourceError(f"{what} must be whole numbers, got {array.dtype}.")
    return array.astype(np.int64)


def _is_sparse(value: Any) -> bool:
    return hasattr(value, "tocsr") and hasattr(value, "shape")


def _entries(matrix: Any, what: str) -> tuple[Numbers, Numbers, Floats]:
    """Return row, column and value of the entries of a matrix that are not 0, dense or of scipy.sparse."""
    if not _is_sparse(matrix):
        dense = array_of(matrix, what)
        if dense.ndim != 2:
            raise SourceError(f"{what} must be a matrix, got shape {dense.shape}.")
        row, column = np.nonzero(dense)
        return row, column, dense[row, column].astype(np.float64)
    compressed = matrix.tocsr().copy()
    if compressed.dtype.kind not in "biuf":
        raise SourceError(f"{what} must hold numbers, got {compressed.dtype}.")
    compressed.sum_duplicates()
    compressed.eliminate_zeros()
    row = np.repeat(np.arange(compressed.shape[0], dtype=np.int64), np.diff(compressed.indptr))
    return row, compressed.indices.astype(np.int64), compressed.data.astype(np.float64)


def table_of(transitions: Any, order: str | None, s_indices: Any, a_indices: Any) -> Table:
    """Return transitions of whichever form they are in.

    Raises
    ------
    SourceError
        Where they are in none, or leave open what their axes are.
    """
    if transitions is None:
        raise SourceError(
            "A model must have transitions: an array [A, S, S] or [S, A, S], a list of matrices, or pairs."
        )
    if order is not None and order not in ORDERS:
        raise SourceError(f"order must be one of {', '.join(ORDERS)}, got '{order}'.")
    if (s_indices is None) != (a_indices is None):
        raise SourceError("Pairs must have both s_indices and a_indices, got one of them only.")
    if s_indices is not None:
        return _pairs(transitions, s_indices, a_indices)
    if _is_list(transitions) and order != "SAS":
        return _grid(
            [_entries(matrix, f"transitions of action {a}") for a, matrix in enumerate(transitions)], transitions
        )
    return _dense(array_of(transitions, "transitions"), order)


def _is_list(value: Any) -> bool:
    """Return whether a value is a list of square matrices, not a nested list of numbers."""
    if isinstance(value, np.ndarray):
        return value.dtype == object and value.ndim == 1 and len(value) > 0
    if not isinstance(value, list | tuple) or not value:
        return False
    shapes = {
        np.shape(item) if isinstance(item, np.ndarray) else item.shape if _is_sparse(item) else () for item in value
    }
    return all(len(shape) == 2 and shape[0] == shape[1] for shape in shapes) or any(_is_sparse(item) for item in value)


def _grid(parts: Sequence[tuple[Numbers, Numbers, Floats]], matrices: Sequence[Any]) -> Table:
    """Return a list of A matrices [S, S] taken apart."""
    shapes = {tuple(map(int, np.shape(m) if not _is_sparse(m) else m.shape)) for m in matrices}
    states = next(iter(shapes))[0]
    if states == 0 or shapes != {(states, states)}:
        raise SourceError(f"Every action must have a matrix [S, S] of the same size, got {sorted(shapes)}.")
    actions = len(parts)
    row = np.concatenate([source * actions + a for a, (source, _, _) in enumerate(parts)])
    target = np.concatenate([column for _, column, _ in parts])
    value = np.concatenate([values for _, _, values in parts])
    by_row = np.lexsort((target, row))
    return _cube("list", states, actions, (row[by_row], target[by_row], value[by_row]))


def _cube(form: str, states: int, actions: int, entries: tuple[Numbers, Numbers, Floats]) -> Table:
    row = np.arange(states * actions)
    return Table(
        form=form,
        states=states,
        actions=actions,
        row_state=row // actions,
        row_action=row % actions,
        row_origin=row,
        entry_row=entries[0],
        entry_target=entries[1],
        entry_value=entries[2],
    )


def _dense(array: npt.NDArray[Any], order: str | None) -> Table:
    """Return a dense array taken apart, once it is clear what its axes are."""
    if array.ndim != 3 or 0 in array.shape:
        raise SourceError(
            f"Dense transitions must have three axes, [A, S, S] or [S, A, S], got shape {array.shape}. "
            "Pairs [L, S] must come with s_indices and a_indices."
        )
    x, y, z = array.shape
    fits = [name for name, fit in (("ASS", y == z), ("SAS", x == z)) if fit]
    if order is None and len(fits) == 2:
        raise SourceError(
            f"Transitions of shape {array.shape} may be [A, S, S] or [S, A, S]. Say which: order='ASS' or order='SAS'."
        )
    order = order or (fits[0] if fits else None)
    if order not in fits:
        wanted = ORDERS[order] if order else "[A, S, S] or [S, A, S]"
        raise SourceError(f"Transitions must have the shape {wanted}, got {array.shape}.")
    by_state = array.transpose(1, 0, 2) if order == "ASS" else array
    state, action, target = np.nonzero(by_state)
    states, actions, _ = by_state.shape
    value = by_state[state, action, target].astype(np.float64)
    return _cube(order, states, actions, (state * actions + action, target, value))


def _pairs(matrix: Any, s_indices: Any, a_indices: Any) -> Table:
    """Return rows that are listed with their state and action taken apart, sorted by state."""
    row, target, value = _entries(matrix, "transitions")
    shape = matrix.shape if _is_sparse(matrix) else np.shape(matrix)
    count, states = int(shape[0]), int(shape[1])
    state = whole_numbers(array_of(s_indices, "s_indices"), "s_indices")
    action = whole_numbers(array_of(a_indices, "a_indices"), "a_indices")
    if state.shape != (count,) or action.shape != (count,) or count == 0:
        raise SourceError(
            f"Pairs must have one state and one action per row of transitions ({count}, at least 1), "
            f"got shapes {state.shape} and {action.shape}."
        )
    if ((state < 0) | (state >= states)).any() or ((action < 0) | (action >= 2**31 - 1)).any():
        raise SourceError(f"s_indices must lie in 0 … {states - 1} and a_indices must not be negative.")
    actions = int(action.max()) + 1
    by_state = np.argsort(state, kind="stable")
    pair = state * np.int64(actions) + action
    twice = np.flatnonzero(np.diff(np.sort(pair)) == 0)
    if len(twice):
        again = int(np.sort(pair)[twice[0]])
        raise ModelError(
            f"Each pair must be listed once, but action {again % actions} of state {again // actions} is twice."
        )
    empty = np.flatnonzero(np.bincount(row, minlength=count) == 0)
    if len(empty):
        where = f"action {action[empty[0]]} of state {state[empty[0]]}"
        raise ModelError(
            f"Probabilities of a choice must sum to 1, got 0 at {where}. Leave pairs out that are not enabled."
        )
    position = np.empty(count, dtype=np.int64)
    position[by_state] = np.arange(count)
    by_row = np.lexsort((target, position[row]))
    return Table(
        form="pairs",
        states=states,
        actions=actions,
        row_state=state[by_state],
        row_action=action[by_state],
        row_origin=by_state,
        entry_row=position[row][by_row],
        entry_target=target[by_row],
        entry_value=value[by_row],
    )


def rewards_on(table: Table, rewards: Mapping[str, Any]) -> dict[str, Reward]:
    """Return rewards on states, choices or branches, by their shape.

    Raises
    ------
    SourceError
        Where the shape is none of those beside the transitions.
    """
    return {name: _reward_on(table, given, f"Reward '{name}'") for name, given in rewards.items()}


def _reward_on(table: Table, given: Any, what: str) -> Reward:
    states, actions = table.states, table.actions
    if table.form != "pairs" and _is_list(given) and len(given) == actions:
        return Reward(branch=_at_entries(table, [_lookup(matrix, what) for matrix in given]))
    if _is_sparse(given):
        given = given.toarray()
    values = array_of(given, what).astype(np.float64)
    if table.form == "pairs":
        if values.shape != table.row_state.shape:
            raise SourceError(
                f"{what} must have one number per pair ({len(table.row_state)}), got shape {values.shape}."
            )
        return Reward(choice=values[table.row_origin])
    if values.shape == (states,):
        return Reward(state=values)
    if values.shape == (states, actions):
        return Reward(choice=values.reshape(-1)[table.enabled()])
    cube = (states, actions, states) if table.form == "SAS" else (actions, states, states)
    if values.shape == cube:
        state, action = table.row_state[table.entry_row], table.row_action[table.entry_row]
        first, second = (state, action) if table.form == "SAS" else (action, state)
        return Reward(branch=values[first, second, table.entry_target])
    raise SourceError(
        f"{what} must have the shape [S] {(states,)}, [S, A] {(states, actions)}, or that of the transitions {cube}, "
        f"got {values.shape}."
    )


def _lookup(matrix: Any, what: str) -> tuple[tuple[int, ...], Numbers, Floats]:
    """Return the shape of a matrix, and its entries by the sorted key row · columns + column."""
    row, column, value = _entries(matrix, what)
    shape = tuple(int(n) for n in (matrix.shape if _is_sparse(matrix) else np.shape(matrix)))
    key = row * np.int64(shape[1]) + column
    by_key = np.argsort(key, kind="stable")
    return shape, key[by_key], value[by_key]


def _at_entries(table: Table, matrices: Sequence[tuple[tuple[int, ...], Numbers, Floats]]) -> Floats:
    """Return the values of A matrices [S, S] at the entries of the transitions, 0 where they have none."""
    values = np.zeros(len(table.entry_row))
    action = table.row_action[table.entry_row]
    wanted = table.row_state[table.entry_row] * np.int64(table.states) + table.entry_target
    for number, (shape, key, value) in enumerate(matrices):
        if shape != (table.states, table.states):
            raise SourceError(f"Rewards must have a matrix [S, S] per action, got shape {shape} for action {number}.")
        if len(key) == 0:
            continue
        own = np.flatnonzero(action == number)
        at = np.minimum(np.searchsorted(key, wanted[own]), len(key) - 1)
        values[own] = np.where(key[at] == wanted[own], value[at], 0.0)
    return values
