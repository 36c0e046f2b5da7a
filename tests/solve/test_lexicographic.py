"""Objectives in order: what each level may still choose, where it ends, and what one policy can attain of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import inf
from random import Random

import numpy as np
import pytest
from random_models import GOAL, HAZARD, Table, problem_of, random_problem

from ratherthan.errors import PropertyError
from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Level,
    Lexicographic,
    Mission,
    ReachAvoid,
    levels_of,
)
from ratherthan.model.policy import Policy
from ratherthan.model.property import parse_property
from ratherthan.solve import Outcome, evaluate, solve
from ratherthan.solve.levels import ended_at

LIKELIEST, CHEAPEST = ReachAvoid(goal=GOAL), ExpectedCost(goal=GOAL, reward="cost")
SAFEST = ReachAvoid(goal=GOAL, through=f"!{HAZARD}")


def both(*levels: object) -> Lexicographic:
    return Lexicographic(levels=levels)  # type: ignore[arg-type]


FORK: Table = {
    0: {
        "cheap and risky": ([(0.9, 3), (0.1, 4)], 1),
        "dear": ([(1.0, 1)], 5),
        "less dear": ([(1.0, 2)], 4),
    },
    1: {"on": ([(1.0, 3)], 1)},
    2: {"on": ([(0.5, 3), (0.5, 2)], 1)},
    3: {"stay": ([(1.0, 3)], 0)},
    4: {"stay": ([(1.0, 4)], 1), "spin": ([(1.0, 4)], 0)},
}


def test_the_second_level_chooses_among_what_is_best_for_the_first() -> None:
    problem = problem_of(FORK, both(SAFEST, CHEAPEST), goals=[3], hazards=[4])
    solution = solve(problem)
    assert solution.outcome is Outcome.CERTIFIED
    assert solution.values.shape == (2, 5)
    assert solution.values[0].tolist() == [1, 1, 1, 1, 0]
    assert np.allclose(solution.values[1], [6, 1, 2, 0, 0])
    assert solution.policy.choice[0] == 1, "the first listed of the two that cost 6"
    assert solution.goal.tolist() == [False, False, False, True, False]
    assert solution.hazard.tolist() == [False, False, False, False, True]
    assert np.allclose(solution.policy_values, solution.values)
    turned = solve(problem, both(CHEAPEST, SAFEST))
    assert np.allclose(turned.values[0][:3], [6, 1, 2]), "a cost that is finite demands arrival"


def test_the_cost_stops_where_nothing_can_be_gained_any_more() -> None:
    table: Table = {
        0: {"on": ([(0.5, 1), (0.5, 2)], 1)},
        1: {"stay": ([(1.0, 1)], 0)},
        2: {"round": ([(1.0, 2)], 7), "on": ([(1.0, 3)], 7)},
        3: {"round": ([(1.0, 2)], 7)},
    }
    solution = solve(problem_of(table, both(LIKELIEST, CHEAPEST), goals=[1]))
    assert np.allclose(solution.values, [[0.5, 1, 0, 0], [1, 0, 0, 0]])
    assert ended_at(solution, 0).tolist() == [False, True, False, False]
    assert ended_at(solution, 1).tolist() == [False, True, True, True]


def test_the_least_risk_of_0_ends_nothing() -> None:
    table: Table = {
        0: {"on": ([(1.0, 1)], 2), "through": ([(0.9, 1), (0.1, 2)], 1)},
        1: {"stay": ([(1.0, 1)], 0)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    solution = solve(problem_of(table, both(ReachAvoid(goal=HAZARD, maximise=False), CHEAPEST), goals=[1], hazards=[2]))
    assert solution.values.tolist()[0] == [0, 0, 1]
    assert np.allclose(solution.values[1], [2, 0, 0])
    assert ended_at(solution, 1).tolist() == [False, True, True]


def test_to_take_the_best_choices_for_ever_is_not_to_arrive() -> None:
    """Going round is tied for the first level and free for the second, but does not get there."""
    table: Table = {
        0: {"round": ([(1.0, 1)], 0), "end": ([(1.0, 2)], 3)},
        1: {"round": ([(1.0, 0)], 0), "end": ([(1.0, 2)], 4)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    solution = solve(problem_of(table, both(LIKELIEST, CHEAPEST), goals=[2]))
    assert np.allclose(solution.values, [[1, 1, 1], [3, 3, 0]])
    assert solution.policy.choice.tolist() == [1, 2, 4]
    assert np.allclose(solution.policy_values, solution.values)


def test_where_no_policy_attains_all_levels_the_first_comes_first_and_the_values_say_so() -> None:
    """The cheapest way to "b" comes by again and again without arriving at the goal."""
    table: Table = {
        0: {"visit": ([(1.0, 1)], 0), "arrive": ([(1.0, 2)], 1)},
        1: {"back": ([(1.0, 0)], 0)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    problem = problem_of(table, both(LIKELIEST, ExpectedCost(goal=HAZARD, reward="cost")), goals=[2], hazards=[1])
    solution = solve(problem)
    assert solution.values.tolist() == [[1, 1, 1], [0, 0, 0]]
    assert solution.policy.choice.tolist() == [1, 2, 3]
    assert np.allclose(solution.policy_values, [[1, 1, 1], [1, 0, 0]])


def test_three_levels_narrow_one_after_the_other() -> None:
    table: Table = {
        0: {
            "a": ([(1.0, 1)], 2),
            "b": ([(0.5, 1), (0.5, 2)], 2),
            "c": ([(1.0, 2)], 2),
            "d": ([(1.0, 2)], 1),
        },
        1: {"on": ([(1.0, 3)], 1)},
        2: {"on": ([(1.0, 3)], 1)},
        3: {"stay": ([(1.0, 3)], 0)},
    }
    steps, risk = ExpectedCost(goal=GOAL, reward=None), ReachAvoid(goal=HAZARD, maximise=False)
    problem = problem_of(table, both(steps, risk, CHEAPEST), goals=[3], hazards=[2])
    solution = solve(problem)
    assert np.allclose(solution.values[:, 0], [2, 0, 3])
    assert solution.policy.choice[0] == 0
    other = solve(problem, both(steps, CHEAPEST, risk))
    assert np.allclose(other.values[:, 0], [2, 2, 1])
    assert other.policy.choice[0] == 3


def test_a_given_policy_has_a_value_for_every_level() -> None:
    problem = problem_of(FORK, both(SAFEST, CHEAPEST), goals=[3], hazards=[4])
    given = evaluate(problem, Policy(choice=np.array([0, 3, 4, 5, 6])))
    assert given.given
    assert np.allclose(given.policy_values, [[0.9, 1, 1, 1, 0], [1, 1, 2, 0, 0]]), "it costs less, at a risk"
    assert np.allclose(given.values[:, 0], [1, 6])
    round_ = evaluate(replace(problem, objective=both(CHEAPEST, SAFEST)), given.policy)
    assert round_.policy_values[0, 0] == inf


def test_a_level_may_be_discounted_or_signed() -> None:
    table: Table = {
        0: {"a": ([(1.0, 1)], 1), "b": ([(1.0, 1)], -2)},
        1: {"on": ([(1.0, 2)], 5)},
        2: {"stay": ([(1.0, 2)], 3)},
    }
    problem = problem_of(table, both(LIKELIEST, Discounted(reward="cost", discount=0.5, maximise=False)), goals=[2])
    solution = solve(problem)
    assert np.allclose(solution.values[1], [0.5, 5, 0]), "what is paid after the end of the run does not count"
    signed = solve(problem, both(LIKELIEST, ExpectedReward(goal=GOAL, reward="cost", maximise=False)))
    assert np.allclose(signed.values[1], [3, 5, 0])
    assert signed.policy.choice[0] == 1


MISSION = Mission(formula=f"F<=2 {GOAL}")
LADDER: Table = {
    0: {"slow": ([(1.0, 1)], 1), "leap": ([(0.5, 2), (0.5, 0)], 3)},
    1: {"on": ([(0.8, 2), (0.2, 1)], 1)},
    2: {"stay": ([(1.0, 2)], 0)},
}


def test_a_mission_is_solved_on_its_product() -> None:
    problem = problem_of(LADDER, MISSION, goals=[2])
    solution = solve(problem)
    assert solution.problem.unfolding is not None
    assert solution.problem.mdp.states > 3
    assert solution.values[0, 0] == pytest.approx(0.8)
    assert solve(solution.problem).values[0, 0] == pytest.approx(0.8), "the product is taken as it is"
    least = solve(problem, replace(MISSION, maximise=False))
    assert least.values[0, 0] == pytest.approx(0.5), "first leap, then walk"
    assert (least.hazard == solution.goal).all()
    given = evaluate(problem, Policy(choice=np.array([1, 2, 3])))
    assert given.policy_values[0, 0] == pytest.approx(0.75)
    assert given.values[0, 0] == pytest.approx(0.8)
    again = evaluate(solution.problem, solution.policy)
    assert np.allclose(again.policy_values, solution.values)


def test_a_mission_comes_first_of_several() -> None:
    problem = problem_of(LADDER, both(MISSION, CHEAPEST), goals=[2])
    solution = solve(problem)
    assert solution.values[0, 0] == pytest.approx(0.8)
    # slow costs 1, then one attempt that succeeds with 0.8: after it the run has arrived, or cannot in time
    assert solution.values[1, 0] == pytest.approx(2)
    assert ended_at(solution, 1).sum() > ended_at(solution, 0).sum() - 1
    given = evaluate(problem, Policy(choice=np.array([1, 2, 3])))
    assert given.policy_values[:, 0].tolist() == pytest.approx([0.75, 4.5])
    with pytest.raises(PropertyError, match="Put it first"):
        solve(problem, both(CHEAPEST, MISSION))


def test_progress_tells_which_objective_is_solved() -> None:
    told: list[str] = []
    solve(problem_of(FORK, both(SAFEST, CHEAPEST), goals=[3], hazards=[4]), progress=told.append)
    assert "objective 2 of 2" in told


WET: Table = {
    0: {"wait": ([(1.0, 0)], 0), "through": ([(1.0, 1)], 1), "past": ([(0.75, 2), (0.25, 1)], 5)},
    1: {"on": ([(1.0, 2)], 1)},
    2: {"stay": ([(1.0, 2)], 0)},
}


@pytest.mark.parametrize("first", [LIKELIEST, CHEAPEST], ids=["likeliest", "cheapest"])
def test_to_stay_for_ever_is_no_way_to_avoid_what_lies_on_the_only_way(first: Level) -> None:
    """Who never arrives keeps dry; but the first level demands that he arrives."""
    dry = ReachAvoid(goal=HAZARD, maximise=False)
    solution = solve(problem_of(WET, both(first, dry), goals=[2], hazards=[1]))
    assert solution.outcome is Outcome.CERTIFIED
    assert solution.values[1].tolist() == pytest.approx([0.25 if first is LIKELIEST else 1, 1, 0])
    assert np.allclose(solution.policy_values, solution.values)
    narrow = {**WET, 0: {"wait": ([(1.0, 0)], 0), "through": ([(1.0, 1)], 1)}}
    solution = solve(problem_of(narrow, both(first, dry), goals=[2], hazards=[1]))
    assert solution.values[1].tolist() == [1, 1, 0], "every way there is wet"


@pytest.mark.parametrize("seed", range(60))
def test_a_least_risk_on_the_way_is_that_of_the_best_plan_that_attains_the_first_level(seed: int) -> None:
    problem = random_problem(Random(seed), most_states=5, objective=LIKELIEST)
    levels = (LIKELIEST, ReachAvoid(goal=HAZARD, maximise=False))
    solution = solve(problem, both(*levels))
    best = solution.values[0]
    risks = []
    for choice in product(*map(problem.mdp.choices_of, range(problem.mdp.states))):
        found = evaluate(problem, Policy(choice=np.array(choice)), both(*levels))
        if np.allclose(found.policy_values[0], best, rtol=0, atol=1e-9):
            risks.append(found.policy_values[1])
    assert np.allclose(np.min(risks, axis=0), solution.values[1], rtol=0, atol=1e-9)
    assert np.allclose(solution.policy_values, solution.values, rtol=0, atol=1e-9)


def test_a_discounted_sum_that_is_best_for_ever_is_refused_after_a_level_that_ends() -> None:
    table: Table = {
        0: {"graze": ([(1.0, 0)], 1), "home": ([(1.0, 1)], 0)},
        1: {"stay": ([(1.0, 1)], 0)},
    }
    problem = problem_of(table, LIKELIEST, goals=[1])
    most, least = (Discounted(reward="cost", discount=0.5, maximise=m) for m in (True, False))
    with pytest.raises(PropertyError, match="a plan that is best for it and for those before it"):
        solve(problem, both(LIKELIEST, most))
    assert solve(problem, both(LIKELIEST, least)).policy.choice[0] == 1
    assert solve(problem, both(most, LIKELIEST)).values[:, 0].tolist() == [2, 0], "first it has its value"


def test_a_largest_cost_without_end_is_refused_before_and_after_a_level_that_ends() -> None:
    table: Table = {
        0: {"wait": ([(1.0, 0)], 1), "go": ([(1.0, 1)], 1)},
        1: {"back": ([(1.0, 0)], 1), "try": ([(0.5, 2), (0.5, 0)], 0)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    dearest = ExpectedCost(goal=GOAL, reward="cost", maximise=True)
    problem = problem_of(table, LIKELIEST, goals=[2])
    with pytest.raises(PropertyError, match="only the last may be without a finite value.*state 0"):
        solve(problem, both(dearest, LIKELIEST))
    with pytest.raises(PropertyError, match="a plan that is best for it"):
        solve(problem, both(LIKELIEST, dearest))
    free = {**table, 0: {"wait": ([(1.0, 0)], 0), "go": ([(1.0, 1)], 3)}, 1: {"on": ([(1.0, 2)], 1)}}
    solution = solve(problem_of(free, both(LIKELIEST, dearest), goals=[2]))
    assert solution.values[1].tolist() == [4, 1, 0], "to wait for ever costs nothing, and does not arrive"
    assert np.allclose(solution.policy_values, solution.values)


def test_where_no_plan_without_memory_has_both_the_first_level_is_kept_to_near_the_end_only() -> None:
    """To see the hazard first and then arrive takes memory at 0; elsewhere both can be had."""
    table: Table = {
        0: {"away": ([(1.0, 2)], 0), "arrive": ([(1.0, 1)], 0)},
        1: {"stay": ([(1.0, 1)], 0)},
        2: {"back": ([(1.0, 0)], 0), "see": ([(1.0, 3)], 0)},
        3: {"back": ([(1.0, 0)], 0)},
    }
    solution = solve(problem_of(table, both(LIKELIEST, ReachAvoid(goal=HAZARD)), goals=[1], hazards=[3]))
    assert solution.policy_values.tolist() == [[1, 1, 1, 1], [0, 0, 1, 1]]


def test_an_objective_without_levels_is_refused() -> None:
    with pytest.raises(PropertyError, match="at least one"):
        solve(problem_of(WET, LIKELIEST, goals=[2], hazards=[1]), both())


def test_a_solution_tells_its_objectives_in_their_one_spelling() -> None:
    problem = problem_of(WET, LIKELIEST, goals=[2], hazards=[1])
    for given, plain in (
        (ReachAvoid(goal=f"({GOAL})", through=f"!({HAZARD})"), SAFEST),
        (ExpectedCost(goal=f"(({GOAL}))", reward="2*cost"), ExpectedCost(goal=GOAL, reward="2 * cost")),
        (Mission(formula=f"F<=2   ({GOAL})"), MISSION),
        (both(Mission(formula=f"F<=2 ({GOAL})"), CHEAPEST), both(MISSION, CHEAPEST)),
    ):
        wanted = levels_of(plain)
        assert solve(problem, given).objectives == wanted
        policy = Policy(choice=np.array([1, 3, 4]))
        assert evaluate(problem, policy, given).objectives == wanted
        assert parse_property(plain.text, problem) == plain
