"""solve, evaluate and arrival: what they answer, and what they refuse."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from math import inf
from random import Random

import numpy as np
import pytest
from exact import optimum_by_enumeration
from random_models import OBJECTIVES, Table, problem_of, random_problem

from ratherthan.errors import PolicyError, PropertyError
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import ExpectedCost, ReachAvoid, Threshold
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, arrival, evaluate, expected_reward, linear, policy_iteration, solve

FORK: Table = {
    0: {"safe": ([(1.0, 1)], 2), "risky": ([(0.5, 1), (0.5, 3)], 1)},
    1: {"on": ([(0.9, 2), (0.1, 1)], 1)},
    2: {"stay": ([(1.0, 2)], 0)},
    3: {"stay": ([(1.0, 3)], 0)},
}


def fork(objective: str) -> Problem:
    return problem_of(FORK, OBJECTIVES[objective], goals=[2], hazards=[3])


def test_a_state_that_cannot_be_sure_to_arrive_costs_infinitely_much_and_still_tries() -> None:
    table: Table = {
        0: {"stay": ([(1.0, 0)], 1), "try": ([(0.5, 1), (0.5, 2)], 1)},
        1: {"stay": ([(1.0, 1)], 0)},
        2: {"stay": ([(1.0, 2)], 1), "also": ([(1.0, 2)], 1)},
    }
    solution = solve(problem_of(table, OBJECTIVES["least cost"], goals=[1]))
    assert solution.lower[0].tolist() == solution.upper[0].tolist() == [inf, 0, inf]
    assert solution.can_arrive.tolist() == [True, True, False]
    assert solution.policy.choice.tolist() == [1, 2, 3], "tries where it can, the first listed where it is lost"
    assert solution.outcome is Outcome.CERTIFIED


def test_the_largest_cost_is_infinite_where_the_goal_can_be_dodged_and_the_policy_dodges_it() -> None:
    table: Table = {
        0: {"on": ([(1.0, 1)], 1), "fork": ([(0.5, 1), (0.5, 2)], 1)},
        1: {"stay": ([(1.0, 1)], 0)},
        2: {"on": ([(1.0, 1)], 1), "wait": ([(1.0, 2)], 0)},
        3: {"on": ([(0.5, 1), (0.5, 3)], 2)},
    }
    solution = solve(problem_of(table, OBJECTIVES["most cost"], goals=[1]))
    assert solution.values[0].tolist() == [inf, 0, inf, 4]
    assert solution.policy.choice.tolist() == [1, 2, 4, 5]
    assert solution.policy_lower[0].tolist()[::2] == [inf, inf]


def test_a_minimised_target_is_the_hazard_and_leaving_the_way_is_the_good_end() -> None:
    problem = fork("safest")
    objective = ReachAvoid(goal='"hazard"', through='!"goal"', maximise=False)
    solution = solve(problem, objective)
    assert solution.hazard.tolist() == [False, False, False, True]
    assert solution.goal.tolist() == [False, False, True, False]
    assert solution.can_arrive.all()
    assert solution.values[0].tolist() == [0, 0, 0, 1]


def test_hazards_end_a_run_that_wants_to_arrive() -> None:
    solution = solve(fork("safest"))
    assert solution.hazard.tolist() == [False, False, False, True]
    assert solution.values[0].tolist() == [1, 1, 1, 0]
    assert solution.can_arrive.tolist() == [True, True, True, False]
    assert solution.policy.choice[0] == 0


def test_values_decided_by_the_graph_are_exact() -> None:
    solution = solve(fork("safest"))
    assert solution.engine == "graph search"
    assert (solution.lower == solution.upper).all()


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(30))
def test_large_systems_are_solved_as_small_ones(seed: int, objective: str, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_problem(Random(seed), most_states=6, objective=OBJECTIVES[objective])
    small = solve(problem)
    monkeypatch.setattr(linear, "MOST_DENSE", 0)
    monkeypatch.setattr(policy_iteration, "MOST_DENSE", 0)
    large = solve(problem)
    assert np.allclose(small.values[0], large.values[0], rtol=1e-12)
    assert (small.policy.choice == large.policy.choice).all()
    for value, lower, upper in zip(
        optimum_by_enumeration(problem), *large.lower.tolist(), *large.upper.tolist(), strict=True
    ):
        assert lower <= value <= upper


def test_rewards_of_states_choices_and_branches_are_added_up() -> None:
    mdp = fork("least cost").mdp
    parts = Reward(
        state=np.array([1.0, 10.0, 100.0, 0.0]),
        choice=np.array([0.5, 0.25, 0.0, 0.0, 0.0]),
        branch=np.array([4.0, 2.0, 6.0, 10.0, 0.0, 0.0, 0.0]),
    )
    mdp = replace(mdp, rewards={"r": parts})
    assert expected_reward(mdp, "r").tolist() == [5.5, 5.25, 19.0, 100.0, 0.0]
    assert expected_reward(mdp, None).tolist() == [1.0] * 5
    solution = solve(Problem(mdp=mdp), ExpectedCost(goal='"goal"', reward="r"))
    assert (
        solution.lower[0, 0]
        <= Fraction(5.5) + Fraction(19) / (Fraction(0.9) / (Fraction(0.9) + Fraction(0.1)))
        <= solution.upper[0, 0]
    )


@pytest.mark.parametrize(
    ("part", "where", "place"),
    [
        ("state", 1, "state 1"),
        ("choice", 1, "action 'risky' of state 0"),
        ("branch", 2, "the branch to state 3 of action 'risky'"),
    ],
)
def test_a_negative_reward_is_refused_with_its_place(part: str, where: int, place: str) -> None:
    mdp = fork("least cost").mdp
    values = np.zeros({"state": mdp.states, "choice": mdp.choices, "branch": mdp.branches}[part])
    values[where] = -2.5
    mdp = replace(mdp, rewards={"r": Reward(**{part: values})})
    with pytest.raises(PropertyError, match=rf"got -2\.5 for 'r' at {place}") as caught:
        solve(Problem(mdp=mdp), ExpectedCost(goal='"goal"', reward="r"))
    assert caught.value.part == part
    assert caught.value.value == -2.5


def test_what_is_no_objective_is_refused() -> None:
    problem = replace(fork("safest"), objective=None)
    with pytest.raises(PropertyError):
        solve(replace(problem, mdp=replace(problem.mdp, labels={}, rewards={})))
    with pytest.raises(PropertyError, match="must ask for a value"):
        solve(problem, Threshold(objective=ReachAvoid(goal='"goal"'), relation=">=", bound=0.5))  # type: ignore[arg-type]
    with pytest.raises(PropertyError, match=r"got 'time'; there are: 'cost'"):
        solve(problem, ExpectedCost(goal='"goal"', reward="time"))


def test_rewards_beyond_the_range_of_doubles_are_refused() -> None:
    mdp = replace(fork("least cost").mdp, rewards={"r": Reward(state=np.full(4, 1e308), choice=np.full(5, 1e308))})
    with pytest.raises(PropertyError, match="exceed the largest double"):
        solve(Problem(mdp=mdp), ExpectedCost(goal='"goal"', reward="r"))


def test_rewards_below_the_range_of_doubles_are_refused_with_their_place() -> None:
    mdp = replace(fork("least cost").mdp, rewards={"r": Reward(choice=np.array([1e-300, 0.0, 3e-300, 1e-300, 5e-324]))})
    with pytest.raises(
        PropertyError, match=r"the largest of 'r' is 3e-300 at action '.*' of state .*smaller unit"
    ) as caught:
        solve(Problem(mdp=mdp), ExpectedCost(goal='"goal"', reward="r"))
    assert caught.value.choice == 2


@pytest.mark.parametrize("scale", [1e-284, 1e-200, 1e200, 1e300])
def test_rewards_in_any_unit_are_solved_and_proved(scale: float) -> None:
    plain = fork("least cost")
    (name,) = plain.mdp.rewards
    paid = plain.mdp.rewards[name].choice
    assert paid is not None
    mdp = replace(plain.mdp, rewards={name: Reward(choice=paid * scale)})
    one, scaled = solve(plain), solve(replace(plain, mdp=mdp))
    assert scaled.outcome is one.outcome
    finite = np.isfinite(one.values[0])
    assert scaled.values[0][finite] == pytest.approx(one.values[0][finite] * scale, rel=1e-9)
    assert (scaled.lower[0] <= one.upper[0] * scale * (1 + 1e-12)).all()
    assert (scaled.upper[0] >= one.lower[0] * scale * (1 - 1e-12)).all()


def test_a_policy_may_be_silent_where_it_does_not_come() -> None:
    table: Table = {**FORK, 4: {"on": ([(1.0, 0)], 1)}, 5: {"on": ([(1.0, 4)], 1)}}
    problem = problem_of(table, OBJECTIVES["least cost"], goals=[2], hazards=[3])
    given = evaluate(problem, Policy(choice=np.array([0, 2, -1, -1, -1, 6])))
    assert given.given
    assert given.policy_lower[0].tolist()[3:] == [-inf, -inf, -inf]
    assert given.policy_upper[0].tolist()[3:] == [inf, inf, inf]
    assert not np.isnan(given.policy_values).any()
    with pytest.raises(
        PolicyError, match=r"says nothing of state 1\. Add a line for it with one of its actions: 'on'"
    ) as caught:
        evaluate(problem, Policy(choice=np.array([0, -1, 3, 4, 5, 6])))
    assert caught.value.state == 1
    with pytest.raises(PolicyError, match="a choice of the state itself"):
        evaluate(problem, Policy(choice=np.array([4, 2, 3, 4, 5, 6])))


def test_a_randomised_policy_is_worth_the_mean() -> None:
    problem = fork("safest")
    given = evaluate(problem, Policy(choice=np.full(4, -1), chance=np.array([0.25, 0.75, 1.0, 1.0, 1.0])))
    assert given.policy_lower[0, 0] <= Fraction(5, 8) <= given.policy_upper[0, 0]
    assert given.policy_upper[0, 0] - given.policy_lower[0, 0] < 1e-13
    assert given.values[0, 0] == 1, "beside the optimum"


def test_arrival_is_the_probability_of_the_policy_to_arrive() -> None:
    problem = fork("least cost")
    goal, hazard = problem.mdp.labels["goal"], problem.mdp.labels["hazard"]
    for source in (problem, problem.mdp):
        lower, upper = arrival(source, Policy(choice=np.array([1, 2, 3, 4])), goal, hazard)
        assert lower[0] <= 0.5 <= upper[0]
        assert lower[1:].tolist() == upper[1:].tolist() == [1, 1, 0]


def test_progress_is_told() -> None:
    told: list[str] = []
    solve(fork("least cost"), progress=told.append)
    assert "proving the bounds" in told


def test_a_small_model_is_solved_without_a_compiler_or_sparse_solvers() -> None:
    program = (
        "import sys, ratherthan as rt; s = rt.solve(rt.read('example:paper-5x5')); "
        "assert s.outcome is rt.Outcome.CERTIFIED; "
        "sys.exit(str([m for m in ('numba', 'scipy', 'stormpy') if m in sys.modules] or ''))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.strip()) in ((0, ""), (1, ""))


def walk(cells: int, forward: float) -> Problem:
    """Return a walk that moves on with probability `forward`, else back."""
    table: Table = {i: {"on": ([(forward, i + 1), (1 - forward, max(i - 1, 0))], 1)} for i in range(cells)}
    table[cells] = {"stay": ([(1.0, cells)], 0)}
    return problem_of(table, OBJECTIVES["least cost"], goals=[cells])


@pytest.mark.parametrize(("cells", "forward"), [(10, 0.1), (60, 0.4)])
def test_a_walk_that_takes_1e9_steps_is_certified(cells: int, forward: float) -> None:
    problem = walk(cells, forward)
    solution = solve(problem)
    [expected, *_] = optimum_by_enumeration(problem)
    assert solution.lower[0, 0] <= expected <= solution.upper[0, 0]
    assert solution.upper[0, 0] - solution.lower[0, 0] <= 1e-9 * expected


@pytest.mark.parametrize("cells", [60, 400])
def test_what_is_beyond_doubles_is_not_certified_and_not_nan(cells: int) -> None:
    solution = solve(walk(cells, 0.1))
    assert solution.outcome in (Outcome.UNCERTIFIED, Outcome.LOWER_ONLY)
    assert solution.lower[0, 0] < 1e57 < solution.upper[0, 0]
    assert not np.isnan(solution.values).any()


def rooms(side: int, hazards: float, seed: int) -> MDP:
    """Return a map with obstacles and hazards on which moves slip sideways: full of places where a run can wait for long."""
    random = np.random.default_rng(seed)
    ground = random.choice(3, size=(side, side), p=[0.9 - hazards, 0.1, hazards])
    ground[0, 0] = ground[-1, -1] = 0
    cells = {(int(y), int(x)): i for i, (y, x) in enumerate(np.argwhere(ground != 1))}
    targets = []
    for (y, x), cell in cells.items():
        moved = [cells.get((y + dy, x + dx), cell) for dy, dx in ((-1, 0), (0, 1), (1, 0), (0, -1))]
        targets += [t for k in range(4) for t in (moved[k], moved[(k + 1) % 4], moved[(k + 3) % 4])]
    n = len(cells)
    return MDP(
        state_to_choices=np.arange(0, 4 * n + 1, 4),
        choice_to_branches=np.arange(0, 12 * n + 1, 3),
        branch_to_target=np.array(targets),
        branch_to_probability=np.tile([0.8, 0.1, 0.1], 4 * n),
        labels={"goal": np.arange(n) == cells[side - 1, side - 1], "hazard": np.array([ground[c] == 2 for c in cells])},
        rewards={"cost": Reward(choice=np.ones(4 * n))},
        initial=np.array([0]),
    )


@pytest.mark.parametrize(("hazards", "seed"), [(0.05, 0), (0.05, 1), (0.05, 2), (0.15, 0), (0.15, 2)])
def test_two_sided_bounds_are_found_among_traps(hazards: float, seed: int) -> None:
    problem = Problem(mdp=rooms(40, hazards, seed))
    solution = solve(problem, OBJECTIVES["safest"])
    assert solution.outcome is Outcome.CERTIFIED
    assert (solution.upper - solution.lower <= 1e-7 * solution.upper).all()
    assert (np.abs(solution.policy_values - solution.values) <= 1e-9 * solution.values).all()
    cheapest = solve(problem, OBJECTIVES["least cost"])
    assert cheapest.outcome is Outcome.CERTIFIED
