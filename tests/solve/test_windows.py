"""Windowed sweeps against policy iteration, and the loops for many branches against those for few."""

from __future__ import annotations

import sys
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from exact import optimum_by_enumeration
from random_models import OBJECTIVES, problem_of

from benchmarks.models import expander, slippery_map
from ratherthan.errors import LimitError
from ratherthan.model.index import build_index
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import ExpectedCost, levels_of
from ratherthan.model.problem import Problem
from ratherthan.model.watch import Limits, current, keep, watching
from ratherthan.solve import PolicyIteration, solve
from ratherthan.solve._kernels import Swept, scaling_needs, swept_rows
from ratherthan.solve.precise import aiming
from ratherthan.solve.stopped import keeping
from ratherthan.solve.system import ROUNDING, System, build_system, drift
from ratherthan.solve.task import Task, goal_of, task_of
from ratherthan.solve.windowed import suits_windows, windowed_optimum
from ratherthan.solve.windows import Sweeping, Windows, _visits_left, begin_sweeps, sweep_on

pytestmark = pytest.mark.kernels
ROOM = sys.modules["ratherthan.solve.windowed"]


def town(side: int, seed: int, *, slip: float = 0.1) -> Problem:
    """Return a slippery map with unequal costs."""
    problem = slippery_map(side, slip=slip, seed=seed)
    paid = np.random.default_rng(seed).integers(1, 4, problem.mdp.states).astype(float)
    mdp = replace(problem.mdp, rewards={"steps": Reward(choice=np.repeat(paid, 4))})
    return replace(problem, mdp=mdp)


def task_on(problem: Problem) -> Task:
    """Return the task that a problem's own objective sets."""
    return task_of(goal_of(problem, problem.objective))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("slip", [0.0, 0.1, 0.45])
def test_windows_find_what_policy_iteration_finds(seed: int, slip: float) -> None:
    problem = town(9 + 3 * seed, seed, slip=slip)
    task = task_on(problem)
    if not task.open.any():
        pytest.skip("no state can reach the goal on this map")
    quick, exact = windowed_optimum(task), solve(problem, method=PolicyIteration())
    assert quick is not None
    lower, upper = exact.lower[0], exact.upper[0]
    assert (quick.lower <= upper).all()
    assert (quick.upper >= lower).all()
    finite = np.isfinite(upper)
    assert (quick.upper[finite] - quick.lower[finite] <= 2e-7 * upper[finite]).all()
    assert (quick.choice == exact.policy.choice).all()


def test_bounds_are_proved_only_where_the_sweeps_converged() -> None:
    assert windowed_optimum(task_on(town(12, 3)), Windows(most=2)) is None


def chain(states: int, forward: float) -> tuple[Swept, Sweeping, Windows]:
    """Return the rows of a walk on a line that moves on with a probability, and sweeps of it."""
    onward, back = np.maximum(np.arange(states) - 1, -1), np.minimum(np.arange(states) + 1, states - 1)
    target = np.where(np.stack([onward, back], 1) < 0, states, np.stack([onward, back], 1)).ravel()
    index = build_index(np.append(np.arange(states + 1), states), np.arange(0, 2 * states + 1, 2), target)
    rows = index.state_to_choices, index.choice_to_branches, index.branch_to_target
    order = np.arange(states, dtype=np.int32)
    rank = np.append(order, np.int32(states))
    swept = swept_rows(rows, np.tile([forward, 1 - forward], states), np.ones(states), order, rank)
    settings = Windows(width=10, most=50)
    return swept, begin_sweeps(order, swept.least, settings), settings


def test_sweeps_give_up_where_everything_rests_on_everything() -> None:
    """A walk that seldom moves on: windows of layers do not help it, and it is told long before all visits are made."""
    swept, state, settings = chain(400, 0.9)
    assert sweep_on(swept.rows, state, settings)
    swept, state, settings = chain(4000, 0.5)
    assert not all(sweep_on(swept.rows, state, settings) for _ in range(9))
    assert state.visits <= 2 * settings.most * 4000


