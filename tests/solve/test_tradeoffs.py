"""Trade-offs against every deterministic policy in fractions, a linear program over frequencies, and Storm."""

from __future__ import annotations

import itertools
import math
import os
import sys
from dataclasses import replace
from fractions import Fraction
from random import Random

import numpy as np
import pytest
from exact import chain_values, rows_of
from random_models import problem_of, random_problem

import ratherthan as rt
from ratherthan.errors import NotExplainableError, PropertyError, QuestionError
from ratherthan.model.mdp import Reward
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, ReachAvoid
from ratherthan.model.problem import Problem
from ratherthan.solve.frequencies import frequencies, mixed
from ratherthan.solve.pareto import Tradeoffs, tradeoffs
from ratherthan.solve.weighing import Weighing

GOAL = '"goal"'
COST, RISK = ExpectedCost(goal=GOAL, reward="cost"), ExpectedCost(goal=GOAL, reward="risk")
MODELS = int(os.environ.get("RATHERTHAN_MODELS", "300"))
Pair = tuple[Fraction, Fraction]


def two_rewards(random: Random, most_states: int = 5) -> Problem:
    """Return a random problem with the rewards "cost" and "risk", which often pull apart."""
    problem = random_problem(random, most_states=most_states, objective=COST)
    cost = problem.mdp.rewards["cost"].choice
    risk = np.array([random.choice([0, 0.5, 1, 2, 3 - paid, 6 - 2 * paid]) for paid in cost], dtype=float)
    mdp = replace(problem.mdp, rewards={**problem.mdp.rewards, "risk": Reward(choice=risk)})
    return replace(problem, mdp=mdp)


def attained(problem: Problem) -> set[Pair]:
    """Return what the deterministic policies that are sure to arrive attain from the start, exactly."""
    mdp, start = problem.mdp, int(problem.mdp.initial[0])
    goals = np.flatnonzero(mdp.labels["goal"]).tolist()
    both = [rows_of(replace(problem, objective=objective)) for objective in (COST, RISK)]
    ways = [[None] if s in goals else range(len(rows)) for s, rows in enumerate(both[0])]
    found = set()
    for way in itertools.product(*ways):
        values = []
        for rows in both:
            chain = [None if pick is None else rows[s][pick] for s, pick in enumerate(way)]
            values.append(chain_values(chain, goals, cost=True)[start])
        if math.inf not in values:
            found.add((values[0], values[1]))
    return found


def corners(points: set[Pair], slack: Fraction = Fraction(0)) -> list[Pair]:
    """Return the vertices of the lower left border of the convex hull, from left to right; `slack` is for rounded points."""
    kept: list[Pair] = []
    for x, y in sorted(points):
        if kept and y >= kept[-1][1]:
            continue
        while len(kept) > 1:
            (x0, y0), (x1, y1) = kept[-2:]
            if (y0 - y1) * (x - x1) > (x1 - x0) * (y1 - y) + slack:
                break
            kept.pop()
        kept.append((x, y))
    return kept


def values_of(found: Tradeoffs) -> list[list[float]]:
    return [plan.values.tolist() for plan in found.plans]


def models(count: int, most_states: int = 6) -> list[Problem]:
    return [two_rewards(Random(seed), most_states) for seed in range(count)]


