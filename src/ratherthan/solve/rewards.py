"""A model and the name of a reward enter, the expected immediate reward r̄ of each choice leaves.

r̄(s, a) = state(s) + choice(s, a) + Σ δ(s, a, s') · branch(s, a, s'). No name counts steps: r̄ = 1.
"""

from __future__ import annotations

import numpy as np

from ratherthan.errors import PropertyError
from ratherthan.model.index import Index
from ratherthan.model.mdp import MDP, Bools, Floats

__all__ = ["costs_of", "expected_reward"]

SMALLEST = 5e-324
"""The least positive double: a reward that is positive stays so, however small its probability."""


def expected_reward(mdp: MDP, name: str | None) -> Floats:
    """Return the expected immediate reward of each choice, ``[C]``.

    Parameters
    ----------
    mdp : MDP
    name : str, optional
        The name of a reward of the model; None counts steps.

    Returns
    -------
    array of float, ``[C]``
        Exact up to a relative rounding error of about 2e-16 per branch, where the parts have one sign.

    Raises
    ------
    PropertyError
        If the model has no such reward.
    """
    if name is None:
        return np.ones(mdp.choices)
    if name not in mdp.rewards:
        there = ", ".join(f"'{known}'" for known in mdp.rewards) or "none"
        raise PropertyError(
            f"The objective must name a reward of the model, got '{name}'; there are: {there}.", reward=name
        )
    reward = mdp.rewards[name]
    total = np.zeros(mdp.choices)
    with np.errstate(over="ignore", invalid="ignore"):
        if reward.state is not None:
            total += np.repeat(reward.state, np.diff(mdp.state_to_choices))
        if reward.choice is not None:
            total += reward.choice
        if reward.branch is not None:
            total += np.add.reduceat(reward.branch * mdp.branch_to_probability, mdp.choice_to_branches[:-1])
    if not np.isfinite(total).all():
        choice = int(np.argmin(np.isfinite(total)))
        raise PropertyError(
            f"Rewards must add up to finite numbers, but those of '{name}' exceed the largest double at action "
            f"'{mdp.action_name(choice)}' of state {mdp.state_of(choice)}. Use a larger unit.",
            reward=name,
            choice=choice,
        )
    return total


def costs_of(mdp: MDP, index: Index, name: str | None) -> tuple[Floats, Bools]:
    """Return r̄ as costs, and where they are positive (by the parts, not by the rounded sum).

    Parameters
    ----------
    mdp : MDP
    index : Index
    name : str, optional
        As for `expected_reward`.

    Returns
    -------
    cost : array of float, ``[C]``
        0 exactly where all parts are 0, else positive.
    costly : array of bool, ``[C]``

    Raises
    ------
    PropertyError
        If there is no such reward, or it is negative somewhere.
    """
    total = expected_reward(mdp, name)
    if name is None:
        return total, np.ones(mdp.choices, dtype=np.bool_)
    reward = mdp.rewards[name]
    costly = np.zeros(mdp.choices, dtype=np.bool_)
    for part, values in reward.parts():
        negative = np.flatnonzero(values < 0)
        if len(negative):
            _refuse(mdp, index, name, (part, int(negative[0]), float(values[negative[0]])))
        positive = values > 0
        if part == "state":
            costly |= positive[index.choice_to_state]
        elif part == "choice":
            costly |= positive
        else:
            costly[index.branch_to_choice[positive]] = True
    return np.where(costly, np.maximum(total, SMALLEST), 0.0), costly


def _refuse(mdp: MDP, index: Index, name: str, fault: tuple[str, int, float]) -> None:
    """Raise PropertyError for a negative reward, with its place."""
    part, where, value = fault
    place: dict[str, object] = {"reward": name, "part": part, "value": value}
    if part == "state":
        state, choice = where, None
    else:
        choice = where if part == "choice" else int(index.branch_to_choice[where])
        state = int(index.choice_to_state[choice])
    called = f"state {state}" + (f" ('{mdp.names[state]}')" if mdp.names.named else "")
    place["state"] = state
    if choice is not None:
        action = mdp.action_name(choice)
        called = f"action '{action}' of {called}"
        place |= {"choice": choice, "action": action}
    if part == "branch":
        target = int(mdp.branch_to_target[where])
        called = f"the branch to state {target} of {called}"
        place["target"] = target
    raise PropertyError(
        f"A reward that is added up until a goal must not be negative, got {value:g} for '{name}' at {called}. "
        "Use a reward without negative parts.",
        **place,
    )
