"""A backend that answers with no numbers, or not at all: another one is asked, and the answer says so."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from random_models import OBJECTIVES, random_problem

import ratherthan as rt
from benchmarks.models import slippery_map
from ratherthan.solve import PolicyIteration, Sweeps, linear, policy_iteration, sparse, sweeps
from ratherthan.solve.linear import Method

BAD = {"NaN": np.nan, "infinity": np.inf, "minus infinity": -np.inf}


def answering(number: float):
    """Return a way to build an inverse that answers with one number for everything."""
    return lambda _: lambda right: np.full_like(right, number)


def solved_by(monkeypatch, *methods: Method) -> None:
    """Let equations be solved by these methods only."""
    for room in (linear, policy_iteration):
        monkeypatch.setattr(room, "methods_for", lambda _: methods)


def broken(system: object) -> None:
    """Fail as SuperLU does where a matrix is singular."""


@pytest.fixture
def town() -> rt.Problem:
    return slippery_map(24)


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("name", ["sparse_lu", "elimination"])
def test_the_next_method_is_asked_and_the_failure_is_named(monkeypatch, town, name, bad):
    monkeypatch.setenv("RATHERTHAN_COMPILE", "never")
    monkeypatch.setattr(linear, "MOST_DENSE", 10)
    whole = rt.solve(town, method=PolicyIteration())
    real, called = (
        (sparse.sparse_lu, "sparse LU") if name == "elimination" else (sparse.elimination, "sparse elimination")
    )
    failing = Method(answering(BAD[bad]), name="the first")
    solved_by(monkeypatch, failing, Method(real, name=called))
    solution = rt.solve(town, method=PolicyIteration())
    assert solution.outcome is rt.Outcome.CERTIFIED
    assert solution.engine == "policy iteration, after the first gave no numbers"
    assert (solution.lower <= whole.upper).all()
    assert (solution.upper >= whole.lower).all()


@pytest.mark.parametrize("bad", BAD)
def test_where_no_equation_solver_gives_numbers_values_are_swept(monkeypatch, town, bad):
    whole = rt.solve(town, method=PolicyIteration())
    solved_by(monkeypatch, Method(answering(BAD[bad])))
    solution = rt.solve(town, method=PolicyIteration())
    assert solution.engine == "value iteration, after policy iteration gave no numbers"
    assert not np.isnan(solution.values).any()
    assert (solution.lower <= whole.upper).all()
    assert (solution.upper >= whole.lower).all()


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("bad", [*BAD, "nothing", "too small", "too large"])
@pytest.mark.parametrize("seed", range(4))
def test_whatever_a_backend_says_no_bound_is_wrong(monkeypatch, seed, bad, objective):
    problem = random_problem(Random(seed), most_states=7, objective=OBJECTIVES[objective])
    whole = rt.solve(problem)
    wrong = {"nothing": broken, "too small": answering(1e-3), "too large": answering(1e6)}
    build = wrong.get(bad) or answering(BAD[bad])
    solved_by(monkeypatch, Method(build))
    solution = rt.solve(problem)
    assert not np.isnan([solution.values, solution.lower, solution.upper]).any()
    assert (solution.lower <= whole.upper).all()
    assert (solution.upper >= whole.lower).all()


@pytest.mark.parametrize("number", BAD.values())
def test_sweeps_without_numbers_prove_nothing_that_is_wrong(monkeypatch, town, number):
    whole = rt.solve(town)
    monkeypatch.setattr(sweeps, "_operator", lambda system, _: lambda _: np.full(system.nodes, number))
    solution = rt.solve(town, method=Sweeps(most=5))
    assert not np.isnan([solution.values, solution.lower, solution.upper]).any()
    assert (solution.lower <= whole.upper).all()
    assert (solution.upper >= whole.lower).all()
