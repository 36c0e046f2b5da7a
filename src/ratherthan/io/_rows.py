"""Rows of choices and branches as a file has them enter; rows that an MDP accepts leave, with a note on every repair."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import ModelError
from ratherthan.model.mdp import Floats, Ints, Reward

__all__ = ["Rows", "checked_offsets", "checked_targets", "with_loops"]


@dataclass(frozen=True, kw_only=True)
class Rows:
    """States → choices → branches, and what lies on them; states may still be without choices."""

    state_to_choices: Ints  # [S+1]
    choice_to_branches: Ints  # [C+1]
    branch_to_target: Ints  # [B]
    branch_to_probability: Floats  # [B]
    choice_to_action: Ints  # [C]
    rewards: Mapping[str, Reward]


def checked_offsets(offsets: npt.NDArray[np.integer[Any]], count: int, name: str) -> Ints:
    """Return offsets that rise from 0 to `count` as signed numbers, whose range they then cannot leave.

    Raises
    ------
    ModelError
        With the first place where they do not.
    """
    if offsets[0] != 0:
        raise ModelError(f"{name} must begin at 0, got {int(offsets[0])}. Write the file anew.")
    falls = offsets[1:] < offsets[:-1]
    if falls.any():
        at = int(falls.argmax())
        raise ModelError(
            f"{name} must not fall, but it does from {int(offsets[at])} to {int(offsets[at + 1])} after row {at}. "
            "Write the file anew.",
            row=at,
        )
    if offsets[-1] != count:
        raise ModelError(f"{name} must end at {count}, got {int(offsets[-1])}. Write the file anew.")
    return _signed(offsets)


def checked_targets(values: npt.NDArray[np.integer[Any]], count: int, what: str) -> Ints:
    """Return indices from 0 on and below `count` as signed numbers.

    Raises
    ------
    ModelError
        With the first that is not.
    """
    wrong = values >= count
    if wrong.any():
        at = int(wrong.argmax())
        raise ModelError(
            f"{what} must lie in 0 … {count - 1}, got {int(values[at])} at entry {at}. Write the file anew.", entry=at
        )
    return _signed(values)


def _signed(values: npt.NDArray[np.integer[Any]]) -> Ints:
    """Return numbers in 32 bits as they are, others in 64."""
    signed: Any = values if values.dtype == np.int32 else values.astype(np.int64)
    made: Ints = signed
    return made


def with_loops(rows: Rows) -> tuple[Rows, tuple[str, ...]]:
    """Give every state without choices a loop to itself that earns nothing, and say so.

    Returns
    -------
    Rows
    tuple of str
        A note, or nothing where every state has a choice.
    """
    counts = np.diff(rows.state_to_choices)
    stuck = np.flatnonzero(counts == 0)
    if len(stuck) == 0:
        return rows, ()
    at_choice = rows.state_to_choices[stuck]  # where in the old choices each new one goes
    at_branch = rows.choice_to_branches[at_choice]
    branches = np.insert(np.diff(rows.choice_to_branches), at_choice, 1)
    rewards = {
        name: Reward(
            state=reward.state,
            choice=None if reward.choice is None else np.insert(reward.choice, at_choice, 0.0),
            branch=None if reward.branch is None else np.insert(reward.branch, at_branch, 0.0),
        )
        for name, reward in rows.rewards.items()
    }
    mended = Rows(
        state_to_choices=np.concatenate([[0], np.cumsum(np.maximum(counts, 1))]),
        choice_to_branches=np.concatenate([[0], np.cumsum(branches)]),
        branch_to_target=np.insert(rows.branch_to_target, at_branch, stuck).astype(np.int64),
        branch_to_probability=np.insert(rows.branch_to_probability, at_branch, 1.0),
        choice_to_action=np.insert(rows.choice_to_action, at_choice, -1).astype(np.int64),
        rewards=rewards,
    )
    some = ", ".join(map(str, stuck[:5].tolist())) + (", …" if len(stuck) > 5 else "")
    which = f"State {some} has" if len(stuck) == 1 else f"{len(stuck)} states ({some}) have"
    return mended, (f"{which} no choice in the source and got a loop in place that earns nothing.",)
