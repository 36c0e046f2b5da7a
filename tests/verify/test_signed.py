"""Rewards of both signs, discounts and weights: bounds contain what trying every policy in fractions gives, and are narrow."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from fractions import Fraction
from random import Random

import numpy as np
import pytest
from brute_force import Chain, linear, paid, reaching, solved, spread
from random_models import SIGNED, Table, problem_of, random_policy, random_rich_problem

from ratherthan.errors import ExplanationError
from ratherthan.model.mdp import Reward
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, Objective
from ratherthan.model.problem import Problem
from ratherthan.verify import candidates
from ratherthan.verify.aims import frame_of
from ratherthan.verify.candidates import Budget
from ratherthan.verify.frame import Frame
from ratherthan.verify.values import Band, following, optimum

EXACT, SWEPT = Budget(), Budget(exact=0)
Number = Fraction | float


def chain_value(chain: Chain, goals: set[int], wanted: Objective) -> list[Number]:
    states = list(range(len(chain)))
    if isinstance(wanted, Discounted):
        return list(linear(chain, states, Fraction(wanted.discount)))
    chain = [(Fraction(0), {s: Fraction(1)}) if s in goals else row for s, row in enumerate(chain)]
    lost = set(states) - reaching(chain, goals)
    failing = reaching(chain, lost)
    bad = math.inf if isinstance(wanted, ExpectedCost) or not wanted.maximise else -math.inf
    open_ = [s for s in states if s not in failing and s not in goals]
    known = dict(zip(open_, linear(chain, open_, Fraction(1)), strict=True))
    return [Fraction(0) if s in goals else known.get(s, bad) for s in states]


def every_chain(problem: Problem) -> list[Chain]:
    mdp, wanted = problem.mdp, problem.objective
    rows = [(paid(mdp, c, wanted.reward), spread(mdp, c)) for c in range(mdp.choices)]
    return [
        [rows[c] for c in taken] for taken in itertools.product(*(list(mdp.choices_of(s)) for s in range(mdp.states)))
    ]


def by_trying_all(problem: Problem) -> list[Number]:
    """Return the optimum over all deterministic policies; ∞ where a set that pays on the average can be reached."""
    wanted, states = problem.objective, range(problem.mdp.states)
    goals = set(np.flatnonzero(problem.mdp.labels["goal"]).tolist())
    better = max if wanted.maximise else min
    found = [chain_value(chain, goals, wanted) for chain in every_chain(problem)]
    best = [better(values[s] for values in found) for s in states]
    if isinstance(wanted, ExpectedReward):
        best = with_gathering(problem, best, goals)
    return best


def with_gathering(problem: Problem, best: list[Number], goals: set[int]) -> list[Number]:
    wanted, mdp = problem.objective, problem.mdp
    sign = 1 if wanted.maximise else -1
    arriving = {s for s, value in enumerate(best) if value != -sign * math.inf}
    growing: set[int] = set()
    for chain in every_chain(problem):
        for state in arriving - goals:
            reached = {state}
            while more := {t for s in reached for t in chain[s][1]} - reached:
                reached |= more
            if not reached <= arriving - goals:
                continue
            if any(state not in reaching(chain, {state}) & {t} and t not in reaching(chain, {state}) for t in reached):
                continue  # not each reached from each
            order = sorted(reached)
            matrix = [[-chain[s][1].get(t, 0) for s in order] for t in order]
            for i in range(len(order)):
                matrix[i][i] += 1
            matrix[-1] = [Fraction(1)] * len(order)
            share = solved([[*row, Fraction(int(i == len(order) - 1))] for i, row in enumerate(matrix)])
            assert share is not None
            if sign * sum(p * chain[s][0] for p, s in zip(share, order, strict=True)) > 0:
                growing |= reached
    usable = [c for s in arriving - goals for c in mdp.choices_of(s) if set(spread(mdp, c)) <= arriving]
    while more := {mdp.state_of(c) for c in usable if set(spread(mdp, c)) & growing} - growing:
        growing |= more
    return [sign * math.inf if s in growing else value for s, value in enumerate(best)]


def agrees(band: Band, values: list[Number], share: float) -> None:
    size = max((abs(float(v)) for v in values if math.isfinite(v)), default=0.0)
    for state, value in enumerate(values):
        bounds = band[state]
        if math.isinf(value):
            assert bounds.lower == bounds.upper == value, (state, value, bounds)
        else:
            assert Fraction(bounds.lower) <= value <= Fraction(bounds.upper), (state, float(value), bounds)
            assert bounds.upper - bounds.lower <= share * size, (state, float(value), bounds)


def case(seed: int, most_states: int = 4) -> tuple[Problem, Frame]:
    objective = list(SIGNED.values())[seed % len(SIGNED)]
    problem = random_rich_problem(Random(seed), most_states=most_states, objective=objective)
    return problem, frame_of(problem, objective)


@pytest.mark.parametrize("seed", range(140))
def test_the_optimum_is_the_best_of_all_policies_in_fractions(seed: int) -> None:
    problem, frame = case(seed)
    agrees(optimum(frame, EXACT), by_trying_all(problem), 1e-15)


@pytest.mark.parametrize("seed", range(140))
def test_a_policy_has_the_value_of_its_chain(seed: int) -> None:
    problem, frame = case(seed, 8)
    mdp, wanted = problem.mdp, problem.objective
    policy = random_policy(Random(seed), mdp)
    chain = [(paid(mdp, c, wanted.reward), spread(mdp, c)) for c in policy.choice.tolist()]
    value = chain_value(chain, set(np.flatnonzero(mdp.labels["goal"]).tolist()), wanted)
    agrees(following(frame, policy.weights(mdp), EXACT), value, 1e-15)
    agrees(following(frame, policy.weights(mdp), SWEPT), value, 1e-9)


def same(frame: Frame, share: float) -> int:
    """Assert that swept bounds contain the exact ones and are near; return in how many states nothing was found."""
    exact, swept = optimum(frame, Budget(exact=1000)), optimum(frame, SWEPT)
    assert (swept.lower <= exact.upper).all()
    assert (exact.lower <= swept.upper).all()
    finite = np.isfinite(exact.lower)
    known = np.isfinite(swept.lower) & np.isfinite(swept.upper)
    size = np.abs(exact.upper[finite]).max(initial=1.0)
    assert (swept.upper[finite & known] - swept.lower[finite & known] <= share * size).all()
    wrong = ~finite & (swept.lower != swept.upper)
    return int((finite & ~known).sum() + wrong.sum())


@pytest.mark.slow
@pytest.mark.parametrize("way", ["dense", "sparse", "value iteration"])
def test_sweeps_agree_with_fractions(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if way != "dense":
        monkeypatch.setattr(candidates, "DENSE", 0)
    if way == "value iteration":
        monkeypatch.setattr(candidates, "EASY", -1)
    states = unknown = 0
    for seed in range(70):
        problem, frame = case(seed, 30)
        unknown += same(frame, 1e-6 if way == "value iteration" else 1e-9)
        states += problem.mdp.states
    assert unknown <= 0.03 * states  # circles that pay nothing on the average may be left open


LINE: Table = {0: {"go": ([(1.0, 1)], 0.0), "stay": ([(1.0, 0)], 0.0)}, 1: {"stay": ([(1.0, 1)], 0.0)}}
BOTH = pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["exact", "swept"])


def line(stay: float, objective: Objective) -> Frame:
    """Two states: staying pays `stay`, going to the goal -5."""
    problem = problem_of(LINE, objective, goals=[1], rewards={"gain": Reward(choice=np.array([-5.0, stay, 0.0]))})
    return frame_of(problem, objective)


@BOTH
@pytest.mark.parametrize("stay", [1e-9, 0.25, 3.0])
def test_what_can_be_gathered_without_end_is_infinite(stay: float, budget: Budget) -> None:
    bounds = optimum(line(stay, SIGNED["most reward"]), budget)[0]
    assert bounds.lower == bounds.upper == math.inf


@BOTH
@pytest.mark.parametrize("stay", [0.0, -1e-9, -2.0])
def test_arrival_is_demanded_however_dear(stay: float, budget: Budget) -> None:
    bounds = optimum(line(stay, SIGNED["most reward"]), budget)[0]
    assert bounds.lower == pytest.approx(-5, rel=1e-14)
    assert bounds.upper == pytest.approx(-5, rel=1e-14)


@BOTH
def test_staying_for_ever_is_no_arrival(budget: Budget) -> None:
    frame = line(2.0, SIGNED["most reward"])
    band = following(frame, np.array([0.0, 1.0, 1.0]), budget)
    assert band[0].lower == band[0].upper == -math.inf


@BOTH
@pytest.mark.parametrize("discount", [0.5, 0.99, 0.999999])
def test_a_discount_sums_a_geometric_series(discount: float, budget: Budget) -> None:
    band = optimum(line(2.0, Discounted(reward="gain", discount=discount)), budget)
    exact = 2 / (1 - Fraction(discount))
    assert Fraction(band[0].lower) <= exact <= Fraction(band[0].upper)
    assert band[0].upper - band[0].lower <= 1e-12 * float(exact)
    assert band[1].lower == band[1].upper == 0.0


@BOTH
def test_a_circle_that_pays_nothing_on_the_average_is_no_gain(budget: Budget) -> None:
    """Up pays 1 and down -1: going round gathers nothing, and the goal costs 5 from below, 7 from above."""
    table: Table = {
        0: {"up": ([(1.0, 1)], 0.0), "home": ([(1.0, 2)], 0.0)},
        1: {"down": ([(1.0, 0)], 0.0), "home": ([(1.0, 2)], 0.0)},
        2: {"stay": ([(1.0, 2)], 0.0)},
    }
    gain = Reward(choice=np.array([1.0, -5.0, -1.0, -7.0, 0.0]))
    problem = problem_of(table, SIGNED["most reward"], goals=[2], rewards={"gain": gain})
    band = optimum(frame_of(problem, SIGNED["most reward"]), budget)
    assert band[0].lower <= -5 <= band[0].upper
    assert band[1].lower <= -6 <= band[1].upper
    if budget is EXACT:
        assert band[0].lower == band[0].upper == -5


def test_what_cancels_on_the_way_round_is_told_in_fractions() -> None:
    """Up pays 1 and down -1 on sixty steps of a ladder: only fractions can tell that going round gathers nothing."""
    steps = 60
    table: Table = {steps: {"stay": ([(1.0, steps)], 0.0)}}
    paid = []
    for s in range(steps):
        up, down = min(s + 1, steps - 1), max(s - 1, 0)
        table[s] = {"up": ([(1.0, up)], 0.0), "down": ([(1.0, down)], 0.0), "home": ([(1.0, steps)], 0.0)}
        paid += [float(up - s), float(down - s), -5.0]
    problem = problem_of(
        dict(sorted(table.items())),
        SIGNED["most reward"],
        goals=[steps],
        rewards={"gain": Reward(choice=np.array([*paid, 0.0]))},
    )
    frame = frame_of(problem, SIGNED["most reward"])
    band = optimum(frame, EXACT)
    assert (band.lower == band.upper).all()
    assert band.lower[:steps].tolist() == [steps - 1 - s - 5 for s in range(steps)]
    assert (optimum(frame, SWEPT).lower[:steps] <= band.lower[:steps]).all()


def ring(count: int, amounts: list[float]) -> Problem:
    """Return a ring of states in which one may go on, slip or turn back, with a dear way out of the first one."""
    table: Table = {}
    for s in range(count):
        after, before = (s + 1) % count, (s - 1) % count
        table[s] = {"on": ([(0.8, after), (0.2, s)], 0.0), "back": ([(0.6, before), (0.4, after)], 0.0)}
    table[0]["out"] = ([(1.0, count)], 0.0)
    table[count] = {"stay": ([(1.0, count)], 0.0)}
    paid = np.zeros(2 * count + 2)
    paid[: 2 * count + 1] = np.resize(amounts, 2 * count + 1)
    paid[2] = -1000.0
    return problem_of(table, SIGNED["most reward"], goals=[count], rewards={"gain": Reward(choice=paid)})


def test_a_large_ring_that_pays_is_found_out() -> None:
    """No policy that turns round for long looks bad: the mean is 0.4 in 120 states, and each value is infinite."""
    frame = frame_of(ring(120, [1.0, -0.2]), SIGNED["most reward"])
    band = optimum(frame, SWEPT)
    assert (band.lower[:120] == np.inf).all()
    assert band[120].upper == 0.0


def test_a_large_ring_that_costs_is_left_at_once() -> None:
    frame = frame_of(ring(120, [-1.0, -0.2]), SIGNED["most reward"])
    band = optimum(frame, SWEPT)
    assert band[0].lower == pytest.approx(-1000)
    assert np.isfinite(band.upper).all()
    assert (band.upper - band.lower <= 1e-6).all()


@pytest.mark.parametrize("maximise", [True, False])
def test_what_is_gathered_is_the_mirror_image_of_what_is_lost(maximise: bool) -> None:
    problem = ring(120, [1.0, -0.2])
    mirrored = {"gain": Reward(choice=-problem.mdp.rewards["gain"].choice)}
    mdp = problem.mdp if maximise else replace(problem.mdp, rewards=mirrored)
    wanted = ExpectedReward(goal='"goal"', reward="gain", maximise=maximise)
    band = optimum(frame_of(replace(problem, mdp=mdp), wanted), SWEPT)
    assert (band.lower[:120] == (np.inf if maximise else -np.inf)).all()


def test_a_negative_cost_is_refused() -> None:
    problem = problem_of(
        LINE, ExpectedCost(goal='"goal"', reward="gain"), goals=[1], rewards={"gain": Reward(choice=-np.ones(3))}
    )
    with pytest.raises(ExplanationError, match="negative"):
        frame_of(problem, problem.objective)


def test_rewards_beyond_the_largest_double_are_refused() -> None:
    most = Reward(choice=np.full(3, 1.5e308), state=np.full(2, 1.5e308))
    problem = problem_of(LINE, SIGNED["most reward"], goals=[1], rewards={"gain": most})
    with pytest.raises(ExplanationError, match="largest double"):
        optimum(frame_of(problem, SIGNED["most reward"]), EXACT)
