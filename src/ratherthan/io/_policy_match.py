"""States and actions as a policy spells them enter; numbers of a model's states and choices, and a Policy, leave."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import PolicyError, QuestionError
from ratherthan.io._policy_rows import SUM_TOLERANCE
from ratherthan.io._policy_valuations import find_valuations, parse_valuation
from ratherthan.model.mdp import MDP, Floats
from ratherthan.model.policy import Policy
from ratherthan.model.states import state_number

__all__ = [
    "Numbers",
    "are_alike",
    "called",
    "choices_of",
    "decided_states",
    "first_with",
    "own_choice",
    "policy_of",
    "settled",
    "shown_actions",
    "state_of_choices",
    "states_of",
]

Numbers = npt.NDArray[np.int64]
MANY_NAMES = 50
MOST_LISTED = 10


def state_of_choices(mdp: MDP) -> Numbers:
    """Return the state of every choice, ``[C]``."""
    return np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))


def decided_states(mdp: MDP) -> int:
    """Return up to which state something is to be decided: without the terminal states at the end, which only loop.

    A reader that gives the ends of episodes states of their own puts them there; who learned from the environment has
    never seen them.
    """
    terminal = mdp.labels.get("terminal")
    if terminal is None:
        return mdp.states
    loops = mdp.branch_to_target == np.repeat(state_of_choices(mdp), np.diff(mdp.choice_to_branches))
    only = np.logical_and.reduceat(loops, mdp.choice_to_branches[mdp.state_to_choices[:-1]]) & terminal
    return mdp.states - int(np.logical_and.accumulate(only[::-1]).sum())


def called(mdp: MDP, state: int) -> str:
    """Return a state as errors name it."""
    return f"state {state} ('{mdp.names[state]}')" if mdp.names.named else f"state {state}"


def shown_actions(mdp: MDP, state: int) -> str:
    """Return the actions of a state as errors list them."""
    own = mdp.choices_of(state)
    shown = ", ".join(f"'{mdp.action_name(choice)}'" for choice in own[:MOST_LISTED])
    return shown + (", …" if len(own) > MOST_LISTED else "")


def are_alike(mdp: MDP, choices: Sequence[int]) -> bool:
    """Return whether choices of one state have the same action, branches and rewards: then it is all one which is taken."""

    def told(choice: int) -> list[Any]:
        own = mdp.branches_of(choice)
        said: list[Any] = [int(mdp.choice_to_action[choice])]
        said += [mdp.branch_to_target[own].tolist(), mdp.branch_to_probability[own].tolist()]
        for reward in mdp.rewards.values():
            said.append(None if reward.choice is None else float(reward.choice[choice]))
            said.append(None if reward.branch is None else reward.branch[own].tolist())
        return said

    return all(told(choice) == told(choices[0]) for choice in choices[1:])


def states_of(given: Iterable[Any], mdp: MDP, what: str) -> Numbers:
    """Return the numbers of states given by number, by name, or by the values of their variables.

    Raises
    ------
    PolicyError
        With the first that is no state of the model.
    """
    keys = list(given)
    found = np.full(len(keys), -1, dtype=np.int64)
    for i, key in enumerate(keys):
        if isinstance(key, str) and key.isascii() and key.strip().isdigit() and len(key) < 19 and int(key) < mdp.states:
            found[i] = int(key)
    open_ = [int(i) for i in np.flatnonzero(found < 0) if isinstance(keys[i], str)]
    if mdp.names.strings is not None and len(open_) > MANY_NAMES:
        by_name: dict[str, int] = {}
        for state in range(mdp.states - 1, -1, -1):
            name = mdp.names[state]
            by_name[name] = -1 if name in by_name else state  # -1: several states have it
        found[open_] = [by_name.get(keys[i], -1) for i in open_]
    elif mdp.names.strings is None and mdp.names.variables and open_:
        found[open_] = np.maximum(find_valuations(mdp, [parse_valuation(keys[i], mdp) or {} for i in open_]), -1)
    for i in np.flatnonzero(found < 0).tolist():
        try:
            found[i] = state_number(mdp, keys[i])
        except QuestionError as error:
            raise PolicyError(f"{what} must list states of the model. {error.message}", state=keys[i]) from error
    return found


def choices_of(states: Numbers, given: Sequence[Any], mdp: MDP, what: str) -> Numbers:
    """Return the choices that are meant by actions at states: by the names they are shown with, or by position.

    Raises
    ------
    PolicyError
        With the first that is not enabled.
    """
    number: dict[Any, int] = {}
    for action, name in enumerate(mdp.actions):
        number.setdefault(name, action)
    actions = np.array([number.get(name, -1) if isinstance(name, str) else -1 for name in given], dtype=np.int64)
    choices = first_with(mdp, states, actions)
    for i in np.flatnonzero(choices < 0).tolist():
        choices[i] = own_choice(int(states[i]), given[i], mdp, what)
    return choices


def first_with(mdp: MDP, states: Numbers, actions: Numbers) -> Numbers:
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


def own_choice(state: int, given: Any, mdp: MDP, what: str) -> int:
    """Return one choice by the name it is shown with, or by its position.

    Raises
    ------
    PolicyError
        Where the state has no such choice.
    """
    own = mdp.choices_of(state)
    shown = [mdp.action_name(choice) for choice in own]
    plain = isinstance(given, str | int | np.integer) and not isinstance(given, bool)
    text = str(given).strip()
    if plain and shown.count(text) == 1:
        return own[shown.index(text)]
    if plain and text.isascii() and text.isdigit() and int(text) < len(own):
        return own[int(text)]
    trouble = "is not enabled there" if text in mdp.actions else "is no action of the model"
    raise PolicyError(
        f"{what} must choose among the actions of {called(mdp, state)}, {shown_actions(mdp, state)}; but {given!r} "
        f"{trouble}.",
        state=state,
        action=given,
    )


def policy_of(
    mdp: MDP, states: Numbers, choices: Numbers, chances: Floats, what: str, *, complete: bool = False
) -> Policy:
    """Return the policy that rows of state, choice and probability say.

    Parameters
    ----------
    mdp : MDP
    states, choices : array of int, ``[N]``
    chances : array of float, ``[N]``
        NaN stands for certainty.
    what : str
        How the policy is called in errors.
    complete : bool
        Take the only choice of a state that is not listed, if it has but one.

    Raises
    ------
    PolicyError
        Where a state is listed twice, or its probabilities do not sum to 1.
    """
    certain = np.isnan(chances)
    listed = np.bincount(states, minlength=mdp.states)
    twice = np.zeros(mdp.states, dtype=bool)
    twice[states[certain]] = listed[states[certain]] > 1
    twice[state_of_choices(mdp)[np.bincount(choices, minlength=mdp.choices) > 1]] = True
    if twice.any():
        raise PolicyError(
            f"{what} must list each state once, but {called(mdp, int(twice.argmax()))} is there twice. Remove one."
        )
    weights = np.zeros(mdp.choices)
    weights[choices] = np.where(certain, 1.0, chances)
    sums = np.add.reduceat(weights, mdp.state_to_choices[:-1])
    wrong = np.flatnonzero((np.abs(sums - 1) > SUM_TOLERANCE) & (listed > 0))
    if len(wrong):
        raise PolicyError(
            f"{what} must give probabilities that sum to 1 in every state, got {sums[wrong[0]]:.10g} at "
            f"{called(mdp, int(wrong[0]))}.",
            state=int(wrong[0]),
        )
    if complete:
        alone = (np.diff(mdp.state_to_choices) == 1) & (listed == 0)
        weights[mdp.state_to_choices[:-1][alone]] = 1.0
    return settled(mdp, weights / np.repeat(np.where(listed > 0, sums, 1.0), np.diff(mdp.state_to_choices)))


def settled(mdp: MDP, weights: Floats) -> Policy:
    """Return a policy from the probability of every choice; a plain one where all are 0 or 1."""
    taken = np.flatnonzero(weights)
    state = state_of_choices(mdp)[taken]
    choice = np.full(mdp.states, -1, dtype=np.int64)
    alone = np.bincount(state, minlength=mdp.states)[state] == 1
    choice[state[alone]] = taken[alone]
    return Policy(choice=choice, chance=None if alone.all() else weights)
