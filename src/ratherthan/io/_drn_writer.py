"""An MDP enters; the lines of a DRN file leave, part by part, as bytes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from ratherthan.io._drn_head import OWN
from ratherthan.io._drn_model import INITIAL, UNNAMED
from ratherthan.io._drn_names import comments_of
from ratherthan.model.mdp import MDP, Floats, Reward

__all__ = ["lines_of"]

AT_ONCE = 1 << 14
"""How many states are spelled in one go."""

STRANGE = re.compile(r'[\s"\[\]{}$\x00-\x1f\x7f-\xa0\u2028\u2029\ud800-\udfff]')


def lines_of(mdp: MDP) -> Iterator[bytes]:
    """Yield the file's parts in their order; see `ratherthan.io.drn.write_drn`."""
    labels = _spelled(mdp.labels, taken={INITIAL})
    actions = _spelled(mdp.actions, taken={"", UNNAMED})
    rewards = _spelled(mdp.rewards, taken={""})
    yield from _head(mdp, {"labels": labels, "actions": actions, "rewards": rewards})
    on_states, on_choices = (_brackets(mdp, part) for part in ("state", "choice"))
    marks = [(INITIAL, np.isin(np.arange(mdp.states), mdp.initial))]
    marks += [(spelled, mdp.labels[name]) for spelled, name in labels]
    variables = mdp.names.variables if mdp.names.strings is None else {}
    comments = comments_of(variables, mdp.states)
    for first in range(0, mdp.states, AT_ONCE):
        last = min(first + AT_ONCE, mdp.states)
        words = [""] * (last - first)
        for name, mask in marks:
            for i in np.flatnonzero(mask[first:last]).tolist():
                words[i] += f" {name}"
        choices = _choices(mdp, [spelled for spelled, _ in actions], (first, last), on_choices)
        parts = []
        for i, own in enumerate(choices):
            state = first + i
            parts.append(f"state {state}{_bracket(on_states, state)}{words[i]}\n")
            if comments is not None:
                parts.append(comments[state] + "\n")
            parts += own
        yield "".join(parts).encode("utf-8")


def _head(mdp: MDP, own: dict[str, list[tuple[str, str]]]) -> Iterator[bytes]:
    if mdp.labels or mdp.actions or mdp.rewards:
        yield OWN + json.dumps(own, separators=(",", ":")).encode("ascii") + b"\n"
    names = " ".join(spelled for spelled, _ in own["rewards"])
    yield (
        f"@type: MDP\n@value_type: double\n@parameters\n\n@reward_models\n{names}\n"
        f"@nr_states\n{mdp.states}\n@nr_choices\n{mdp.choices}\n@model\n"
    ).encode()


def _spelled(names: Iterable[str], taken: set[str]) -> list[tuple[str, str]]:
    """Return every name as the format can hold it, each once, beside the name itself."""
    pairs, used = [], set(taken)
    for name in names:
        plain = STRANGE.sub("_", name)[:200] or "_"
        unique, count = plain, 2
        while unique in used:
            unique, count = f"{plain}_{count}", count + 1
        used.add(unique)
        pairs.append((unique, name))
    return pairs


def _number(value: float) -> str:
    """Return a number with as many digits as it takes to read the same one back."""
    return repr(value).removesuffix(".0")


def _brackets(mdp: MDP, part: str) -> list[list[str]]:
    """Return the rewards of every state or choice, spelled: a list per reward."""
    count = mdp.states if part == "state" else mdp.choices
    spelled = []
    for reward in mdp.rewards.values():
        values = reward.state if part == "state" else _expected(mdp, reward)
        spelled.append(["0"] * count if values is None else [_number(value) for value in values.tolist()])
    return spelled


def _expected(mdp: MDP, reward: Reward) -> Floats | None:
    """Return what a choice earns, with what it may expect of its branches."""
    if reward.branch is None:
        return reward.choice
    expected = np.add.reduceat(reward.branch * mdp.branch_to_probability, mdp.choice_to_branches[:-1])
    return expected if reward.choice is None else reward.choice + expected


def _bracket(rewards: list[list[str]], row: int) -> str:
    return f" [{','.join(column[row] for column in rewards)}]" if rewards else ""


def _choices(mdp: MDP, actions: list[str], states: tuple[int, int], rewards: list[list[str]]) -> Iterator[list[str]]:
    """Yield the lines of every state's choices with their branches."""
    offsets = mdp.state_to_choices[states[0] : states[1] + 1].tolist()
    rows = mdp.choice_to_branches[offsets[0] : offsets[-1] + 1].tolist()
    numbers = mdp.choice_to_action[offsets[0] : offsets[-1]].tolist()
    branches = [
        f"\t\t{target} : {_number(probability)}\n"
        for target, probability in zip(
            mdp.branch_to_target[rows[0] : rows[-1]].tolist(),
            mdp.branch_to_probability[rows[0] : rows[-1]].tolist(),
            strict=True,
        )
    ]
    for begin, end in pairwise(offsets):
        lines = []
        for choice in range(begin, end):
            i = choice - offsets[0]
            unnamed = UNNAMED if actions else str(choice - begin)
            name = actions[numbers[i]] if numbers[i] >= 0 else unnamed
            lines.append(f"\taction {name}{_bracket(rewards, choice)}\n")
            lines += branches[rows[i] - rows[0] : rows[i + 1] - rows[0]]
        yield lines
