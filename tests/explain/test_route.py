"""The route is the most probable path under the policy; what does not arrive is an answer."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from random_models import OBJECTIVES, Table, problem_of, random_policy, random_problem

from ratherthan.explain import explain
from ratherthan.explain import route as routes
from ratherthan.explain.route import policy_graph, route_from
from ratherthan.model.policy import Policy
from ratherthan.narrate import narrate
from ratherthan.solve import Solution, evaluate, solve

COST = OBJECTIVES["least cost"]


def followed(table: Table, choices: list[int], *, goals: list[int]) -> Solution:
    problem = problem_of(table, COST, goals=goals)
    return evaluate(problem, Policy(choice=np.array(choices)))


def most_probable_by_enumeration(solution: Solution, start: int) -> float:
    """Return the largest probability of a path without repetition to a goal."""
    graph = policy_graph(solution)
    best = 0.0
    todo = [(start, 1.0, frozenset([start]))]
    while todo:
        state, probability, seen = todo.pop()
        if solution.goal[state]:
            best = max(best, probability)
            continue
        for edge in graph.edges_of(state):
            target = int(graph.target[edge])
            if target not in seen:
                todo.append((target, probability * float(graph.probability[edge]), seen | {target}))
    return best


@pytest.mark.parametrize("seed", range(200))
@pytest.mark.parametrize("small", [0, 20_000])
def test_the_route_is_the_most_probable_path(seed: int, small: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(routes, "SMALL", small)  # 0: the way of large models
    random = Random(seed)
    problem = random_problem(random, objective=COST)
    solution = evaluate(problem, random_policy(random, problem.mdp, randomised=seed % 3 == 0))
    start = int(problem.mdp.initial[0])
    route = route_from(solution, policy_graph(solution), start)
    best = most_probable_by_enumeration(solution, start)
    assert (route.outcome in ("arrives", "there")) == (best > 0)
    if best > 0:
        assert route.probability == pytest.approx(best, rel=1e-9)
        assert len(route.choices) == len(route.states) - 1


def test_ties_go_to_the_first_branches() -> None:
    table: Table = {
        0: {"go": ([(0.5, 2), (0.5, 1)], 1)},
        1: {"go": ([(1.0, 3)], 1)},
        2: {"go": ([(1.0, 3)], 1)},
        3: {"stay": ([(1.0, 3)], 0)},
    }
    solution = followed(table, [0, 1, 2, 3], goals=[3])
    assert route_from(solution, policy_graph(solution), 0).states == (0, 2, 3)


def test_staying_in_place_is_not_a_turn() -> None:
    table: Table = {
        0: {"go": ([(0.8, 0), (0.15, 1), (0.05, 2)], 1)},
        1: {"go": ([(1.0, 2)], 1)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    solution = followed(table, [0, 1, 2], goals=[2])
    route = route_from(solution, policy_graph(solution), 0)
    assert route.states == (0, 1, 2)
    assert route.probability == pytest.approx(0.75)


def test_a_policy_that_goes_round_is_said_to() -> None:
    table: Table = {
        0: {"on": ([(1.0, 1)], 1)},
        1: {"back": ([(1.0, 0)], 1), "on": ([(1.0, 2)], 1)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    explanation = explain(followed(table, [0, 1, 3], goals=[2]), "contrastive")
    assert explanation.route_outcome == "circles"
    assert explanation.circle == (0, 1)
    assert explanation.arrival is not None
    assert explanation.arrival.upper == 0.0
    assert narrate(explanation) == (
        "We take back at critical state 1 although taking on would lead to a route with less cost (1 instead of 3). "
        "All other decisions result in equivalent routes. "
        "We never arrive: we go round at state 0 and state 1 for ever."
    )


def test_the_circle_is_where_the_policy_cannot_leave() -> None:
    """From 0 the likelier branch comes back from 1, but in the end it stays at 2 for ever."""
    table: Table = {
        0: {"go": ([(0.9, 1), (0.1, 2)], 1), "home": ([(1.0, 3)], 9)},
        1: {"go": ([(1.0, 0)], 1)},
        2: {"wait": ([(1.0, 2)], 1)},
        3: {"stay": ([(1.0, 3)], 0)},
    }
    explanation = explain(followed(table, [0, 2, 3, 4], goals=[3]), "naive-path")
    assert explanation.circle == (2,)
    assert narrate(explanation).endswith("We never arrive: we stay at state 2 for ever.")


def test_where_there_is_no_way_it_is_said_what_can_be_reached() -> None:
    table: Table = {
        0: {"on": ([(1.0, 1)], 1)},
        1: {"back": ([(1.0, 0)], 1)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    explanation = explain(solve(problem_of(table, COST, goals=[2])))
    assert explanation.route_outcome == "no way"
    assert narrate(explanation) == "There is no way to arrive from state 0: from there we get no further than state 1."


def test_hazards_in_the_way_are_named() -> None:
    table: Table = {
        0: {"on": ([(1.0, 1)], 1)},
        1: {"on": ([(1.0, 2)], 1)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    explanation = explain(solve(problem_of(table, OBJECTIVES["safest"], goals=[2], hazards=[1])))
    assert explanation.in_the_way == (1,)
    assert narrate(explanation) == "There is no way to arrive safely from state 0: state 1 in between must be avoided."


def test_at_the_goal_we_are_already_there() -> None:
    table: Table = {0: {"stay": ([(1.0, 0)], 0)}}
    solution = solve(problem_of(table, COST, goals=[0]))
    assert [narrate(explain(solution, kind)) for kind in ("contrastive", "naive-path", "responsibility")] == (
        ["We are already there."] * 3
    )


def test_an_unlikely_route_and_an_unlikely_arrival_are_said() -> None:
    table: Table = {
        0: {"go": ([(0.3, 1), (0.7, 2)], 1)},
        1: {"stay": ([(1.0, 1)], 0)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    text = narrate(explain(solve(problem_of(table, OBJECTIVES["likeliest"], goals=[1])), "naive-path"))
    assert text == (
        "We take go at state 0. The chance to follow exactly this route is 30 %. The chance to arrive at all is 30 %."
    )


def test_without_a_goal_the_route_follows_the_most_probable_branch_until_it_repeats() -> None:
    table: Table = {
        0: {"go": ([(0.7, 1), (0.3, 2)], 1)},
        1: {"back": ([(1.0, 0)], 1)},
        2: {"stay": ([(1.0, 2)], 0)},
    }
    explanation = explain(solve(problem_of(table, OBJECTIVES["least risk"], goals=[], hazards=[2])), "naive-path")
    assert explanation.route_outcome == "open end"
    assert explanation.route == (0, 1, 0)