def test_windows_that_overlap_and_windows_of_all_layers_come_to_the_same() -> None:
    for width in (20, 10**6):
        swept, state, _ = chain(50, 0.9)
        state.width, settings = width, Windows(width=width)
        for _ in range(12):
            assert sweep_on(swept.rows, state, settings)
        assert state.values[:50] == pytest.approx(solve(line(50, 0.9)).values[0][:50], rel=1e-6)


def line(states: int, forward: float) -> Problem:
    """Return the same walk as a problem."""
    table = {
        s: {
            "go": (
                [(forward, s - 1), (1 - forward, min(s + 1, states - 1))]
                if s
                else [(forward, states), (1 - forward, 1)],
                1,
            )
        }
        for s in range(states)
    }
    table[states] = {"stay": ([(1.0, states)], 0)}
    return problem_of(table, OBJECTIVES["least cost"], goals=[states])


def test_rows_that_are_nearly_as_good_as_the_best_do_not_end_the_sweeps() -> None:
    """What is listed first and lies behind the best by less than what ties may lose is taken, and the bounds allow for it."""
    plain = line(300, 0.9)
    offsets = plain.mdp.choice_to_branches
    twice = np.repeat(np.arange(301), 2)
    cost = np.where(twice < 300, 1.0 + np.tile([1.6e-7, 0.0], 301), 0.0)
    mdp = replace(
        plain.mdp,
        state_to_choices=2 * plain.mdp.state_to_choices,
        choice_to_branches=np.concatenate([[0], np.cumsum(np.diff(offsets)[twice])]),
        branch_to_target=np.concatenate([plain.mdp.branch_to_target[offsets[s] : offsets[s + 1]] for s in twice]),
        branch_to_probability=np.concatenate(
            [plain.mdp.branch_to_probability[offsets[s] : offsets[s + 1]] for s in twice]
        ),
        choice_to_action=np.tile([0, 1], 301),
        actions=("scenic", "go"),
        rewards={name: Reward(choice=cost) for name in plain.mdp.rewards},
    )
    found = windowed_optimum(task_on(replace(plain, mdp=mdp)))
    best = solve(plain).values[0][:300]
    assert found is not None
    assert (found.choice[:300] == 2 * np.arange(300)).all()  # the first listed
    assert (found.lower[:300] <= best).all()
    assert (found.upper[:300] >= best * (1 + 1.6e-7)).all()  # what that plan costs
    assert (found.upper[:300] - found.lower[:300] <= 1e-6 * best).all()


def exact_needs(problem: Problem, values: np.ndarray, factor: Fraction) -> list[Fraction]:
    """Return cost + Σ p x - x over fractions for x = factor · values, p divided by their sum, of all rows with finite targets."""
    mdp, found = problem.mdp, []
    for s in range(mdp.states):
        if not np.isfinite(values[s]) or mdp.labels["goal"][s]:
            continue
        for c in mdp.choices_of(s):
            own = mdp.branches_of(c)
            if not np.isfinite(values[mdp.branch_to_target[own]]).all():
                continue
            chances = [Fraction(float(p)) for p in mdp.branch_to_probability[own]]
            after = [factor * Fraction(float(values[t])) for t in mdp.branch_to_target[own]]
            mean = sum((p * x for p, x in zip(chances, after, strict=True)), Fraction(0)) / sum(chances)
            found.append(Fraction(float(mdp.rewards["steps"].choice[c])) + mean - factor * Fraction(float(values[s])))
    return found


