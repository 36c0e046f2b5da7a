"""A policy as people have it enters (a file, a table, an array), a Policy that fits the model leaves.

================= ====================================================================================================
form              what it says
================= ====================================================================================================
JSON, dict        ``{"10": "east"}``, or by a state's name. Randomised: ``{"10": {"east": 0.6, "south": 0.4}}``
CSV               ``state,action`` or ``state,action,probability``, with or without this first line
Q table           numbers ``[S, A]``, columns in the order of the model's actions (``.npy`` or an array): the action with
                  the largest is taken, with the smallest on request; NaN or -∞ means not enabled, and so does the model
actions           whole numbers ``[S]`` (``.npy`` or an array): the number of an action; -1 says nothing
================= ====================================================================================================

States are given by number or exact name; the number wins. Actions are given by the names they are shown with, or by their
position among the state's choices, counted from 0. Of equal numbers in a Q table the choice listed first in the model is
taken. In a model whose actions have no names, columns and action numbers mean positions among the state's choices.
States that are not listed stay open: that is an error only where they are reached.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import PolicyError, QuestionError
from ratherthan.io._policy_files import SUM_TOLERANCE, Rows, mapping_rows, read_policy_file
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.policy import Policy, check_policy
from ratherthan.model.states import state_number

__all__ = ["read_policy"]

MANY_NAMES = 50
MOST_LISTED = 10


def read_policy(source: Any, mdp: MDP, *, minimise_q: bool = False) -> Policy:
    """Read a policy and fit it to a model.

    Parameters
    ----------
    source : path, mapping, array or Policy
        In one of the forms above.
    mdp : MDP
    minimise_q : bool
        Take the smallest number of a Q table (its entries are costs), not the largest.

    Returns
    -------
    Policy

    Raises
    ------
    SourceError
        Where the file is missing, empty or unreadable.
    PolicyError
        Where it is in none of the forms, or does not fit the model: unknown states or actions, actions that are not
        enabled, a state twice, probabilities that do not sum to 1, a table of another shape, a row without a number.
    """
    what = "The policy"
    if isinstance(source, str | os.PathLike):
        what = f"The policy '{os.fspath(source)}'"
        source = read_policy_file(source, what)
    if isinstance(source, Policy):
        policy = source
    elif isinstance(source, np.ndarray):
        policy = _of_array(source, mdp, what, minimise_q=minimise_q)
    elif isinstance(source, Mapping):
        policy = _of_rows(mapping_rows(source, what), mdp, what)
    elif isinstance(source, Rows):
        policy = _of_rows(source, mdp, what)
    else:
        raise PolicyError(
            f"{what} must be a table of states and their actions, or an array, got {type(source).__name__}. "
            'Write it like {"10": "east"}.'
        )
    check_policy(mdp, policy)
    return policy


def _of_rows(rows: Rows, mdp: MDP, what: str) -> Policy:
    """Return the policy that rows of state, action and probability say; NaN stands for certainty."""
    states = _states((row[0] for row in rows), mdp, what)
    choices = _choices(states, [row[1] for row in rows], mdp, what)
    chances = np.array([row[2] for row in rows], dtype=np.float64)
    certain = np.isnan(chances)
    listed = np.bincount(states, minlength=mdp.states)
    twice = np.zeros(mdp.states, dtype=bool)
    twice[states[certain]] = listed[states[certain]] > 1
    twice[_state_of_choices(mdp)[np.bincount(choices, minlength=mdp.choices) > 1]] = True
    if twice.any():
        raise PolicyError(
            f"{what} must list each state once, but {_called(mdp, int(twice.argmax()))} is there twice. Remove one."
        )
    weights = np.zeros(mdp.choices)
    weights[choices] = np.where(certain, 1.0, chances)
    sums = np.add.reduceat(weights, mdp.state_to_choices[:-1])
    wrong = np.flatnonzero((np.abs(sums - 1) > SUM_TOLERANCE) & (listed > 0))
    if len(wrong):
        raise PolicyError(
            f"{what} must give probabilities that sum to 1 in every state, got {sums[wrong[0]]:.10g} at "
            f"{_called(mdp, int(wrong[0]))}.",
            state=int(wrong[0]),
        )
    return _settled(mdp, weights / np.repeat(np.where(listed > 0, sums, 1.0), np.diff(mdp.state_to_choices)))


def _settled(mdp: MDP, weights: Floats) -> Policy:
    """Return a policy from the probability of every choice; a plain one where all are 0 or 1."""
    taken = np.flatnonzero(weights)
    state = _state_of_choices(mdp)[taken]
    alone = np.bincount(state, minlength=mdp.states)[state] == 1
    choice = np.full(mdp.states, -1, dtype=mdp.state_to_choices.dtype)
    choice[state[alone]] = taken[alone]
    return Policy(choice=choice, chance=None if alone.all() else weights)


def _state_of_choices(mdp: MDP) -> npt.NDArray[np.int64]:
    """Return the state of every choice, ``[C]``."""
    return np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))


def _called(mdp: MDP, state: int) -> str:
    return f"state {state} ('{mdp.names[state]}')" if mdp.names.named else f"state {state}"


def _states(given: Iterable[Any], mdp: MDP, what: str) -> npt.NDArray[np.int64]:
    """Return the numbers of states given by number or name."""
    keys = list(given)
    by_name: dict[str, int] = {}
    if mdp.names.named and sum(isinstance(key, str) and not key.strip().isdigit() for key in keys) > MANY_NAMES:
        for state in range(mdp.states - 1, -1, -1):
            name = mdp.names[state]
            by_name[name] = -1 if name in by_name else state  # -1: several states have it
    found = np.empty(len(keys), dtype=np.int64)
    for i, key in enumerate(keys):
        if isinstance(key, str) and key.strip().isdigit() and key.isascii() and int(key) < mdp.states:
            found[i] = int(key)
        elif isinstance(key, str) and by_name.get(key, -1) >= 0:
            found[i] = by_name[key]
        else:
            try:
                found[i] = state_number(mdp, key)
            except QuestionError as error:
                raise PolicyError(f"{what} must list states of the model. {error.message}", state=key) from error
    return found


def _choices(states: npt.NDArray[np.int64], given: list[Any], mdp: MDP, what: str) -> npt.NDArray[np.int64]:
    """Return the choices that are meant by actions at states."""
    number: dict[Any, int] = {}
    for action, name in enumerate(mdp.actions):
        number.setdefault(name, action)
    actions = np.array([number.get(name, -1) if isinstance(name, str) else -1 for name in given], dtype=np.int64)
    choices = _first_with(mdp, states, actions)
    for i in np.flatnonzero(choices < 0):
        choices[i] = _choice(int(states[i]), given[i], mdp, what)
    return choices


def _first_with(mdp: MDP, states: npt.NDArray[np.int64], actions: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the first choice of each state that has the action, -1 where none has."""
    first, counts = (
        mdp.state_to_choices[states].astype(np.int64),
        np.diff(mdp.state_to_choices)[states].astype(np.int64),
    )
    found = np.full(len(states), -1, dtype=np.int64)
    for step in range(int(counts.max(initial=0))):
        open_ = np.flatnonzero((found < 0) & (counts > step) & (actions >= 0))
        if len(open_) == 0:
            break
        at = first[open_] + step
        fits = mdp.choice_to_action[at] == actions[open_]
        found[open_[fits]] = at[fits]
    return found


