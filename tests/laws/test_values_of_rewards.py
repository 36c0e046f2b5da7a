"""Sums of rewards of either sign and objectives in order equal the best of all policies, tried one by one exactly."""

from __future__ import annotations

import itertools
import os
from dataclasses import replace
from fractions import Fraction
from math import inf, isinf
from random import Random

import numpy as np
import pytest
from exact import level_values, lexicographic_values, policy_level_values
from random_models import GOAL, HAZARD, problem_of, random_policy, random_table

from ratherthan.errors import PropertyError
from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Level,
    Lexicographic,
    Objective,
    ReachAvoid,
    levels_of,
)
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, Solution, evaluate, solve

MODELS = int(os.environ.get("RATHERTHAN_MODELS", "40"))
SINGLE: dict[str, Level] = {
    "most reward": ExpectedReward(goal=GOAL, reward="cost"),
    "least reward": ExpectedReward(goal=GOAL, reward="cost", maximise=False),
    "most discounted": Discounted(reward="cost", discount=0.9),
    "least discounted": Discounted(reward="cost", discount=0.5, maximise=False),
    "most discounted, far": Discounted(reward="cost", discount=0.999999),
}
WIDTH = {"most discounted, far": 1e-5}
"""Where gains and losses of a million steps cancel, their rounding does not."""
REWARDS = {
    "both": [-2, -1, 0, 1, 2, -3.5],
    "gains": [0, 0, 1, 2],
    "losses": [0, -1, -2, -1],
    "odd": [0.1, -0.3, 0, -0.7],
}
ORDERED: dict[str, tuple[Level, ...]] = {
    "safest, then cheapest": (ReachAvoid(goal=GOAL, through=f"!{HAZARD}"), ExpectedCost(goal=GOAL, reward="cost")),
    "likeliest, then fewest steps": (ReachAvoid(goal=GOAL), ExpectedCost(goal=GOAL, reward=None)),
    "least risk, then cheapest": (
        ReachAvoid(goal=HAZARD, maximise=False),
        ExpectedCost(goal=GOAL, reward="cost"),
    ),
    "cheapest, then safest": (ExpectedCost(goal=GOAL, reward="cost"), ReachAvoid(goal=GOAL, through=f"!{HAZARD}")),
    "fewest steps, then most reward": (ExpectedCost(goal=GOAL, reward=None), ExpectedReward(goal=GOAL, reward="cost")),
    "safest, then most discounted": (ReachAvoid(goal=GOAL), Discounted(reward="cost", discount=0.75)),
    "discounted, then cheapest": (
        Discounted(reward="cost", discount=0.5, maximise=False),
        ExpectedCost(goal=GOAL, reward=None),
    ),
    "three": (
        ReachAvoid(goal=GOAL),
        ExpectedCost(goal=GOAL, reward=None),
        ReachAvoid(goal=HAZARD, maximise=False),
    ),
}


def random_rewards(seed: int, rewards: list[float], objective: Objective, *, most: int = 5) -> Problem:
    """Return a random problem with rewards out of a list."""
    random = Random(seed)
    states = random.randint(2, most)
    table = {
        s: {a: (branches, random.choice(rewards)) for a, (branches, _) in row.items()}
        for s, row in random_table(random, states).items()
    }
    special = random.sample(range(states), min(states, random.choice([1, 2, 2])))
    return problem_of(table, objective, goals=special[:1], hazards=special[1:2], start=random.randrange(states))


def inside(
    values: list[Fraction | float], lower: np.ndarray, upper: np.ndarray, *, exact: bool, width: float = 1e-9
) -> None:
    size = max((abs(v) for v in values if not isinf(v)), default=0)
    for value, low, high in zip(values, lower.tolist(), upper.tolist(), strict=True):
        if isinf(value):
            assert low <= value <= high
            assert not exact or low == high
            continue
        assert (Fraction(low) <= value) if low > -inf else not exact
        assert (value <= Fraction(high)) if high < inf else not exact
        assert not exact or high - low <= width * max(abs(value), size / 100)


