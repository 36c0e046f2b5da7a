"""Probabilities past traps: what the sharp methods prove is true, of small models that they would not be taken for."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from random import Random

import numpy as np
import pytest
from exact import optimum_by_enumeration, rows_of
from random_models import OBJECTIVES, Table, problem_of

from ratherthan.apps.answers import value_document, value_lines
from ratherthan.model.mdp import MDP
from ratherthan.model.objective import ReachAvoid
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, Solution, evaluate, solve, trapped
from ratherthan.solve.certify import never_falls, never_rises
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.linear import solve_chain
from ratherthan.solve.system import System
from ratherthan.solve.system import rows_of as taken
from ratherthan.solve.trapped import attained, exact, proof, traps
from ratherthan.solve.trapped.horizon import within_steps
from ratherthan.solve.trapped.plateaus import flattened

WANTED = ["likeliest", "safest", "least risk"]
TINY = [1e-3, 1e-9, 1e-12, 1e-20, 1e-30]
TINIER = [1e-9, 1e-30, 1e-120, 1e-300]


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take the methods of large models for small ones."""
    monkeypatch.setattr(trapped, "FEWEST", 1)
    monkeypatch.setattr(trapped, "is_compiled", lambda _: True)


def trapped_problem(random: Random, objective: str, *, states: int = 6, chances: list[float] = TINY) -> Problem:
    """Return a random problem with end components, near end components, and rows that nearly stay."""
    table: Table = {}
    for s in range(states):
        table[s] = {}
        for name in "abc"[: random.randint(1, 3)]:
            first, second, third = random.randrange(states), random.randrange(states), random.randrange(states)
            tiny = random.choice(chances)
            table[s][name] = (
                random.choice(
                    [
                        [(1.0, first)],
                        [(0.8, first), (0.1, second), (0.1, third)],
                        [(1.0 - tiny, first), (tiny, second)],
                        [(0.5, first), (0.5 - tiny / 2, second), (tiny / 2, third)],
                    ]
                ),
                1,
            )
    goals = [states - 1, *([states - 2] if random.random() < 0.3 else [])]
    hazards = [states - 3]
    return problem_of(table, OBJECTIVES[objective], goals=goals, hazards=hazards, start=0)


@pytest.mark.parametrize("objective", WANTED)
@pytest.mark.parametrize("seed", range(60))
def test_bounds_past_traps_hold_exactly(seed: int, objective: str) -> None:
    problem = trapped_problem(Random(seed), objective, states=5)
    solution = solve(problem)
    assert_held(problem, solution)
    assert solution.outcome is Outcome.CERTIFIED
    assert solution.engine in ("policy iteration past traps", "graph search", "one backward pass", "policy iteration")


@pytest.mark.parametrize("objective", WANTED)
@pytest.mark.parametrize("seed", range(60))
def test_bounds_hold_where_next_to_nothing_leaks(seed: int, objective: str) -> None:
    problem = trapped_problem(Random(seed), objective, states=5, chances=TINIER)
    assert_held(problem, solve(problem))


def assert_held(problem: Problem, solution: Solution) -> None:
    """Assert that the exact optimum is within the bounds, those of the policy as well if it attains it."""
    best = optimum_by_enumeration(problem)
    for bounds in ((solution.lower, solution.upper), (solution.policy_lower, solution.policy_upper)):
        for value, low, high in zip(best, *(part[0].tolist() for part in bounds), strict=True):
            assert 0.0 <= low <= high <= 1.0
            assert Fraction(low) <= value <= Fraction(high)


def random_system(random: Random, nodes: int) -> System:
    """Return a random system of which every policy is absorbed."""
    begin, target, chance, rows = [0], [], [], [0]
    for s in range(nodes):
        for _ in range(random.randint(1, 3)):
            others = random.sample(range(max(s - 3, 0), min(s + 4, nodes)), min(nodes, 3))
            share = random.choice([0.3, 0.01, 1e-8])
            target += [*others, random.choice([nodes, nodes + 1])]
            chance += [(1 - share) / len(others)] * len(others) + [share]
            begin.append(len(target))
        rows.append(len(begin) - 1)
    return System(
        node_to_rows=np.array(rows),
        row_to_branches=np.array(begin),
        target=np.array(target),
        probability=np.array(chance),
        cost=np.zeros(len(begin) - 1),
        source=np.arange(len(begin) - 1),
        given=True,
    )


