"""Bounds by sweeps: every way of finding candidates gives the same, slow mixing included, and a wrong candidate is refused."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import numpy as np
import pytest
from random_models import OBJECTIVES, problem_of, random_policy, random_problem

from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import ExpectedCost, ReachAvoid
from ratherthan.model.problem import Problem
from ratherthan.verify import candidates, sweeps
from ratherthan.verify.aims import frame_of
from ratherthan.verify.candidates import Budget
from ratherthan.verify.frame import Frame
from ratherthan.verify.values import following, optimum

EXACT, SWEPT = Budget(exact=1000), Budget(exact=0)


def frame(problem: Problem) -> Frame:
    assert problem.objective is not None
    return frame_of(problem, problem.objective)


def larger_problem(seed: int) -> Problem:
    random = Random(seed)
    return random_problem(random, most_states=40, objective=list(OBJECTIVES.values())[seed % len(OBJECTIVES)])


def same(problem: Problem, share: float) -> None:
    """Assert that swept bounds contain the exact values and are near to each other."""
    exact, swept = optimum(frame(problem), EXACT), optimum(frame(problem), SWEPT)
    assert (swept.lower <= exact.upper).all()
    assert (exact.lower <= swept.upper).all()
    finite = np.isfinite(exact.upper)
    assert (swept.lower[~finite] == np.inf).all()
    assert (swept.upper[finite] - swept.lower[finite] <= share * exact.upper[finite]).all()


@pytest.mark.parametrize("seed", range(30))
def test_dense_solves_agree_with_fractions(seed: int) -> None:
    same(larger_problem(seed), 1e-10)


@pytest.mark.parametrize("seed", range(30))
def test_sparse_solves_agree_with_fractions(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(candidates, "DENSE", 0)
    same(larger_problem(seed), 1e-10)


@pytest.mark.parametrize("seed", range(30))
def test_value_iteration_agrees_with_fractions(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(candidates, "DENSE", 0)
    monkeypatch.setattr(candidates, "EASY", -1)
    same(larger_problem(seed), 1e-7)


@pytest.mark.parametrize("seed", range(30))
def test_randomised_policies_agree_with_fractions(seed: int) -> None:
    problem = larger_problem(seed)
    weight = random_policy(Random(seed), problem.mdp, randomised=True).weights(problem.mdp)
    exact, swept = (following(frame(problem), weight, budget) for budget in (EXACT, SWEPT))
    assert (swept.lower <= exact.upper).all()
    assert (exact.lower <= swept.upper).all()
    finite = np.isfinite(exact.upper)
    assert (swept.upper[finite] - swept.lower[finite] <= 1e-10 * exact.upper[finite]).all()


@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])
@pytest.mark.parametrize("escape", [1e-3, 1e-6, 1e-9, 1e-12])
def test_slow_mixing_is_no_matter(escape: float, budget: Budget) -> None:
    """Two states that mostly lead to each other: the cost until the escape is 1 / escape."""
    away = {"go": ([(1 - escape, 1), (escape, 2)], 1.0)}
    table = {0: away, 1: {"back": ([(1.0, 0)], 0.0)}, 2: {"stay": ([(1.0, 2)], 0.0)}}
    bounds = optimum(frame(problem_of(table, OBJECTIVES["least cost"], goals=[2])), budget)[0]
    leaving, staying = Fraction(escape), Fraction(1 - escape)
    exact = (leaving + staying) / leaving
    assert Fraction(bounds.lower) <= exact <= Fraction(bounds.upper)
    assert bounds.upper - bounds.lower <= 1e-12 * float(exact)


@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])
def test_going_round_for_nothing_is_not_cheap(budget: Budget) -> None:
    """Waiting costs nothing, getting on 3: the least cost of a policy that arrives is 3, not 0."""
    table = {
        0: {"wait": ([(1.0, 1)], 0.0), "go": ([(1.0, 2)], 5.0)},
        1: {"wait": ([(1.0, 0)], 0.0), "go": ([(0.5, 2), (0.5, 1)], 1.5)},
        2: {"stay": ([(1.0, 2)], 0.0)},
    }
    band = optimum(frame(problem_of(table, OBJECTIVES["least cost"], goals=[2])), budget)
    assert band[0].lower == pytest.approx(3, rel=1e-14)
    assert band[0].upper == pytest.approx(3, rel=1e-14)


@pytest.mark.parametrize("factor", [1 + 1e-9, 1.5], ids=["a little", "much"])
@pytest.mark.parametrize("wanted", ["least cost", "most cost", "likeliest", "least risk"])
def test_no_wrong_candidate_is_proved(wanted: str, factor: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is offered as a bound from below is refused if it is too high, and the other way round."""
    table = {
        0: {"a": ([(0.5, 1), (0.3, 2), (0.2, 3)], 1.0), "b": ([(0.9, 1), (0.1, 3)], 2.0)},
        1: {"a": ([(0.6, 0), (0.4, 2)], 1.0), "b": ([(0.5, 1), (0.2, 2), (0.3, 3)], 2.0)},
        2: {"stay": ([(1.0, 2)], 0.0)},
        3: {"stay": ([(1.0, 3)], 0.0)},
    }
    cost = "cost" in wanted
    problem = problem_of(table, OBJECTIVES[wanted], goals=[2, 3] if cost else [2], hazards=[3])
    exact = optimum(frame(problem), EXACT)
    offers, real = [], sweeps.search

    def twisted(core, budget, judge):
        def swapped(values, rows):
            middle = values[0]
            for turn in (factor, 1 / factor):
                offers.append(judge((middle * turn, np.zeros_like(middle)), rows))
            return True, True

        real(core, budget, swapped)

    monkeypatch.setattr(sweeps, "search", twisted)
    band = optimum(frame(problem), SWEPT)
    assert offers
    assert (band.lower[:2] <= exact.lower[:2]).all()
    assert (band.upper[:2] >= exact.upper[:2]).all()