def _choice(state: int, given: Any, mdp: MDP, what: str) -> int:
    """Return one choice by the name it is shown with, or by its position."""
    own = mdp.choices_of(state)
    shown = [mdp.action_name(choice) for choice in own]
    plain = isinstance(given, str | int | np.integer) and not isinstance(given, bool)
    text = str(given).strip()
    if plain and shown.count(text) == 1:
        return own[shown.index(text)]
    if plain and text.isascii() and text.isdigit() and int(text) < len(own):
        return own[int(text)]
    listed = ", ".join(f"'{name}'" for name in shown[:MOST_LISTED]) + (", …" if len(shown) > MOST_LISTED else "")
    trouble = "is not enabled there" if text in mdp.actions else "is no action of the model"
    raise PolicyError(
        f"{what} must choose among the actions of {_called(mdp, state)}, {listed}; but {given!r} {trouble}.",
        state=state,
        action=given,
    )


def _of_array(array: npt.NDArray[Any], mdp: MDP, what: str, *, minimise_q: bool) -> Policy:
    """Return the policy of a Q table, or of an action per state."""
    if array.dtype.kind not in "iuf":
        raise PolicyError(f"{what} must hold numbers, got {array.dtype}.")
    if array.ndim == 1 and array.dtype.kind in "iu":
        return _of_actions(array, mdp, what)
    widest = int(np.diff(mdp.state_to_choices).max())
    columns = len(mdp.actions) or widest
    if array.shape != (mdp.states, columns):
        raise PolicyError(
            f"{what} must be a Q table with a row per state and a column per action, {(mdp.states, columns)}, or whole "
            f"numbers, one per state ({mdp.states}); got {array.dtype} of shape {array.shape}."
        )
    state = _state_of_choices(mdp)
    column = _columns_of(mdp, state)
    values = np.where(column >= 0, array[state, np.maximum(column, 0)].astype(np.float64), np.nan)
    silent = np.isnan(values) | np.isneginf(values)
    worth = np.where(silent, -np.inf, -values if minimise_q else values)
    if silent.all():
        raise PolicyError(
            f"{what} must have a number for some enabled action, but all of them are NaN or -inf. "
            "Check that it was filled, and that its columns are the model's actions in their order."
        )
    return Policy(choice=_first_best(mdp, state, worth, silent))


