"""Windowed sweeps against policy iteration, and the loops for many branches against those for few."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.models import slippery_map
from ratherthan.model.index import build_index
from ratherthan.model.mdp import Reward
from ratherthan.model.problem import Problem
from ratherthan.solve import PolicyIteration, solve
from ratherthan.solve.optimum import _systems
from ratherthan.solve.system import System, build_system, drift
from ratherthan.solve.task import goal_of, task_of
from ratherthan.solve.windowed import suits_windows, windowed_optimum
from ratherthan.solve.windows import Windows, sweep_windows

pytestmark = pytest.mark.kernels
ROOM = sys.modules["ratherthan.solve.windowed"]


def town(side: int, seed: int, *, slip: float = 0.1) -> Problem:
    """Return a slippery map with unequal costs."""
    problem = slippery_map(side, slip=slip, seed=seed)
    paid = np.random.default_rng(seed).integers(1, 4, problem.mdp.states).astype(float)
    mdp = replace(problem.mdp, rewards={"steps": Reward(choice=np.repeat(paid, 4))})
    return replace(problem, mdp=mdp)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("slip", [0.0, 0.1, 0.45])
def test_windows_find_what_policy_iteration_finds(seed: int, slip: float) -> None:
    problem = town(9 + 3 * seed, seed, slip=slip)
    task = task_of(goal_of(problem, problem.objective))
    if not task.open.any():
        pytest.skip("no state can reach the goal on this map")
    _, core, whole = _systems(task)
    assert core is whole
    quick, exact = windowed_optimum(task, core), solve(problem, method=PolicyIteration())
    assert quick is not None
    lower, upper = exact.lower[0], exact.upper[0]
    assert (quick.lower <= upper).all()
    assert (quick.upper >= lower).all()
    finite = np.isfinite(upper)
    assert (quick.upper[finite] - quick.lower[finite] <= 1e-7 * upper[finite]).all()
    assert (quick.choice == exact.policy.choice).all()


def test_bounds_are_proved_only_where_the_sweeps_converged() -> None:
    problem = town(12, 3)
    task = task_of(goal_of(problem, problem.objective))
    _, core, _ = _systems(task)
    assert windowed_optimum(task, core, Windows(most=2)) is None


def test_sweeps_give_up_where_everything_rests_on_everything() -> None:
    """A walk on a ring that seldom moves on: windows of layers do not help it."""
    states = 400
    forward = np.minimum(np.arange(states) + 1, states)
    back = np.maximum(np.arange(states) - 1, 0)
    begin = np.append(np.arange(states + 1), states)
    index = build_index(begin, np.arange(0, 2 * states + 1, 2), np.stack([forward, back], 1).ravel())
    probability = np.tile([0.5, 0.5], states)
    system = build_system(index, probability, np.ones(states), np.arange(states), np.arange(states + 1))
    found = sweep_windows(system, Windows(width=10, most=50))
    assert not found.converged
    assert found.visits >= 50


def test_a_wrong_vector_is_not_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = town(12, 5)
    task = task_of(goal_of(problem, problem.objective))
    _, core, _ = _systems(task)
    true = sweep_windows(core, Windows())
    for wrong in (true.values * 1.001, true.values * 0.999, np.where(np.arange(core.nodes) == 3, 0.0, true.values)):
        monkeypatch.setattr(ROOM, "sweep_windows", lambda *_, wrong=wrong: true._replace(values=wrong))
        assert windowed_optimum(task, core) is None


def test_only_positive_costs_of_many_states_suit_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = town(12, 5)
    task = task_of(goal_of(problem, problem.objective))
    _, core, whole = _systems(task)
    assert not suits_windows(task, core, whole)  # too few
    monkeypatch.setattr(ROOM, "FEWEST", 10)
    monkeypatch.setattr(ROOM, "is_compiled", lambda _: True)
    assert suits_windows(task, core, whole)
    assert not suits_windows(task, replace(core, cost=np.where(np.arange(core.rows) == 5, 0.0, core.cost)), whole)
    free = replace(core, cost=np.zeros(core.rows))
    assert not suits_windows(task, free, free)


def random_systems(count: int, many: int, monkeypatch: pytest.MonkeyPatch) -> list[System]:
    """Return small random systems, built as if a model had `many` branches at least to be large."""
    monkeypatch.setattr(sys.modules["ratherthan.solve.system"], "MANY", many)
    rng, systems = np.random.default_rng(5), []
    for _ in range(count):
        states = int(rng.integers(2, 12))
        choices = rng.integers(1, 4, states)
        branches = rng.integers(1, 4, int(choices.sum()))
        index = build_index(
            np.concatenate([[0], np.cumsum(choices)]),
            np.concatenate([[0], np.cumsum(branches)]),
            rng.integers(0, states, int(branches.sum())),
        )
        nodes = states - 1  # the last state is the sink of value 0
        node = np.concatenate([rng.permutation(nodes), [nodes]])
        rows = np.flatnonzero(node[index.choice_to_state] < nodes)
        rows = rows[rng.random(len(rows)) < 0.9] if rng.random() < 0.5 else rows
        probability = np.concatenate([rng.dirichlet(np.ones(n)) for n in branches])
        cost = rng.random(len(branches)) * (rng.random(len(branches)) < 0.7)
        if len(rows):
            systems.append(build_system(index, probability, cost, rows, node))
    return systems


def test_systems_and_drifts_of_many_branches_are_those_of_few(monkeypatch: pytest.MonkeyPatch) -> None:
    few = random_systems(60, 10**9, monkeypatch)
    plain = [_facts(system) for system in few]
    monkeypatch.setattr(sys.modules["ratherthan.solve.system"], "is_compiled", lambda _: True)
    compiled = [_facts(system) for system in random_systems(60, 0, monkeypatch)]
    assert len(plain) == len(compiled) > 30
    for first, second in zip(plain, compiled, strict=True):
        for one, other in zip(first, second, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-15)


def _facts(system: System) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(1)
    if len(system.node_to_rows) - 1 != system.nodes or (np.diff(system.node_to_rows) == 0).any():
        return (system.source,)
    high, low = rng.random(system.nodes), 1e-17 * rng.random(system.nodes)
    return (
        system.node_to_rows,
        system.row_to_branches,
        system.target,
        system.probability,
        system.source,
        *drift(system, high, low),
        *drift(system, high, cost=np.ones(system.rows), one=0.0),
    )
