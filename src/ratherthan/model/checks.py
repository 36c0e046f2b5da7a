"""An MDP's arrays enter, the list of their faults leaves: each says what must hold, what came, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ratherthan.model.names import StateNames

if TYPE_CHECKING:
    from ratherthan.model.mdp import MDP

__all__ = ["Fault", "faults_of", "normalised", "shape_faults"]

MOST_FAULTS = 20
BLOCK = 1 << 15
"""How many rows are summed at a time."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One fault: a sentence, and where it is."""

    sentence: str
    place: dict[str, Any] = field(default_factory=dict)


def shape_faults(mdp: MDP) -> list[Fault]:
    """Return the faults of the row structure: dimensions, offsets that fall, empty rows, lengths that disagree."""
    faults = []
    for name in ("state_to_choices", "choice_to_branches", "branch_to_target", "branch_to_probability"):
        array = np.asarray(getattr(mdp, name))
        if array.ndim != 1:
            faults.append(Fault(sentence=f"{name} must be one-dimensional, got shape {array.shape}."))
        elif name != "branch_to_probability" and not _whole(array):
            faults.append(Fault(sentence=f"{name} must hold integers, got {array.dtype}."))
        elif name == "branch_to_probability" and array.dtype.kind not in "fiub":
            faults.append(Fault(sentence=f"{name} must hold numbers, got {array.dtype}."))
    if faults:
        return faults
    faults += _offset_faults("state_to_choices", np.asarray(mdp.state_to_choices), "state", "choice")
    faults += _offset_faults("choice_to_branches", np.asarray(mdp.choice_to_branches), "choice", "branch")
    if faults:
        return faults
    choices, branches = len(mdp.choice_to_branches) - 1, len(mdp.branch_to_target)
    if mdp.state_to_choices[-1] != choices:
        faults.append(
            Fault(
                sentence=f"state_to_choices must end at the number of choices, {choices}, got {mdp.state_to_choices[-1]}."
            )
        )
    if mdp.choice_to_branches[-1] != branches:
        faults.append(
            Fault(
                sentence=f"choice_to_branches must end at the number of branches, {branches}, got {mdp.choice_to_branches[-1]}."
            )
        )
    if len(mdp.branch_to_probability) != branches:
        faults.append(
            Fault(
                sentence=f"There must be one probability per branch: {branches} targets, got {len(mdp.branch_to_probability)} probabilities."
            )
        )
    actions = mdp.choice_to_action
    if actions is not None and (np.ndim(actions) != 1 or len(actions) != choices or not _whole(np.asarray(actions))):
        faults.append(
            Fault(
                sentence=f"choice_to_action must hold one integer per choice ({choices}), got shape {np.shape(actions)}."
            )
        )
    if np.ndim(mdp.initial) != 1 or not _whole(np.asarray(mdp.initial)):
        faults.append(Fault(sentence=f"initial must be a list of states (integers), got {mdp.initial!r}."))
    return faults + _kind_faults(mdp)


def _kind_faults(mdp: MDP) -> list[Fault]:
    """Return the rewards that are no numbers."""
    faults = []
    for name, reward in mdp.rewards.items():
        for part, values in reward.parts():
            if not _numbers(values):
                sentence = f"Reward '{name}' on {part}s must hold numbers, one per {part}, got {values!r:.60}."
                faults.append(Fault(sentence=sentence, place={"reward": name, "part": part}))
    return faults


def _numbers(values: Any) -> bool:
    """Whether values are numbers, or lists of them that are all of one length."""
    try:
        return np.asarray(values).dtype.kind in "fiub"
    except ValueError:
        return False


def _whole(array: npt.NDArray[Any]) -> bool:
    return array.dtype.kind in "iu" or array.size == 0


def _offset_faults(name: str, offsets: npt.NDArray[Any], row: str, entry: str) -> list[Fault]:
    if len(offsets) < 2:
        return [Fault(sentence=f"A model must have at least one {row}: {name} must have two entries or more.")]
    if offsets[0] != 0:
        return [Fault(sentence=f"{name} must begin at 0, got {offsets[0]}.")]
    if (offsets[1:] > offsets[:-1]).all():
        return []
    steps = offsets[1:].astype(np.int64) - offsets[:-1].astype(np.int64)
    faults = [
        Fault(sentence=f"{name} must not fall, but it does after {row} {row_}.", place={row: row_})
        for row_ in map(int, np.flatnonzero(steps < 0)[:MOST_FAULTS])
    ]
    fix = "; give a state without a way on a loop to itself" if row == "state" else ""
    faults += [
        Fault(sentence=f"Every {row} must have at least one {entry}, {row} {row_} has none{fix}.", place={row: row_})
        for row_ in map(int, np.flatnonzero(steps == 0)[:MOST_FAULTS])
    ]
    return faults


