"""Several levels: bounds of each contain what trying every policy that is best for the levels before gives."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from fractions import Fraction
from random import Random

import numpy as np
import pytest
from brute_force import Chain, linear, paid, reaching, spread
from random_models import LEVELS, Table, problem_of, random_rich_problem

from ratherthan.explain.question import question
from ratherthan.model.mdp import Reward
from ratherthan.model.objective import Discounted, ExpectedCost, Lexicographic, Objective, ReachAvoid, levels_of
from ratherthan.model.problem import Problem
from ratherthan.verify.candidates import Budget
from ratherthan.verify.levels import Levels, levels_on
from ratherthan.verify.values import Band

Number = Fraction | float
EXACT, SWEPT = Budget(), Budget(exact=0)
TRIED = ("safest, then cheapest", "cheapest, then least toll", "three in a row", "fewest steps, then toll")
FEWEST = Lexicographic(
    levels=(ExpectedCost(goal='"goal"', reward=None), ExpectedCost(goal='"goal"', reward="toll")),
)


def levels_of_problem(problem: Problem, budget: Budget) -> Levels:
    assert problem.objective is not None
    return Levels(
        frames=levels_on(problem, problem.objective),
        asked=question(),
        weight=np.zeros(problem.mdp.choices),
        given=True,
        slack=1e-5,
        budget=budget,
    )


def chance(chain: Chain, goals: set[int], ends: set[int]) -> list[Number]:
    """Return the chance to reach a goal before any other end."""
    moving = [row if s not in ends else (Fraction(0), {s: Fraction(1)}) for s, row in enumerate(chain)]
    can = reaching(moving, goals) - ends
    rows = [
        (sum((p for t, p in spread.items() if t in goals), Fraction(0)), {t: p for t, p in spread.items() if t in can})
        for _, spread in moving
    ]
    found = dict(zip(sorted(can), linear(rows, sorted(can), Fraction(1)), strict=True))
    return [Fraction(int(s in goals)) if s in ends else found.get(s, Fraction(0)) for s in range(len(chain))]


def cost(chain: Chain, ends: set[int]) -> list[Number]:
    """Return the expected cost until an end, ∞ where it is not reached for sure."""
    moving = [row if s not in ends else (Fraction(0), {s: Fraction(1)}) for s, row in enumerate(chain)]
    failing = reaching(moving, set(range(len(chain))) - reaching(moving, ends))
    open_ = [s for s in range(len(chain)) if s not in failing | ends]
    rows = [(paid_, {t: p for t, p in spread.items() if t not in ends}) for paid_, spread in moving]
    found = dict(zip(open_, linear(rows, open_, Fraction(1)), strict=True))
    return [Fraction(0) if s in ends else found.get(s, math.inf) for s in range(len(chain))]


def by_trying_all(problem: Problem) -> list[list[Number]]:
    """Return the optimum of each level over all policies that are best for the levels before in every state."""
    mdp, levels = problem.mdp, levels_of(problem.objective)
    goals, hazards = (set(np.flatnonzero(mdp.labels[name]).tolist()) for name in ("goal", "hazard"))
    first_is_chance = isinstance(levels[0], ReachAvoid)
    over = goals | hazards if first_is_chance else set(goals)
    left = list(itertools.product(*(list(mdp.choices_of(s)) for s in range(mdp.states))))
    found: list[list[Number]] = []
    for number, level in enumerate(levels):
        rows = [(paid(mdp, c, getattr(level, "reward", None)), spread(mdp, c)) for c in range(mdp.choices)]
        values = {}
        for taken in left:
            chain = [rows[c] for c in taken]
            values[taken] = chance(chain, goals, over) if isinstance(level, ReachAvoid) else cost(chain, over)
        better = max if level.maximise else min
        best = [better(value[s] for value in values.values()) for s in range(mdp.states)]
        found.append(best)
        left = [taken for taken in left if values[taken] == best]
        if number == 0 and first_is_chance:
            over = over | {s for s, value in enumerate(best) if value == 0}
    return found


def contains(band: Band, values: list[Number], *, tight: bool) -> None:
    for state, value in enumerate(values):
        bounds = band[state]
        assert bounds.lower <= float(value) * (1 + 1e-15) + 1e-300
        assert bounds.upper >= float(value) * (1 - 1e-15)
        if tight:
            assert bounds.upper == bounds.lower or bounds.upper - bounds.lower <= 1e-8 * max(float(value), 1e-9)


@pytest.mark.parametrize("seed", range(80))
@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])
def test_each_level_is_best_among_what_is_best_before(seed: int, budget: Budget) -> None:
    wanted = ({**LEVELS, "fewest steps, then toll": FEWEST})[TRIED[seed % len(TRIED)]]
    problem = random_rich_problem(Random(seed), most_states=4, objective=wanted)
    bands = levels_of_problem(problem, budget).best
    tried = by_trying_all(problem)
    for k, values in enumerate(tried):
        known = k == 0 or all(math.isfinite(v) for v in tried[k - 1])  # else no policy is best in every state
        if known and all(map(math.isfinite, values)):
            contains(bands[k], values, tight=True)


def two_ways(gap: float) -> Problem:
    """Two ways to the goal: they cost 1 and 1 + gap, with tolls of 5 and 3."""
    table: Table = {
        0: {"a": ([(1.0, 1)], 1.0), "b": ([(1.0, 1)], 1.0 + gap)},
        1: {"stay": ([(1.0, 1)], 0.0)},
    }
    toll = Reward(choice=np.array([5.0, 3.0, 0.0]))
    return problem_of(table, LEVELS["cheapest, then least toll"], goals=[1], rewards={"toll": toll})


@pytest.mark.parametrize(
    ("gap", "lower", "upper"), [(0.0, 3, 3), (1e-15, 3, 3), (1e-10, 3, 5), (1e-5, 5, 5), (1, 5, 5)]
)
def test_what_is_tied_is_decided_where_it_can_be(gap: float, lower: float, upper: float) -> None:
    band = levels_of_problem(two_ways(gap), EXACT).best[1]
    assert (band[0].lower, band[0].upper) == (lower, upper)


def test_the_second_level_ends_where_nothing_can_be_gained() -> None:
    """From state 1 the goal is out of reach: what is paid there is nobody's concern."""
    table: Table = {
        0: {"try": ([(0.5, 1), (0.5, 2)], 1.0)},
        1: {"wander": ([(1.0, 1)], 1.0)},
        2: {"stay": ([(1.0, 2)], 0.0)},
    }
    problem = problem_of(table, LEVELS["safest, then cheapest"], goals=[2])
    bands = levels_of_problem(problem, EXACT).best
    assert bands[0][0].lower == bands[0][0].upper == 0.5
    assert bands[1][0].lower == bands[1][0].upper == 1.0
    assert bands[1][1].lower == bands[1][1].upper == 0.0


