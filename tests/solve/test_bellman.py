"""Impacts and action values with their bounds, against exact arithmetic."""

from __future__ import annotations

import sys
from fractions import Fraction
from math import inf, isinf
from random import Random

import numpy as np
import pytest
from exact import optimum_by_enumeration, rows_of
from random_models import OBJECTIVES, Table, problem_of, random_problem

from ratherthan.model.index import index_of
from ratherthan.model.mdp import MDP
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.policy import Policy
from ratherthan.solve import action_value_bounds, evaluate, impact_bounds, one_step, solve


def mean(chances: dict[int, Fraction], values: list[Fraction | float]) -> Fraction | float:
    return inf if any(isinf(values[t]) for t in chances) else sum(p * values[t] for t, p in chances.items())


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(50))
def test_action_values_and_impacts_lie_within_their_bounds(seed: int, objective: str) -> None:
    problem = random_problem(Random(seed), most_states=6, objective=OBJECTIVES[objective])
    solution, values = solve(problem), optimum_by_enumeration(problem)
    rows = [row for own in rows_of(problem) for row in own]
    q, q_lower, q_upper = action_value_bounds(solution)
    w, w_lower, w_upper = impact_bounds(solution)
    for c, (chances, cost) in enumerate(rows):
        impact = mean(chances, values)
        value = impact + cost if isinstance(problem.objective, ExpectedCost) else impact
        assert w_lower[c] <= impact <= w_upper[c]
        assert q_lower[c] <= value <= q_upper[c]
        assert q_lower[c] <= q[c] <= q_upper[c]
        assert w_lower[c] <= w[c] <= w_upper[c]
        if not isinf(value):
            assert q_upper[c] - q_lower[c] <= 1e-9 * value


def test_infinity_flows_through_one_step() -> None:
    table: Table = {0: {"a": ([(0.5, 0), (0.5, 1)], 1)}, 1: {"a": ([(1.0, 1)], 1)}}
    mdp = problem_of(table, OBJECTIVES["least cost"], goals=[0]).mdp
    assert one_step(mdp, np.array([1.0, inf])).tolist() == [inf, inf]
    assert one_step(mdp, np.array([-inf, inf])).tolist() == [inf, inf]
    assert one_step(mdp, np.array([1.0, -inf])).tolist() == [-inf, -inf]
    assert one_step(mdp, np.array([2.0, 4.0])).tolist() == [3.0, 4.0]


def test_certainty_stays_certain() -> None:
    table: Table = {0: {"a": ([(0.1, 1), (0.2, 2), (0.7, 1)], 0)}, 1: {"a": ([(1.0, 1)], 0)}, 2: {"a": ([(1.0, 1)], 0)}}
    solution = solve(problem_of(table, OBJECTIVES["likeliest"], goals=[1]))
    value, lower, upper = action_value_bounds(solution)
    assert value.tolist() == lower.tolist() == upper.tolist() == [1, 1, 1]


def test_values_of_a_policy_can_be_asked_for() -> None:
    table: Table = {
        0: {"a": ([(1.0, 1)], 1), "b": ([(1.0, 2)], 1)},
        1: {"a": ([(1.0, 2)], 1)},
        2: {"a": ([(1.0, 2)], 0)},
    }
    given = evaluate(problem_of(table, OBJECTIVES["least cost"], goals=[2]), Policy(choice=np.array([0, 2, 3])))
    assert given.policy_values[0].tolist() == [2, 1, 0]
    assert (
        action_value_bounds(given)[0].tolist() == action_value_bounds(given, of_policy=True)[0].tolist() == [2, 1, 1, 0]
    )
    assert impact_bounds(given, of_policy=True)[0].tolist() == [1, 0, 0, 0]


@pytest.mark.kernels
@pytest.mark.parametrize("below_wins", [False, True])
def test_means_of_many_branches_are_those_of_few(monkeypatch: pytest.MonkeyPatch, below_wins: bool) -> None:
    room, rng = sys.modules["ratherthan.solve.bellman"], np.random.default_rng(3)
    monkeypatch.setattr(room, "is_compiled", lambda _: True)
    for _ in range(100):
        states = int(rng.integers(1, 9))
        choices = rng.integers(1, 4, states)
        branches = rng.integers(1, 4, int(choices.sum()))
        mdp = MDP(
            state_to_choices=np.concatenate([[0], np.cumsum(choices)]),
            choice_to_branches=np.concatenate([[0], np.cumsum(branches)]),
            branch_to_target=rng.integers(0, states, int(branches.sum())),
            branch_to_probability=np.concatenate([rng.dirichlet(np.ones(n)) for n in branches]),
            initial=np.array([0]),
        )
        values = rng.normal(size=states)
        values[rng.random(states) < 0.2] = np.inf
        values[rng.random(states) < 0.2] = -np.inf
        found = []
        for many in (10**9, 0):
            monkeypatch.setattr(room, "MANY", many)
            found.append(room._mean(mdp, index_of(mdp), values, below_wins=below_wins))
        for few, lots in zip(*found, strict=True):
            np.testing.assert_allclose(few, lots, rtol=1e-13, atol=1e-15)
