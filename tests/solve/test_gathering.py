"""Rewards of either sign: what has no end, what cannot arrive, what cancels, and what others computed."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from math import inf
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from exact import level_values
from random_models import GOAL, Table, problem_of, random_problem, random_table

from ratherthan.errors import PropertyError
from ratherthan.io import read
from ratherthan.model.mdp import Reward
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve import (
    Outcome,
    PolicyIteration,
    Sweeps,
    action_value_bounds,
    evaluate,
    impact_bounds,
    linear,
    optimum,
    policy_iteration,
    solve,
)
from ratherthan.solve.endless import rising_nodes, stuck_nodes
from ratherthan.solve.policy_iteration import Found, iterate_policies
from ratherthan.solve.system import System

MOST, LEAST = ExpectedReward(goal=GOAL, reward="cost"), ExpectedReward(goal=GOAL, reward="cost", maximise=False)


def solved(table: Table, level: ExpectedReward | Discounted = MOST, goal: int = 2, **settings: Any) -> Any:
    return solve(problem_of(table, level, goals=[goal]), **settings)


def exactly(solution: Any) -> list[float]:
    assert solution.outcome is Outcome.CERTIFIED
    return [round(x, 9) for x in solution.values[0].tolist()]


def test_where_the_goal_may_be_missed_for_ever_the_value_is_minus_infinity_whatever_is_gathered() -> None:
    table: Table = {
        0: {"stay": ([(1.0, 0)], 9), "try": ([(0.5, 2), (0.5, 1)], 100)},
        1: {"stay": ([(1.0, 1)], 9)},
        2: {"stay": ([(1.0, 2)], 5)},
    }
    most, least = solved(table), solved(table, LEAST)
    assert most.lower[0].tolist() == most.upper[0].tolist() == [-inf, -inf, 0]
    assert least.lower[0].tolist() == least.upper[0].tolist() == [inf, inf, 0]
    assert most.can_arrive.tolist() == [True, False, True]
    assert most.policy.choice[0] == 1, "it tries"
    assert most.policy_values[0].tolist() == [-inf, -inf, 0]


@pytest.mark.parametrize(("there", "back"), [(1.0, 0.0), (3.0, -1.0), (-1.0, 1.0009765625)])
def test_where_more_and_more_can_be_gathered_the_value_is_infinite_and_the_policy_arrives(
    there: float, back: float
) -> None:
    table: Table = {
        0: {"go": ([(1.0, 1)], there), "end": ([(1.0, 2)], -4)},
        1: {"back": ([(1.0, 0)], back), "end": ([(0.5, 2), (0.5, 3)], -4)},
        2: {"stay": ([(1.0, 2)], 0)},
        3: {"on": ([(1.0, 2)], 2)},
        4: {"in": ([(1.0, 0)], -1000), "out": ([(1.0, 3)], 0)},
    }
    solution = solved(table)
    assert solution.values[0].tolist()[:3] == [inf, inf, 0]
    assert solution.values[0, 4] == inf, "it can go where there is no end"
    assert exactly(solution)[3] == 2
    assert solution.policy_upper[0, [0, 1, 4]].max() < inf, "no policy attains it; this one arrives"
    turned = {s: {a: (b, -r) for a, (b, r) in row.items()} for s, row in table.items()}
    assert solved(turned, LEAST).values[0].tolist()[:3] == [-inf, -inf, 0]


def test_a_cycle_that_gives_and_takes_the_same_is_solved_exactly() -> None:
    table: Table = {
        0: {"go": ([(1.0, 1)], 0.1), "end": ([(0.9, 2), (0.1, 0)], -3)},
        1: {"back": ([(1.0, 0)], -0.1), "end": ([(1.0, 2)], -3)},
        2: {"stay": ([(1.0, 2)], 5)},
        3: {"in": ([(0.5, 0), (0.5, 3)], 1)},
    }
    solution = solved(table)
    every = [range(len(row)) for row in table.values()]
    best = level_values(solution.problem, MOST, every, set())
    assert solution.outcome is Outcome.CERTIFIED
    for value, low, high in zip(best, solution.lower[0].tolist(), solution.upper[0].tolist(), strict=True):
        assert low <= value <= high
        assert high - low < 1e-12
    assert solution.policy.choice[0] == 0


def test_a_cycle_of_mean_0_by_chance_is_no_reason_to_claim_anything() -> None:
    table: Table = {
        0: {"play": ([(0.5, 1), (0.5, 3)], 0), "end": ([(1.0, 2)], 0.5)},
        1: {"won": ([(1.0, 0)], 1)},
        2: {"stay": ([(1.0, 2)], 0)},
        3: {"lost": ([(1.0, 0)], -1)},
        4: {"on": ([(0.8, 2), (0.2, 4)], -2), "more": ([(1.0, 2)], 2.25)},
        5: {"in": ([(1.0, 0)], -7)},
    }
    solution = solved(table)
    assert solution.outcome is Outcome.LOWER_ONLY
    assert solution.lower[0, 0] <= 0.5 <= solution.upper[0, 0]
    assert solution.upper[0, 0] == inf
    assert solution.upper[0, 4] - solution.lower[0, 4] < 1e-12, "what cannot come there is proved"
    assert solution.lower[0, 4] <= 2.25 <= solution.upper[0, 4]
    assert solution.upper[0, 5] == inf
    tilted = {**table, 1: {"won": ([(1.0, 0)], 1.001)}}
    assert solved(tilted).lower[0, 0] == inf


def test_a_choice_that_goes_round_for_nothing_is_not_taken_though_it_is_listed_first() -> None:
    table: Table = {
        0: {"round": ([(1.0, 1)], 0), "end": ([(1.0, 2)], 3)},
        1: {"round": ([(1.0, 0)], 0), "end": ([(1.0, 2)], 3)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    solution = solved(table)
    assert exactly(solution) == [3, 3, 0]
    assert [round(x, 9) for x in solution.policy_values[0].tolist()] == [3, 3, 0]


@pytest.mark.parametrize(("paid", "value"), [(-1.0, 2.0), (-3.0, 2.0), (-0.5, inf)])
def test_parts_of_a_reward_may_cancel(paid: float, value: float) -> None:
    """Staying gives 1 for the state and takes `paid` for the choice: only what is left of it counts."""
    table: Table = {0: {"stay": ([(1.0, 0)], paid), "end": ([(1.0, 1)], 1)}, 1: {"stay": ([(1.0, 1)], 0)}}
    problem = problem_of(table, MOST, goals=[1])
    reward = replace(problem.mdp.rewards["cost"], state=np.array([1.0, 0.0]))
    solution = solve(replace(problem, mdp=replace(problem.mdp, rewards={"cost": reward})))
    assert exactly(solution)[0] == value
    assert (solution.policy.choice[0] == 1) or value == inf


def test_a_loop_whose_sign_is_lost_in_rounding_proves_nothing() -> None:
    table: Table = {
        0: {"stay": ([(0.1, 0), (0.9, 0)], -1e-17), "end": ([(1.0, 1)], 1)},
        1: {"stay": ([(1.0, 1)], 0)},
    }
    problem = problem_of(table, MOST, goals=[1])
    branch = np.array([0.9, -0.1, 0.0, 0.0])
    reward = replace(problem.mdp.rewards["cost"], branch=branch)
    solution = solve(replace(problem, mdp=replace(problem.mdp, rewards={"cost": reward})))
    assert solution.outcome is Outcome.LOWER_ONLY
    assert solution.upper[0, 0] == inf


def test_whole_numbers_that_cancel_are_told_to_be_equal() -> None:
    """Both ways are worth 0, which no relative width of bounds around it could tell."""
    table: Table = {
        0: {"up": ([(1.0, 1)], 3), "down": ([(1.0, 3)], -5), "far": ([(1.0, 4)], 1)},
        1: {"on": ([(1.0, 2)], -3)},
        2: {"stay": ([(1.0, 2)], 0)},
        3: {"on": ([(1.0, 2)], 5)},
        4: {"on": ([(1.0, 2)], -2), "slip": ([(0.5, 2), (0.5, 4)], -4)},
    }
    solution = solved(table)
    assert solution.lower[0].tolist() == solution.upper[0].tolist() == [0, -3, 0, 5, -2]
    _, lower, upper = action_value_bounds(solution)
    assert lower[:3].tolist() == upper[:3].tolist() == [0, 0, -1]
    given = evaluate(solution.problem, Policy(choice=np.array([2, 3, 4, 5, 6])))
    assert given.policy_lower[0].tolist() == given.policy_upper[0].tolist() == [-1, -3, 0, 5, -2]
    tenths = {s: {a: (b, r / 10) for a, (b, r) in row.items()} for s, row in table.items()}
    rounded = solved(tenths)
    assert rounded.lower[0, 0] <= 0 <= rounded.upper[0, 0]


def test_what_is_paid_after_the_end_does_not_count() -> None:
    table: Table = {0: {"end": ([(1.0, 1)], -2)}, 1: {"stay": ([(1.0, 1)], 50)}}
    assert exactly(solved(table, goal=1)) == [-2, 0]


def test_values_that_are_0_by_the_graph_are_exactly_0() -> None:
    table: Table = {
        0: {"pay": ([(1.0, 2)], -1), "slip": ([(0.5, 1), (0.5, 2)], 0)},
        1: {"on": ([(0.9, 2), (0.1, 1)], 0), "pay": ([(1.0, 0)], -3)},
        2: {"stay": ([(1.0, 2)], 0)},
        3: {"win": ([(1.0, 0)], 1)},
    }
    solution = solved(table)
    assert solution.lower[0].tolist()[:3] == solution.upper[0].tolist()[:3] == [0, 0, 0]
    discounted = solved(table, Discounted(reward="cost", discount=0.9))
    assert discounted.lower[0, 2] == discounted.upper[0, 2] == 0


@pytest.mark.parametrize("gamma", [0.5, 0.99, 0.999999])
@pytest.mark.parametrize("maximise", [True, False])
def test_a_discounted_sum_needs_no_goal(gamma: float, maximise: bool) -> None:
    table: Table = {
        0: {"a": ([(1.0, 0)], 1), "b": ([(0.5, 1), (0.5, 0)], -2)},
        1: {"a": ([(1.0, 0)], 3), "b": ([(1.0, 2)], 0)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    level = Discounted(reward="cost", discount=gamma, maximise=maximise)
    solution = solved(table, level)
    assert solution.outcome is Outcome.CERTIFIED
    assert solution.can_arrive.all()
    assert not solution.ended.any()
    best = level_values(solution.problem, level, [range(len(row)) for row in table.values()], set())
    for value, low, high in zip(best, solution.lower[0].tolist(), solution.upper[0].tolist(), strict=True):
        assert low <= value <= high
        assert high - low <= 1e-7 * max(1, abs(value))
    q, lower, upper = action_value_bounds(solution)
    impact = impact_bounds(solution)[0]
    paid = solution.problem.mdp.rewards["cost"].choice
    assert np.allclose(q, paid + gamma * impact, rtol=1e-12)
    choose = np.maximum if maximise else np.minimum
    assert np.allclose(choose.reduceat(q, [0, 2, 4]), solution.values[0], rtol=1e-9)
    assert ((lower <= q) & (q <= upper)).all()


@pytest.mark.parametrize("gamma", [0.0, 1.0, 1.5, -0.5])
def test_a_discount_lies_between_0_and_1(gamma: float) -> None:
    with pytest.raises(PropertyError, match="between 0 and 1"):
        solved({0: {"a": ([(1.0, 0)], 1)}}, Discounted(reward="cost", discount=gamma), goal=0)


def test_action_values_of_infinite_values_are_infinite_and_arriving_comes_first() -> None:
    table: Table = {
        0: {"both": ([(0.5, 1), (0.5, 3)], 1), "more": ([(0.5, 1), (0.5, 2)], 1), "end": ([(1.0, 2)], 1)},
        1: {"again": ([(1.0, 1)], 1), "end": ([(1.0, 2)], 1)},
        2: {"stay": ([(1.0, 2)], 0)},
        3: {"lost": ([(1.0, 3)], 5)},
    }
    for level, best in ((MOST, inf), (LEAST, -inf)):
        turned = table if level.maximise else {s: {a: (b, -r) for a, (b, r) in row.items()} for s, row in table.items()}
        q, lower, upper = action_value_bounds(solved(turned, level))
        assert q[:3].tolist() == lower[:3].tolist() == upper[:3].tolist() or q[2] not in (inf, -inf)
        assert q[:2].tolist() == [-best, best]
        assert not np.isnan(q).any()


def test_rewards_beyond_the_range_of_doubles_are_refused() -> None:
    problem = problem_of({0: {"a": ([(1.0, 1)], 1)}, 1: {"a": ([(1.0, 1)], 0)}}, MOST, goals=[1])
    for reward in (
        Reward(state=np.full(2, 1e308), choice=np.full(2, 1e308)),
        Reward(state=np.full(2, 1e308), choice=np.full(2, -1e308)),
    ):
        with pytest.raises(PropertyError, match="exceed the largest double"):
            solve(replace(problem, mdp=replace(problem.mdp, rewards={"cost": reward})))
    rewards = {"a": Reward(choice=np.full(2, 1e308)), "b": Reward(choice=np.full(2, -1e308))}
    for name in ("10 * a", "10 * a + 10 * b", "a + b"):
        with pytest.raises(PropertyError, match="exceed the largest double"):
            solve(replace(problem, mdp=replace(problem.mdp, rewards=rewards)), replace(MOST, reward=name))


def test_a_weighted_sum_of_rewards_is_a_reward() -> None:
    table: Table = {
        0: {"short": ([(1.0, 1)], 2), "safe": ([(1.0, 1)], 5)},
        1: {"stay": ([(1.0, 1)], 0)},
    }
    problem = problem_of(table, MOST, goals=[1])
    rewards = {**problem.mdp.rewards, "risk": Reward(choice=np.array([1.0, -0.5, 0.0]))}
    problem = replace(problem, mdp=replace(problem.mdp, rewards=rewards))
    for weight, value in ((1.0, 3.0), (10.0, 0.0)):
        least = ExpectedReward(goal=GOAL, reward=f"cost + {weight:g} * risk", maximise=False)
        solution = solve(problem, least)
        assert solution.lower[0, 0] <= value <= solution.upper[0, 0]
        assert solution.upper[0, 0] - solution.lower[0, 0] < 1e-12
    with pytest.raises(PropertyError, match="must not be negative"):
        solve(problem, ExpectedCost(goal=GOAL, reward="cost + risk"))


@pytest.mark.parametrize("seed", range(40))
def test_rewards_of_one_sign_are_costs(seed: int) -> None:
    problem = random_problem(Random(seed))
    cost = solve(problem, ExpectedCost(goal=GOAL, reward="cost"))
    same = solve(problem, LEAST)
    assert (cost.lower == same.lower).all()
    assert (cost.upper == same.upper).all()
    losses = replace(problem.mdp, rewards={"cost": Reward(choice=-problem.mdp.rewards["cost"].choice)})
    most = solve(replace(problem, mdp=losses), MOST)
    assert (cost.lower == -most.upper).all()
    assert (cost.policy.choice == most.policy.choice).all()
    assert not np.signbit(most.values[most.values == 0]).any(), "0 has no sign"


def signed_problem(seed: int, level: ExpectedReward | Discounted, states: int = 6) -> Problem:
    random = Random(seed)
    table = {
        s: {a: (b, random.choice([-3, -2, -1, -1, 0, 1])) for a, (b, _) in row.items()}
        for s, row in random_table(random, random.randint(2, states)).items()
    }
    return problem_of(table, level, goals=[random.randrange(len(table))])


LEVELS = (MOST, LEAST, Discounted(reward="cost", discount=0.9))


@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
@pytest.mark.parametrize("seed", range(30))
def test_large_systems_are_solved_as_small_ones(
    seed: int, level: ExpectedReward | Discounted, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = signed_problem(seed, level)
    small = solve(problem)
    monkeypatch.setattr(linear, "MOST_DENSE", 0)
    monkeypatch.setattr(policy_iteration, "MOST_DENSE", 0)
    large = solve(problem)
    assert np.allclose(small.values[0], large.values[0], rtol=1e-12, atol=1e-12)
    assert (small.policy.choice == large.policy.choice).all()
    assert large.outcome is small.outcome


@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
@pytest.mark.parametrize("seed", range(40))
def test_whatever_a_solver_says_the_bounds_hold(
    seed: int, level: ExpectedReward | Discounted, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = Random(seed)
    problem = signed_problem(seed, level, 5)
    every = [range(len(problem.mdp.choices_of(s))) for s in range(problem.mdp.states)]
    best = level_values(problem, level, every, set())

    def liar(system: System, maximise: bool, settings: PolicyIteration, progress: None, **_: Any) -> Found | None:
        found = iterate_policies(system, maximise, settings, progress)
        if found is None or found.endless is not None:
            return found
        wrong = np.array([random.choice([-1.0, 0.0, 1.0, 1.0, 1 + 1e-9, 0.9, 2.0]) for _ in range(system.nodes)])
        solved = found.solved._replace(high=found.solved.high * wrong, low=np.zeros(system.nodes))
        return replace(found, solved=solved)

    monkeypatch.setattr(optimum, "iterate_policies", liar)
    solution = solve(problem)
    for value, lower, upper in zip(best, solution.lower[0].tolist(), solution.upper[0].tolist(), strict=True):
        assert lower <= value <= upper


@pytest.mark.parametrize("gamma", [0.5, 0.95])
@pytest.mark.parametrize("seed", range(15))
def test_value_iteration_stands_in_for_signed_discounted_sums(seed: int, gamma: float) -> None:
    level = Discounted(reward="cost", discount=gamma)
    problem = signed_problem(seed, level)
    exact, swept = solve(problem), solve(problem, method=Sweeps())
    assert np.allclose(exact.values, swept.values, atol=1e-8)
    assert swept.outcome is Outcome.CERTIFIED
    assert (swept.lower <= exact.upper).all()
    assert (exact.lower <= swept.upper).all()


def ring(rewards: list[float]) -> System:
    """Return a ring with a second row at the first node that leaves it."""
    n = len(rewards)
    targets = [1 % n, n, *[(i + 1) % n for i in range(1, n)]]
    return System(
        node_to_rows=np.array([0, *range(2, n + 2)]),
        row_to_branches=np.arange(n + 2),
        target=np.array(targets),
        probability=np.ones(n + 1),
        cost=np.array([rewards[0], -5.0, *rewards[1:]]),
        source=np.arange(n + 1),
        signed=True,
    )


@pytest.mark.parametrize(
    ("rewards", "rises"), [([1.0, -0.5], True), ([1.0, -1.0], False), ([1.0, -2.0], False), ([0.1, 0.2, -0.29], True)]
)
def test_only_a_mean_above_0_is_proved_to_have_no_end(rewards: list[float], rises: bool) -> None:
    system = ring(rewards)
    rows = np.array([0, *range(2, len(rewards) + 1)])
    stuck = stuck_nodes(system, rows)
    assert stuck is not None
    assert stuck.all()
    assert (rising_nodes(system, rows, stuck) is not None) is rises
    assert stuck_nodes(system, np.array([1, *range(2, len(rewards) + 1)])) is None


def test_an_evaluated_policy_that_goes_round_is_worth_minus_infinity() -> None:
    table: Table = {
        0: {"round": ([(1.0, 1)], 5), "end": ([(1.0, 2)], -1)},
        1: {"round": ([(1.0, 0)], -9), "end": ([(1.0, 2)], -1)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    problem = problem_of(table, MOST, goals=[2])
    given = evaluate(problem, Policy(choice=np.array([0, 2, 4])))
    assert given.policy_lower[0].tolist() == given.policy_upper[0].tolist() == [-inf, -inf, 0]
    assert given.values[0, 0] == pytest.approx(4)
    mixed = evaluate(problem, Policy(choice=np.full(3, -1), chance=np.array([0.5, 0.5, 1.0, 0.0, 1.0])))
    value = (Fraction(1, 2) * (5 - 9) - Fraction(1, 2)) / Fraction(1, 2)
    assert mixed.policy_lower[0, 0] <= value <= mixed.policy_upper[0, 0]


TABLES = {"CliffWalking-v1": -13.0, "Taxi-v4": None, "FrozenLake-v1_4x4_slippery": 14 / 17}


def iterated(table: dict[str, Any], gamma: float) -> list[float]:
    """Return the discounted optimum of a Gymnasium table by plain value iteration: an episode ends where it says so."""
    values = [0.0] * table["nS"]
    entries = table["P"]
    for _ in range(10_000):
        after = [
            max(sum(p * (r + (0.0 if done else gamma * values[t])) for p, t, r, done in row) for row in entries[s])
            for s in range(table["nS"])
        ]
        change = max(abs(x - y) for x, y in zip(values, after, strict=True))
        values = after
        if change < 1e-13:
            break
    return values


@pytest.mark.parametrize("name", TABLES)
def test_tables_of_gymnasium_have_the_values_of_plain_value_iteration(name: str, shared_data: Path) -> None:
    path = shared_data / "envs" / f"{name}.json.gz"
    with gzip.open(path, "rt") as file:
        table = json.load(file)
    problem = read(str(path))
    start = int(problem.mdp.initial[0])
    for gamma in (0.5, 0.9):
        solution = solve(problem, Discounted(reward="reward", discount=gamma))
        assert solution.outcome is Outcome.CERTIFIED
        assert solution.values[0, start] == pytest.approx(iterated(table, gamma)[start], abs=1e-10)
    [recomputed] = [value for key, value in table.items() if key.startswith("recomputed_optimal_values")]
    for gamma, said in recomputed.items():
        if gamma.startswith("undiscounted_"):  # within so many steps: another question
            continue
        level = Discounted(reward="reward", discount=float(gamma)) if float(gamma) < 1 else None
        solution = solve(problem, level or ExpectedReward(goal='"terminal"', reward="reward"))
        assert solution.outcome is Outcome.CERTIFIED
        assert solution.values[0, start] == pytest.approx(said["V"][start], abs=1e-9)
    if TABLES[name] is not None:
        assert solve(problem, ExpectedReward(goal='"terminal"', reward="reward")).values[0, start] == pytest.approx(
            TABLES[name]
        )


DISCOUNTED = """mdp
module walk
  s : [0..3] init 0;
  [a] s=0 -> 0.9:(s'=1)+0.1:(s'=0);
  [b] s=0 -> 0.5:(s'=2)+0.5:(s'=0);
  [a] s=1 -> 0.7:(s'=3)+0.3:(s'=0);
  [a] s=2 -> 1:(s'=0);
  [a] s=3 -> 1:(s'=3);
endmodule
rewards "r"
  [a] s=0 : 1; [b] s=0 : 2.5; [a] s=1 : 3; s=2 : 0.25;
endrewards
"""


@pytest.mark.parametrize("gamma", [0.5, 0.95])
@pytest.mark.parametrize("way", ["max", "min"])
def test_storm_answers_the_same(way: str, gamma: float, tmp_path: Path) -> None:
    stormpy = pytest.importorskip("stormpy")
    path = tmp_path / "walk.prism"
    path.write_text(DISCOUNTED)
    program = stormpy.parse_prism_program(str(path))
    properties = stormpy.parse_properties(f'R{{"r"}}{way}=? [Cdiscount={gamma}]', program)
    model = stormpy.build_model(program, properties)
    said = stormpy.model_checking(model, properties[0]).get_value(model.initial_states[0])
    solution = solve(read(str(path)), Discounted(reward="r", discount=gamma, maximise=way == "max"))
    assert said == pytest.approx(float(solution.values[0, 0]), rel=1e-5)


@pytest.mark.parametrize(
    "text",
    [
        'R{"distance"}max=? [Fsure "destination"]',
        'R{"distance"}min=? [Cdiscount=0.9]',
        'Pmax=? [F "destination"] then R{"distance"}min=? [F "destination"]',
        'Pmax=? [F<=5 "destination"]',
    ],
)
def test_a_small_model_is_solved_without_a_compiler_or_sparse_solvers(text: str) -> None:
    program = (
        "import sys, ratherthan as rt; from ratherthan.model.property import parse_property; "
        f"p = rt.read('example:paper-5x5'); s = rt.solve(p, parse_property({text!r}, p)); "
        "assert s.outcome is rt.Outcome.CERTIFIED; "
        "sys.exit(str([m for m in ('numba', 'scipy', 'stormpy') if m in sys.modules] or ''))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.strip()) in ((0, ""), (1, ""))