def test_the_plans_are_the_corners_of_what_all_deterministic_policies_attain():
    most = 0
    for problem in models(max(MODELS // 3, 40)):
        exact = corners(attained(problem))
        found = tradeoffs(problem, [COST, RISK])
        assert found.complete
        assert np.array(values_of(found)).ravel() == pytest.approx(np.array(exact, dtype=float).ravel(), abs=1e-9)
        for plan, point in zip(found.plans, exact, strict=True):
            for k in range(2):
                assert Fraction(float(plan.lower[k])) <= point[k] <= Fraction(float(plan.upper[k]))
        most = max(most, len(exact))
    assert most > 2  # the models do have plans in between


def ladder(rungs: int) -> Problem:
    """Return a model in which each rung is passed for 1, or free of charge with a risk that doubles from rung to rung."""
    table = {
        rung: {"pay": ([(0.5, rung + 1), (0.5, rung)], 0.5), "dare": ([(1.0, rung + 1)], 0)} for rung in range(rungs)
    }
    problem = problem_of(table | {rungs: {"stay": ([(1.0, rungs)], 0)}}, COST, goals=[rungs])
    risk = np.array([0.0 if choice % 2 == 0 else 2.0 ** (choice // 2) for choice in range(2 * rungs)] + [0.0])
    return replace(problem, mdp=replace(problem.mdp, rewards={**problem.mdp.rewards, "risk": Reward(choice=risk)}))


def test_a_ladder_of_n_rungs_has_n_plus_one_plans():
    found = tradeoffs(ladder(7), [COST, RISK])
    # Pay where the risk is largest first: what is left of 1 + 2 + … + 64.
    assert values_of(found) == [pytest.approx([paid, 2 ** (7 - paid) - 1], abs=1e-12) for paid in range(8)]
    assert [trade.gain for trade in found.trades] == pytest.approx([64, 32, 16, 8, 4, 2, 1])
    few = tradeoffs(ladder(7), [COST, RISK], most=4)
    assert len(few.plans) == 4
    assert not few.complete
    assert all(plan.values.tolist() in [whole.values.tolist() for whole in found.plans] for plan in few.plans)
    for plan in few.plans:
        whole = next(other for other in found.plans if other.values.tolist() == plan.values.tolist())
        assert whole.weights[1][0] <= plan.weights[1][0] * (1 + 1e-9)
        assert plan.weights[1][1] <= whole.weights[1][1] * (1 + 1e-9)


def crossing(pay: float) -> Problem:
    """Return a model where paying once or taking a risk are best for one each, unless the third way is free of both."""
    table = {
        0: {"dare": ([(1.0, 1)], 0), "pay": ([(1.0, 1)], pay), "round": ([(1.0, 1)], 0)},
        1: {"on": ([(1.0, 2)], 5)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    problem = problem_of(table, COST, goals=[2])
    risk = Reward(choice=np.array([1.0, 0.0, 0.0, 0.0, 0.0]))
    return replace(problem, mdp=replace(problem.mdp, rewards={**problem.mdp.rewards, "risk": risk}))


@pytest.mark.parametrize("discount", [None, 0.9])
def test_a_plan_that_beats_both_ends_is_the_only_one(discount):
    wishes = [COST, RISK]
    if discount is not None:
        wishes = [Discounted(reward=name, discount=discount, maximise=False) for name in ("cost", "risk")]
    found = tradeoffs(crossing(2.0), wishes, bound={"risk": 0.5})
    assert (len(found.plans), found.trades, found.complete) == (1, (), True)
    assert found.plans[0].values == pytest.approx([5 * (discount or 1.0), 0.0])
    assert found.plans[0].weights[1] == (0.0, math.inf)
    assert found.bounded.plan.values == pytest.approx(found.plans[0].values)


@pytest.mark.slow
def test_an_end_that_is_beaten_makes_way_whichever_of_several_best_plans_is_found(monkeypatch):
    """Of several plans that are best for one cost alone, the solver may return the worst for the other."""
    weigh = Weighing.best
    for problem in models(60):
        exact = corners(attained(problem))

        def unlucky(weighing, weights, problem=problem):
            found = weigh(weighing, weights)
            if found is None or np.count_nonzero(weights) == 2:
                return found
            free = int(np.flatnonzero(weights == 0)[0])
            ways = [list(problem.mdp.choices_of(s)) for s in range(problem.mdp.states)]
            tied = [weighing.followed(rt.Policy(choice=np.array(way))) for way in itertools.product(*ways)]
            own = found.costs[1 - free]
            tied = [plan for plan in tied if plan and abs(plan.costs[1 - free] - own) <= 1e-12 * abs(own)]
            return replace(max(tied, key=lambda plan: plan.costs[free]), least=found.least)

        monkeypatch.setattr(Weighing, "best", unlucky)
        found = tradeoffs(problem, [COST, RISK])
        assert found.complete
        assert np.array(values_of(found)).ravel() == pytest.approx(np.array(exact, dtype=float).ravel(), abs=1e-9)
        ranges = [plan.weights[1] for plan in found.plans]
        assert not ranges or (ranges[0][0], ranges[-1][1]) == (0.0, math.inf)


def test_each_plan_is_best_for_its_weights_and_the_weights_leave_no_gap():
    for problem in models(60):
        points = attained(problem)
        found = tradeoffs(problem, [COST, RISK])
        ranges = [plan.weights[1] for plan in found.plans]
        assert not ranges or (ranges[0][0], ranges[-1][1]) == (0.0, math.inf)
        assert all(one[1] == pytest.approx(other[0]) for one, other in itertools.pairwise(ranges))
        for plan, (low, high) in zip(found.plans, ranges, strict=True):
            weight = Fraction(low + 1 if high == math.inf else (low + high) / 2)
            least = min(x + weight * y for x, y in points)
            own = Fraction(float(plan.values[0])) + weight * Fraction(float(plan.values[1]))
            assert abs(float(own - least)) <= 1e-9 * max(1.0, float(least))


def test_each_step_says_what_the_values_say():
    for problem in models(60):
        found = tradeoffs(problem, [COST, RISK])
        assert [(trade.origin, trade.target) for trade in found.trades] == list(
            itertools.pairwise(range(len(found.plans)))
        )
        for trade in found.trades:
            assert trade.complete
            step = found.plans[trade.target].values - found.plans[trade.origin].values
            assert (trade.price, trade.gain) == pytest.approx((step[0], -step[1]))
            assert trade.price > 0 < trade.gain


def least_within(problem: Problem, bound: float) -> float:
    """Return the least cost with a risk within the bound, by a linear program over frequencies; ∞ where there is none."""
    from scipy.optimize import linprog

    mdp = problem.mdp
    start, goal = int(problem.mdp.initial[0]), mdp.labels["goal"]
    if goal[start]:
        return 0.0 if bound >= 0 else math.inf
    owner = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
    flow = np.zeros((mdp.states, mdp.choices))
    for choice in range(mdp.choices):
        flow[owner[choice], choice] += 1
        own = mdp.branches_of(choice)
        np.add.at(flow[:, choice], mdp.branch_to_target[own], -mdp.branch_to_probability[own])
    begin = np.zeros(mdp.states)
    begin[start] = 1
    kept = ~goal[owner]
    solved = linprog(
        mdp.rewards["cost"].choice[kept],
        A_ub=mdp.rewards["risk"].choice[kept][None],
        b_ub=[bound],
        A_eq=flow[~goal][:, kept],
        b_eq=begin[~goal],
    )
    return float(solved.fun) if solved.status == 0 else math.inf


def test_the_best_plan_within_a_bound_is_that_of_the_linear_program_and_tosses_one_coin():
    tossed = 0
    for problem in models(max(MODELS // 3, 40)):
        points = corners(attained(problem))
        if not points:
            continue
        low, high = float(points[-1][1]), float(points[0][1])
        for bound in {low, high, (low + high) / 2, 0.9 * low + 0.1 * high, high + 1}:
            bounded = tradeoffs(problem, [COST, RISK], bound={"risk": bound}).bounded
            assert bounded is not None
            assert bounded.plan is not None
            plan = bounded.plan
            assert plan.values[0] == pytest.approx(least_within(problem, bound), rel=1e-6, abs=1e-7)
            assert plan.upper[1] <= bound + 1e-9 * max(1.0, bound)
            assert bounded.best <= plan.upper[0]
            assert bounded.best == pytest.approx(plan.values[0], rel=1e-5, abs=1e-9)
            assert len(bounded.coins) <= 1
            tossed += len(bounded.coins)
    assert tossed > 5


def test_on_the_ladder_the_coin_is_tossed_at_the_rung_that_the_bound_cuts():
    for bound, rung in ((100.0, 6), (50.0, 5), (10.0, 3), (0.25, 0)):
        found = tradeoffs(ladder(7), [COST, RISK], bound={"risk": bound}).bounded
        assert found is not None
        assert found.plan is not None
        assert found.coins == (rung,)
        paid = 6 - rung + (2 ** (rung + 1) - 1 - bound) / 2**rung
        assert found.plan.values.tolist() == pytest.approx([paid, bound])
        assert found.best <= paid <= found.best + 1e-9


@pytest.mark.parametrize("success", [1e-3, 1e-9])
def test_on_a_ladder_that_is_climbed_slowly_numbers_stay_exact(success):
    table = {
        rung: {
            "pay": ([(success, rung + 1), (1 - success, rung)], 1),
            "dare": ([(success, rung + 1), (1 - success, rung)], 0),
        }
        for rung in range(3)
    }
    problem = problem_of(table | {3: {"stay": ([(1.0, 3)], 0)}}, COST, goals=[3])
    risk = np.array([0, 1, 0, 2, 0, 4, 0], dtype=float)
    problem = replace(problem, mdp=replace(problem.mdp, rewards={**problem.mdp.rewards, "risk": Reward(choice=risk)}))
    found = tradeoffs(problem, [COST, RISK], bound={"risk": 2 / success})
    assert values_of(found) == [
        pytest.approx([paid / success, (2 ** (3 - paid) - 1) / success], rel=1e-6) for paid in range(4)
    ]
    assert found.complete
    assert found.bounded.plan.upper[1] <= 2 / success
    assert found.bounded.plan.values[0] == pytest.approx(1.5 / success, rel=1e-6)
    assert found.bounded.best <= found.bounded.plan.upper[0]


def test_where_no_plan_is_within_the_bound_the_least_that_can_be_is_told():
    refused = 0
    for problem in models(40):
        points = corners(attained(problem))
        if not points or not points[-1][1]:
            continue
        least = float(points[-1][1])
        bounded = tradeoffs(problem, [COST, RISK], bound={"risk": 0.9 * least}).bounded
        assert bounded is not None
        assert bounded.plan is None
        assert bounded.best == math.inf
        assert bounded.nearest == pytest.approx(least)
        assert Fraction(bounded.nearest) <= points[-1][1]
        refused += 1
    assert refused > 3


def test_where_no_policy_is_sure_to_arrive_there_are_no_plans():
    seen = 0
    for problem in models(60):
        if not attained(problem):
            found = tradeoffs(problem, [COST, RISK], bound={"risk": 1.0})
            assert (found.plans, found.trades, found.bounded, found.complete) == ((), (), None, True)
            seen += 1
    assert seen > 3


@pytest.mark.parametrize("dense", [400, 0])
def test_a_mixture_of_frequencies_is_the_mixture_of_what_the_policies_earn(monkeypatch, dense):
    monkeypatch.setattr(sys.modules["ratherthan.solve.frequencies"], "MOST_DENSE", dense)
    for seed in range(40):
        problem = two_rewards(Random(seed))
        mdp, start, ended = problem.mdp, int(problem.mdp.initial[0]), problem.mdp.labels["goal"]
        ends = [rt.solve(problem, objective).policy for objective in (COST, RISK)]
        taken = [frequencies(mdp, policy, start, ended) for policy in ends]
        if any(often is None for often in taken):
            continue
        both = mixed(mdp, (ends[0], taken[0]), (ends[1], taken[1]), 0.3)
        for objective, reward in ((COST, "cost"), (RISK, "risk")):
            values = [float(often @ mdp.rewards[reward].choice) for often in taken]
            solution = rt.evaluate(problem, both, objective)
            assert solution.policy_values[0, start] == pytest.approx(0.3 * values[0] + 0.7 * values[1], abs=1e-9)


def test_with_three_objectives_there_are_the_neighbours_toward_each():
    problem = rt.read("example:pedestrians")
    noise = np.where(problem.mdp.rewards["risk"].choice == 0.4, 0.7, 0.1)
    mdp = replace(problem.mdp, rewards={**problem.mdp.rewards, "noise": Reward(choice=noise)})
    wishes = [ExpectedCost(goal='"destination"', reward=name) for name in ("distance", "risk", "noise")]
    found = tradeoffs(replace(problem, mdp=mdp), wishes)
    assert {trade.objective for trade in found.trades} == {1, 2}
    for other in (1, 2):
        pair = tradeoffs(replace(problem, mdp=mdp), [wishes[0], wishes[other]])
        assert len(pair.trades) == sum(trade.objective == other for trade in found.trades)
    for trade in found.trades:
        assert found.plans[trade.target].values[trade.objective] < found.plans[trade.origin].values[trade.objective]


def test_plans_part_where_they_come_by_the_same_choices_and_go_on_differently():
    for problem in models(40):
        found = tradeoffs(problem, [COST, RISK])
        mdp = problem.mdp
        for trade in found.trades:
            one, other = (found.plans[place].policy.choice for place in (trade.origin, trade.target))
            seen, todo, parted = set(), [found.start], set()
            while todo:
                state = todo.pop()
                if state in seen or mdp.labels["goal"][state]:
                    continue
                seen.add(state)
                if one[state] != other[state]:
                    parted.add(state)
                else:
                    todo += mdp.branch_to_target[mdp.branches_of(int(one[state]))].tolist()
            assert trade.partings == tuple(sorted(parted))
            assert parted


def test_steps_and_weighted_sums_are_objectives_too():
    problem = rt.read("example:pedestrians")
    wishes = [
        ExpectedCost(goal='"destination"', reward=None),
        ExpectedCost(goal='"destination"', reward="distance + 10 * risk"),
    ]
    found = tradeoffs(problem, wishes)
    assert [plan.values[0] for plan in found.plans] == pytest.approx([8.75, 13.75])
    assert [plan.values[1] for plan in found.plans] == pytest.approx([28.75, 15.75])


def test_when_only_some_plans_are_wanted_it_is_said_that_there_may_be_more():
    problem = rt.read("example:pedestrians")
    wishes = [problem.properties["shortest"], problem.properties["safest"]]
    found = tradeoffs(problem, wishes, most=2)
    assert values_of(found) == [pytest.approx([8.75, 2]), pytest.approx([16.25, 0])]
    assert not found.complete
    assert [trade.complete for trade in found.trades] == [False]
    assert [plan.weights[1] for plan in found.plans] == [(0.0, 0.0), (math.inf, math.inf)]


def onward(random: Random) -> Problem:
    """Return a random model in which every policy arrives, with two rewards of both signs."""
    states = random.randint(3, 6)
    table = {states - 1: {"stay": ([(1.0, states - 1)], 0)}}
    for state in range(states - 1):
        ahead = range(state + 1, states)
        table[state] = {
            action: ([(0.25, state), (0.25, random.choice(ahead)), (0.5, random.choice(ahead))], 0)
            for action in random.sample("abc", random.choice([1, 2, 3]))
        }
    problem = problem_of(table, COST, goals=[states - 1])
    signed = {
        name: Reward(
            choice=np.array([random.randint(-3, 3) for _ in range(problem.mdp.choices - 1)] + [0], dtype=float)
        )
        for name in ("one", "other")
    }
    return replace(problem, mdp=replace(problem.mdp, rewards=signed))


def linear_values(problem: Problem, choices: tuple[int, ...], discount: float) -> tuple[float, float]:
    """Return what a deterministic policy gathers from state 0, by one linear system."""
    mdp, goal = problem.mdp, problem.mdp.labels["goal"]
    matrix = np.eye(mdp.states)
    paid = np.zeros((mdp.states, 2))
    for state, choice in enumerate(choices):
        if discount == 1.0 and goal[state]:
            continue
        own = mdp.branches_of(choice)
        np.add.at(matrix[state], mdp.branch_to_target[own], -discount * mdp.branch_to_probability[own])
        paid[state] = [mdp.rewards[name].choice[choice] for name in ("one", "other")]
    values = np.linalg.solve(matrix, paid)[0]
    return float(values[0]), float(values[1])


@pytest.mark.parametrize("discount", [1.0, 0.8])
def test_rewards_of_both_signs_are_gathered_and_kept_small_with_and_without_a_discount(discount):
    most = 0
    for seed in range(max(MODELS // 3, 40)):
        random = Random(seed)
        problem = onward(random)
        ways = (random.random() < 0.5, random.random() < 0.5)
        signs = [-1 if way else 1 for way in ways]
        wishes = [
            ExpectedReward(goal=GOAL, reward=name, maximise=way)
            if discount == 1.0
            else Discounted(reward=name, discount=discount, maximise=way)
            for name, way in zip(("one", "other"), ways, strict=True)
        ]
        every = itertools.product(*(problem.mdp.choices_of(state) for state in range(problem.mdp.states)))
        points = {
            tuple(
                Fraction(round(sign * value, 9))
                for sign, value in zip(signs, linear_values(problem, way, discount), strict=True)
            )
            for way in every
        }
        border = corners(points, Fraction(1, 10**7))
        exact = [[sign * float(value) for sign, value in zip(signs, point, strict=True)] for point in border]
        found = tradeoffs(problem, wishes)
        assert np.array(values_of(found)).ravel() == pytest.approx(np.array(exact).ravel(), abs=1e-7)
        for plan in found.plans:
            assert (plan.lower <= plan.values).all()
            assert (plan.values <= plan.upper).all()
        most = max(most, len(exact))
    assert most > 2


def test_what_can_be_gathered_without_end_has_no_best_plan():
    problem = rt.read("example:pedestrians")
    endless = ExpectedReward(goal='"destination"', reward="risk")
    with pytest.raises(PropertyError, match="more and more can be gathered"):
        tradeoffs(problem, [problem.properties["shortest"], endless])


@pytest.mark.parametrize(
    ("wishes", "error", "said"),
    [
        ([COST], QuestionError, "between two or more objectives, got 1"),
        ([COST, COST], QuestionError, "'cost' twice"),
        ([COST, ReachAvoid(goal=GOAL)], NotExplainableError, "expected totals of rewards"),
        ([COST, replace(RISK, maximise=True)], NotExplainableError, r"\[Fsure"),
        ([COST, replace(RISK, goal='"hazard"')], NotExplainableError, "end alike"),
        ([COST, Discounted(reward="risk", discount=0.9)], NotExplainableError, "end alike"),
        ([COST, replace(RISK, reward="rsik")], PropertyError, "'rsik'"),
    ],
)
def test_what_cannot_be_traded_is_refused(wishes, error, said):
    problem = next(
        problem for problem in models(40) if (problem.mdp.labels["goal"] != problem.mdp.labels["hazard"]).any()
    )
    with pytest.raises(error, match=said):
        tradeoffs(problem, wishes)


@pytest.mark.parametrize(
    ("bound", "said"),
    [
        ({"rsik": 1.0}, "cost, risk, got 'rsik'"),
        ({"risk": math.nan}, "finite number"),
        ({"risk": "1"}, "finite number"),
        ({"risk": None}, "finite number"),
        ({"risk": True}, "finite number"),
        ({"risk": 10**400}, "finite number"),
        (0.5, "name of a reward with a number"),
        ({"risk": 1.0, "cost": 2.0}, "one objective can be bounded"),
    ],
)
def test_a_bound_that_means_nothing_is_refused(bound, said):
    with pytest.raises(QuestionError, match=said.capitalize() if said[0] == "o" else said):
        tradeoffs(two_rewards(Random(1)), [COST, RISK], bound=bound)


@pytest.mark.parametrize(
    "wishes", [5, "safest", ["shortest", None], ["shortest", 'P>=0.5 [F "crowd"]'], ["shortest", 5]]
)
def test_what_is_no_objective_is_refused_in_a_sentence(wishes):
    with pytest.raises(QuestionError, match="must be between"):
        tradeoffs(rt.read("example:pedestrians"), wishes)


@pytest.mark.parametrize("most", [1, "3", 2.5])
def test_how_many_plans_are_wanted_is_a_whole_number_from_two_on(most):
    with pytest.raises(QuestionError, match="At least two plans"):
        tradeoffs(rt.read("example:pedestrians"), ["shortest", "safest"], most=most)


def test_objectives_can_be_given_as_texts_and_names():
    problem = rt.read("example:pedestrians")
    known = values_of(tradeoffs(problem, [problem.properties["shortest"], problem.properties["safest"]]))
    for wishes in (["shortest", "risk"], ['R{"distance"}min=? [F "destination"]', problem.properties["safest"]]):
        assert values_of(tradeoffs(problem, wishes)) == known


def by_storm(problem: Problem, folder, goal: str, names: tuple[str, str], bound: float) -> float:
    """Return the least of one reward with at most a bound of another, by Storm's multi-objective engine."""
    stormpy = pytest.importorskip("stormpy")
    path = folder / "model.drn"
    rt.write(problem, path)
    model = stormpy.build_model_from_drn(str(path))
    text = f'multi(R{{"{names[0]}"}}min=? [F "{goal}"], R{{"{names[1]}"}}<={bound!r} [F "{goal}"])'
    result = stormpy.model_checking(model, stormpy.parse_properties(text)[0], only_initial_states=True)
    return float(result.get_value(model.initial_states[0]))


@pytest.mark.parametrize("bound", [0.1, 0.2, 1.0, 1.9, 3.0])
def test_storm_agrees_on_the_least_distance_within_a_risk(tmp_path, bound):
    problem = rt.read("example:pedestrians")
    wishes = [problem.properties["shortest"], problem.properties["safest"]]
    bounded = tradeoffs(problem, wishes, bound={"risk": bound}).bounded
    assert bounded is not None
    assert bounded.plan is not None
    storm = by_storm(problem, tmp_path, "destination", ("distance", "risk"), bound)
    assert bounded.plan.values[0] == pytest.approx(storm, rel=1e-4)


def test_storm_agrees_on_random_models(tmp_path):
    compared = 0
    for problem in models(30):
        points = corners(attained(problem))
        if len(points) < 2:
            continue
        bound = float(points[0][1] + points[-1][1]) / 2
        bounded = tradeoffs(problem, [COST, RISK], bound={"risk": bound}).bounded
        assert bounded is not None
        assert bounded.plan is not None
        storm = by_storm(problem, tmp_path, "goal", ("cost", "risk"), bound)
        assert bounded.plan.values[0] == pytest.approx(storm, rel=1e-3, abs=1e-4)
        compared += 1
    assert compared > 3