def normalised(mdp: MDP) -> dict[str, Any]:
    """Return the fields of `mdp` in one width, zero branches dropped, sums rescaled, locked.

    Faults that this would hide (a wrong sum, a negative probability) are left in place for `faults_of` to name.
    """
    probability = np.asarray(mdp.branch_to_probability, dtype=np.float64)
    rows, target = np.asarray(mdp.choice_to_branches), np.asarray(mdp.branch_to_target)
    rewards = dict(mdp.rewards)
    if not probability.all():
        keep = probability != 0.0
        before = np.concatenate([[0], np.cumsum(keep)])
        kept_rows = before[rows]
        if (np.diff(kept_rows) > 0).all():
            rewards = {name: _keep_branches(reward, keep) for name, reward in rewards.items()}
            rows, target, probability = kept_rows, target[keep], probability[keep]
    probability = _rescaled(rows, probability)
    states, choices, branches = len(mdp.state_to_choices) - 1, len(rows) - 1, len(target)
    small = max(states, choices, branches) < np.iinfo(np.int32).max
    if small and len(target) and (target.min() < np.iinfo(np.int32).min or target.max() > np.iinfo(np.int32).max):
        small = False
    width = np.int32 if small else np.int64
    actions = np.full(choices, -1) if mdp.choice_to_action is None else mdp.choice_to_action
    return {
        "state_to_choices": _locked(np.asarray(mdp.state_to_choices), width),
        "choice_to_branches": _locked(rows, width),
        "branch_to_target": _locked(target, width),
        "branch_to_probability": _locked(probability, np.float64),
        "choice_to_action": _locked(np.asarray(actions), np.int32),
        "actions": tuple(map(str, mdp.actions)),
        "labels": {str(name): _locked(np.asarray(mask), None) for name, mask in mdp.labels.items()},
        "rewards": {str(name): _locked_reward(reward) for name, reward in rewards.items()},
        "initial": _locked(np.unique(np.asarray(mdp.initial, dtype=np.int64)), width),
        "names": StateNames(count=states) if mdp.names is None else mdp.names,
    }


def _keep_branches(reward: Any, keep: npt.NDArray[np.bool_]) -> Any:
    branch = reward.branch
    if branch is None or len(branch) != len(keep):
        return reward
    return type(reward)(state=reward.state, choice=reward.choice, branch=np.asarray(branch)[keep])


