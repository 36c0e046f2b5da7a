"""What an MDP is checked for, also where its rows are summed block by block."""

from __future__ import annotations

import numpy as np
import pytest

from ratherthan.errors import ModelError
from ratherthan.model import checks
from ratherthan.model.mdp import MDP


def rows_of(sums: list[float]) -> MDP:
    """Return a model of one state with a choice of three branches per sum."""
    count = len(sums)
    return MDP(
        state_to_choices=np.array([0, count]),
        choice_to_branches=np.arange(0, 3 * count + 1, 3),
        branch_to_target=np.zeros(3 * count, dtype=np.int32),
        branch_to_probability=np.concatenate([np.array([0.5, 0.25, 0.25]) * total for total in sums]),
        initial=np.array([0]),
    )


@pytest.fixture(params=[1, 2, 1 << 15], autouse=True)
def block(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "BLOCK", request.param)


def test_sums_that_miss_1_by_little_are_mended_and_no_others() -> None:
    mdp = rows_of([1.0, 1.0 + 5e-9, 1.0, 1.0 - 5e-9, 1.0])
    sums = np.add.reduceat(mdp.branch_to_probability, mdp.choice_to_branches[:-1])
    assert np.abs(sums - 1.0).max() <= 2.3e-16 * 7
    assert mdp.branch_to_probability[:3].tolist() == [0.5, 0.25, 0.25]


def test_an_array_that_needs_no_mending_is_taken_over() -> None:
    probability = np.array([0.5, 0.5])
    mdp = MDP(
        state_to_choices=np.array([0, 1]),
        choice_to_branches=np.array([0, 2]),
        branch_to_target=np.array([0, 0]),
        branch_to_probability=probability,
        initial=np.array([0]),
    )
    assert mdp.branch_to_probability is probability
    assert not probability.flags.writeable


def test_every_wrong_sum_is_named_with_its_place() -> None:
    with pytest.raises(ModelError) as caught:
        rows_of([1.0, 0.9, 1.0, 1.0, 1.1])
    assert [fault[:55] for fault in caught.value.faults] == [
        "Probabilities of a choice must sum to 1, got 0.9 at act",
        "Probabilities of a choice must sum to 1, got 1.1 at act",
    ]
    assert caught.value.place["choice"] == 1


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), -0.1, 1.5])
def test_numbers_that_are_no_probabilities_are_named(wrong: float) -> None:
    with pytest.raises(ModelError, match="Probabilities must lie between 0 and 1"):
        rows_of([1.0, wrong * 4, 1.0])


@pytest.mark.parametrize("wrong", [-1, 1, 2**40])
def test_targets_outside_the_model_are_named(wrong: int) -> None:
    with pytest.raises(ModelError, match=f"Targets must lie in 0 … 0, got {wrong}"):
        MDP(
            state_to_choices=np.array([0, 1]),
            choice_to_branches=np.array([0, 2]),
            branch_to_target=np.array([0, wrong]),
            branch_to_probability=np.array([0.5, 0.5]),
            initial=np.array([0]),
        )
