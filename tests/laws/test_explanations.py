"""What every explanation obeys, on random models with random policies."""

from __future__ import annotations

import json
from dataclasses import replace
from random import Random

import numpy as np
import pytest
from random_models import random_policy, random_problem

from ratherthan.explain import KINDS, Explanation, explain
from ratherthan.explain.record import from_document, to_document
from ratherthan.model.mdp import MDP
from ratherthan.model.names import StateNames
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.narrate import narrate
from ratherthan.solve import Solution, evaluate, solve

SEEDS = range(150)


def solution_of(random: Random) -> Solution:
    problem = random_problem(random)
    if random.random() < 0.5:
        return solve(problem)
    return evaluate(problem, random_policy(random, problem.mdp, randomised=random.random() < 0.3))


def every_kind(solution: Solution) -> list[Explanation]:
    return [explain(solution, kind) for kind in KINDS]


@pytest.mark.parametrize("seed", SEEDS)
def test_an_explanation_survives_a_round_trip_through_json(seed: int) -> None:
    for explanation in every_kind(solution_of(Random(seed))):
        text = narrate(explanation)
        again, said = from_document(json.loads(json.dumps(to_document(explanation, text), allow_nan=False)))
        assert again == explanation
        assert said == text == narrate(again)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_text_is_one_line_of_whole_sentences(seed: int) -> None:
    for explanation in every_kind(solution_of(Random(seed))):
        text = narrate(explanation)
        assert "\n" not in text
        assert "  " not in text
        assert "{" not in text
        assert "nan" not in text
        assert text == "" if explanation.question.kind == "none" else text[0].isupper() and text.endswith(".")


@pytest.mark.parametrize("seed", SEEDS)
def test_the_closing_sentence_is_said_only_where_all_untold_choices_are_equal(seed: int) -> None:
    explanation = explain(solution_of(Random(seed)), "selective")
    said = "All other decisions result in equivalent routes." in narrate(explanation)
    told = [step for step in explanation.steps if step.critical is not False]
    assert said == (explanation.closing.printed and bool(told))


@pytest.mark.parametrize("seed", SEEDS)
def test_no_superlative_is_said_of_a_choice_that_another_beats(seed: int) -> None:
    solution = solution_of(Random(seed))
    explanation = explain(solution, scope="route", factors=["responsibility"])
    for step in explanation.steps:
        claims = {claim.claim for claim in step.claims}
        if claims & {"best", "among the best"}:
            assert not claims & {"not best", "right start only", "hopeless"}
            own = next(c for c in step.claims if c.claim in ("best", "among the best"))
            for _, optimum, followed in own.evidence.follows:
                assert optimum.value == pytest.approx(followed.value, rel=2e-6, abs=1e-12)


def renamed(solution_problem: Problem, order: list[int]) -> Problem:
    """Return the same problem with states in another order, each keeping its name."""
    mdp = solution_problem.mdp
    new_of = np.argsort(order)
    first = [0]
    rows: list[int] = []
    for old in order:
        rows += list(mdp.choices_of(old))
        first.append(len(rows))
    branches = [b for c in rows for b in range(mdp.branches_of(c).start, mdp.branches_of(c).stop)]
    counts = [mdp.branches_of(c).stop - mdp.branches_of(c).start for c in rows]
    again = MDP(
        state_to_choices=np.array(first),
        choice_to_branches=np.concatenate([[0], np.cumsum(counts)]),
        branch_to_target=new_of[mdp.branch_to_target[branches]],
        branch_to_probability=mdp.branch_to_probability[branches],
        choice_to_action=mdp.choice_to_action[rows],
        actions=mdp.actions,
        labels={name: mask[order] for name, mask in mdp.labels.items()},
        rewards={name: replace(r, choice=r.choice[rows]) for name, r in mdp.rewards.items()},
        initial=new_of[mdp.initial],
        names=StateNames(count=mdp.states, strings=[mdp.names[old] for old in order]),
    )
    return replace(solution_problem, mdp=again)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", ["naive-path", "contrastive"])
def test_renaming_states_renames_the_explanation(seed: int, kind: str) -> None:
    random = Random(seed)
    problem = random_problem(random)
    names = [f"place {chr(65 + s)}" for s in range(problem.mdp.states)]
    problem = renamed(problem, list(range(problem.mdp.states)))
    problem = replace(problem, mdp=replace(problem.mdp, names=StateNames(count=len(names), strings=names)))
    order = list(range(problem.mdp.states))
    random.shuffle(order)
    one, two = explain(solve(problem), kind), explain(solve(renamed(problem, order)), kind)
    if one.route_outcome in ("arrives", "there", "open end"):  # lists of states are given in the model's order
        assert narrate(one) == narrate(two)


@pytest.mark.parametrize("seed", SEEDS)
def test_explaining_the_optimal_policy_as_a_given_one_says_the_same(seed: int) -> None:
    problem = random_problem(Random(seed))
    optimal = solve(problem)
    given = evaluate(problem, Policy(choice=optimal.policy.choice))
    for kind in ("naive-path", "contrastive"):
        assert narrate(explain(given, kind)) == narrate(explain(optimal, kind))
