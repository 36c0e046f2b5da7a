"""What one question leaves behind changes no answer to the next, and goes when its solution goes."""

from __future__ import annotations

import gc
import weakref

import pytest

import ratherthan as rt
from ratherthan.explain import question, shared
from ratherthan.narrate import to_json
from ratherthan.solve import evaluate

EXAMPLES = ("example:paper-5x5", "example:city-1", "example:delivery")


def questions(solution):
    mdp = solution.problem.mdp
    asked = [question(kind) for kind in ("contrastive", "selective", "naive-path")]
    asked.append(question("contrastive", alpha=0.5))
    asked.append(question("contrastive", omega=True))
    for state in range(0, mdp.states, max(1, mdp.states // 8)):
        own = mdp.choices_of(state)
        taken = int(solution.policy.choice[state])
        others = [choice for choice in own if choice != taken]
        if others and not solution.ended[state]:
            asked.append(question(state=state, rather_than=mdp.action_name(others[0])))
    return asked


@pytest.mark.parametrize("source", EXAMPLES)
def test_the_order_of_questions_changes_no_answer(source):
    problem = rt.read(source)
    fresh = {asked: to_json(rt.explain(rt.solve(problem), asked=asked)) for asked in questions(rt.solve(problem))}
    solution = rt.solve(problem)
    for asked in [*reversed(list(fresh)), *fresh]:
        assert to_json(rt.explain(solution, asked=asked)) == fresh[asked]


def test_what_is_kept_goes_with_its_solution():
    solution = rt.solve(rt.read("example:paper-5x5"))
    rt.explain(solution)
    gone, before = weakref.ref(solution), len(shared._KEPT)
    del solution
    gc.collect()
    assert gone() is None
    assert len(shared._KEPT) < before


def test_a_policy_and_the_optimum_share_nothing():
    problem = rt.read("example:paper-5x5")
    solution = rt.solve(problem)
    rt.explain(solution)
    given = evaluate(problem, solution.policy)
    assert rt.narrate(rt.explain(given)) == rt.narrate(rt.explain(solution))
    assert shared.graph_of(given) is not shared.graph_of(solution)
