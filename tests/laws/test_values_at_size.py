"""What the methods of large models prove is true: of small ones that they are made to solve, against exact fractions.

RATHERTHAN_MODELS says how many models: end components, free moves that go round, near end components, chances of 1e-9, several goals.
"""

from __future__ import annotations

import importlib
import os
from collections import Counter
from fractions import Fraction
from math import inf
from random import Random

import numpy as np
import pytest
from exact import chain_values, optimum_by_enumeration, rows_of
from random_models import OBJECTIVES, Table, problem_of

from ratherthan.model.mdp import Floats
from ratherthan.model.objective import ExpectedCost, ReachAvoid
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, Solution, solve

MODELS = int(os.environ.get("RATHERTHAN_MODELS", "400"))
ROOM = "ratherthan.solve.contracting.contraction"
BLOCKS = 20
"""In how many tests they are."""
PROVED = 0.97
"""Which share of them is proved to the precision that is wanted, at least."""
FAINT = (0.01, 1e-6, 1e-9)


def _row(random: Random, states: int) -> list[tuple[float, int]]:
    """Return a random row, often one that nearly stays among a few states."""
    first, second, third = (random.randrange(states) for _ in range(3))
    faint = random.choice(FAINT)
    return random.choice(
        [
            [(1.0, first)],
            [(0.8, first), (0.1, second), (0.1, third)],
            [(1.0 - faint, first), (faint, second)],
            [(0.5, first), (0.5 - faint / 2, second), (faint / 2, third)],
        ]
    )


def _problem(seed: int) -> Problem:
    random = Random(seed)
    states = random.randint(3, 5)
    table: Table = {
        s: {
            name: (_row(random, states), random.choice([0, 0, 1, 1, 3]))
            for name in "abc"[: random.choice([1, 2, 2, 3])]
        }
        for s in range(states)
    }
    special = random.sample(range(states), random.choice([2, 2, 3]))
    objective = random.choice(list(OBJECTIVES.values()))
    return problem_of(table, objective, goals=[special[0], *special[2:]], hazards=special[1:2], start=0)


def _followed(solution: Solution) -> list[Fraction | float]:
    """Return the exact values of following the solution's policy."""
    problem, mdp, wanted = solution.problem, solution.problem.mdp, solution.problem.objective
    cost = isinstance(wanted, ExpectedCost)
    least_risk = isinstance(wanted, ReachAvoid) and not wanted.maximise
    ends = solution.hazard if least_risk else solution.goal
    taken = solution.policy.choice - mdp.state_to_choices[:-1]
    rows = rows_of(problem)
    chain = [None if solution.ended[s] else rows[s][taken[s]] for s in range(mdp.states)]
    return chain_values(chain, np.flatnonzero(ends).tolist(), cost=cost)


def _assert_within(values: list[Fraction | float], lower: Floats, upper: Floats, seed: int) -> None:
    for value, low, high in zip(values, lower.tolist(), upper.tolist(), strict=True):
        if inf in (value, low):
            assert low == high == value == inf, f"model {seed}"
        elif high == inf:
            assert Fraction(low) <= value, f"model {seed}"
        else:
            assert Fraction(low) <= value <= Fraction(high), f"model {seed}"


@pytest.fixture
def at_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the methods of large models have the first turn, and sweeps but a short one."""
    rooms = "ratherthan.solve."
    contraction, chain, optimum, trapped = (
        importlib.import_module(rooms + name) for name in ("contracting.contraction", "chain", "optimum", "trapped")
    )
    monkeypatch.setattr(contraction, "FEWEST", 1)
    monkeypatch.setattr(contraction, "is_compiled", lambda _: True)
    monkeypatch.setattr(chain, "SOME", 0)
    monkeypatch.setattr(optimum, "_windowed", lambda *_: None)
    monkeypatch.setattr(optimum, "_layered_bounds", lambda *_: None)
    monkeypatch.setattr(trapped, "FEWEST", 1)
    monkeypatch.setattr(trapped, "is_compiled", lambda _: True)


@pytest.mark.parametrize("block", range(BLOCKS))
@pytest.mark.usefixtures("at_any_size")
def test_bounds_hold_exactly_whatever_method_is_taken(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RATHERTHAN_COMPILE", "never")
    monkeypatch.setattr(importlib.import_module(ROOM), "BRIEFLY", (0.1, 2.0)[block % 2])
    outcomes: Counter[Outcome] = Counter()
    engines: set[str] = set()
    for seed in range(block, MODELS, BLOCKS):
        problem = _problem(seed)
        solution = solve(problem)
        outcomes[solution.outcome] += 1
        engines.add(solution.engine)
        _assert_within(optimum_by_enumeration(problem), solution.lower[0], solution.upper[0], seed)
        _assert_within(_followed(solution), solution.policy_lower[0], solution.policy_upper[0], seed)
    assert outcomes[Outcome.CERTIFIED] >= PROVED * outcomes.total(), outcomes
    if outcomes.total() >= 100:
        assert {"policy iteration by components", "policy iteration past traps"} <= engines