def test_waiting_is_tied_but_does_not_arrive() -> None:
    """Waiting keeps the chance; the least cost is that of the way which arrives, not that of waiting for nothing."""
    table: Table = {
        0: {"wait": ([(1.0, 0)], 0.0), "go": ([(1.0, 1)], 4.0)},
        1: {"stay": ([(1.0, 1)], 0.0)},
    }
    problem = problem_of(table, LEVELS["safest, then cheapest"], goals=[1])
    for budget in (EXACT, SWEPT):
        band = levels_of_problem(problem, budget).best[1]
        assert band[0].lower == pytest.approx(4)
        assert band[0].upper == pytest.approx(4)


ARRIVE = ReachAvoid(goal='"goal"')


def puddle(second: Objective, risk: float) -> Problem:
    """Waiting keeps the chance to arrive and keeps dry, "go" arrives; "jump" as well, but through the puddle, state 2."""
    table: Table = {
        0: {"wait": ([(1.0, 0)], 1.0), "go": ([(risk, 2), (1.0 - risk, 1)], 4.0), "jump": ([(1.0, 2)], 0.0)},
        1: {"stay": ([(1.0, 1)], 0.0)},
        2: {"on": ([(1.0, 1)], 0.0)},
    }
    return problem_of(table, Lexicographic(levels=(ARRIVE, second)), goals=[1], hazards=[2])


@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])
@pytest.mark.parametrize("risk", [0.25, 1e-6])
def test_who_never_arrives_does_not_keep_off_the_risk_of_the_way(risk: float, budget: Budget) -> None:
    band = levels_of_problem(puddle(ReachAvoid(goal='"hazard"', maximise=False), risk), budget).best[1]
    assert band[0].lower <= risk <= band[0].upper
    assert band[0].upper - band[0].lower <= 1e-9 * risk
    assert band[1].lower == band[1].upper == 0.0


@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])
def test_the_largest_chance_of_a_second_level_is_attained_on_the_way(budget: Budget) -> None:
    band = levels_of_problem(puddle(ReachAvoid(goal='"hazard"'), 0.25), budget).best[1]
    assert band[0].lower == pytest.approx(1.0)
    assert band[0].upper == pytest.approx(1.0)


@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])
def test_what_is_the_better_the_longer_one_puts_off_the_goal_is_never_confirmed(budget: Budget) -> None:
    """Waiting for ever would give 1 / (1 - 0.75) = 4 and a great cost; who arrives has less, as near as he likes."""
    put_off = puddle(Discounted(reward="cost", discount=0.75), 0.25)
    levels = levels_of_problem(put_off, budget)
    assert levels.best[1][0].upper >= 4.0
    at_once = levels_of_problem(puddle(Discounted(reward="cost", discount=0.75, maximise=False), 0.25), budget)
    assert at_once.best[1][0].lower == pytest.approx(0.0)
    assert at_once.best[1][0].upper == pytest.approx(0.0, abs=1e-9)  # to jump costs nothing

    lazy = replace(levels, weight=np.array([1.0, 0, 0, 1, 1]))
    assert lazy.followed[0][0].upper == 0.0  # it never arrives
    table: Table = {
        0: {"wait": ([(1.0, 0)], 1.0), "go": ([(1.0, 1)], 0.0)},
        1: {"stay": ([(1.0, 1)], 0.0)},
    }
    second = Discounted(reward="cost", discount=0.75)
    problem = problem_of(table, Lexicographic(levels=(ARRIVE, second)), goals=[1])
    band = levels_of_problem(problem, budget).best[1]
    assert (band[0].lower, band[0].upper) == (-math.inf, pytest.approx(4.0))


def test_what_is_infinitely_much_at_the_first_level_leaves_the_second_open() -> None:
    """Who goes round pays for ever; which of those who do pays the least toll in the puddle is not told by tied choices."""
    table: Table = {
        0: {"round": ([(1.0, 0)], 1.0), "wade": ([(1.0, 2)], 1.0), "on": ([(1.0, 1)], 1.0)},
        1: {"stay": ([(1.0, 1)], 0.0)},
        2: {"back": ([(1.0, 0)], 1.0)},
    }
    for second in (ReachAvoid(goal='"hazard"', maximise=False), ExpectedCost(goal='"hazard"', reward="cost")):
        first = ExpectedCost(goal='"goal"', reward="cost", maximise=True)
        problem = problem_of(table, Lexicographic(levels=(first, second)), goals=[1], hazards=[2])
        bands = levels_of_problem(problem, EXACT).best
        assert bands[0][0].lower == math.inf
        assert (bands[1][0].lower, bands[1][0].upper) == (-math.inf, math.inf)
