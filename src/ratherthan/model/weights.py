"""The name of a reward enters, single or a weighted sum such as ``distance + 10 * risk``; its parts and its numbers leave.

A reward of the model is meant by its exact name, whatever signs are in it. Any other text is read as a sum: terms with "+"
between them, each the name of a reward, a weight ("10 * risk") before it or not. Weights are at least 0 and not all of them 0.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ratherthan.errors import PropertyError
from ratherthan.model.mdp import MDP, Floats, Reward

__all__ = ["canonical_reward", "reward_of", "weighted_name", "weights_of"]

_WEIGHT = re.compile(r"\s*(?P<weight>[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)\s*\*\s*(?P<name>.*\S)\s*")


def weights_of(name: str, rewards: Mapping[str, Reward]) -> dict[str, float] | None:
    """Return the parts of a reward with their weights: itself with 1 if the model has it.

    Parameters
    ----------
    name : str
    rewards : mapping of str to Reward
        Those of the model.

    Returns
    -------
    dict of str to float, or None
        Parts of weight 0 are left out. None if a part is no reward of the model.

    Raises
    ------
    PropertyError
        For a negative weight, or weights that sum to 0, and a reward that stands twice.
    """
    if name in rewards:
        return {name: 1.0}
    found: dict[str, float] = {}
    for term in _terms(name, rewards):
        if term is None:
            return None
        part, weight = term
        if not 0 <= weight < float("inf"):
            raise PropertyError(
                f"A weight must be a finite number from 0 on, got {weight:g} for '{part}'.", reward=part
            )
        if part in found:
            raise PropertyError(
                f"A weighted sum must name each reward once, got '{part}' twice in '{name}'.", reward=part
            )
        found[part] = weight
    if not any(found.values()):
        raise PropertyError(f"The weights of a sum must not all be 0, got '{name}'.", reward=name)
    return {part: weight for part, weight in found.items() if weight > 0}


def _terms(name: str, rewards: Mapping[str, Reward]) -> list[tuple[str, float] | None]:
    """Return the terms of a sum, None for one that is none. Names with a "+" in them are found as long as they can be."""
    pieces, terms, at = name.split("+"), [], 0
    while at < len(pieces):
        for end in range(len(pieces), at, -1):
            term = _term("+".join(pieces[at:end]), rewards)
            if term is not None:
                break
        terms.append(term)
        at = end
    return terms


def _term(text: str, rewards: Mapping[str, Reward]) -> tuple[str, float] | None:
    if text.strip() in rewards:
        return text.strip(), 1.0
    match = _WEIGHT.fullmatch(text)
    if match is None or match["name"] not in rewards:
        return None
    return match["name"], float(match["weight"])


def weighted_name(weights: Mapping[str, float]) -> str:
    """Return the name of a weighted sum: ``distance + 10 * risk``."""
    return " + ".join(name if weight == 1.0 else f"{_short(weight)} * {name}" for name, weight in weights.items())


def _short(weight: float) -> str:
    return f"{weight:g}" if float(f"{weight:g}") == weight else repr(weight)


def canonical_reward(name: str, rewards: Mapping[str, Reward]) -> str | None:
    """Return the name of a reward or weighted sum in its one spelling, None if a part is no reward of the model.

    Raises
    ------
    PropertyError
        As `weights_of`.
    """
    found = weights_of(name, rewards)
    return None if found is None else weighted_name(found)


def reward_of(mdp: MDP, name: str) -> Reward | None:
    """Return a reward of a model, or a weighted sum of its rewards; None if there is no such reward.

    Parameters
    ----------
    mdp : MDP
    name : str

    Returns
    -------
    Reward or None
    """
    weights = weights_of(name, mdp.rewards)
    if weights is None:
        return None
    if list(weights.values()) == [1.0]:
        return mdp.rewards[next(iter(weights))]
    sums: dict[str, Floats] = {}
    with np.errstate(over="ignore", invalid="ignore"):  # what is too large is refused where it is used
        for part, weight in weights.items():
            for kind, values in mdp.rewards[part].parts():
                sums[kind] = weight * values + sums.get(kind, 0.0)
    return Reward(**sums)
