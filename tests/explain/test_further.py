"""A plan under further objectives: it is judged until its own objective has ended, whatever it would do after."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from random_models import OBJECTIVES, Table, problem_of, random_policy, random_rich_problem

from ratherthan.errors import PolicyError
from ratherthan.explain import explain
from ratherthan.explain.further import further_objectives, stopped, views_of
from ratherthan.explain.record import to_document
from ratherthan.model.objective import Discounted, ExpectedCost, Lexicographic, Mission, ReachAvoid
from ratherthan.model.policy import Policy
from ratherthan.narrate import narrate
from ratherthan.solve import Solution, evaluate, solve
from ratherthan.verify import Verdict, verify

COST = OBJECTIVES["least cost"]
END: dict[str, tuple[list[tuple[float, int]], float]] = {"end": ([(1.0, 2)], 0)}


def confirmed(solution: Solution, **asked: object) -> str:
    """Return the text of an explanation that the re-checker confirms."""
    explanation = explain(solution, **asked)  # type: ignore[arg-type]
    text = narrate(explanation)
    origin = solution.problem.unfolding.origin if solution.problem.unfolding else solution.problem
    verdicts = verify(to_document(explanation, text), origin)
    assert [(c.what, c.where, c.reason) for c in verdicts.checks if c.verdict is Verdict.FAILS] == []
    assert not verdicts.undecided
    return text


@pytest.mark.parametrize("seed", range(20))
def test_a_stopped_run_stays_for_nothing_where_the_objective_has_ended(seed: int) -> None:
    random = Random(seed)
    problem = random_rich_problem(random, objective=OBJECTIVES["safest"])
    policy = random_policy(random, problem.mdp, randomised=seed % 2 == 0)
    solution = evaluate(problem, policy)
    again, same = stopped(solution)
    mdp, taken = again.mdp, same.weights(again.mdp)
    assert mdp.states == problem.mdp.states
    assert mdp.choices == problem.mdp.choices
    for state in range(mdp.states):
        for choice in mdp.choices_of(state):
            before, after = problem.mdp.branches_of(choice), mdp.branches_of(choice)
            if solution.ended[state]:
                assert mdp.branch_to_target[after].tolist() == [state]
                assert mdp.branch_to_probability[after].tolist() == [1.0]
                assert all(_paid(reward, state, choice, after) == 0 for reward in mdp.rewards.values())
            else:
                assert mdp.branch_to_target[after].tolist() == problem.mdp.branch_to_target[before].tolist()
                assert [_paid(r, state, choice, after) for r in mdp.rewards.values()] == [
                    _paid(r, state, choice, before) for r in problem.mdp.rewards.values()
                ]
                assert taken[choice] == policy.weights(problem.mdp)[choice]
        assert taken[list(mdp.choices_of(state))].sum() == pytest.approx(1.0)


def _paid(reward: object, state: int, choice: int, branches: slice) -> float:
    rows = {"state": state, "choice": choice, "branch": branches}
    return sum(float(np.sum(values[rows[kind]])) for kind, values in reward.parts())  # type: ignore[attr-defined]


def test_a_policy_may_be_silent_where_its_objective_has_ended() -> None:
    table: Table = {
        0: {"a": ([(0.5, 1), (0.5, 2)], 1), "b": ([(1.0, 2)], 3)},
        1: {"x": ([(1.0, 0)], 1), "y": ([(1.0, 1)], 1)},
        2: END,
    }
    problem = problem_of(table, OBJECTIVES["safest"], goals=[2], hazards=[1])
    solution = evaluate(problem, Policy(choice=np.array([0, -1, -1])))
    text = confirmed(solution, also=['Pmin=? [F "hazard"]'], rather_than="b", factors=["responsibility"])
    assert text == (
        "We take a rather than b at state 0 although taking b would lead to a safer route (1 instead of 0.5, the chance to arrive "
        "safely) and a safer one (0 instead of 0.5, the risk), as we go on."
    )


def test_numbers_under_objectives_with_the_same_words_carry_their_property() -> None:
    table: Table = {
        0: {"a": ([(0.5, 1), (0.5, 2)], 1), "b": ([(1.0, 2)], 3)},
        1: {"x": ([(1.0, 1)], 1)},
        2: END,
        3: END,
    }
    solution = solve(problem_of(table, COST, goals=[2], hazards=[1]))
    also = ['Pmin=? [F "hazard"]', 'Pmin=? [F "init"]']
    text = confirmed(solution, rather_than="a", factors=["responsibility"], also=also[:1])
    assert text.endswith("because taking a may fail to arrive and it leads to a safer route (0 instead of 0.5).")
    text = confirmed(solution, kind="contrastive", also=also)
    assert "a risk of 0 (hazard) and a risk of 1 (init)" in text


def test_what_follows_an_objective_of_its_own_end_does_not_matter() -> None:
    """At state 1 the hazard has been met: what is done there matters to the cost, not to the risk."""
    table: Table = {
        0: {"go": ([(1.0, 1)], 1)},
        1: {"dear": ([(1.0, 2)], 5), "cheap": ([(1.0, 2)], 1)},
        2: END,
    }
    problem = problem_of(table, COST, goals=[2], hazards=[1])
    solution = solve(problem)
    explanation = explain(solution, state=1, rather_than="dear", also=['Pmin=? [F "hazard"]'])
    risk = explanation.steps[0].trades[0].judged[1]
    assert (risk.relation, risk.taken.number.value, risk.other.number.value) == ("equal", 1.0, 1.0)
    assert confirmed(solution, state=1, rather_than="dear", also=['Pmin=? [F "hazard"]']).startswith(
        "We take cheap rather than dear at state 1 because it leads to a route with less cost (1 instead of 5), and both "
        "lead to equally safe routes."
    )


def test_views_have_the_values_of_the_plan() -> None:
    problem = random_rich_problem(Random(3), objective=COST)
    solution = solve(problem)
    wanted = further_objectives(solution, ["toll", Discounted(reward="gain", discount=0.9)])
    own, toll, gain = views_of(solution, wanted)
    assert own.solution is solution
    for view, objective in ((toll, wanted[0]), (gain, wanted[1])):
        stopped_problem, policy = stopped(solution)
        again = evaluate(stopped_problem, policy, objective)
        assert view.solution.policy_values[0].tolist() == again.policy_values[0].tolist()


def test_a_second_objective_that_cannot_be_had_is_said_so() -> None:
    """To stay out of danger for sure means never to arrive."""
    table: Table = {
        0: {"stay": ([(1.0, 1)], 1), "wait": ([(1.0, 0)], 1), "dare": ([(0.5, 2), (0.5, 3)], 1)},
        1: {"back": ([(1.0, 0)], 1)},
        2: END,
        3: {"lost": ([(1.0, 3)], 0)},
    }
    objective = Lexicographic(levels=(OBJECTIVES["least risk"], COST))  # type: ignore[arg-type]
    solution = solve(problem_of(table, objective, goals=[2], hazards=[3]))
    text = confirmed(solution, kind="responsibility")
    assert "because it leads to one of the safest routes, although none of these is sure to arrive." in text


def test_explanations_of_missions_are_confirmed_on_the_model_itself() -> None:
    table: Table = {0: {"a": ([(0.5, 0), (0.5, 1)], 1), "b": ([(1.0, 1)], 1)}, 1: {"c": ([(1.0, 2)], 1)}, 2: END}
    for formula in ('F<=2 "goal"', 'F ("hazard" & (F "goal"))', '(F "goal") & (F<=1 "hazard")'):
        solution = solve(problem_of(table, Mission(formula=formula), goals=[2], hazards=[1]))
        assert confirmed(solution)
        assert confirmed(solution, also=['R{"cost"}min=? [F "goal"]'])


def test_a_policy_that_is_silent_on_the_way_is_refused() -> None:
    table: Table = {0: {"a": ([(1.0, 1)], 1)}, 1: {"b": ([(1.0, 2)], 1)}, 2: END}
    with pytest.raises(PolicyError):
        evaluate(
            problem_of(table, ExpectedCost(goal='"goal"', reward="cost"), goals=[2]),
            Policy(choice=np.array([0, -1, -1])),
        )


def test_a_probability_and_its_opposite_are_two_objectives() -> None:
    table: Table = {0: {"a": ([(0.5, 1), (0.5, 2)], 1), "b": ([(1.0, 2)], 3)}, 1: {"x": ([(1.0, 1)], 1)}, 2: END}
    plan = solve(problem_of(table, ReachAvoid(goal='"goal"'), goals=[2], hazards=[1]))
    assert "a risk of 0" in confirmed(plan, also=['Pmin=? [F "hazard"]'])
