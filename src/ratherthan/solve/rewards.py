"""A model and the name of a reward enter, the expected immediate reward r̄ of each choice leaves.

r̄(s, a) = state(s) + choice(s, a) + Σ δ(s, a, s') · branch(s, a, s'). No name counts steps: r̄ = 1. A name may be a weighted
sum of rewards.

Where parts have different signs they may cancel, and the rounding error of r̄ is not small in relation to r̄, but to the sum of
the absolute values: the *size* of r̄. Whether a choice pays at all is told by its parts, not by the rounded sum.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ratherthan.errors import PropertyError
from ratherthan.model.index import Index
from ratherthan.model.mdp import MDP, Bools, Floats, Reward
from ratherthan.model.weights import reward_of, weights_of
from ratherthan.solve.system import two_sum

__all__ = ["Paid", "costs_of", "expected_reward", "paid_of"]

SMALLEST = 5e-324
"""The least positive double: a reward that is positive stays so, however small its probability."""
LEAST_UNIT = 1e-285
"""How large the largest reward must be at least: rounding is accounted for by terms that are far smaller."""


FEW_PARTS = 8
"""How many rewards a weighted sum may have within the rounding error that `system` allows for."""


class Paid(NamedTuple):
    """What each choice pays, ``[C]`` each."""

    total: Floats
    """r̄; 0 exactly where all parts are 0."""
    size: Floats
    """The sum of the absolute values of its parts, which its rounding error is in proportion to."""
    pays: Bools
    """Where it is not exactly 0, as far as can be told."""
    signs: tuple[Bools, Bools]
    """Where a part is above, and where one is below 0."""
    exact: Bools
    """Where r̄ was computed without rounding."""


_TOTALS: WeakKeyDictionary[MDP, WeakKeyDictionary[Reward, Floats]] = WeakKeyDictionary()
"""What is paid per choice, by models and their rewards: adding up a million branches takes longer than most that is asked of it."""


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
        If the model has no such reward, or its sums are beyond doubles, or below them.
    """
    if name is None:
        return np.ones(mdp.choices)
    reward = reward_of(mdp, name)
    if reward is None:
        there = ", ".join(f"'{known}'" for known in mdp.rewards) or "none"
        raise PropertyError(
            f"The objective must name a reward of the model, got '{name}'; there are: {there}.", reward=name
        )
    total = _total(mdp, reward)
    _refuse_infinite(mdp, name, total)
    _refuse_tiny(mdp, name, total)
    return total


def _refuse_tiny(mdp: MDP, name: str, total: Floats) -> None:
    """Raise PropertyError where all rewards are so small that their sums and differences fall below doubles."""
    largest = max(float(total.max(initial=0.0)), -float(total.min(initial=0.0)))
    if 0.0 < largest < LEAST_UNIT:
        choice = int(np.argmax(np.abs(total)))
        raise PropertyError(
            f"Of rewards some must be at least {LEAST_UNIT:g}, or what they add up to cannot be told in doubles, but the largest of "
            f"'{name}' is {total[choice]:g} at action '{mdp.action_name(choice)}' of state {mdp.state_of(choice)}. "
            "Use a smaller unit.",
            reward=name,
            choice=choice,
        )


def _refuse_infinite(mdp: MDP, name: str, total: Floats) -> None:
    """Raise PropertyError where sums are beyond doubles."""
    if not np.isfinite(total).all():
        choice = int(np.argmin(np.isfinite(total)))
        raise PropertyError(
            f"Rewards must add up to finite numbers, but those of '{name}' exceed the largest double at action "
            f"'{mdp.action_name(choice)}' of state {mdp.state_of(choice)}. Use a larger unit.",
            reward=name,
            choice=choice,
        )


