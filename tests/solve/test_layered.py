"""A graph without cycles needs one backward pass: its bounds hold exactly, and are found where equations are not solved."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import numpy as np
import pytest
from exact import optimum_by_enumeration
from random_models import GOAL, HAZARD, OBJECTIVES, Table, problem_of

from ratherthan.model.objective import Discounted, ExpectedReward, Mission, ReachAvoid
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, evaluate, solve
from ratherthan.solve.layered import layered_bounds
from ratherthan.solve.system import System

PLAIN = {name: OBJECTIVES[name] for name in ("least cost", "most cost", "likeliest", "least risk")}


def forward_only(random: Random, states: int = 6) -> Table:
    """Return a model whose steps lead to later states only, the last two of which end it."""
    table: Table = {}
    for s in range(states - 2):
        table[s] = {}
        for number in range(random.choice([1, 2, 3])):
            targets = random.sample(range(s + 1, states), k=min(random.choice([1, 2, 3]), states - s - 1))
            shares = [random.choice([1, 2, 3, 1e-7]) for _ in targets]
            row = [(share / sum(shares), target) for share, target in zip(shares, targets, strict=True)]
            table[s][f"a{number}"] = (row, random.choice([0, 1, 0.1, 3]))
    table[states - 2] = {"stay": ([(1.0, states - 2)], 0)}
    table[states - 1] = {"stay": ([(1.0, states - 1)], 0)}
    return table


@pytest.mark.parametrize("objective", PLAIN)
@pytest.mark.parametrize("seed", range(12))
def test_the_bounds_of_one_pass_hold_exactly(seed: int, objective: str) -> None:
    problem = problem_of(forward_only(Random(seed)), PLAIN[objective], goals=[4], hazards=[5])
    solution = solve(problem)
    assert solution.outcome is Outcome.CERTIFIED
    assert solution.engine in ("one backward pass", "graph search")
    for value, lower, upper in zip(
        optimum_by_enumeration(problem), *solution.lower.tolist(), *solution.upper.tolist(), strict=True
    ):
        assert lower <= value <= upper
    assert (solution.policy_lower <= solution.upper).all()
    assert (solution.policy_upper >= solution.lower).all()


def line(steps: int) -> Problem:
    table: Table = {
        0: {"try": ([(0.3, 1), (0.7, 0)], 1), "leap": ([(0.4, 1), (0.1, 2), (0.5, 0)], 1)},
        1: {"stay": ([(1.0, 1)], 0)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    return problem_of(table, Mission(formula=f"F<={steps} {GOAL}"), goals=[1], hazards=[2])


@pytest.mark.parametrize("steps", [1, 40, 200])
def test_a_chance_within_many_steps_is_proved_to_its_last_digits(steps: int) -> None:
    """To try surely misses 0.7 ** steps, which vanishes beside 1 after some hundred steps."""
    solution = solve(line(steps))
    assert solution.outcome is Outcome.CERTIFIED
    policy = evaluate(line(steps), Policy(choice=np.array([0, 2, 3])))
    for found, chance in ((policy.policy_lower, 0.3), (policy.policy_upper, 0.3)):
        exact = 1 - (1 - Fraction(chance)) ** steps
        start = int(solution.problem.mdp.initial[0])
        assert abs(Fraction(float(found[0, start])) - exact) <= Fraction(1, 10**12)
    assert policy.outcome is Outcome.CERTIFIED
    assert solution.upper[0, start] >= policy.policy_lower[0, start]


def test_a_cycle_is_told_from_none() -> None:
    def system(target: list[int]) -> System:
        ends = np.arange(len(target) + 1)
        ones = np.ones(len(target))
        return System(
            node_to_rows=ends,
            row_to_branches=ends,
            target=np.array(target),
            probability=ones,
            cost=ones,
            source=ends[:-1],
        )

    found = layered_bounds(system([1, 2, 3]), maximise=True)
    assert found is not None
    assert found.values.tolist() == pytest.approx([3, 2, 1])
    assert layered_bounds(system([1, 2, 0]), maximise=True) is None
    assert layered_bounds(system([1, 1, 3]), maximise=True) is None


def test_signed_whole_numbers_are_exact() -> None:
    table: Table = {
        0: {"a": ([(1.0, 1)], 3), "b": ([(1.0, 2)], -1)},
        1: {"a": ([(1.0, 2)], -3)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    solution = solve(problem_of(table, ExpectedReward(goal=GOAL, reward="cost"), goals=[2]))
    assert solution.lower.tolist() == solution.upper.tolist() == [[0, -3, 0]]


def test_a_value_that_a_choice_has_exactly_is_exact_whatever_was_rounded_elsewhere() -> None:
    """The other choice of state 1 leads back, and rests on what was rounded; it is worse."""
    table: Table = {
        0: {"bad": ([(1 - 1e-9, 2), (1e-9, 3)], -1), "on": ([(1.0, 1)], 1)},
        1: {"end": ([(1.0, 2)], 0), "back": ([(1.0, 0)], -1)},
        2: {"stay": ([(1.0, 2)], 0)},
        3: {"stay": ([(1.0, 3)], 0)},
    }
    solution = solve(problem_of(table, Discounted(reward="cost", discount=0.9), goals=[2]))
    assert solution.lower[0, 1] == solution.upper[0, 1] == 0


def test_the_pass_is_of_no_use_for_a_risk_that_comes_again() -> None:
    table: Table = {
        0: {"round": ([(0.5, 1), (0.5, 0)], 1)},
        1: {"round": ([(0.5, 0), (0.25, 2), (0.25, 3)], 1)},
        2: {"stay": ([(1.0, 2)], 0)},
        3: {"stay": ([(1.0, 3)], 0)},
    }
    solution = solve(problem_of(table, ReachAvoid(goal=GOAL, through=f"!{HAZARD}"), goals=[2], hazards=[3]))
    assert solution.engine == "policy iteration"
    assert solution.values[0, 0] == pytest.approx(0.5)
