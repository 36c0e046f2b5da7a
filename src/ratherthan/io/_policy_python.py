"""A policy that lives in Python enters (a function, a trained agent), a Policy that fits the model leaves.

Both are asked only where there is something to decide: where a state has but one choice, that is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ratherthan.errors import PolicyError
from ratherthan.io._policy_match import (
    Numbers,
    called,
    choices_of,
    decided_states,
    first_with,
    policy_of,
    shown_actions,
)
from ratherthan.io._policy_rows import Rows, mapping_rows
from ratherthan.model.mdp import MDP
from ratherthan.model.policy import Policy

__all__ = ["ask_agent", "ask_function", "is_agent"]

AT_ONCE = 1 << 22
"""How many numbers an agent may make of the observations of one call: it may spell each out as one of n."""

ITSELF = "The number of a state must be what the agent observes there (a Discrete observation space of the model's {states} states, from 0)"


def ask_function(function: Callable[..., Any], mdp: MDP) -> Policy:
    """Ask a function what it does in every state.

    Parameters
    ----------
    function : callable
        ``function(state, actions)`` gets the state's name, or its number where the model has no names, and the names of its
        actions. It returns an action's name or position, or probabilities by name or position, or None to say nothing.
    mdp : MDP

    Raises
    ------
    PolicyError
        With the first state where it returns something else.
    """
    what = f"The policy {getattr(function, '__name__', type(function).__name__)!r}"
    rows = Rows()
    for state in np.flatnonzero(np.diff(mdp.state_to_choices) > 1).tolist():
        actions = [mdp.action_name(choice) for choice in mdp.choices_of(state)]
        said = function(mdp.names[state] if mdp.names.named else state, actions)
        if isinstance(said, np.ndarray) and said.ndim == 0:
            said = said.item()
        if said is not None:
            rows += mapping_rows({state: said}, what)
    states = np.array([row[0] for row in rows], dtype=np.int64)
    choices = choices_of(states, [row[1] for row in rows], mdp, what)
    return policy_of(mdp, states, choices, np.array([row[2] for row in rows], dtype=np.float64), what, complete=True)


def is_agent(source: object) -> bool:
    """Return whether this is a trained agent in the manner of Stable-Baselines3."""
    return callable(getattr(source, "predict", None)) and hasattr(source, "observation_space")


def ask_agent(agent: Any, mdp: MDP) -> Policy:
    """Ask a trained agent, ``agent.predict(observation, deterministic=True)``, what it does in every state.

    Parameters
    ----------
    agent : object
        With the spaces of what it observes and does.
    mdp : MDP

    Raises
    ------
    PolicyError
        Where it observes something else than the state's number, has memory, or takes an action that is not enabled.
    """
    what = f"The agent {type(agent).__name__}"
    _check_observations(agent, mdp, what)
    columns = len(mdp.actions) or int(np.diff(mdp.state_to_choices).max())
    space = getattr(agent, "action_space", None)
    first = int(getattr(space, "start", 0))
    if getattr(space, "n", columns) != columns:
        raise PolicyError(
            f"{what} must have the {columns} actions of the model, got {space}. It was trained on another model."
        )
    states = np.flatnonzero(np.diff(mdp.state_to_choices) > 1)
    states = states[states < int(agent.observation_space.n)]
    actions = np.concatenate(
        [np.zeros(0, dtype=np.int64), *(_predicted(agent, part, what) for part in _parts(states, mdp))]
    )
    choices = _choices(states, actions - first, mdp)
    if (choices < 0).any():
        at = int((choices < 0).argmax())
        state, number = int(states[at]), int(actions[at]) - first
        name = f"'{mdp.actions[number]}'" if 0 <= number < len(mdp.actions) else f"number {number}"
        raise PolicyError(
            f"{what} must choose among the actions of {called(mdp, state)}, {shown_actions(mdp, state)}, but it takes {name}.",
            state=state,
        )
    unseen = np.arange(int(agent.observation_space.n), mdp.states)
    states, choices = np.concatenate([states, unseen]), np.concatenate([choices, mdp.state_to_choices[unseen]])
    return policy_of(mdp, states, choices, np.full(len(states), np.nan), what, complete=True)


def _check_observations(agent: Any, mdp: MDP, what: str) -> None:
    space = agent.observation_space
    count = getattr(space, "n", None)
    numbered = isinstance(count, int | np.integer) and int(getattr(space, "start", 0)) == 0
    if numbered and decided_states(mdp) <= int(count or 0) <= mdp.states:
        return
    raise PolicyError(
        f"{ITSELF.format(states=mdp.states)}, but {what[0].lower()}{what[1:]} observes {space}. Ask it yourself in each state, "
        "and give the actions as a table {state: action} or a function of state and actions."
    )


def _parts(states: Numbers, mdp: MDP) -> list[Numbers]:
    size = max(1, min(4096, AT_ONCE // mdp.states))
    return [states[first : first + size] for first in range(0, len(states), size)]


def _predicted(agent: Any, states: Numbers, what: str) -> Numbers:
    """Return the numbers of the actions that an agent takes in some states."""
    answer = agent.predict(states.copy(), deterministic=True)
    actions, memory = answer if isinstance(answer, tuple) and len(answer) == 2 else (answer, None)
    if memory is not None:
        raise PolicyError(
            f"{what} must not do what depends on more than the state to be explained, but it has memory. Explain an agent "
            "without memory."
        )
    numbers = np.asarray(actions)
    if numbers.shape not in (states.shape, (*states.shape, 1)) or numbers.dtype.kind not in "iu":
        raise PolicyError(
            f"{what} must predict one action number per state ({len(states)}), got {numbers.dtype} of shape {numbers.shape}."
        )
    return numbers.reshape(-1).astype(np.int64)


def _choices(states: Numbers, actions: Numbers, mdp: MDP) -> Numbers:
    """Return the choices with these action numbers, -1 where none is enabled; positions where actions have no names."""
    if mdp.actions:
        return first_with(mdp, states, actions)
    within = (actions >= 0) & (actions < np.diff(mdp.state_to_choices)[states])
    return np.where(within, mdp.state_to_choices[states] + actions, -1)
