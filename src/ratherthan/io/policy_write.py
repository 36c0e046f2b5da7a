"""A policy enters, a JSON file leaves that `read_policy` reads: `{"10": "east", "11": {"east": 0.9, "north": 0.1}}`."""

from __future__ import annotations

import json
import os

import numpy as np

from ratherthan.io._files import write_atomically
from ratherthan.model.mdp import MDP
from ratherthan.model.policy import Policy, check_policy

__all__ = ["write_policy"]


def write_policy(policy: Policy, mdp: MDP, path: str | os.PathLike[str]) -> None:
    """Write a policy to a JSON file: for each state of which it says something, by number, an action or chances of several.

    Parameters
    ----------
    policy : Policy
    mdp : MDP
        The model that it is for.
    path : path

    Raises
    ------
    PolicyError
        If the policy does not fit the model.
    SourceError
        If the file cannot be written.
    """
    check_policy(mdp, policy)
    weights = policy.weights(mdp)
    owner = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
    taken = np.flatnonzero(weights > 0.0)
    said: dict[str, str | dict[str, float]] = {}
    for choice, state, chance in zip(taken.tolist(), owner[taken].tolist(), weights[taken].tolist(), strict=True):
        name, key = mdp.action_name(choice), str(state)
        before = said.get(key)
        if chance == 1.0:
            said[key] = name
        elif isinstance(before, dict):
            before[name] = chance
        else:
            said[key] = {name: chance}
    lines = [f" {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}" for key, value in said.items()]
    with write_atomically(path) as file:
        file.write(("{\n" + ",\n".join(lines) + "\n}\n").encode("utf-8", "backslashreplace"))
