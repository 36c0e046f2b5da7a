"""Sweeps, rough solves and collected margins on small random models, against every policy in exact fractions."""

from __future__ import annotations

import importlib
from dataclasses import replace
from fractions import Fraction
from random import Random
from typing import Any

import numpy as np
import pytest
from exact import level_values
from random_models import GOAL, Table, problem_of, random_table

from ratherthan.errors import QuestionError
from ratherthan.explain import explain, question
from ratherthan.explain.measures import Factors
from ratherthan.model.mdp import Floats, Reward
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, Level, Lexicographic
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, evaluate, solve
from ratherthan.solve.contracting import contracted
from ratherthan.solve.contracting.corrections import corrected, repaired
from ratherthan.solve.contracting.field import Field, begin_with, field_of, residual_of, swept
from ratherthan.solve.contracting.growth import growing_nodes
from ratherthan.solve.contracting.proof import bounded_by, gaps_of, margins_for
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.equations import systems_of
from ratherthan.solve.policy_iteration import rows_towards_sinks
from ratherthan.solve.task import goal_of, task_of

pytestmark = pytest.mark.kernels
ROOM = "ratherthan.solve.contracting."
contraction, field, proof, chain, optimum = (
    importlib.import_module(name)
    for name in (
        ROOM + "contraction",
        ROOM + "field",
        ROOM + "proof",
        "ratherthan.solve.chain",
        "ratherthan.solve.optimum",
    )
)
LEVELS: tuple[Level, ...] = (
    ExpectedCost(goal=GOAL, reward="cost"),
    ExpectedCost(goal=GOAL, reward="cost", maximise=True),
    ExpectedReward(goal=GOAL, reward="cost"),
    ExpectedReward(goal=GOAL, reward="cost", maximise=False),
    Discounted(reward="cost", discount=0.9),
    Discounted(reward="cost", discount=0.9, maximise=False),
)