def _rescaled(rows: npt.NDArray[Any], probability: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    from ratherthan.model.mdp import SUM_TOLERANCE

    if not _between(probability, -np.finfo(np.float64).max, np.finfo(np.float64).max):
        return probability
    rescaled = probability
    for block, sums in _sums(rows, probability):
        off = np.abs(sums - 1.0)
        if not (off > 2.3e-16 * 5).any():  # a row has a branch at least
            continue
        counts = np.diff(rows[block.start : block.stop + 1])
        to_mend = (off > 2.3e-16 * (counts + 4)) & (off <= SUM_TOLERANCE)
        if to_mend.any():
            rescaled = probability.copy() if rescaled is probability else rescaled
            rescaled[rows[block.start] : rows[block.stop]] /= np.repeat(np.where(to_mend, sums, 1.0), counts)
    return rescaled


def _sums(
    rows: npt.NDArray[Any], probability: npt.NDArray[np.float64]
) -> Iterator[tuple[slice, npt.NDArray[np.float64]]]:
    """Yield the sums of the rows, some thousands at a time, which stay in the processor's cache: which rows, and their sums."""
    count = len(rows) - 1
    for first in range(0, count, BLOCK):
        last = min(first + BLOCK, count)
        begin = rows[first]
        yield slice(first, last), np.add.reduceat(probability[begin : rows[last]], rows[first:last] - begin)


def _between(values: npt.NDArray[Any], least: float, most: float) -> bool:
    """Return whether all values lie between two numbers, both allowed; NaN does not. No array is made for it."""
    with np.errstate(invalid="ignore"):
        return len(values) == 0 or bool(values.min() >= least and values.max() <= most)


def _locked(array: npt.NDArray[Any], dtype: Any) -> npt.NDArray[Any]:
    """Return `array` read-only in `dtype`: taken over where it owns its memory, copied where a base can be written."""
    array = np.ascontiguousarray(array, dtype=dtype)
    if array.flags.writeable and not array.flags.owndata:
        array = array.copy()
    array.flags.writeable = False
    return array


def _locked_reward(reward: Any) -> Any:
    parts = {name: _locked(np.asarray(values), np.float64) for name, values in reward.parts()}
    return type(reward)(**parts)


def faults_of(mdp: MDP) -> list[Fault]:
    """Return every fault of the values: probabilities, targets, actions, labels, rewards, initial states, names."""
    faults = _target_faults(mdp)
    faults += _probability_faults(mdp)
    faults += _action_faults(mdp)
    for name, mask in mdp.labels.items():
        if mask.shape != (mdp.states,) or mask.dtype != np.bool_:
            came = f"{mask.dtype} of shape {mask.shape}"
            faults.append(
                Fault(
                    sentence=f"Label '{name}' must be one true or false per state ({mdp.states}), got {came}.",
                    place={"label": name},
                )
            )
    faults += _reward_faults(mdp)
    outside = [int(s) for s in mdp.initial if not 0 <= s < mdp.states]
    faults += [
        Fault(sentence=f"Initial states must lie in 0 … {mdp.states - 1}, got {s}.", place={"state": s})
        for s in outside
    ]
    if len(mdp.initial) == 0:
        faults.append(Fault(sentence="A model must have at least one initial state, got none."))
    if mdp.names.count != mdp.states:
        faults.append(
            Fault(sentence=f"There must be one name per state: {mdp.states} states, got names for {mdp.names.count}.")
        )
    return faults


def _where(mdp: MDP, choice: int) -> str:
    action = mdp.choice_to_action[choice]
    state = mdp.state_of(choice)
    named = mdp.actions[action] if 0 <= action < len(mdp.actions) else ""
    called = f" ('{mdp.names[state]}')" if mdp.names.count == mdp.states and mdp.names.named else ""
    return f"at action '{named or f'choice {choice - int(mdp.state_to_choices[state])}'}' of state {state}{called}"


def _place(mdp: MDP, choice: int) -> dict[str, Any]:
    action = int(mdp.choice_to_action[choice])
    name = mdp.actions[action] if 0 <= action < len(mdp.actions) else None
    return {"state": mdp.state_of(choice), "choice": choice, "action": name}


def _choice_of_branch(mdp: MDP, branch: int) -> int:
    return int(np.searchsorted(mdp.choice_to_branches, branch, side="right")) - 1


def _target_faults(mdp: MDP) -> list[Fault]:
    if _between(mdp.branch_to_target, 0, mdp.states - 1):
        return []
    wrong = np.flatnonzero((mdp.branch_to_target < 0) | (mdp.branch_to_target >= mdp.states))[:MOST_FAULTS]
    return [
        Fault(
            sentence=f"Targets must lie in 0 … {mdp.states - 1}, got {mdp.branch_to_target[b]} "
            f"{_where(mdp, _choice_of_branch(mdp, b))}.",
            place=_place(mdp, _choice_of_branch(mdp, b)) | {"branch": int(b)},
        )
        for b in wrong
    ]


def _probability_faults(mdp: MDP) -> list[Fault]:
    from ratherthan.model.mdp import SUM_TOLERANCE

    probability = mdp.branch_to_probability
    wrong: Any = ()
    if not _between(probability, 0.0, 1.0 + SUM_TOLERANCE):
        wrong = np.flatnonzero(~((probability >= 0.0) & (probability <= 1.0 + SUM_TOLERANCE)))[:MOST_FAULTS]
    faults = [
        Fault(
            sentence=f"Probabilities must lie between 0 and 1, got {probability[b]:g} "
            f"{_where(mdp, _choice_of_branch(mdp, b))}.",
            place=_place(mdp, _choice_of_branch(mdp, b)) | {"branch": int(b)},
        )
        for b in wrong
    ]
    if faults:
        return faults
    for block, sums in _sums(mdp.choice_to_branches, probability):
        faults += [
            Fault(
                sentence=f"Probabilities of a choice must sum to 1, got {sums[c]:.10g} {_where(mdp, block.start + int(c))}.",
                place=_place(mdp, block.start + int(c)),
            )
            for c in np.flatnonzero(np.abs(sums - 1.0) > SUM_TOLERANCE)[:MOST_FAULTS]
        ]
    return faults[:MOST_FAULTS]


def _action_faults(mdp: MDP) -> list[Fault]:
    if _between(mdp.choice_to_action, -1, len(mdp.actions) - 1):
        return []
    wrong = np.flatnonzero((mdp.choice_to_action < -1) | (mdp.choice_to_action >= len(mdp.actions)))[:MOST_FAULTS]
    return [
        Fault(
            sentence=f"Actions must be numbered 0 … {len(mdp.actions) - 1} (-1: no name), got {mdp.choice_to_action[c]} "
            f"at choice {c} of state {mdp.state_of(int(c))}.",
            place={"choice": int(c), "state": mdp.state_of(int(c))},
        )
        for c in wrong
    ]


def _reward_faults(mdp: MDP) -> list[Fault]:
    lengths = {"state": mdp.states, "choice": mdp.choices, "branch": mdp.branches}
    faults = []
    for name, reward in mdp.rewards.items():
        for part, values in reward.parts():
            place = {"reward": name, "part": part}
            if values.shape != (lengths[part],):
                faults.append(
                    Fault(
                        sentence=f"Reward '{name}' on {part}s must have one number per {part} ({lengths[part]}), "
                        f"got shape {values.shape}.",
                        place=place,
                    )
                )
                continue
            if _between(values, -np.finfo(np.float64).max, np.finfo(np.float64).max):
                continue
            faults += [
                Fault(
                    sentence=f"Rewards must be finite numbers, got {values[i]:g} for '{name}' at {part} {i}.",
                    place=place | {part: int(i)},
                )
                for i in np.flatnonzero(~np.isfinite(values))[:MOST_FAULTS]
            ]
    return faults
