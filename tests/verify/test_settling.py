"""Sweeps of large systems: what they prove contains the exact values, compiled or not, and wrong values are never proved."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from random_models import OBJECTIVES, problem_of, random_policy, random_problem

from ratherthan.model.objective import Discounted, ExpectedCost, ReachAvoid
from ratherthan.model.problem import Problem
from ratherthan.verify import candidates, equations, settling
from ratherthan.verify._kernels import Table, arranged, nearest, outwards
from ratherthan.verify.aims import frame_of
from ratherthan.verify.candidates import Budget
from ratherthan.verify.frame import Frame
from ratherthan.verify.values import Band, following, optimum

EXACT, SWEPT = Budget(exact=1000), Budget(exact=0, fill=0)
"""Fractions; and sweeps alone, for nothing is solved."""


@pytest.fixture
def sweeps_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take small systems for large ones."""
    monkeypatch.setattr(candidates, "DENSE", 0)
    monkeypatch.setattr(candidates, "EASY", -1)
    monkeypatch.setattr(settling, "PLAIN_WORK", 300_000)


def frame(problem: Problem) -> Frame:
    assert problem.objective is not None
    return frame_of(problem, problem.objective)


def larger_problem(seed: int) -> Problem:
    return random_problem(Random(seed), most_states=40, objective=list(OBJECTIVES.values())[seed % len(OBJECTIVES)])


def assert_holds(exact: Band, swept: Band) -> bool:
    """Assert that swept bounds contain the exact values; return whether they are near to each other where those are finite."""
    assert (swept.lower <= exact.upper).all()
    assert (exact.lower <= swept.upper).all()
    finite = np.isfinite(exact.upper) & np.isfinite(exact.lower)
    size = np.maximum(np.abs(exact.upper[finite]), 1e-300)
    return bool((swept.upper[finite] - swept.lower[finite] <= 1e-7 * size).all())


@pytest.mark.kernels
@pytest.mark.usefixtures("sweeps_alone")
@pytest.mark.parametrize("seed", range(6))
def test_sweeps_alone_agree_with_fractions(seed: int) -> None:
    """Where sweeps come to no end in the work that they may do, nothing is said."""
    problems = [larger_problem(10 * seed + k) for k in range(10)]
    closed = [assert_holds(optimum(frame(problem), EXACT), optimum(frame(problem), SWEPT)) for problem in problems]
    assert sum(closed) >= 7


@pytest.mark.kernels
@pytest.mark.usefixtures("sweeps_alone")
@pytest.mark.parametrize("seed", range(4))
def test_sweeps_along_a_policy_agree_with_fractions(seed: int) -> None:
    closed = []
    for k in range(10):
        problem = larger_problem(10 * seed + k)
        weight = random_policy(Random(k), problem.mdp, randomised=k % 2 == 0).weights(problem.mdp)
        exact, swept = (following(frame(problem), weight, budget) for budget in (EXACT, SWEPT))
        closed.append(assert_holds(exact, swept))
    assert sum(closed) >= 7


@pytest.mark.kernels
@pytest.mark.usefixtures("sweeps_alone")
@pytest.mark.parametrize("seed", range(30))
def test_discounted_sums_of_both_signs_agree_with_fractions(seed: int) -> None:
    random = Random(seed)
    problem = random_problem(random, most_states=30, objective=OBJECTIVES["least cost"])
    for discount in (0.5, 0.99):
        for maximise in (False, True):
            wanted = frame_of(problem, Discounted(reward="cost", discount=discount, maximise=maximise))
            exact, swept = optimum(wanted, EXACT), optimum(wanted, SWEPT)
            assert (swept.lower <= exact.upper).all()
            assert (exact.lower <= swept.upper).all()
            most = max(float(np.abs(exact.upper).max()), 1e-300)
            assert (swept.upper - swept.lower <= 1e-7 * most).all()