def _first_best(mdp: MDP, state: npt.NDArray[np.int64], worth: Floats, silent: Bools) -> npt.NDArray[np.int64]:
    """Return the first choice of each state with the largest worth, among those that are not silent."""
    best = np.maximum.reduceat(worth, mdp.state_to_choices[:-1])
    candidates = np.flatnonzero((worth == best[state]) & ~silent)
    choice = np.full(mdp.states, -1, dtype=np.int64)
    choice[state[candidates[::-1]]] = candidates[::-1]  # the first is written last
    return choice


def _columns_of(mdp: MDP, state: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the column of every choice: its action, or its position where actions have no names."""
    if mdp.actions:
        return mdp.choice_to_action.astype(np.int64)
    return np.arange(mdp.choices) - mdp.state_to_choices[state].astype(np.int64)


def _of_actions(array: npt.NDArray[Any], mdp: MDP, what: str) -> Policy:
    """Return the policy of an action number per state, -1 where nothing is said."""
    if array.shape != (mdp.states,):
        raise PolicyError(f"{what} must have one action per state ({mdp.states}), got shape {array.shape}.")
    count = len(mdp.actions) or int(np.diff(mdp.state_to_choices).max())
    wrong = (array >= count) if array.dtype.kind == "u" else (array >= count) | (array < -1)
    if wrong.any():
        where = int(wrong.argmax())
        raise PolicyError(
            f"{what} must number actions 0 … {count - 1}, got {array[where]} at {_called(mdp, where)}.", state=where
        )
    states, actions = np.arange(mdp.states), array.astype(np.int64)
    if mdp.actions:
        choice = _first_with(mdp, states, actions)
    else:
        choice = np.where(
            (actions >= 0) & (actions < np.diff(mdp.state_to_choices)), mdp.state_to_choices[:-1] + actions, -1
        )
    missed = (choice < 0) & (actions >= 0)
    if missed.any():
        where = int(missed.argmax())
        number = int(actions[where])
        _choice(where, mdp.actions[number] if mdp.actions else number, mdp, what)
    return Policy(choice=choice)