def exactly(system: System, high: np.ndarray, low: np.ndarray) -> list[Fraction]:
    """Return the drift of high + low along every row in fractions."""
    x = [Fraction(float(h)) + Fraction(float(d)) for h, d in zip(high, low, strict=True)] + [Fraction(0), Fraction(1)]
    return [
        sum(
            (
                Fraction(float(system.probability[b])) * (x[system.target[b]] - x[system.row_node[a]])
                for b in range(system.row_to_branches[a], system.row_to_branches[a + 1])
            ),
            Fraction(0),
        )
        for a in range(system.rows)
    ]


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("seed", range(30))
def test_the_exact_drift_is_within_its_error(seed: int, compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exact, "is_compiled", lambda _: compiled)  # the kernel or its twin
    random = Random(seed)
    system = random_system(random, 12)
    scale = random.choice([1.0, 1e-150, 1e-300])
    near = random.choice([1.0, 1e-10, 1e-25])
    high = np.array([scale * (0.5 + near * random.random()) for _ in range(12)])
    low = np.array([scale * near * 1e-17 * (random.random() - 0.5) for _ in range(12)])
    total, error = exact.exact_drift(system, high, low)
    size = np.abs(total).max()
    for true, found, doubt in zip(exactly(system, high, low), total.tolist(), error.tolist(), strict=True):
        assert abs(true - Fraction(found)) <= Fraction(doubt)
        assert doubt <= 1e-15 * abs(found) + 1e-28 * size + 1e-320


def corridor(length: int = 30, leak: float = 1e-24) -> System:
    """Return two rooms between which one can go to and fro, hardly ever falling; one of them has a door to the goal."""
    n = length
    begin, target, chance, rows = [0], [], [], [0]
    for s in range(n):
        target += [(s + 1) % n, n]
        chance += [1.0, leak]
        begin.append(len(target))
        target += [n, n + 1]
        chance += [0.5, 0.5]
        begin.append(len(target))
        rows.append(len(begin) - 1)
    return System(
        node_to_rows=np.array(rows),
        row_to_branches=np.array(begin),
        target=np.array(target),
        probability=np.array(chance),
        cost=np.zeros(2 * n),
        source=np.arange(2 * n),
        given=True,
    )


@pytest.mark.parametrize("leak", [1e-12, 1e-20, 1e-24, 1e-60])
def test_where_one_can_wander_for_ages_both_bounds_are_proved(leak: float) -> None:
    system = corridor(leak=leak)
    found = traps.avoid_traps(system, maximise=True)
    assert found is not None
    for share in traps.PLATEAUS:
        smooth = traps.on_plateaus(system, found, share, maximise=True)
        assert smooth is not None
        made, node, best = smooth
        bound = proof.bound_of_all(made, system, node[: system.nodes], best, maximise=True)
        if bound is not None:
            break
    assert bound is not None
    assert (bound >= 0.5).all()
    assert bound.max() <= 0.5 + 1e-9


def test_a_vector_that_rises_by_a_grain_is_refused() -> None:
    system = corridor(leak=1e-40)
    high, low = np.full(system.nodes, 0.5), np.full(system.nodes, 1e-20)
    assert never_rises(system, high, low)
    assert not never_rises(system, high, np.zeros(system.nodes))  # that is the value, and leaves no room for rounding
    assert not never_falls(system, high, low)
    low[3] += 1e-20  # the node before it gains so much by going there
    assert not never_rises(system, high, low)
    low[3] = 0.0
    assert not never_rises(system, high, low)


