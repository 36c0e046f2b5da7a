"""The re-checker's bounds contain what trying every policy gives, exactly where few states are open and closely elsewhere."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from fractions import Fraction
from random import Random

import pytest
from random_models import OBJECTIVES, random_policy, random_problem

from ratherthan.model.mdp import MDP
from ratherthan.verify.aims import frame_of
from ratherthan.verify.candidates import Budget
from ratherthan.verify.exact import eliminate, row_of
from ratherthan.verify.frame import Frame
from ratherthan.verify.values import Band, following, optimum

EXACT, SWEPT = Budget(), Budget(exact=0)
Number = Fraction | float


def value_of_chain(frame: Frame, taken: list[int]) -> list[Number]:
    """Return the value of one choice per state: plain sets, one elimination."""
    rows = {s: row_of(frame, c) for s, c in enumerate(taken)}
    running = {s for s in rows if frame.running[s]}
    target = {s for s in rows if frame.target[s]}

    def reaching(to: set[int]) -> set[int]:
        found = set(to)
        while True:
            more = {s for s in running - found if found & set(rows[s][1])}
            if not more:
                return found
            found |= more

    arrives = reaching(target)
    stuck = reaching(set(rows) - arrives)
    values: list[Number] = [Fraction(int(s in target)) if not frame.costs else Fraction(0) for s in rows]
    unknown = [s for s in running & arrives if not frame.costs or s not in stuck]
    inside = set(unknown)
    for s in running - inside:
        values[s] = math.inf if frame.costs else Fraction(0)
    settled = {}
    for s in unknown:
        price, spread = rows[s]
        settled[s] = (
            price + sum(p * values[t] for t, p in spread.items() if t not in inside),
            {t: p for t, p in spread.items() if t in inside},
        )
    for s, value in eliminate(settled).items():
        values[s] = value
    return values


def every_policy(mdp: MDP) -> Iterator[tuple[int, ...]]:
    yield from itertools.product(*(mdp.choices_of(s) for s in range(mdp.states)))


def best_of_all(frame: Frame) -> list[Number]:
    """Return the optimum over all deterministic policies; a largest cost is infinite where the goal can be missed."""
    found = [value_of_chain(frame, list(taken)) for taken in every_policy(frame.mdp)]
    choose = max if frame.maximise else min
    return [choose(values[s] for values in found) for s in range(frame.mdp.states)]


def contains(band: Band, state: int, value: Number) -> bool:
    bounds = band[state]
    if value == math.inf:
        return bounds.lower == bounds.upper == math.inf
    low = bounds.lower == -math.inf or Fraction(bounds.lower) <= value
    return low and (bounds.upper == math.inf or Fraction(bounds.upper) >= value)


def tight(band: Band, state: int, value: Number, share: float) -> bool:
    bounds = band[state]
    return value == math.inf or bounds.upper - bounds.lower <= share * float(value)


@pytest.mark.parametrize("seed", range(150))
@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])
def test_the_optimum_is_the_best_of_all_policies(seed: int, budget: Budget) -> None:
    random = Random(seed)
    problem = random_problem(random, most_states=5, objective=list(OBJECTIVES.values())[seed % len(OBJECTIVES)])
    assert problem.objective is not None
    frame = frame_of(problem, problem.objective)
    band = optimum(frame, budget)
    for state, value in enumerate(best_of_all(frame)):
        assert contains(band, state, value)
        assert tight(band, state, value, 1e-9)


@pytest.mark.parametrize("seed", range(100))
@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])
def test_a_policy_has_the_value_of_its_chain(seed: int, budget: Budget) -> None:
    random = Random(seed)
    problem = random_problem(random, objective=list(OBJECTIVES.values())[seed % len(OBJECTIVES)])
    assert problem.objective is not None
    frame = frame_of(problem, problem.objective)
    policy = random_policy(random, problem.mdp)
    band = following(frame, policy.weights(problem.mdp), budget)
    for state, value in enumerate(value_of_chain(frame, policy.choice.tolist())):
        assert contains(band, state, value)
        assert tight(band, state, value, 1e-9)
