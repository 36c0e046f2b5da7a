"""The check refuses what is not a bound: each of its parts has a test here in which it fails."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import inf
from random import Random
from typing import Any

import numpy as np
import pytest
from exact import optimum_by_enumeration
from random_models import OBJECTIVES, Table, problem_of, random_problem

from ratherthan.model.objective import ExpectedReward
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, evaluate, optimum, solve
from ratherthan.solve.certify import (
    Parts,
    Tight,
    chain_bounds,
    fits,
    never_falls,
    never_rises,
    nowhere_negative,
    optimum_bound,
    outward,
)
from ratherthan.solve.equations import systems_of
from ratherthan.solve.linear import solve_chain
from ratherthan.solve.policy_iteration import Found, PolicyIteration, iterate_policies
from ratherthan.solve.system import System, rows_of
from ratherthan.solve.task import goal_of, task_of
from ratherthan.solve.wanted import objective_of

WALK: Table = {
    0: {"on": ([(0.9, 1), (0.1, 0)], 1), "leap": ([(0.5, 2), (0.5, 0)], 1)},
    1: {"on": ([(0.9, 2), (0.1, 1)], 1), "back": ([(1.0, 0)], 1)},
    2: {"stay": ([(1.0, 2)], 0)},
}
FREE_ROUND: Table = {
    0: {"round": ([(1.0, 1)], 0), "pay": ([(0.9, 2), (0.1, 0)], 3)},
    1: {"round": ([(1.0, 0)], 0), "pay": ([(0.9, 2), (0.1, 1)], 4)},
    2: {"on": ([(0.5, 3), (0.5, 2)], 1)},
    3: {"stay": ([(1.0, 3)], 0)},
}


def prepared(table: Table, objective: str, **places: Any) -> tuple[System, System, np.ndarray, Found, Problem]:
    """Return the collapsed system of a problem, the whole one, the node of each open state, and the solver's answer."""
    problem = problem_of(table, OBJECTIVES[objective], **places)
    task = task_of(goal_of(problem, objective_of(problem, None)))
    node, core, whole = systems_of(task)
    found = iterate_policies(core, task.goal.maximise, PolicyIteration())
    assert found is not None
    return core, whole, node[task.open], found, problem


def tight(found: Found, values: np.ndarray | None = None) -> Tight:
    parts = Parts(found.solved.high, found.solved.low) if values is None else Parts(values, np.zeros(len(values)))
    return Tight(parts, found.rows, found.solved.inverse)


def test_the_values_with_their_margin_pass_and_a_little_less_does_not() -> None:
    core, whole, _, found, _ = prepared(WALK, "least cost", goals=[2])
    chain = rows_of(core, found.rows)
    lower, upper = chain_bounds(
        chain, Tight(Parts(found.solved.high, found.solved.low), np.arange(2), found.solved.inverse)
    )
    assert lower is not None
    assert upper is not None
    assert never_rises(chain, upper)
    assert never_falls(whole, lower * (1 - 1e-12))
    assert not never_rises(chain, upper * (1 - 1e-9)), "too low for an upper bound"
    assert not never_falls(whole, lower * (1 + 1e-9)), "too high for a lower bound"


def test_a_bound_for_one_policy_is_none_for_all() -> None:
    table: Table = {**WALK, 1: {"on": WALK[1]["on"], "slowly": ([(0.5, 2), (0.5, 1)], 1)}}
    core, whole, _, found, _ = prepared(table, "most cost", goals=[2])
    other = solve_chain(rows_of(core, np.where(found.rows == core.node_to_rows[:-1], found.rows + 1, found.rows - 1)))
    assert other is not None
    assert (other.high < found.solved.high * (1 - 1e-6)).any()
    assert not never_rises(whole, other.high * (1 + 1e-6))


def test_a_vector_below_0_is_no_upper_bound_of_a_largest_value() -> None:
    assert not nowhere_negative(Parts(np.array([-1e-20]), np.zeros(1)), np.zeros(1))
    assert nowhere_negative(Parts(np.array([1e-20]), np.zeros(1)), np.zeros(1))


