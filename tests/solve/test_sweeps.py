"""Value iteration stands in where equations cannot be solved: slower, but what it proves holds."""

from __future__ import annotations

from math import inf
from random import Random

import numpy as np
import pytest
from exact import optimum_by_enumeration
from random_models import OBJECTIVES, Table, problem_of, random_policy, random_problem

from ratherthan.solve import Outcome, Sweeps, chain, evaluate, linear, policy_iteration, solve

SLOW: Table = {
    0: {"on": ([(0.001, 1), (0.999, 0)], 1), "off": ([(0.002, 2), (0.998, 0)], 1)},
    1: {"stay": ([(1.0, 1)], 0)},
    2: {"stay": ([(1.0, 2)], 0)},
}


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(40))
def test_values_of_sweeps_lie_within_their_bounds(seed: int, objective: str) -> None:
    problem = random_problem(Random(seed), most_states=6, objective=OBJECTIVES[objective])
    solution = solve(problem, method=Sweeps(most=20_000))
    for value, lower, upper in zip(
        optimum_by_enumeration(problem), *solution.lower.tolist(), *solution.upper.tolist(), strict=True
    ):
        assert lower <= value <= upper
    if "most" not in objective:
        assert solution.outcome is Outcome.CERTIFIED


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(25))
def test_without_any_equation_solver_the_bounds_hold(
    seed: int, objective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (linear, policy_iteration, chain):
        monkeypatch.setattr(module, "solve_chain", lambda *_: None)
    random = Random(seed)
    problem = random_problem(random, most_states=5, objective=OBJECTIVES[objective])
    solution = solve(problem)
    assert solution.engine.split(",")[0] in ("value iteration", "graph search", "one backward pass")
    for value, lower, upper in zip(
        optimum_by_enumeration(problem), *solution.lower.tolist(), *solution.upper.tolist(), strict=True
    ):
        assert lower <= value <= upper
    given = evaluate(problem, random_policy(random, problem.mdp, randomised=True))
    assert (given.policy_lower <= given.policy_values).all()
    assert (given.policy_values <= given.policy_upper).all()


def test_sweeps_that_are_stopped_say_so() -> None:
    problem = problem_of(SLOW, OBJECTIVES["likeliest"], goals=[1])
    solution = solve(problem, method=Sweeps(most=10))
    assert solution.values[0, 0] == 1, "the graph knows better"
    costs = solve(problem_of(SLOW, OBJECTIVES["least cost"], goals=[1]), method=Sweeps(most=10))
    assert costs.lower[0, 0] <= 1000 <= costs.upper[0, 0]


def test_sweeps_leave_rows_that_do_not_arrive() -> None:
    table: Table = {
        0: {"round": ([(1.0, 1)], 1), "pay": ([(1.0, 2)], 1000)},
        1: {"round": ([(1.0, 0)], 1), "pay": ([(1.0, 2)], 1000)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    solution = solve(problem_of(table, OBJECTIVES["least cost"], goals=[2]), method=Sweeps(most=5))
    assert solution.policy_upper[0, 0] < inf
    assert solution.lower[0, 0] <= 1000 <= solution.upper[0, 0]


def test_policy_iteration_is_the_default() -> None:
    problem = problem_of(SLOW, OBJECTIVES["least cost"], goals=[1, 2])
    solution = solve(problem)
    assert solution.engine == "policy iteration"
    assert np.isclose(solution.values[0, 0], 500)
