"""A policy as people have it enters (a file, a table, an array, a function), a Policy that fits the model leaves.

================= ====================================================================================================
form              what it says
================= ====================================================================================================
JSON, dict        ``{"10": "east"}``, or by a state's name. Randomised: ``{"10": {"east": 0.6, "south": 0.4}}``
CSV               ``state,action`` or ``state,action,probability``, with or without this first line
Q table           numbers ``[S, A]``, columns in the order of the model's actions (``.npy`` or an array): the action with
                  the largest is taken, with the smallest on request; NaN or -∞ means not enabled, and so does the model
actions           whole numbers ``[S]`` (``.npy`` or an array): the number of an action; -1 says nothing
Storm             a scheduler exported as JSON or text: `ratherthan.io._policy_storm`
PRISM             a strategy exported as actions, indices or induced model: `ratherthan.io._policy_prism`
function          ``function(state, actions) -> action``, state by name (by number where it has none); in Python only
agent             with ``predict`` and ``observation_space``, as those of Stable-Baselines3; in Python only, and only where
                  what it observes is the number of the state
================= ====================================================================================================

States are given by number or exact name; the number wins. Actions are given by the names they are shown with, or by their
position among the state's choices, counted from 0. Of equal numbers in a Q table the choice listed first in the model is
taken. In a model whose actions have no names, columns and action numbers mean positions among the state's choices.
States that are not listed stay open: that is an error only where they are reached. An array may end before the terminal states
at the end of the model that only loop, such as those that a reader adds for the ends of episodes. Storm, PRISM, functions and agents need
not speak of states with one choice only.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import PolicyError
from ratherthan.io._policy_files import Foreign, read_policy_file
from ratherthan.io._policy_match import (
    called,
    choices_of,
    decided_states,
    first_with,
    own_choice,
    policy_of,
    state_of_choices,
    states_of,
)
from ratherthan.io._policy_python import ask_agent, ask_function, is_agent
from ratherthan.io._policy_rows import Rows, mapping_rows
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.policy import Policy, check_policy

__all__ = ["read_policy"]


def read_policy(source: Any, mdp: MDP, *, minimise_q: bool = False) -> Policy:
    """Read a policy and fit it to a model.

    Parameters
    ----------
    source : path, mapping, array, function, agent or Policy
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
    elif isinstance(source, Foreign):
        policy = source.read(mdp, what)
    elif is_agent(source):
        policy = ask_agent(source, mdp)
    elif callable(source) and not isinstance(source, type):
        policy = ask_function(source, mdp)
    else:
        raise PolicyError(
            f"{what} must be a table of states and their actions, an array, a function or an agent, got "
            f'{_described(source)}. Write it like {{"10": "east"}}.'
        )
    check_policy(mdp, policy)
    return policy


def _described(source: object) -> str:
    if isinstance(source, type):
        return f"the class {source.__name__}"
    if callable(getattr(source, "predict", None)):
        return (
            f"{type(source).__name__}, which predicts but does not say what it observes (it has no observation_space)"
        )
    return type(source).__name__


def _of_rows(rows: Rows, mdp: MDP, what: str) -> Policy:
    """Return the policy that rows of state, action and probability say; NaN stands for certainty."""
    states = states_of((row[0] for row in rows), mdp, what)
    choices = choices_of(states, [row[1] for row in rows], mdp, what)
    return policy_of(mdp, states, choices, np.array([row[2] for row in rows], dtype=np.float64), what)


def _of_array(array: npt.NDArray[Any], mdp: MDP, what: str, *, minimise_q: bool) -> Policy:
    """Return the policy of a Q table, or of an action per state."""
    if array.dtype.kind not in "iuf":
        raise PolicyError(f"{what} must hold numbers, got {array.dtype}.")
    array = _with_ends(array, mdp)
    if array.ndim == 1 and array.dtype.kind in "iu":
        return _of_actions(array, mdp, what)
    widest = int(np.diff(mdp.state_to_choices).max())
    columns = len(mdp.actions) or widest
    if array.shape != (mdp.states, columns):
        raise PolicyError(
            f"{what} must be a Q table with a row per state and a column per action, {(mdp.states, columns)}, or whole "
            f"numbers, one per state ({mdp.states}); got {array.dtype} of shape {array.shape}."
        )
    state = state_of_choices(mdp)
    column = _columns_of(mdp, state)
    values = np.where(column >= 0, array[state, np.maximum(column, 0)].astype(np.float64), np.nan)
    silent = np.isnan(values) | np.isneginf(values)
    worth = np.where(silent, -np.inf, -values if minimise_q else values)
    if not np.isfinite(values).any():
        raise PolicyError(
            f"{what} must have a finite number for some enabled action, but all of them are NaN, -inf or inf. "
            "Check that it was filled, and that its columns are the model's actions in their order."
        )
    return Policy(choice=_first_best(mdp, state, worth, silent))


def _with_ends(array: npt.NDArray[Any], mdp: MDP) -> npt.NDArray[Any]:
    """Return an array with rows for the terminal states at the end, where it has none: any action, as all of them loop."""
    if array.ndim not in (1, 2) or not decided_states(mdp) <= len(array) < mdp.states:
        return array
    missing = mdp.states - len(array)
    if array.ndim == 2:
        return np.concatenate([array, np.zeros((missing, array.shape[1]), dtype=array.dtype)])
    loop = np.maximum(mdp.choice_to_action[mdp.state_to_choices[len(array) : mdp.states]], 0)
    return np.concatenate([array, loop.astype(array.dtype)])


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
            f"{what} must number actions 0 … {count - 1}, got {array[where]} at {called(mdp, where)}.", state=where
        )
    states, actions = np.arange(mdp.states), array.astype(np.int64)
    if mdp.actions:
        choice = first_with(mdp, states, actions)
    else:
        choice = np.where(
            (actions >= 0) & (actions < np.diff(mdp.state_to_choices)), mdp.state_to_choices[:-1] + actions, -1
        )
    missed = (choice < 0) & (actions >= 0)
    if missed.any():
        where = int(missed.argmax())
        number = int(actions[where])
        own_choice(where, mdp.actions[number] if mdp.actions else number, mdp, what)
    return Policy(choice=choice)