def _total(mdp: MDP, reward: Reward, *, absolute: bool = False) -> Floats:
    """Return Σ of the parts per choice, or of their absolute values; what is said of choices alone as it is, not a copy."""
    if reward.choice is not None and reward.state is None and reward.branch is None:
        return np.abs(reward.choice) if absolute else reward.choice
    kept = _TOTALS.setdefault(mdp, WeakKeyDictionary())
    if not absolute and reward in kept:
        return kept[reward]
    total = np.zeros(mdp.choices)
    with np.errstate(over="ignore", invalid="ignore"):
        for part, values in reward.parts():
            given = np.abs(values) if absolute else values
            if part == "state":
                total += np.repeat(given, np.diff(mdp.state_to_choices))
            elif part == "choice":
                total += given
            else:
                total += np.add.reduceat(given * mdp.branch_to_probability, mdp.choice_to_branches[:-1])
    if not absolute:
        total.flags.writeable = False
        kept[reward] = total
    return total


def paid_of(mdp: MDP, index: Index, name: str | None) -> Paid:
    """Return what each choice pays, with all that is known of its sign and its rounding error.

    Parameters
    ----------
    mdp : MDP
    index : Index
    name : str, optional
        As for `expected_reward`.

    Returns
    -------
    Paid

    Raises
    ------
    PropertyError
        If there is no such reward, or it exceeds the range of doubles.
    """
    total = expected_reward(mdp, name)
    every, none = np.ones(mdp.choices, dtype=np.bool_), np.zeros(mdp.choices, dtype=np.bool_)
    weights = None if name is None else weights_of(name, mdp.rewards)
    if weights is None:
        return Paid(total, total, every, (every, none), every)
    size, above, below = np.zeros(mdp.choices), none.copy(), none.copy()
    with np.errstate(over="ignore"):
        for known, weight in weights.items():
            size += weight * _total(mdp, mdp.rewards[known], absolute=True)
            for part, values in mdp.rewards[known].parts():
                above |= _choices_with(index, part, values > 0)
                below |= _choices_with(index, part, values < 0)
        size *= max(1.0, len(weights) / FEW_PARTS)
    _refuse_infinite(mdp, name or "", size)
    exact = ~(above | below)
    if list(weights.values()) == [1.0]:
        exact |= _exact(mdp, index, mdp.rewards[next(iter(weights))])
    nothing = exact & (total == 0.0)
    above, below = above & ~nothing, below & ~nothing
    return Paid(np.where(nothing, 0.0, total), np.where(nothing, 0.0, size), above | below, (above, below), exact)


def _exact(mdp: MDP, index: Index, reward: Reward) -> Bools:
    """Return ``[C]``: where the parts of a reward add up without rounding, one certain branch at most being paid for."""
    single = (np.diff(mdp.choice_to_branches) == 1) & (mdp.branch_to_probability[mdp.choice_to_branches[:-1]] == 1.0)
    total: Floats | None = None
    exact = np.ones(mdp.choices, dtype=np.bool_)
    for part, values in reward.parts():
        if part == "branch":
            exact &= single | ~_choices_with(index, part, values != 0.0)
            given = np.where(single, values[mdp.choice_to_branches[:-1]], 0.0)
        else:
            given = values[index.choice_to_state] if part == "state" else values
        if total is None:
            total = given
            continue
        total, lost = two_sum(total, given)
        exact &= lost == 0.0
    return exact


def _choices_with(index: Index, part: str, marked: Bools) -> Bools:
    """Return ``[C]``: the choices that have a marked state, choice or branch."""
    if part == "state":
        return marked[index.choice_to_state]
    if part == "choice":
        return marked
    found = np.zeros(index.choices, dtype=np.bool_)
    found[index.branch_to_choice[marked]] = True
    return found


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
        If there is no such reward, or it (or a part of a weighted sum) is negative somewhere.
    """
    if name is None:
        return np.ones(mdp.choices), np.ones(mdp.choices, dtype=np.bool_)
    total, pays = expected_reward(mdp, name), np.zeros(mdp.choices, dtype=np.bool_)
    for known in weights_of(name, mdp.rewards) or {}:
        for part, values in mdp.rewards[known].parts():
            if values.min() < 0.0:
                first = int(np.argmax(values < 0.0))
                _refuse(mdp, index, known, (part, first, float(values[first])))
            pays |= _choices_with(index, part, values > 0.0)
    if pays.all() and total.min() >= SMALLEST:
        return total, pays
    return np.where(pays, np.maximum(total, SMALLEST), 0.0), pays


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
        f"Use a reward without negative parts, or ask for plans that are sure to arrive: [Fsure goal].",
        **place,
    )
