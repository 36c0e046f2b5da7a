"""Random problems with random policies and questions, explained and stored: what the re-checker is tried on."""

from __future__ import annotations

import json
import os
from random import Random
from typing import Any, NamedTuple

import numpy as np
from random_models import LEVELS, MISSIONS, OBJECTIVES, SIGNED, random_policy, random_problem, random_rich_problem

from ratherthan.errors import PolicyError, PropertyError
from ratherthan.explain import KINDS, explain, question
from ratherthan.explain.question import FACTORS, Question
from ratherthan.explain.record import to_document
from ratherthan.factors import Search
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.narrate import narrate
from ratherthan.solve import Solution, evaluate, solve

MODELS = int(os.environ.get("RATHERTHAN_MODELS", "300"))
"""How many models the laws are tried on."""


class Case(NamedTuple):
    """A problem and an explanation of it, as a JSON document that went through text."""

    problem: Problem
    document: dict[str, Any]


def random_question(random: Random, solution: Solution) -> Question:
    """Return a random question that fits the model."""
    mdp = solution.problem.mdp
    lively = np.flatnonzero(solution.can_arrive & ~solution.ended & (np.diff(mdp.state_to_choices) > 1)).tolist()
    states = [None, random.randrange(mdp.states), *random.sample(lively, min(len(lively), 4))]
    settings: dict[str, Any] = {
        "state": random.choice(states),
        "alpha": random.choice([0.0, 0.0, 0.1, 1.0, 2.5]),
        "omega": random.random() < 0.2,
        "policy_values": random.random() < 0.25,
        "detail": random.random() < 0.5,
        "search": Search(horizon=random.choice([None, None, 0, 1, 2]), toward_goal=random.random() < 0.15),
    }
    way = random.random()
    if way < 0.2:
        state = int(mdp.initial[0]) if settings["state"] is None else settings["state"]
        taken = solution.policy.weights(mdp)
        foils = [c for c in mdp.choices_of(state) if taken[c] == 0.0]
        if foils and not solution.ended[state]:
            return question(rather_than=mdp.action_name(random.choice(foils)), **settings)
    if way < 0.75:
        return question(random.choice([*KINDS, "selective", "contrastive", "contrastive"]), **settings)
    factors = random.sample(FACTORS, random.randint(0, 3))
    return question(scope=random.choice(["state", "route", "route"]), factors=factors, **settings)


def random_case(seed: int) -> Case:
    """Return the case of a seed."""
    random = Random(seed)
    objective = list(OBJECTIVES.values())[seed % len(OBJECTIVES)]
    problem = random_problem(random, objective=objective)
    solution = _solution(random, problem)
    try:
        explanation = explain(solution, asked=random_question(random, solution))
    except PolicyError:  # asked about a state of which the policy says nothing
        explanation = explain(solution)
    document = to_document(explanation, narrate(explanation))
    return Case(problem, json.loads(json.dumps(document)))


RICH = {**SIGNED, **MISSIONS, **LEVELS}
"""The objectives beyond one cost and one probability."""

ALSO = (
    'R{"cost"}min=? [F "goal"]',
    'R{"toll"}min=? [F "goal"]',
    'R{"gain"}max=? [Fsure "goal"]',
    'R{"toll + 0.5 * cost"}min=? [F "goal"]',
    'Pmax=? [!"hazard" U "goal"]',
    'Pmin=? [F "hazard"]',
    'R{"gain"}max=? [Cdiscount=0.75]',
    "toll",
)
"""Further objectives."""


def random_rich_case(seed: int) -> Case:
    """Return a case of what else can be wanted: rewards of both signs, discounts, weights, missions, levels, trade-offs."""
    random = Random(seed)
    objective = list(RICH.values())[seed % len(RICH)]
    problem = random_rich_problem(random, objective=objective, most_states=random.choice([4, 6, 8]))
    solution = _rich_solution(random, problem)
    also: list[str] = []
    if random.random() < 0.4:
        also = random.sample(ALSO, random.choice([1, 1, 2]))
    asked = random_question(random, solution)
    try:
        explanation = explain(solution, asked=asked, also=also)
    except PolicyError:  # asked about a state of which the policy says nothing
        explanation = explain(solution)
    except PropertyError:  # the plan's own objective, or no goal until which a reward could count
        explanation = explain(solution, asked=asked)
    return Case(problem, json.loads(json.dumps(to_document(explanation, narrate(explanation)))))


def _rich_solution(random: Random, problem: Problem) -> Solution:
    """Return the optimum, or a random policy for the model or its product against it."""
    best = solve(problem)
    if random.random() < 0.5:
        return best
    mdp = random.choice([problem, best.problem]).mdp
    return evaluate(problem, random_policy(random, mdp, randomised=random.random() < 0.4))


def _solution(random: Random, problem: Problem) -> Solution:
    """Return the optimum, or a random policy against it."""
    if random.random() < 0.5:
        return solve(problem)
    policy = random_policy(random, problem.mdp, randomised=random.random() < 0.4)
    if policy.chance is None and random.random() < 0.3:
        silent = random.randrange(problem.mdp.states)
        try:
            return evaluate(
                problem, Policy(choice=np.where(np.arange(problem.mdp.states) == silent, -1, policy.choice))
            )
        except PolicyError:  # a state that it comes to must have a choice
            pass
    return evaluate(problem, policy)