def test_without_given_probabilities_nothing_is_told_exactly() -> None:
    system = replace(corridor(leak=1e-12), given=False)
    assert not exact.is_exact(system)
    assert not exact.is_exact(replace(system, given=True, cost=np.ones(system.rows)))
    low = np.full(system.nodes, 1e-20)
    low[::2] = 2e-20
    assert not never_rises(system, np.full(system.nodes, 0.5), low)


@pytest.mark.parametrize("seed", range(40))
def test_what_is_kept_of_factors_is_as_good_as_new(seed: int) -> None:
    random = Random(seed)
    system = random_system(random, 60)
    equations = Factored(system)
    rows = np.array([random.randrange(*system.node_to_rows[s : s + 2]) for s in range(60)])
    for _ in range(6):
        assert equations.follow(rows)
        right = np.array([random.random() for _ in range(60)])
        solved = solve_chain(taken(system, rows))
        assert solved is not None
        np.testing.assert_allclose(equations.solve(right), solved.inverse(right), rtol=1e-7)
        rows = rows.copy()
        for s in random.sample(range(60), 2):
            rows[s] = random.randrange(*system.node_to_rows[s : s + 2])
    assert equations.eliminated < 6 * 60


def test_plateaus_are_what_can_be_wandered_on() -> None:
    system = corridor(length=5, leak=1e-24)
    flat = flattened(system, np.full(5, 0.5), np.zeros(5), 1e-16)
    assert flat is not None
    made, node = flat
    assert made.nodes == 1
    assert node.tolist() == [0, 0, 0, 0, 0, 1, 2]
    assert made.rows == 10
    assert flattened(system, np.arange(1, 6) / 10, np.zeros(5), 1e-16) is None


