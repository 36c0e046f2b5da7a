"""With several objectives, a state is critical if one of them says so of the choices that the ones before leave equal."""

from __future__ import annotations

from math import inf, isfinite
from random import Random

import numpy as np
import pytest
from random_models import GOAL, HAZARD, OBJECTIVES, Table, problem_of, random_problem

from ratherthan.factors import compared_at, critical_states, critical_states_of_levels, nearer_goal, responsibility
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, Level, Lexicographic, ReachAvoid
from ratherthan.solve import solve
from ratherthan.solve.levels import ended_at

LEVELS: dict[str, tuple[Level, ...]] = {
    "safest, cheapest": (ReachAvoid(goal=GOAL, through=f"!{HAZARD}"), ExpectedCost(goal=GOAL, reward="cost")),
    "steps, reward": (ExpectedCost(goal=GOAL, reward=None), ExpectedReward(goal=GOAL, reward="cost")),
    "least risk, discounted": (ReachAvoid(goal=HAZARD, maximise=False), Discounted(reward="cost", discount=0.5)),
    "three": (
        ReachAvoid(goal=GOAL),
        ExpectedCost(goal=GOAL, reward=None),
        ExpectedCost(goal=GOAL, reward="cost"),
    ),
}


def apart(x: float, y: float) -> bool:
    if x == y:
        return False
    return not (isfinite(x) and isfinite(y)) or abs(x - y) > 1e-6 * max(abs(x), abs(y))


@pytest.mark.parametrize("name", LEVELS)
@pytest.mark.parametrize("seed", range(60))
def test_critical_states_of_levels_equal_their_definition(seed: int, name: str) -> None:
    problem = random_problem(Random(seed), objective=Lexicographic(levels=LEVELS[name]))
    solution = solve(problem)
    measures = [responsibility(solution, objective=k) for k in range(len(LEVELS[name]))]
    found = critical_states_of_levels(solution, measures)
    compared = compared_at(solution, measures)
    assert compared[0].certain.all()
    for s in range(problem.mdp.states):
        chosen = list(problem.mdp.choices_of(s))
        critical = False
        for k, level in enumerate(LEVELS[name]):
            assert chosen == [c for c in problem.mdp.choices_of(s) if compared[k].possible[c]]
            values = [float(measures[k].action_value[c]) for c in chosen]
            if ended_at(solution, k)[s]:
                continue
            critical |= apart(min(values), max(values))
            best = (max if level.maximise else min)(values)
            chosen = [c for c, value in zip(chosen, values, strict=True) if not apart(value, best)]
        assert found.possible[s] or not critical
        assert critical or not found.certain[s]
        assert found.of(s) in (critical, None)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(20))
def test_one_level_is_the_ordinary_criticality(seed: int, objective: str) -> None:
    problem = random_problem(Random(seed), objective=OBJECTIVES[objective])
    solution = solve(problem)
    measures = responsibility(solution)
    for alpha in (0.0, 0.75):
        one = critical_states(problem.mdp, measures, solution.ended, alpha=alpha)
        other = critical_states_of_levels(solution, [measures], alpha=alpha)
        assert (one.certain == other.certain).all()
        assert (one.possible == other.possible).all()


def test_the_threshold_is_in_the_unit_of_the_first_level() -> None:
    table: Table = {
        0: {"a": ([(1.0, 1)], 5), "b": ([(1.0, 2)], 1)},
        1: {"on": ([(1.0, 3)], 0)},
        2: {"on": ([(0.95, 3), (0.05, 4)], 0)},
        3: {"stay": ([(1.0, 3)], 0)},
        4: {"stay": ([(1.0, 4)], 0)},
        5: {"a": ([(1.0, 1)], 5), "b": ([(1.0, 1)], 5.5)},
    }
    levels = LEVELS["safest, cheapest"]
    solution = solve(problem_of(table, Lexicographic(levels=levels), goals=[3], hazards=[4]))
    measures = [responsibility(solution, objective=k) for k in range(2)]
    assert np.flatnonzero(critical_states_of_levels(solution, measures).certain).tolist() == [0, 5]
    at_most = critical_states_of_levels(solution, measures, alpha=0.1)
    assert np.flatnonzero(at_most.certain).tolist() == [5], "the cheap one is not as safe, so its cost is not compared"


@pytest.mark.parametrize("maximise", [True, False])
def test_nearer_is_different_and_better_for_numbers_of_either_sign(maximise: bool) -> None:
    values = np.array([-inf, -7.0, -7.0 * (1 + 5e-7), -7.0 * (1 - 3e-6), -1e-9, 0.0, 1e-9, 3.0, 3.0 * (1 + 2e-6), inf])
    for nearer in nearer_goal(values, values, maximise=maximise):
        for s, origin in enumerate(values):
            for t, target in enumerate(values):
                better = target > origin if maximise else target < origin
                expected = better and apart(float(origin), float(target))
                assert (nearer.target[t] < nearer.origin[s]) == expected, (origin, target)


@pytest.mark.parametrize("seed", range(40))
def test_responsibility_of_rewards_is_the_distance_from_the_least(seed: int) -> None:
    problem = random_problem(Random(seed), objective=ExpectedReward(goal=GOAL, reward="cost"))
    solution = solve(problem)
    measures = responsibility(solution)
    assert not np.isnan(measures.responsibility).any()
    for s in range(problem.mdp.states):
        own = list(problem.mdp.choices_of(s))
        q = [float(measures.action_value[c]) for c in own]
        for c, value in zip(own, q, strict=True):
            share = 0.0 if solution.ended[s] or value == min(q) else value - min(q)
            assert measures.responsibility[c] == share