@pytest.mark.usefixtures("sweeps_alone")
@pytest.mark.parametrize("seed", range(1, 13))
@pytest.mark.parametrize("factor", [1 - 1e-7, 1 + 1e-7, 0.5, 2.0, -1.0, np.nan, np.inf])
def test_whatever_sweeps_come_to_nothing_wrong_is_proved(
    seed: int, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = larger_problem(seed)
    exact, real = optimum(frame(problem), EXACT), settling._System.settled

    def wrong(self, y, work):
        found = real(self, y, work)
        return None if found is None else found * np.where(np.arange(len(found)) % 3 == seed % 3, factor, 1.0)

    monkeypatch.setattr(settling._System, "settled", wrong)
    with np.errstate(all="ignore"):
        swept = optimum(frame(problem), SWEPT)
    assert (swept.lower <= exact.upper).all()
    assert (exact.lower <= swept.upper).all()


@pytest.mark.usefixtures("sweeps_alone")
def test_what_takes_too_much_work_is_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two states that mostly lead to each other, for a thousand million steps: no sweeps come to an end there."""
    monkeypatch.setattr(settling, "PLAIN_WORK", 20_000)
    monkeypatch.setattr(settling, "WORK", 20_000)
    away = {"go": ([(1 - 1e-9, 1), (1e-9, 2)], 1.0)}
    table = {0: away, 1: {"back": ([(1.0, 0)], 1.0)}, 2: {"stay": ([(1.0, 2)], 0.0)}}
    band = optimum(frame(problem_of(table, OBJECTIVES["least cost"], goals=[2])), SWEPT)
    assert band[0].lower <= 2e9 <= band[0].upper


@pytest.mark.usefixtures("sweeps_alone")
def test_who_goes_round_for_ever_is_not_taken_for_one_who_arrives() -> None:
    """Staying and going are equally likely to arrive in the end: the policy that proves it is one that goes."""
    table = {
        0: {"round": ([(1.0, 1)], 0.0), "go": ([(0.5, 2), (0.5, 3)], 0.0)},
        1: {"round": ([(1.0, 0)], 0.0), "back": ([(0.9, 0), (0.1, 3)], 0.0)},
        2: {"stay": ([(1.0, 2)], 0.0)},
        3: {"stay": ([(1.0, 3)], 0.0)},
    }
    problem = problem_of(table, OBJECTIVES["safest"], goals=[2], hazards=[3])
    band = optimum(frame(problem), SWEPT)
    assert band[0].lower == pytest.approx(0.5, rel=1e-9)
    assert band[0].upper == pytest.approx(0.5, rel=1e-9)


def slippery(side: int, seed: int) -> Problem:
    """Return a map with obstacles on which every move slips sideways one time in five."""
    rng = np.random.default_rng(seed)
    free = rng.random((side, side)) > 0.2
    free[0, 0] = free[-1, -1] = True
    cells = np.flatnonzero(free)
    number = np.full(side * side, -1)
    number[cells] = np.arange(len(cells))
    table = {}
    for cell in cells.tolist():
        row, column = divmod(cell, side)
        near = []
        for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            r, c = row + down, column + right
            inside = 0 <= r < side and 0 <= c < side and free[r, c]
            near.append(int(number[r * side + c]) if inside else int(number[cell]))
        table[int(number[cell])] = {
            name: ([(0.8, near[k]), (0.1, near[(k + 1) % 4]), (0.1, near[k - 1])], 1.0)
            for k, name in enumerate(("east", "south", "west", "north"))
        }
    goal, hazard = len(cells) - 1, len(cells) // 2
    return problem_of(table, OBJECTIVES["least cost"], goals=[goal], hazards=[hazard])


@pytest.mark.kernels
@pytest.mark.parametrize("seed", range(2))
def test_solving_and_sweeping_agree_on_a_map(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = slippery(24, seed)
    goals = (
        ExpectedCost(goal='"goal"', reward="cost"),
        ReachAvoid(goal='"goal"', through='!"hazard"'),
        ReachAvoid(goal='"hazard"', through='!"goal"', maximise=True),
    )
    for wanted in goals:
        own = frame_of(problem, wanted)
        solved = optimum(own, Budget(exact=0))
        with monkeypatch.context() as patched:
            patched.setattr(candidates, "DENSE", 0)
            patched.setattr(candidates, "EASY", -1)
            swept = optimum(own, SWEPT)
        known = np.isfinite(solved.upper)
        assert (swept.lower <= solved.upper).all()
        assert (solved.lower <= swept.upper).all()
        assert (swept.upper[known] - swept.lower[known] <= 1e-7 * np.maximum(swept.upper[known], 1e-9)).all()


@pytest.mark.kernels
@pytest.mark.parametrize("seed", range(40))
def test_both_ways_to_add_up_what_a_sweep_changes_agree(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = larger_problem(seed)
    own, rng = frame(problem), np.random.default_rng(seed)
    choices = np.arange(problem.mdp.choices)
    opened = equations.Open(
        frame=own,
        open=np.ones(problem.mdp.states, dtype=np.bool_),
        rows=np.ones(len(choices), dtype=np.bool_),
        known=np.zeros(problem.mdp.states),
        block=np.full(problem.mdp.states, -1),
    )
    rows = equations.rows_of(opened, choices)
    x = rng.normal(size=problem.mdp.states) * 10.0 ** rng.integers(-3, 9)
    for rest in (None, 1e-12 * rng.normal(size=problem.mdp.states)):
        found = []
        for looped in (False, True):
            monkeypatch.setattr(equations, "is_compiled", lambda _, looped=looped: looped)
            found.append(rows.drift(x, rest))
        (plain, error), (other, further) = found
        assert (np.abs(plain - other) <= error + further).all()
        assert np.allclose(error, further, rtol=1e-9)


@pytest.mark.parametrize("seed", range(60))
def test_nearest_finds_the_shortest_ways(seed: int) -> None:
    """Bellman and Ford's relaxing of all moves until nothing changes is the measure."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 30))
    moves = int(rng.integers(0, 4 * count))
    origin, target = rng.integers(0, count, moves), np.sort(rng.integers(0, count, moves))
    length = rng.choice([0.0, 0.1, 0.5, float(rng.random())], moves)
    ends = rng.random(count) < 0.2
    expected = np.where(ends, 0.0, np.inf)
    for _ in range(count):
        for a, b, far in zip(origin, target, length, strict=True):
            expected[a] = min(expected[a], far + expected[b])
    first = np.concatenate([[0], np.cumsum(np.bincount(target, minlength=count))]).astype(np.int64)
    distance, room = np.where(ends, 0.0, np.inf), np.zeros((2, count), dtype=np.int64)
    settled = nearest(first, origin, length, distance, room[0], room[1])
    assert (distance == expected).all()
    assert settled == np.isfinite(expected).sum()


@pytest.mark.parametrize("seed", range(40))
def test_arranged_rows_are_the_same_rows(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 9))
    begin = np.concatenate([[0], np.cumsum(rng.integers(1, 4, n))]).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(rng.integers(0, 4, begin[-1]))]).astype(np.int64)
    table = Table(begin, first, rng.integers(0, n, first[-1]).astype(np.int32), rng.random(first[-1]))
    order = rng.permutation(n).astype(np.int64)
    after, number = arranged(table, order)
    for i, node in enumerate(order.tolist()):
        assert number[after.begin[i] : after.begin[i + 1]].tolist() == list(range(begin[node], begin[node + 1]))
    for row, was in enumerate(number.tolist()):
        new, old = slice(after.first[row], after.first[row + 1]), slice(first[was], first[was + 1])
        assert order[after.target[new]].tolist() == table.target[old].tolist()
        assert after.share[new].tolist() == table.share[old].tolist()


def test_layers_lie_as_many_moves_from_the_outside() -> None:
    """A line of four nodes, of which the last leads outside, and one that leads nowhere."""
    begin = np.arange(6)
    first = np.array([0, 1, 2, 3, 3, 4])
    table = Table(begin, first, np.array([1, 2, 3, 4], dtype=np.int32), np.ones(4))
    outer = np.array([False, False, False, True, False])
    order, starts, taken = outwards(table, outer, np.ones(5, dtype=np.bool_))
    assert order.tolist() == [3, 2, 1, 0]
    assert starts.tolist() == [0, 1, 2, 3, 4]
    assert taken.tolist() == [0, 1, 2, 3, -1]
