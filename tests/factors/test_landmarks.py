"""What landmarks count against one search per choice."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
import pytest

from ratherthan.factors.constrictiveness import Constrictiveness, constrictiveness
from ratherthan.factors.landmarks import landmarks, tree_weights
from ratherthan.factors.selectiveness import Criticality
from ratherthan.model.index import index_of
from ratherthan.model.mdp import MDP, Bools

pytestmark = pytest.mark.kernels


def random_cases(count: int) -> Iterator[tuple[MDP, Bools, Criticality, np.random.Generator]]:
    """Yield small models with ends and critical states; half of them are chains of neighbours, where much is cut off."""
    rng = np.random.default_rng(11)
    for number in range(count):
        states = int(rng.integers(1, 12))
        choices = rng.integers(1, 4, states)
        branches = rng.integers(1, 4, int(choices.sum()))
        total = int(branches.sum())
        own = np.repeat(np.repeat(np.arange(states), choices), branches)
        near = np.clip(own + rng.integers(-1, 3, total), 0, states - 1)
        mdp = MDP(
            state_to_choices=np.concatenate([[0], np.cumsum(choices)]),
            choice_to_branches=np.concatenate([[0], np.cumsum(branches)]),
            branch_to_target=near if number % 2 else rng.integers(0, states, total),
            branch_to_probability=np.repeat(1.0 / branches, branches),
            initial=np.array([0]),
        )
        ended = rng.random(states) < 0.2
        possible = (rng.random(states) < 0.7) & ~ended
        yield mdp, ended, Criticality(certain=possible & (rng.random(states) < 0.7), possible=possible), rng


@pytest.mark.parametrize("budget", [0, 5, 10**9])
def test_landmarks_count_what_one_search_per_choice_counts(budget: int) -> None:
    for mdp, ended, critical, rng in random_cases(120):
        wanted = constrictiveness(mdp, critical, ended, range(mdp.choices))
        near = np.arange(mdp.states)[: int(rng.integers(0, mdp.states + 1))]
        weight = np.diff(mdp.state_to_choices).astype(np.int64)
        lower, upper = tree_weights(
            index_of(mdp),
            landmarks(index_of(mdp), ended, near),
            np.arange(mdp.choices),
            (weight * critical.certain, weight * critical.possible),
            budget,
        )
        found = {c: Constrictiveness(lower=int(lower[c]), upper=int(upper[c])) for c in range(mdp.choices)}
        assert found == wanted


def test_the_counts_do_not_depend_on_how_they_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = sys.modules["ratherthan.factors.constrictiveness"]  # the function has the module's name
    for mdp, ended, critical, rng in random_cases(60):
        asked = [int(choice) for choice in rng.permutation(mdp.choices)]
        wanted = constrictiveness(mdp, critical, ended, asked)
        with monkeypatch.context() as forced:
            forced.setattr(counted, "FEW", 0)
            forced.setattr(counted, "LITTLE", 0)
            assert constrictiveness(mdp, critical, ended, asked) == wanted
            assert constrictiveness(mdp, critical, ~ended, asked) is not None  # other leaves: other landmarks
            assert constrictiveness(mdp, critical, ended, asked) == wanted
