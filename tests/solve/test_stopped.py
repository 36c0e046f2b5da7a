"""A solver that a limit stops, at whatever moment, leaves bounds that are true."""

from __future__ import annotations

import itertools
from dataclasses import replace
from fractions import Fraction
from math import inf
from random import Random

import numpy as np
import pytest
from exact import optimum_by_enumeration
from random_models import LEVELS, MISSIONS, OBJECTIVES, SIGNED, random_policy, random_problem, random_rich_problem

import ratherthan as rt
from benchmarks.models import slippery_map
from ratherthan.model import watch
from ratherthan.solve import PolicyIteration, Sweeps

METHODS = {"chosen by the program": None, "policy iteration": PolicyIteration(), "value iteration": Sweeps(most=40)}


class Clock:
    """A clock that goes on by a second each time that somebody looks at it."""

    def __init__(self) -> None:
        self.now = 0.0

    def monotonic(self) -> float:
        self.now += 1.0
        return self.now


def stopped_at(monkeypatch, moment, solve):
    """Return what is known when a limit is reached at the so-and-so-many-th look, and whether it was reached at all."""
    with monkeypatch.context() as patched:
        patched.setattr(watch, "time", Clock())
        try:
            with rt.watching(rt.Limits(seconds=float(moment))):
                return solve(), False
        except rt.LimitError as error:
            stopped = error
    assert stopped.limit == "time"
    assert stopped.message.startswith(f"The time limit of {moment} s was reached while ")
    if not isinstance(stopped, rt.StoppedError):
        return None, True  # before there was anything to solve
    assert stopped.solution.outcome is rt.Outcome.STOPPED
    assert not np.isnan(stopped.solution.values).any()
    return stopped.solution, True


def moments(monkeypatch, solve):
    """Yield the solution at every moment at which a limit may stop a solver."""
    for moment in itertools.count(2):
        solution, stopped = stopped_at(monkeypatch, moment, solve)
        if not stopped:
            return
        if solution is not None:
            yield solution


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(8))
def test_bounds_are_true_at_every_moment(monkeypatch, seed, objective, method):
    problem = random_problem(Random(seed), most_states=6, objective=OBJECTIVES[objective])
    best = optimum_by_enumeration(problem)
    seen = 0
    for solution in moments(monkeypatch, lambda: rt.solve(problem, method=METHODS[method])):
        seen += 1
        for value, low, high in zip(best, solution.lower[0].tolist(), solution.upper[0].tolist(), strict=True):
            assert low <= high
            assert low == -inf or (low <= value if value == inf else Fraction(low) <= value if low < inf else False)
            assert high == inf or (value < inf and Fraction(high) >= value)
    assert seen


@pytest.mark.parametrize("objective", {**SIGNED, **MISSIONS, **LEVELS})
@pytest.mark.parametrize("seed", range(3))
def test_bounds_agree_with_those_of_a_solver_that_has_the_time(monkeypatch, seed, objective):
    problem = random_rich_problem(Random(seed), most_states=6, objective={**SIGNED, **MISSIONS, **LEVELS}[objective])
    try:
        whole = rt.solve(problem)
    except rt.PropertyError:
        pytest.skip("levels that no plan attains")
    for solution in moments(monkeypatch, lambda: rt.solve(problem)):
        assert solution.lower.shape == whole.lower.shape
        assert (solution.lower[0] <= whole.upper[0]).all()
        assert (solution.upper[0] >= whole.lower[0]).all()


@pytest.mark.parametrize("method", METHODS)
def test_on_a_map_bounds_are_true_and_narrow_down(monkeypatch, method):
    problem = slippery_map(14)
    start = int(problem.mdp.initial[0])
    whole = rt.solve(problem, method=PolicyIteration())
    widths = []
    for solution in moments(monkeypatch, lambda: rt.solve(problem, method=METHODS[method])):
        assert (solution.lower <= whole.upper).all()
        assert (solution.upper >= whole.lower).all()
        widths.append(float(solution.upper[0, start] - solution.lower[0, start]))
    assert widths[0] == inf
    if method == "policy iteration":
        assert widths[-1] < inf


def test_what_the_graph_decides_is_known_though_nothing_was_swept(monkeypatch):
    """So many steps at least, each of which costs one."""
    problem = slippery_map(14)
    solutions = list(moments(monkeypatch, lambda: rt.solve(problem, method=Sweeps(most=3))))
    start = int(problem.mdp.initial[0])
    assert max(solution.lower[0, start] for solution in solutions) >= 20.0


@pytest.mark.parametrize("seed", range(6))
def test_of_a_policy_that_was_not_judged_to_the_end_nothing_is_claimed(monkeypatch, seed):
    problem = random_problem(Random(seed), most_states=6, objective=OBJECTIVES["least cost"])
    policy = random_policy(Random(seed), problem.mdp)
    whole = rt.evaluate(problem, policy)
    for solution in moments(monkeypatch, lambda: rt.evaluate(problem, policy)):
        assert solution.given
        assert solution.policy is policy
        assert (solution.policy_lower <= whole.policy_lower).all()
        assert (solution.policy_upper >= whole.policy_upper).all()
        assert (solution.lower <= whole.upper).all()
        assert (solution.upper >= whole.lower).all()


def test_a_discounted_sum_is_bounded_before_anything_is_solved(monkeypatch):
    problem = random_rich_problem(Random(4), most_states=6, objective=SIGNED["most in the long run"])
    whole = rt.solve(problem)
    solution = next(moments(monkeypatch, lambda: rt.solve(problem)))
    later = list(moments(monkeypatch, lambda: rt.solve(problem)))[-1]
    assert (solution.lower <= whole.upper).all()
    assert np.isfinite(later.lower).all()
    assert np.isfinite(later.upper).all()


def test_the_message_says_what_is_proved_at_the_start(monkeypatch):
    problem = slippery_map(14)
    problem = replace(problem, mdp=replace(problem.mdp, initial=problem.mdp.initial[:1]))
    said = []
    for moment in itertools.count(2):
        with monkeypatch.context() as patched:
            patched.setattr(watch, "time", Clock())
            try:
                with rt.watching(rt.Limits(seconds=float(moment))):
                    rt.solve(problem, method=PolicyIteration())
            except rt.StoppedError as error:
                said.append(error.message)
            else:
                break
    assert said[0].endswith('Proved so far: R{"steps"}min=? [F "goal"] at the start is at least 0.')
    assert "Proved so far: " in said[-1]
    assert " at the start is at least " in said[-1]
    assert " and at most " in said[-1]


def test_a_stopped_solver_is_a_limit_and_an_unsolved_problem():
    assert issubclass(rt.StoppedError, rt.LimitError)
    assert issubclass(rt.StoppedError, rt.UnsolvedError)