def test_a_policy_that_never_arrives_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Zero does not rise along a costless circle, yet it is no bound: the policy does not leave the open states."""
    table = {
        0: {"wait": ([(1.0, 1)], 0.0), "go": ([(1.0, 2)], 1.0)},
        1: {"back": ([(1.0, 0)], 1e-300)},
        2: {"stay": ([(1.0, 2)], 0.0)},
    }
    asked = []

    def foolish(core, budget, judge):
        rows = core.begin.copy()  # the first row of each node: round and round
        asked.append(judge((np.zeros(core.count) + 1e-200, np.zeros(core.count)), rows))

    monkeypatch.setattr(sweeps, "search", foolish)
    band = optimum(frame(problem_of(table, OBJECTIVES["least cost"], goals=[2])), SWEPT)
    assert asked == [(False, False)]
    assert band[0].upper == np.inf


def grid(side: int) -> MDP:
    """Return a square to be crossed from one corner to the other; every move slips sideways one time in five."""
    number = np.arange(side * side).reshape(side, side)
    padded = np.pad(number, 1, mode="edge")
    ways = [padded[1:-1, 2:], padded[2:, 1:-1], padded[1:-1, :-2], padded[:-2, 1:-1]]
    rows = [np.stack([ways[k], ways[(k + 1) % 4], ways[k - 1]], axis=-1) for k in range(4)]
    targets = np.stack(rows, axis=2).reshape(-1)
    choices = 4 * side * side
    return MDP(
        state_to_choices=np.arange(0, choices + 1, 4),
        choice_to_branches=np.arange(0, 3 * choices + 1, 3),
        branch_to_target=targets,
        branch_to_probability=np.tile([0.8, 0.1, 0.1], choices),
        choice_to_action=np.tile(np.arange(4), side * side),
        actions=("east", "south", "west", "north"),
        labels={"goal": np.arange(side * side) == side * side - 1, "hazard": np.arange(side * side) == side - 1},
        rewards={"cost": Reward(choice=np.ones(choices))},
        initial=np.array([0]),
    )


def test_large_systems_have_narrow_bounds() -> None:
    mdp = grid(60)
    cost = optimum(frame(Problem(mdp=mdp, objective=ExpectedCost(goal='"goal"', reward="cost"))), SWEPT)
    assert (cost.upper - cost.lower <= 1e-9 * cost.upper).all()
    assert 118 / 0.9 < cost[0].lower < 118 / 0.7
    risk = ReachAvoid(goal='"hazard"', through='!"goal"', maximise=True)
    chance = optimum(frame(Problem(mdp=mdp, objective=risk)), SWEPT)
    assert (chance.upper - chance.lower <= 1e-9).all()


def test_what_would_take_too_long_is_left_open() -> None:
    mdp = grid(30)
    problem = Problem(mdp=mdp, objective=ExpectedCost(goal='"goal"', reward="cost"))
    band = optimum(frame(problem), Budget(exact=0, sweeps=3, rounds=1, fill=0))
    assert band[0].lower == 0.0
    assert band[0].upper == np.inf
