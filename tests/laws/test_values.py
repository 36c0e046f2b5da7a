"""Values equal the best of all policies, tried one by one in exact arithmetic, and lie inside their bounds."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import inf, isinf
from random import Random

import numpy as np
import pytest
from exact import chain_values, optimum_by_enumeration, rows_of
from random_models import OBJECTIVES, Table, problem_of, random_policy, random_problem

from ratherthan.model.objective import ExpectedCost
from ratherthan.solve import Outcome, Solution, evaluate, solve


def inside(values: list[Fraction | float], lower: np.ndarray, upper: np.ndarray, *, width: float = 1e-9) -> None:
    for value, low, high in zip(values, lower.tolist(), upper.tolist(), strict=True):
        if isinf(value):
            assert low == high == inf
            continue
        assert not isinf(low)
        assert not isinf(high)
        assert Fraction(low) <= value <= Fraction(high)
        assert high - low <= width * abs(value), "bounds are useful"


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(120))
def test_values_are_the_best_of_all_policies(seed: int, objective: str) -> None:
    problem = random_problem(Random(seed), most_states=6, objective=OBJECTIVES[objective])
    solution = solve(problem)
    best = optimum_by_enumeration(problem)
    assert solution.outcome is Outcome.CERTIFIED
    inside(best, solution.lower[0], solution.upper[0])
    inside(best, solution.policy_lower[0], solution.policy_upper[0])  # the policy attains it


def followed(solution: Solution) -> list[Fraction | float]:
    """Return the exact value of following the solution's policy."""
    problem, mdp = solution.problem, solution.problem.mdp
    rows, weights = rows_of(problem), solution.policy.weights(mdp)
    cost = isinstance(problem.objective, ExpectedCost)
    ended = solution.ended
    targets = solution.hazard if not cost and not problem.objective.maximise else solution.goal
    chain = []
    for s in range(mdp.states):
        if ended[s]:
            chain.append(None)
            continue
        mixed: dict[int, Fraction] = {}
        paid = Fraction(0)
        for (chances, price), c in zip(rows[s], mdp.choices_of(s), strict=True):
            weight = Fraction(float(weights[c]))
            paid += weight * price
            for t, p in chances.items():
                mixed[t] = mixed.get(t, Fraction(0)) + weight * p
        chain.append(({t: p for t, p in mixed.items() if p}, paid))
    return chain_values(chain, np.flatnonzero(targets).tolist(), cost=cost)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("randomised", [False, True])
@pytest.mark.parametrize("seed", range(60))
def test_a_given_policy_has_the_value_of_its_chain(seed: int, objective: str, randomised: bool) -> None:
    random = Random(seed)
    problem = random_problem(random, most_states=7, objective=OBJECTIVES[objective])
    solution = evaluate(problem, random_policy(random, problem.mdp, randomised=randomised))
    inside(followed(solution), solution.policy_lower[0], solution.policy_upper[0])


@pytest.mark.parametrize("escape", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("objective", ["least cost", "most cost", "likeliest", "safest", "least risk"])
def test_bounds_hold_where_a_model_mixes_slowly(escape: float, objective: str) -> None:
    table: Table = {
        0: {"a": ([(1 - escape, 0), (escape, 1)], 1), "b": ([(1 - escape, 0), (escape / 2, 1), (escape / 2, 2)], 1)},
        1: {"a": ([(1 - escape, 0), (escape, 3)], 1), "b": ([(0.5, 1), (0.5 - escape, 0), (escape, 3)], 2)},
        2: {"a": ([(0.5, 3), (0.5, 4)], 1)},
        3: {"a": ([(1.0, 3)], 0)},
        4: {"a": ([(1.0, 4)], 0)},
    }
    problem = problem_of(table, OBJECTIVES[objective], goals=[3], hazards=[4])
    solution = solve(problem)
    best = optimum_by_enumeration(problem)
    inside(best, solution.lower[0], solution.upper[0], width=1e-7)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_costs_of_very_different_size_do_not_ruin_the_bounds(scale: float) -> None:
    table: Table = {
        0: {"a": ([(0.9, 1), (0.1, 0)], 1e9 * scale), "b": ([(0.5, 2), (0.5, 0)], 1e-9 * scale)},
        1: {"a": ([(1.0, 2)], 0), "b": ([(1.0, 3)], 1e-9 * scale)},
        2: {"a": ([(1.0, 1)], 0), "b": ([(0.25, 3), (0.75, 2)], 1e-3 * scale)},
        3: {"a": ([(1.0, 3)], 0)},
    }
    problem = problem_of(table, OBJECTIVES["least cost"], goals=[3])
    solution = solve(problem)
    inside(optimum_by_enumeration(problem), solution.lower[0], solution.upper[0])


def test_of_several_best_choices_the_first_listed_is_taken() -> None:
    table: Table = {
        0: {"z": ([(1.0, 1)], 1), "a": ([(1.0, 2)], 2), "m": ([(1.0, 3)], 3)},
        1: {"on": ([(1.0, 2)], 1)},
        2: {"on": ([(1.0, 3)], 1)},
        3: {"stay": ([(1.0, 3)], 0)},
    }
    assert solve(problem_of(table, OBJECTIVES["least cost"], goals=[3])).policy.choice[0] == 0
    swapped = {**table, 0: dict(reversed(table[0].items()))}
    assert solve(problem_of(swapped, OBJECTIVES["least cost"], goals=[3])).policy.choice[0] == 0


def test_a_choice_that_goes_round_for_nothing_is_not_taken_though_it_is_listed_first() -> None:
    table: Table = {
        0: {"round": ([(1.0, 1)], 0), "pay": ([(1.0, 2)], 3)},
        1: {"round": ([(1.0, 0)], 0), "pay": ([(1.0, 2)], 3)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    solution = solve(problem_of(table, OBJECTIVES["least cost"], goals=[2]))
    assert solution.values[0].tolist() == [3, 3, 0]
    assert solution.policy_upper[0, 0] < inf


@pytest.mark.parametrize("seed", range(60))
def test_scaling_costs_scales_the_values(seed: int) -> None:
    problem = random_problem(Random(seed), objective=OBJECTIVES["least cost"])
    mdp = problem.mdp
    reward = mdp.rewards["cost"]
    eightfold = replace(mdp, rewards={"cost": replace(reward, choice=8.0 * reward.choice)})
    one, eight = solve(problem), solve(replace(problem, mdp=eightfold))
    assert np.allclose(8.0 * one.values[0][np.isfinite(one.values[0])], eight.values[0][np.isfinite(one.values[0])])
    assert (one.policy.choice == eight.policy.choice).all()


def test_nobody_drives_east_in_order_to_slip_south() -> None:
    """Everything arrives with probability 1; the layers follow the likely branches."""
    slip = 0.02
    table: Table = {
        0: {"east": ([(1 - slip, 1), (slip, 2)], 1), "south": ([(1 - slip, 2), (slip, 1)], 1)},
        1: {"west": ([(1.0, 0)], 1)},
        2: {"north": ([(1.0, 0)], 1), "south": ([(1 - slip, 3), (slip, 2)], 1)},
        3: {"stay": ([(1.0, 3)], 0)},
    }
    problem = problem_of(table, OBJECTIVES["likeliest"], goals=[3])
    policy = solve(problem).policy
    assert [problem.mdp.action_name(int(policy.choice[s])) for s in (0, 2)] == ["south", "south"]