@pytest.mark.parametrize("objective", WANTED)
@pytest.mark.parametrize("seed", range(25))
def test_whatever_is_found_past_traps_the_bounds_hold(
    seed: int, objective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = Random(seed)
    honest = traps.avoid_traps

    def liar(*args: object, **settings: object) -> object:
        found = honest(*args, **settings)  # type: ignore[arg-type]
        if found is None:
            return None
        push = 10.0 ** -random.randint(1, 25) * np.array([random.uniform(-1, 1) for _ in found.high])
        high = np.clip(found.high + push, 0.0, 1.0)
        total, error = exact.exact_drift(found.equations.system, high, found.low)
        return replace(found, high=high, drift=total, error=error)

    monkeypatch.setattr(attained, "avoid_traps", liar)
    problem = trapped_problem(random, objective, states=5)
    solution = solve(problem)
    for bounds in ((solution.lower, solution.upper), (solution.policy_lower, solution.policy_upper)):
        for value, low, high in zip(
            optimum_by_enumeration(problem) if bounds[0] is solution.lower else [None] * 5,
            *(part[0].tolist() for part in bounds),
            strict=True,
        ):
            assert low <= high
            if value is not None:
                assert Fraction(low) <= value <= Fraction(high)


def steps_exactly(problem: Problem, steps: int) -> list[Fraction]:
    """Return the largest probability to be at the goal within so many steps, through no hazard."""
    mdp = problem.mdp
    goal, hazard = mdp.labels["goal"], mdp.labels["hazard"]
    values = [Fraction(int(g)) for g in goal]
    for _ in range(steps):
        values = [
            values[s]
            if goal[s] or hazard[s]
            else max(sum(p * values[t] for t, p in chances.items()) for chances, _ in rows)
            for s, rows in enumerate(rows_of(problem))
        ]
    return values


@pytest.mark.parametrize("seed", range(20))
def test_where_no_bound_is_proved_from_above_it_is_said_for_how_many_steps_one_is(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proof, "bound_of_all", lambda *_: None)
    problem = trapped_problem(Random(seed), "safest", states=5)
    problem = replace(problem, objective=ReachAvoid(goal='"goal"', through='!"hazard"'))
    solution = solve(problem)
    if solution.outcome is Outcome.CERTIFIED:
        assert solution.horizon is None
        assert solution.within is None
        return
    document = value_document(solution, solution.objectives[0])
    if solution.outcome is Outcome.STOPPED:  # the values were no good for that
        assert "horizon" not in document
        return
    assert solution.outcome is Outcome.HORIZON
    assert solution.horizon in (1_000, 10_000, 100_000)
    assert solution.within is not None
    assert (solution.within <= 1.0).all()
    assert (solution.upper[0] == 1.0).any()  # it is no bound
    for value, high in zip(steps_exactly(problem, 12), solution.within.tolist(), strict=True):
        assert value <= Fraction(high)
    assert document["outcome"] == "horizon"
    assert document["horizon"] == solution.horizon
    assert json.dumps(document["upper_within_horizon"])
    assert f"within {solution.horizon:,} steps" in "\n".join(value_lines(document, "P"))


def test_a_vector_that_rises_much_holds_for_no_steps() -> None:
    system = corridor()
    assert within_steps(system, np.full(system.nodes, 0.4)) is None
    assert within_steps(system, np.full(system.nodes, np.nan)) is None
    found = within_steps(system, np.full(system.nodes, 0.5) - 1e-13)
    assert found is not None
    assert found.steps == 100_000
    assert (found.upper >= 0.5).all()
    assert (found.upper <= 0.5 + 1e-7).all()


@pytest.mark.parametrize("seed", range(20))
def test_a_given_policy_is_told_as_sharply(seed: int) -> None:
    random = Random(seed)
    problem = trapped_problem(random, "safest", states=6)
    first = np.array([random.choice(list(problem.mdp.choices_of(s))) for s in range(6)])
    solution = evaluate(problem, Policy(choice=first))
    assert (solution.policy_lower <= solution.policy_upper).all()
    assert (solution.policy_upper - solution.policy_lower <= 1e-6).all()


@pytest.mark.slow
@pytest.mark.kernels
@pytest.mark.parametrize("leak", [1e-9, 1e-30, 1e-100])
@pytest.mark.parametrize("maximise", [False, True])
def test_a_long_way_through_rooms_that_hardly_leak_is_proved_from_both_sides(leak: float, maximise: bool) -> None:
    """Each of 4000 rooms has a door to the next one that is risky; to stay inside seems to be free of it."""
    count = 4000
    risks = np.random.default_rng(1).uniform(1e-6, 1e-3, count)
    trap, goal = 2 * count, 2 * count + 1
    inner, door = 2 * np.arange(count), 2 * np.arange(count) + 1
    ahead = np.append(inner[1:], goal)
    row = np.stack([door, np.full(count, trap), inner, np.full(count, trap), ahead, np.full(count, trap)], 1)
    chance = np.stack([np.full(count, p) for p in (1.0, leak, 1.0, leak)] + [1.0 - risks, risks], 1)
    mdp = MDP(
        state_to_choices=np.append(
            np.stack([3 * np.arange(count), 3 * np.arange(count) + 1], 1), 3 * count + np.arange(3)
        ),
        choice_to_branches=np.append(np.arange(0, 6 * count + 1, 2), [6 * count + 1, 6 * count + 2]),
        branch_to_target=np.append(row, [trap, goal]),
        branch_to_probability=np.append(chance, [1.0, 1.0]),
        choice_to_action=np.zeros(3 * count + 2, dtype=np.int64),
        actions=("go",),
        initial=np.array([0]),
        labels={"trap": np.arange(2 * count + 2) == trap, "goal": np.arange(2 * count + 2) == goal},
    )
    wanted = "goal" if maximise else "trap"
    objective = ReachAvoid(goal=f'"{wanted}"', through=None, maximise=maximise)
    solution = solve(Problem(mdp=mdp, objective=objective))
    arrives = float(np.exp(np.log1p(-risks).sum()))
    assert solution.outcome is Outcome.CERTIFIED
    value = arrives if maximise else 1.0 - arrives
    slack = 1e-11 + 3.0 * count * leak
    assert value - slack <= solution.lower[0, 0] <= solution.upper[0, 0] <= value + slack