def test_without_rounding_only_the_exact_solution_fits() -> None:
    table: Table = {
        0: {"on": ([(1.0, 1)], 3), "slip": ([(0.5, 1), (0.5, 0)], -1)},
        1: {"on": ([(1.0, 2)], -4)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    objective = ExpectedReward(goal='"goal"', reward="cost")
    task = task_of(goal_of(problem_of(table, objective, goals=[2]), objective))
    _, whole, _ = systems_of(task)
    assert fits(whole, np.array([-1.0, -4.0]), -1.0)
    assert not fits(whole, np.array([-1.0, -4.0]), 1.0), "slipping is worse"
    assert not fits(whole, np.nextafter([-1.0, -4.0], -np.inf), -1.0)
    assert not fits(whole, np.array([-1.0, np.nextafter(-4.0, 0.0)]), -1.0)
    for value in (np.nan, inf, -inf):
        with np.errstate(invalid="ignore"):
            assert not fits(whole, np.array([value, -4.0]), -1.0)
    inexact = replace(whole, exact=np.zeros(whole.rows, dtype=bool))
    assert not fits(inexact, np.array([-1.0, -4.0]), -1.0)


def test_nan_and_infinity_pass_no_check() -> None:
    core, *_ = prepared(WALK, "least cost", goals=[2])
    with np.errstate(invalid="ignore"):
        for value in (np.nan, inf, -inf):
            x = np.array([value, 1.0])
            assert not never_falls(core, x)
            assert not never_rises(core, x)


def test_margins_are_rounded_outward() -> None:
    values, margin = Parts(np.array([1.0, 1e16]), np.array([1e-17, -0.3])), np.array([1e-20, 0.1])
    lower, upper = outward(values, margin)
    for i in range(2):
        middle = Fraction(float(values.high[i])) + Fraction(float(values.low[i]))
        assert Fraction(float(lower[i])) <= middle - Fraction(float(margin[i]))
        assert Fraction(float(upper[i])) >= middle + Fraction(float(margin[i]))


def test_a_collapse_that_is_none_is_refused() -> None:
    core, whole, node, found, _ = prepared(FREE_ROUND, "least cost", goals=[3])
    assert core.nodes == 2
    assert whole.nodes == 3
    assert optimum_bound(core, whole, node, tight(found), maximise=False) is not None
    for wrong in ([0, 1, 1], [1, 0, 0], [0, 0, 0], [1, 1, 1], [1, 1, 0]):
        bound = optimum_bound(core, whole, np.array(wrong), tight(found), maximise=False)
        assert bound is None or (bound <= found.values[node]).all(), "either refused or still true"
    assert optimum_bound(core, whole, np.array([1, 0, 0]), tight(found), maximise=False) is None


@pytest.mark.parametrize("objective", ["least cost", "most cost", "safest", "least risk"])
@pytest.mark.parametrize("seed", range(40))
def test_whatever_a_solver_says_the_bounds_hold(seed: int, objective: str, monkeypatch: pytest.MonkeyPatch) -> None:
    random = Random(seed)
    problem = random_problem(random, most_states=6, objective=OBJECTIVES[objective])
    best = optimum_by_enumeration(problem)

    def liar(system: System, maximise: bool, settings: PolicyIteration, progress: None, **_: Any) -> Found | None:
        found = iterate_policies(system, maximise, settings, progress)
        assert found is not None
        wrong = np.array([random.choice([0.0, 1.0, 1.0, 1 + 1e-9, 0.9, 2.0]) for _ in range(system.nodes)])
        solved = found.solved._replace(high=found.solved.high * wrong, low=np.zeros(system.nodes))
        rows = np.array(
            [
                random.choice(range(int(a), int(b)))
                for a, b in zip(system.node_to_rows, system.node_to_rows[1:], strict=False)
            ]
        )
        return replace(found, solved=solved, rows=random.choice([rows, found.rows]))

    monkeypatch.setattr(optimum, "iterate_policies", liar)
    solution = solve(problem)
    for value, lower, upper in zip(best, solution.lower[0].tolist(), solution.upper[0].tolist(), strict=True):
        assert lower <= value <= upper


def test_a_policy_that_goes_round_for_nothing_costs_infinitely_much() -> None:
    problem = problem_of(FREE_ROUND, OBJECTIVES["least cost"], goals=[3])
    given = evaluate(problem, Policy(choice=np.array([0, 2, 4, 5])))
    assert given.policy_lower[0].tolist()[:2] == [inf, inf]
    assert given.policy_values[0].tolist()[:2] == [inf, inf]
    assert given.upper[0, 0] < 6


def test_a_solver_that_never_arrives_is_not_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_of(FREE_ROUND, OBJECTIVES["least cost"], goals=[3])
    monkeypatch.setattr(optimum, "first_tied", lambda *_: np.array([0, 2, 4, 5]))
    solution = solve(problem)
    assert solution.upper[0, 0] == inf
    assert solution.outcome is not Outcome.CERTIFIED
