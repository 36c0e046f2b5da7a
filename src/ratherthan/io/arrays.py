"""Arrays in the forms that people have enter, a Problem leaves.

==================== =================================================================================================
form                 transitions, and the rewards beside them
==================== =================================================================================================
dense                ``[A, S, S]`` or ``[S, A, S]``: ``order="ASS"`` or ``"SAS"`` says which, and must where the shape
                     leaves it open. Rewards ``[S]``, ``[S, A]``, or of the shape of the transitions
list of matrices     A matrices ``[S, S]``, dense or of scipy.sparse, as pymdptoolbox has them. Rewards ``[S]``,
                     ``[S, A]``, or A matrices ``[S, S]``
pairs                ``[L, S]``, dense or of scipy.sparse, with `s_indices` and `a_indices` ``[L]``, as QuantEcon's
                     DiscreteDP has them. Rewards ``[L]``
compressed rows      the MDP's own fields by name: ``state_to_choices``, ``choice_to_branches``, ``branch_to_target``,
                     ``branch_to_probability``, ``choice_to_action``. Rewards: a `Reward`, or a table of ``state``,
                     ``choice``, ``branch``
==================== =================================================================================================

A row of zeros means that the action is not enabled in the state (but not among pairs, which are listed because they are
enabled). A state in which no action is gets a loop in place that earns nothing; a note says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._array_forms import (
    Numbers,
    array_of,
    doubles,
    offsets_and_targets,
    rewards_on,
    table_of,
    whole_numbers,
)
from ratherthan.io._rows import Rows, checked_offsets, with_loops
from ratherthan.model.mdp import MDP, Bools, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem

__all__ = ["from_arrays"]

ROW_FIELDS = ("state_to_choices", "choice_to_branches", "branch_to_target", "branch_to_probability", "choice_to_action")
PARTS = ("state", "choice", "branch")


def from_arrays(
    transitions: Any = None,
    rewards: Any = None,
    *,
    order: str | None = None,
    s_indices: Any = None,
    a_indices: Any = None,
    actions: Sequence[str] | None = None,
    names: Sequence[str] | None = None,
    labels: Mapping[str, Any] | None = None,
    initial: Any = None,
    **rows: Any,
) -> Problem:
    """Build a problem from arrays.

    Parameters
    ----------
    transitions : array, sequence of matrices, or scipy.sparse matrix
        Probabilities in one of the forms above.
    rewards : array, sequence of matrices, or mapping of str to these, optional
        One reward, which is called ``reward``, or several by name.
    order : str, optional
        ``"ASS"`` or ``"SAS"``: what the axes of a dense array are.
    s_indices, a_indices : array of int, ``[L]``, optional
        State and action of each row of the pair form.
    actions : sequence of str, optional
        The names of the actions, ``[A]``; without them they are called a0, a1, …
    names : sequence of str, optional
        The names of the states, ``[S]``.
    labels : mapping of str to array, optional
        Named sets of states: truth values ``[S]``, or the numbers of the states.
    initial : int or list of int, optional
        The initial states; without them any state may be the start.
    **rows
        The compressed rows by name, in place of `transitions`.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        Where the arrays do not have these shapes, or leave open what their axes are.
    ModelError
        Where the model in them breaks a law.

    Examples
    --------
    >>> problem = from_arrays(
    ...     [[[0.0, 1.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]]],
    ...     [[1.0, 0.0], [0.0, 0.0]],
    ...     order="ASS",
    ...     actions=["go", "stay"],
    ...     labels={"goal": [1]},
    ...     initial=0,
    ... )
    >>> problem.mdp
    MDP(2 states, 3 choices, 3 branches; labels: goal; rewards: reward)
    """
    given = None if actions is None else _texts(actions, "actions")
    if rows:
        if transitions is not None or s_indices is not None or a_indices is not None:
            raise SourceError(
                "A model must come in one form, got both transitions and compressed rows. Give one of them."
            )
        built = _compressed(rows, rewards)
        states, called = len(built.state_to_choices) - 1, given or _numbered(built.choice_to_action)
    else:
        table = table_of(transitions, order, s_indices, a_indices)
        if given is not None and len(given) < table.actions:
            raise SourceError(f"There must be one name per action: {table.actions} actions, got {len(given)} names.")
        built = table.rows(rewards_on(table, _by_name(rewards)))
        states, called = table.states, given or tuple(f"a{number}" for number in range(table.actions))
    built, notes = with_loops(built)
    if initial is None:
        notes += ("The arrays name no initial state: any state may be the start.",)
    mdp = MDP(
        state_to_choices=built.state_to_choices,
        choice_to_branches=built.choice_to_branches,
        branch_to_target=built.branch_to_target,
        branch_to_probability=built.branch_to_probability,
        choice_to_action=built.choice_to_action,
        actions=called,
        labels={str(name): _mask(str(name), states_in, states) for name, states_in in (labels or {}).items()},
        rewards=built.rewards,
        initial=np.arange(states) if initial is None else _state_list(initial, "initial", states),
        names=StateNames(count=states, strings=None if names is None else _texts(names, "names")),
    )
    return Problem(mdp=mdp, source="arrays", notes=notes)


def _texts(given: Any, what: str) -> tuple[str, ...]:
    """Return names given as a list; numbers are names too."""
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if (
        not isinstance(given, Sequence)
        or isinstance(given, str)
        or not all(isinstance(name, str | int) for name in given)
    ):
        raise SourceError(f"{what} must be a list of names, got {_shown(given)}.")
    return tuple(map(str, given))


def _by_name(rewards: Any) -> dict[str, Any]:
    if rewards is None:
        return {}
    return (
        {str(name): value for name, value in rewards.items()} if isinstance(rewards, Mapping) else {"reward": rewards}
    )


def _numbered(choice_to_action: npt.NDArray[Any]) -> tuple[str, ...]:
    """Return a name per action number that is used."""
    if choice_to_action.ndim != 1 or choice_to_action.dtype.kind not in "iu" or len(choice_to_action) == 0:
        return ()
    most = int(choice_to_action.max())
    if most >= len(choice_to_action):
        raise SourceError(
            f"Actions must be numbered from 0 without great gaps, got {most} for {len(choice_to_action)} choices. "
            "Number them anew, or give their names."
        )
    return tuple(f"a{number}" for number in range(most + 1))


def _compressed(rows: Mapping[str, Any], rewards: Any) -> Rows:
    """Return compressed rows given by name; what is in them is checked where the MDP is made."""
    unknown, missing = sorted(set(rows) - set(ROW_FIELDS)), sorted(set(ROW_FIELDS[:-1]) - set(rows))
    if unknown or missing:
        came = f"unknown: {', '.join(unknown)}" if unknown else f"missing: {', '.join(missing)}"
        raise SourceError(
            f"Compressed rows must be given as {', '.join(ROW_FIELDS)} (the last may be left out); {came}."
        )
    arrays = {name: array_of(value, name) for name, value in rows.items()}
    for name, array in arrays.items():
        if array.ndim != 1 or (name.startswith(("state_to", "choice_to_b")) and len(array) < 2):
            raise SourceError(f"{name} must be one-dimensional and not empty, got shape {array.shape}.")
    numbers = {name: offsets_and_targets(arrays[name], name) for name in arrays if name != "branch_to_probability"}
    choices, branches = len(numbers["choice_to_branches"]) - 1, len(numbers["branch_to_target"])
    action = numbers.get("choice_to_action", np.full(choices, -1))
    if len(action) and int(action.max()) >= 2**31:
        raise SourceError(f"choice_to_action must hold numbers below {2**31}, got {int(action.max())}.")
    parts = _reward_parts(rewards)
    lengths = {"state": len(numbers["state_to_choices"]) - 1, "choice": choices, "branch": branches}
    wanted = {
        "branch_to_probability": (arrays["branch_to_probability"].shape, branches),
        "choice_to_action": (action.shape, choices),
    }
    for name, reward in parts.items():
        wanted |= {f"reward '{name}' on {part}": (values.shape, lengths[part]) for part, values in reward.parts()}
    for name, (shape, length) in wanted.items():
        if shape != (length,):
            raise SourceError(f"{name} must have {length} entries, got shape {shape}.")
    return Rows(
        state_to_choices=checked_offsets(numbers["state_to_choices"], choices, "state_to_choices"),
        choice_to_branches=checked_offsets(numbers["choice_to_branches"], branches, "choice_to_branches"),
        branch_to_target=numbers["branch_to_target"],
        branch_to_probability=doubles(arrays["branch_to_probability"]),
        choice_to_action=action,
        rewards=parts,
    )


def _reward_parts(rewards: Any) -> dict[str, Reward]:
    """Return rewards given as `Reward`, as a table of parts, or by name as either."""
    if rewards is None:
        return {}
    if isinstance(rewards, Reward):
        rewards = {"reward": rewards}
    if not isinstance(rewards, Mapping):
        raise SourceError(
            f"Rewards on compressed rows must be tables of {', '.join(PARTS)}, got {type(rewards).__name__}."
        )
    if not all(isinstance(value, Mapping | Reward) for value in rewards.values()):
        rewards = {"reward": rewards}
    found = {}
    for name, value in rewards.items():
        if isinstance(value, Reward):
            value = {part: getattr(value, part) for part in PARTS if getattr(value, part) is not None}
        if not set(value) <= set(PARTS):
            raise SourceError(
                f"Reward '{name}' must be a table of {', '.join(PARTS)}, got {', '.join(map(str, value))}."
            )
        found[str(name)] = Reward(
            **{part: doubles(array_of(values, f"reward '{name}' on {part}")) for part, values in value.items()}
        )
    return found


def _mask(name: str, given: Any, states: int) -> Bools:
    """Return a set of states from truth values or from state numbers."""
    array = array_of(given, f"label '{name}'")
    if array.dtype == np.bool_:
        if array.shape != (states,):
            raise SourceError(
                f"Label '{name}' must have one truth value per state ({states}), got shape {array.shape}."
            )
        return array
    mask = np.zeros(states, dtype=bool)
    mask[_state_list(array, f"label '{name}'", states)] = True
    return mask


def _state_list(given: Any, what: str, states: int) -> Numbers:
    numbers = whole_numbers(np.atleast_1d(array_of(given, what)), what)
    if numbers.ndim != 1 or ((numbers < 0) | (numbers >= states)).any():
        raise SourceError(
            f"{what} must list states in 0 … {states - 1}, got {_shown(given)}. States are counted from 0."
        )
    return numbers


def _shown(given: Any) -> str:
    text = repr(given)
    return text if len(text) <= 60 else text[:57] + "…"