@pytest.fixture
def at_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let sweeps have the first turn, however few states there are."""
    monkeypatch.setattr(contraction, "FEWEST", 1)
    monkeypatch.setattr(contraction, "is_compiled", lambda _: True)
    monkeypatch.setattr(chain, "SOME", 0)
    monkeypatch.setattr(optimum, "_windowed", lambda *_: None)
    monkeypatch.setattr(optimum, "_layered_bounds", lambda *_: None)


def random_sums(seed: int, level: Level, *, slow: bool = False, states: int = 6) -> Problem:
    """Return a random problem; with `slow` some choices hardly ever move on."""
    random = Random(seed)
    prices = [0, 0, 1, 2, 3] if isinstance(level, ExpectedCost) else [-3, -2, -1, -1, 0, 1]
    table: Table = {}
    for state, row in random_table(random, random.randint(2, states)).items():
        table[state] = {}
        for action, (branches, _) in row.items():
            if slow and random.random() < 0.3:
                branches = [(1e-9 * p, t) for p, t in branches] + [(1.0 - 1e-9, state)]
            table[state][action] = (branches, random.choice(prices))
    goals = random.sample(range(len(table)), min(len(table), random.choice([1, 1, 2])))
    return problem_of(table, level, goals=goals)


def true_values(problem: Problem, level: Level) -> list[Fraction | float]:
    every = [range(len(problem.mdp.choices_of(s))) for s in range(problem.mdp.states)]
    return level_values(problem, level, every, set())


def assert_within(solution: Any, best: list[Fraction | float]) -> None:
    for value, lower, upper in zip(best, solution.lower[0].tolist(), solution.upper[0].tolist(), strict=True):
        assert lower <= value <= upper


@pytest.mark.usefixtures("at_any_size")
@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
@pytest.mark.parametrize("slow", [False, True], ids=["", "slow"])
@pytest.mark.parametrize("seed", range(25))
def test_bounds_hold_for_every_kind_of_sum(seed: int, slow: bool, level: Level) -> None:
    problem = random_sums(seed, level, slow=slow, states=5)
    assert_within(solve(problem), true_values(problem, level))


@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
@pytest.mark.parametrize("seed", range(25))
def test_large_models_are_answered_as_small_ones(seed: int, level: Level, request: pytest.FixtureRequest) -> None:
    problem = random_sums(seed, level)
    small = solve(problem)
    request.getfixturevalue("at_any_size")
    large = solve(problem)
    assert np.allclose(small.values[0], large.values[0], rtol=1e-6, atol=1e-6)
    assert (small.lower[0] <= large.upper[0]).all()
    assert (large.lower[0] <= small.upper[0]).all()
    assert (small.policy.choice == large.policy.choice).all()
    assert large.outcome is small.outcome


@pytest.mark.usefixtures("at_any_size")
@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
def test_sweeps_prove_most_of_them(level: Level) -> None:
    """The laws above would hold as well if sweeps never had an answer."""
    answered = asked = 0
    for seed in range(30):
        task = task_of(goal_of(random_sums(seed, level), level))
        if task.open.any() and not np.isinf(task.fixed).any():
            node, core, whole = systems_of(task)
            found, _ = contracted(task, (core, whole), node)
            answered, asked = answered + (found is not None and found.good), asked + 1
    assert asked > 3
    assert answered >= 0.6 * asked


@pytest.mark.usefixtures("at_any_size")
@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
@pytest.mark.parametrize("seed", range(25))
def test_whatever_sweeps_say_the_bounds_hold(seed: int, level: Level, monkeypatch: pytest.MonkeyPatch) -> None:
    random, problem = Random(seed), random_sums(seed, level, states=5)
    true = Field.of_nodes

    def lying(self: Field) -> Floats:
        values = true(self)
        return values * np.array([random.choice([-1.0, 0.0, 1.0, 1.0, 1.0 + 1e-9, 0.9, 2.0]) for _ in values])

    monkeypatch.setattr(Field, "of_nodes", lying)
    assert_within(solve(problem), true_values(problem, level))


@pytest.mark.usefixtures("at_any_size")
@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
@pytest.mark.parametrize("seed", range(15))
def test_whatever_margin_is_tried_the_bounds_hold(seed: int, level: Level, monkeypatch: pytest.MonkeyPatch) -> None:
    random, problem = Random(seed), random_sums(seed, level, states=5)
    true = contraction.margins_for

    def careless(*given: Any, **named: Any) -> Floats | None:
        margin = true(*given, **named)
        return None if margin is None else margin * np.array([random.choice([0.0, 0.5, 1.0]) for _ in margin])

    monkeypatch.setattr(contraction, "margins_for", careless)
    assert_within(solve(problem), true_values(problem, level))


def line(length: int, *, cost: float = 1.0, back: float = 0.4, free: bool = True) -> Problem:
    """Return a walk that goes on or back, with two choices of equal costs, and perhaps one more that costs nothing but goes back."""
    table: Table = {}
    for s in range(length):
        step = ([(1.0 - back, s + 1), (back, max(s - 1, 0))], cost)
        table[s] = {"a": step, "b": step}
        if free:
            table[s]["c"] = ([(0.5, s), (0.5, max(s - 1, 0))], 0.0 if s else cost)
    table[length] = {"a": ([(1.0, length)], 0.0)}
    return problem_of(table, ExpectedCost(goal=GOAL, reward="cost"), goals=[length])


def test_a_wrong_value_is_refused_and_a_right_one_with_its_margin_is_not() -> None:
    problem = line(40, back=0.1)
    assert problem.objective is not None
    task = task_of(goal_of(problem, problem.objective))
    node, core, whole = systems_of(task)
    own = node[task.open]
    area = field_of(core, maximise=False)
    assert begin_with(area, rows_towards_sinks(core), unit=1.0)
    assert swept(area, 1e-10, unit=1.0)
    values = area.of_nodes()
    gaps = gaps_of(core, values, maximise=False)
    margin = margins_for(core, values, gaps, 1.0)
    assert margin is not None
    assert margin.max() < 1e-5
    assert bounded_by(whole, values[own], margin[own], maximise=False) is not None
    for wrong in (
        values + 1e-3 * np.arange(len(values)),
        values * 1.001,
        np.where(values == values.max(), 1e9, values),
    ):
        assert bounded_by(whole, wrong[own], margin[own], maximise=False) is None
    assert bounded_by(whole, values[own], 0.0 * margin[own], maximise=False) is None


def test_rough_solves_find_what_sweeps_find() -> None:
    problem = line(60, back=0.1)
    assert problem.objective is not None
    task = task_of(goal_of(problem, problem.objective))
    _, core, _ = systems_of(task)
    one, other = field_of(core, maximise=False), field_of(core, maximise=False)
    begin_with(one, rows_towards_sinks(core), unit=1.0)
    assert swept(one, 1e-11, unit=1.0)
    assert corrected(other, 1e-9, unit=1.0)
    assert residual_of(other) <= 1e-9
    assert np.allclose(one.of_nodes(), other.of_nodes(), rtol=1e-6)


def test_rows_that_go_round_are_replaced() -> None:
    problem = line(5)
    assert problem.objective is not None
    task = task_of(goal_of(problem, problem.objective))
    _, core, _ = systems_of(task)
    last = np.asarray(core.node_to_rows[1:]) - 1  # choice c: back for ever
    mended = repaired(core, last)
    assert (mended != last).any()
    assert (repaired(core, mended) == mended).all()


@pytest.mark.usefixtures("at_any_size")
@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
@pytest.mark.parametrize("seed", range(10))
def test_a_given_policy_is_worth_the_same_at_any_size(seed: int, level: Level) -> None:
    problem = random_sums(seed, level)
    best = solve(problem)
    given = evaluate(problem, best.policy)
    assert (given.policy_lower[0] <= best.policy_upper[0]).all()
    assert (given.policy_upper[0] >= best.policy_lower[0]).all()


@pytest.mark.usefixtures("at_any_size")
@pytest.mark.parametrize("scale", [1e-284, 1e-150, 1e150, 1e300])
@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
def test_numbers_far_from_1_are_right_or_not_certified(level: Level, scale: float) -> None:
    for seed in range(8):
        problem = random_sums(seed, level, states=5)
        mdp = problem.mdp
        paid = mdp.rewards["cost"]
        scaled = replace(paid, choice=None if paid.choice is None else paid.choice * scale)
        problem = replace(problem, mdp=replace(mdp, rewards={"cost": scaled}))
        solution = solve(problem)
        assert not np.isnan([solution.values, solution.lower, solution.upper]).any()
        assert_within(solution, true_values(problem, level))


def test_outcomes_at_size_are_certified(at_any_size: None) -> None:
    solution = solve(line(300, back=0.3))
    assert solution.outcome is Outcome.CERTIFIED
    assert solution.engine != "policy iteration"


def corner(pay: float) -> Problem:
    """Return a room of 3 × 3 cells in which a step may slip, with something paid at the middle, and a way out that must be taken."""
    table: Table = {}
    for s in range(9):
        row, column = divmod(s, 3)
        beside = [
            (max(row - 1, 0), column),
            (row, min(column + 1, 2)),
            (min(row + 1, 2), column),
            (row, max(column - 1, 0)),
        ]
        ahead = [3 * r + c for r, c in beside]
        own = pay if s == 4 else -1.0
        table[s] = {
            "nesw"[k]: ([(0.8, ahead[k]), (0.1, ahead[(k + 1) % 4]), (0.1, ahead[(k - 1) % 4])], own) for k in range(4)
        }
    table[8]["out"] = ([(1.0, 9)], -1.0)
    table[9] = {"stay": ([(1.0, 9)], 0.0)}
    level = ExpectedReward(goal=GOAL, reward="cost")
    return problem_of(table, level, goals=[9])


@pytest.mark.parametrize(("pay", "endless"), [(0.5, False), (1.0, False), (2.0, True), (30.0, True)])
def test_a_room_where_going_round_is_paid_for_has_no_end(pay: float, endless: bool) -> None:
    problem = corner(pay)
    task = task_of(goal_of(problem, LEVELS[2]))
    _, core, _ = systems_of(task)
    best = max(_means(problem))
    assert (best > 0) is endless
    assert (growing_nodes(core) is not None) is endless


def _means(problem: Problem) -> list[float]:
    """Return the mean reward of going to the middle and back, by long value iteration on the room alone."""
    mdp = problem.mdp
    paid = mdp.rewards["cost"].choice
    assert paid is not None
    x = np.zeros(mdp.states)
    for _ in range(4000):
        step = paid + np.add.reduceat(mdp.branch_to_probability * x[mdp.branch_to_target], mdp.choice_to_branches[:-1])
        best = [max(step[c] for c in list(mdp.choices_of(s))[:4]) for s in range(9)]
        y = np.append(0.5 * x[:9] + 0.5 * np.array(best), 0.0)
        gains, x = 2.0 * (y - x)[:9], y
    return gains.tolist()


@pytest.mark.usefixtures("at_any_size")
@pytest.mark.parametrize("precision", [1e-9, 1e-6, 1e-3, 0.1])
def test_a_coarse_precision_unties_no_choices_of_the_level_before(precision: float) -> None:
    """Both ways from 2 take as much toll, and one of them costs nothing."""
    table: Table = {
        0: {"a": ([(0.5, 1), (0.5, 0)], 0.0), "b": ([(0.7, 0), (0.3, 1)], 1.0)},
        1: {"a": ([(1.0, 2)], 1.0), "b": ([(0.2, 3), (0.3, 1), (0.5, 0)], 3.0)},
        2: {"a": ([(0.5, 1), (0.5, 3)], 0.0), "b": ([(0.2, 1), (0.3, 2), (0.5, 3)], 1.0)},
        3: {"a": ([(1.0, 3)], 0.0)},
    }
    levels = tuple(ExpectedCost(goal=GOAL, reward=name) for name in ("toll", "cost"))
    problem = problem_of(table, Lexicographic(levels=levels), goals=[3])
    toll = Reward(choice=np.array([0.0, 0.25, 0.0, 1.0, 0.25, 0.25, 0.0]))
    problem = replace(problem, mdp=replace(problem.mdp, rewards={**problem.mdp.rewards, "toll": toll}))
    solution = solve(problem, precision=precision)
    assert solution.lower[1, 0] <= 2.0 <= solution.upper[1, 0]
    assert np.all(solution.lower[1] <= solution.policy_upper[1])


@pytest.mark.parametrize("discount", [1.0, 0.9])
@pytest.mark.parametrize("beyond", [np.inf, -np.inf, np.nan, 1e308])
def test_values_beyond_doubles_have_no_margin(beyond: float, discount: float) -> None:
    _, core, _ = systems_of(task_of(goal_of(corner(0.5), LEVELS[2])))
    values = np.zeros(core.nodes)
    values[::2], values[1::2] = beyond, -beyond
    with np.errstate(all="ignore"):
        assert margins_for(core, values, gaps_of(core, values, maximise=True), discount) is None


@pytest.mark.parametrize("wrong", [0.0, 1.0, 1e6])
def test_no_vector_proves_growth_where_there_is_none(wrong: float, monkeypatch: pytest.MonkeyPatch) -> None:
    task = task_of(goal_of(corner(0.5), LEVELS[2]))
    _, core, _ = systems_of(task)
    true = Field.of_nodes
    random = np.random.default_rng(3)
    monkeypatch.setattr(Field, "of_nodes", lambda self: true(self) + wrong * random.normal(size=len(self.order)))
    assert growing_nodes(core) is None


@pytest.mark.usefixtures("at_any_size")
def test_a_coarse_precision_is_enough_where_nothing_is_open_and_sharpened_where_something_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Factored, "follow", lambda *_: False)  # sweeps and rough solves are left
    problem = line(60, back=0.2, free=False)
    paid = problem.mdp.rewards["cost"].choice
    assert paid is not None
    dearer = paid.copy()
    dearer[1:120:2] *= 1.0 + 1e-4  # every choice b, by less than coarse bounds can tell
    problem = replace(problem, mdp=replace(problem.mdp, rewards={"cost": Reward(choice=dearer)}))
    coarse, fine = solve(problem, precision=0.2), solve(problem)
    assert float((coarse.upper - coarse.lower).max()) > 100.0 * float((fine.upper - fine.lower).max())
    assert coarse.precision == 0.2
    criticality = Factors(solution=coarse, asked=question("selective", state=0)).critical
    assert (criticality.certain != criticality.possible).any(), "the coarse bounds leave nothing open"
    one, other = (explain(s, kind="selective", state=0) for s in (coarse, fine))
    assert [step.critical for step in one.steps] == [step.critical for step in other.steps] == [True] * len(one.steps)


@pytest.mark.parametrize("precision", [0.0, 1.0, -1e-6, float("nan")])
def test_a_precision_lies_between_0_and_1(precision: float) -> None:
    with pytest.raises(QuestionError, match="precision"):
        solve(line(3), precision=precision)