@pytest.mark.parametrize("objective", SINGLE)
@pytest.mark.parametrize("rewards", REWARDS)
def test_values_are_the_best_of_all_policies(objective: str, rewards: str) -> None:
    open_ = 0
    for seed in range(MODELS):
        problem = random_rewards(seed, REWARDS[rewards], SINGLE[objective])
        solution = solve(problem)
        every = [range(len(problem.mdp.choices_of(s))) for s in range(problem.mdp.states)]
        best = level_values(problem, SINGLE[objective], every, set())
        certified = solution.outcome is Outcome.CERTIFIED
        open_ += not certified
        inside(best, solution.lower[0], solution.upper[0], exact=certified, width=WIDTH.get(objective, 1e-9))
        for value, low, high in zip(best, solution.policy_lower[0], solution.policy_upper[0], strict=True):
            if not isinf(value):
                slack = 1e-9 * max(1, abs(value))
                assert low - slack <= value <= high + slack, "the policy attains it"
    assert open_ <= (MODELS // 10 if rewards == "both" and "reward" in objective else 0)


@pytest.mark.parametrize("objective", SINGLE)
@pytest.mark.parametrize("rewards", REWARDS)
def test_a_given_policy_has_the_value_of_its_chain(objective: str, rewards: str) -> None:
    for seed in range(MODELS // 2):
        problem = random_rewards(seed, REWARDS[rewards], SINGLE[objective])
        mdp = problem.mdp
        policy = random_policy(Random(seed), mdp)
        solution = evaluate(problem, policy)
        own = (policy.choice - mdp.state_to_choices[:-1]).tolist()
        inside(
            policy_level_values(problem, SINGLE[objective], own, set()),
            solution.policy_lower[0],
            solution.policy_upper[0],
            exact=True,
            width=WIDTH.get(objective, 1e-9),
        )


def first_over(problem: Problem, level: Level, values: list[Fraction | float], solution: Solution) -> set[int]:
    over = set(np.flatnonzero(solution.ended).tolist())
    if isinstance(level, ReachAvoid) and level.maximise:
        over |= {s for s, v in enumerate(values) if v == 0}
    return over


@pytest.mark.parametrize("objective", ORDERED)
def test_levels_are_the_best_of_what_the_levels_before_leave(objective: str) -> None:
    levels = ORDERED[objective]
    signed = objective == "fewest steps, then most reward" or "discounted" in objective
    for seed in range(MODELS):
        rewards = REWARDS["both"] if signed else [0, 1, 1, 2]
        problem = random_rewards(seed, rewards, Lexicographic(levels=levels))
        mdp = problem.mdp
        try:
            solution = solve(problem)
        except PropertyError:
            assert_not_attained(problem, levels)
            continue
        assert solution.objectives == levels == levels_of(problem.objective)
        best, permitted = lexicographic_values(problem, levels)
        for k in range(len(levels)):
            certified = solution.outcome is Outcome.CERTIFIED
            inside(best[k], solution.lower[k], solution.upper[k], exact=certified)
        over = first_over(problem, levels[0], best[0], solution)
        own = (solution.policy.choice - mdp.state_to_choices[:-1]).tolist()
        reached = [
            policy_level_values(problem, level, own, set() if k == 0 else over) for k, level in enumerate(levels)
        ]
        for k in range(len(levels)):
            inside(reached[k], solution.policy_lower[k], solution.policy_upper[k], exact=True)
        assert equal(reached[0], best[0]), "the first level is attained whatever comes after"
        attainable = any(
            all(
                equal(policy_level_values(problem, level, choices, set() if k == 0 else over), best[k])
                for k, level in enumerate(levels)
            )
            for choices in itertools.product(*permitted)
        )
        if attainable:
            assert all(map(equal, reached, best)), "all levels are attained where one policy can"


def assert_not_attained(problem: Problem, levels: tuple[Level, ...]) -> None:
    """Check that no policy attains all levels: a discounted sum may be better the later the run ends."""
    assert isinstance(levels[1], Discounted)
    best, permitted = lexicographic_values(problem, levels)
    lost = {s for s, value in enumerate(best[0]) if value == 0}
    over = lost | set(np.flatnonzero(problem.mdp.labels["goal"]).tolist())
    assert not any(
        all(
            equal(policy_level_values(problem, level, choices, set() if k == 0 else over), best[k])
            for k, level in enumerate(levels)
        )
        for choices in itertools.product(*permitted)
    )


def equal(one: list[Fraction | float], other: list[Fraction | float]) -> bool:
    return all(
        x == y or (not isinf(x) and not isinf(y) and abs(x - y) <= 1e-9 * max(1, abs(y)))
        for x, y in zip(one, other, strict=True)
    )


@pytest.mark.parametrize("objective", ORDERED)
def test_a_given_policy_is_evaluated_at_every_level(objective: str) -> None:
    levels = ORDERED[objective]
    for seed in range(MODELS // 2):
        problem = random_rewards(seed, [0, 1, 1, 2], Lexicographic(levels=levels))
        mdp = problem.mdp
        policy = random_policy(Random(seed), mdp)
        try:
            solution = evaluate(problem, policy)
        except PropertyError:
            assert_not_attained(problem, levels)
            continue
        best, _ = lexicographic_values(problem, levels)
        over = first_over(problem, levels[0], best[0], solution)
        own = (policy.choice - mdp.state_to_choices[:-1]).tolist()
        for k, level in enumerate(levels):
            values = policy_level_values(problem, level, own, set() if k == 0 else over)
            inside(values, solution.policy_lower[k], solution.policy_upper[k], exact=True)


@pytest.mark.parametrize("seed", range(40))
def test_turning_round_rewards_and_direction_turns_round_the_values(seed: int) -> None:
    for level in SINGLE.values():
        problem = random_rewards(seed, REWARDS["both"], level)
        reward = problem.mdp.rewards["cost"]
        opposite = replace(problem.mdp, rewards={"cost": replace(reward, choice=0.0 - reward.choice)})
        one = solve(problem)
        other = solve(replace(problem, mdp=opposite, objective=replace(level, maximise=not level.maximise)))
        assert (one.lower == -other.upper).all()
        assert (one.upper == -other.lower).all()
        assert (one.policy.choice == other.policy.choice).all()


@pytest.mark.parametrize("objective", ["most reward", "least reward"])
def test_a_potential_moves_every_value_by_its_height(objective: str) -> None:
    """A reward of φ(t) - φ(s) for going from s to t adds up to -φ(s) on every way to a goal, where φ is 0."""
    for seed in range(MODELS):
        random = Random(seed)
        problem = random_rewards(seed, REWARDS["losses" if seed % 2 else "both"], SINGLE[objective], most=7)
        mdp = problem.mdp
        height = np.where(mdp.labels["goal"], 0.0, [random.choice([0.0, 1.0, -2.0, 0.1]) for _ in range(mdp.states)])
        own = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
        origin = np.repeat(own, np.diff(mdp.choice_to_branches))
        steps = height[mdp.branch_to_target] - height[origin]
        moved = replace(mdp, rewards={"cost": replace(mdp.rewards["cost"], branch=steps)})
        one, other = solve(problem), solve(replace(problem, mdp=moved))
        slack = 1e-9 * (1.0 + float(np.abs(steps).max()))
        finite = np.isfinite(one.values[0])
        if one.outcome is Outcome.CERTIFIED and other.outcome is Outcome.CERTIFIED:
            assert (one.values[0][~finite] == other.values[0][~finite]).all()
            assert np.allclose(one.values[0][finite], (other.values[0] + height)[finite], rtol=1e-9, atol=slack)
        with np.errstate(invalid="ignore"):
            assert not (other.lower[0] + height - one.upper[0] > slack).any()
            assert not (one.lower[0] - other.upper[0] - height > slack).any()


@pytest.mark.parametrize("objective", SINGLE)
def test_scaling_rewards_scales_the_values(objective: str) -> None:
    for seed in range(MODELS // 2):
        problem = random_rewards(seed, REWARDS["odd"], SINGLE[objective])
        reward = problem.mdp.rewards["cost"]
        eightfold = replace(problem.mdp, rewards={"cost": replace(reward, choice=8.0 * reward.choice)})
        one, eight = solve(problem), solve(replace(problem, mdp=eightfold))
        assert (8.0 * one.values == eight.values).all() or np.allclose(8.0 * one.values, eight.values, rtol=1e-12)
        assert (one.policy.choice == eight.policy.choice).all()