@pytest.mark.parametrize("seed", range(12))
def test_scaled_values_never_fall_in_exact_arithmetic(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops, equal targets twice, costs of all sizes and probabilities that miss 1 by rounding: the need is large enough."""
    rng = np.random.default_rng(seed)
    problem = rough(rng)
    task = task_on(problem)
    if not task.open.any():
        pytest.skip("the goal cannot be reached")
    level, order = ROOM._nearest(task)
    swept = ROOM._rows(task, order)
    state = begin_sweeps(level[order], swept.least, Windows())
    for _ in range(4):
        sweep_on(swept.rows, state, Windows(most=10**6))
    values = state.values.copy()
    for spoilt in (values, values * (1 + 1e-3 * rng.random(len(values)))):
        needs = scaling_needs(
            swept.rows,
            swept.source,
            spoilt,
            (1e-7 * swept.least, (swept.longest + 8) * ROUNDING),
            ROOM.fixed_best(task),
        )
        if not needs.below < 0.5:
            continue
        on_states = np.where(np.isfinite(task.fixed), 0.0, np.inf)
        on_states[order] = spoilt[: len(order)]
        factor = 1 - Fraction(needs.below * ROOM.ROOM + ROOM.TINY)
        assert min(exact_needs(problem, on_states, factor)) >= 0
        if needs.below > 1e-4:  # what is needed is needed: half of it is not enough
            assert min(exact_needs(problem, on_states, 1 - Fraction(needs.below) / 2)) < 0


def rough(rng: np.random.Generator) -> Problem:
    """Return a random problem with a goal, some loops and doubled targets, and rows that sum to 1 only nearly."""
    states = int(rng.integers(3, 9))
    choices = rng.integers(1, 4, states)
    branches = rng.integers(1, 5, int(choices.sum()))
    target = rng.integers(0, states, int(branches.sum()))
    probability = np.concatenate([rng.dirichlet(np.full(n, 0.3)) for n in branches])
    probability = np.maximum(probability, 1e-9)
    begin = np.concatenate([[0], np.cumsum(branches)])
    probability /= np.repeat(np.add.reduceat(probability, begin[:-1]), branches)
    probability *= 1 + 2e-16 * rng.integers(-3, 4, len(probability))
    goal = np.arange(states) == states - 1
    mdp = MDP(
        state_to_choices=np.concatenate([[0], np.cumsum(choices)]),
        choice_to_branches=begin,
        branch_to_target=target,
        branch_to_probability=np.minimum(probability, 1.0),
        initial=np.array([0]),
        labels={"goal": goal, "hazard": np.zeros(states, dtype=np.bool_)},
        rewards={"steps": Reward(choice=10.0 ** rng.uniform(-3, 3, len(branches)))},
    )
    return Problem(mdp=mdp, objective=ExpectedCost(goal='"goal"', reward="steps"))


@pytest.mark.parametrize("seed", range(40))
def test_bounds_hold_the_exact_optimum(seed: int) -> None:
    problem = rough(np.random.default_rng(100 + seed))
    task = task_on(problem)
    quick = windowed_optimum(task, Windows(most=10**6)) if task.open.any() else None
    if quick is None:
        return
    exact = optimum_by_enumeration(problem)
    for s, value in enumerate(exact):
        assert quick.lower[s] <= value <= quick.upper[s]


def test_a_wrong_vector_is_not_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    task = task_on(town(12, 5))
    true, sweep = ROOM.sweep_on, {}
    for number, spoil in enumerate(
        (lambda v: v * 1.001, lambda v: v * 0.999, lambda v: np.where(np.arange(len(v)) == 3, 0.0, v), lambda v: -v)
    ):

        def wrong(rows, state, *rest, spoil=spoil) -> bool:
            came = true(rows, state, *rest)
            state.values[: state.nodes] = spoil(state.values)[: state.nodes]
            return came

        monkeypatch.setattr(ROOM, "sweep_on", wrong)
        sweep[number] = windowed_optimum(task)
    assert sweep == {0: None, 1: None, 2: None, 3: None}


def test_a_policy_that_need_not_arrive_has_no_upper_bound() -> None:
    """Values that no row of a state lives up to are refused as an upper bound, though they are one from below."""
    swept, state, settings = chain(40, 0.9)
    sweep_on(swept.rows, state, settings)
    state.values[:40] *= 0.5
    needs = scaling_needs(swept.rows, swept.source, state.values, (1e-8, 1e-14), np.zeros(40, dtype=np.bool_))
    assert needs.below < 1e-6 < 0.1 < needs.above


def test_only_positive_costs_of_many_states_suit_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    task = task_on(town(12, 5))
    assert not suits_windows(task)  # too few
    monkeypatch.setattr(ROOM, "FEWEST", 10)
    monkeypatch.setattr(ROOM, "is_compiled", lambda _: True)
    assert suits_windows(task)
    free = np.arange(task.goal.index.choices) != np.flatnonzero(task.allowed)[5]
    assert not suits_windows(replace(task, goal=replace(task.goal, costly=free)))
    assert not suits_windows(replace(task, goal=replace(task.goal, maximise=True)))


def test_where_there_is_no_cycle_one_backward_pass_is_left_to_do_it() -> None:
    straight = line(50, 1.0)
    assert windowed_optimum(task_on(straight)) is None
    assert solve(straight).engine == "one backward pass"


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


def test_bounds_are_as_narrow_as_the_precision_wants_them() -> None:
    task = task_on(town(15, 4))
    widths = []
    for precision in (1e-3, 1e-6, 1e-8):
        with aiming(precision):
            found = windowed_optimum(task)
        assert found is not None
        own = task.open
        widths.append(float(((found.upper[own] - found.lower[own]) / found.upper[own]).max()))
    assert widths[0] <= 4e-7
    assert widths[1] <= 4e-7
    assert widths[2] <= 4e-9


@pytest.mark.parametrize("passed", [False, True])
def test_what_was_swept_is_told_where_a_limit_ends_it(passed: bool) -> None:
    problem = town(15, 4)
    task, whole = task_on(problem), solve(problem)
    sweep = ROOM.sweep_on

    def stop(*work: Any) -> bool:
        if passed:
            sweep(*work)
        raise LimitError("The time limit of 1 s was reached.", limit="time")

    with (
        pytest.MonkeyPatch.context() as patched,
        watching(Limits(seconds=600)),
        keeping(problem, levels_of(problem.objective)),
    ):
        keep(task=task)
        patched.setattr(ROOM, "sweep_on", stop)
        with pytest.raises(LimitError):
            windowed_optimum(task)
        seen = dict(current().board.kept)
    lower, upper = seen["bounds"]
    assert len(seen["guess"]) == len(lower) == len(upper) == int(task.open.sum())
    assert whole.outcome.name == "CERTIFIED"
    assert (lower <= whole.upper[0][task.open]).all()
    assert (upper >= whole.lower[0][task.open]).all()
    assert np.isfinite(upper).all() == passed
    assert (lower > 0.0).all() == passed


@pytest.mark.parametrize("states", [3200, 5000])
def test_a_window_that_holds_everything_is_given_more_than_one_look(states: int) -> None:
    """A guess of what is left takes two looks: small models make many sweeps between these."""
    if not ROOM.is_compiled(10**9):
        pytest.skip("windows are swept by compiled code only")
    solution = solve(expander(states))
    assert solution.engine == "windowed sweeps"
    assert solution.outcome.name == "CERTIFIED"


def test_where_the_goal_costs_nothing_the_policy_arrives_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 0 both choices are free, and the one listed first goes round for ever."""
    table = {
        0: {"a": ([(1.0, 0)], 0.0), "b": ([(0.5, 2), (0.5, 0)], 0.0)},
        1: {"a": ([(0.5, 0), (0.5, 1)], 1.0), "b": ([(0.5, 2), (0.5, 1)], 2.0)},
        2: {"a": ([(1.0, 2)], 0.0)},
    }
    problem = problem_of(table, OBJECTIVES["least cost"], goals=[2])
    monkeypatch.setattr(ROOM, "FEWEST", 1)
    monkeypatch.setattr(ROOM, "is_compiled", lambda _: True)
    solution = solve(problem)
    assert solution.engine == "windowed sweeps"
    assert solution.policy.choice.tolist() == [1, 2, 4]


def test_what_is_left_of_a_window_is_guessed_from_steady_progress_only() -> None:
    """A row that is found late makes values jump: that is no reason to give a window up."""
    slow = [(k, 0.999**k) for k in range(1, 17)]
    assert _visits_left(slow, 1e-6) > 1e4
    assert _visits_left(slow[:7], 1e-6) == 0.0  # too early to tell
    quick = [(k, 0.1**k) for k in range(1, 17)]
    assert _visits_left(quick, 1e-20) == pytest.approx(4.0, abs=1.5)
    assert _visits_left([(k, 1.0) for k in range(1, 17)], 1e-6) == np.inf
    assert _visits_left([*slow, (17, 7.5), (18, 0.2), (19, 0.01)], 1e-6) == 0.0
    steady = [(k, 50.0 - 6 * k) for k in range(1, 9)]
    assert _visits_left(steady, 1e-6) < 40
