"""Random models with missions on them, for the laws of products."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import numpy as np
from lasso import longest, random_path
from random_models import OBJECTIVES, random_problem

from ratherthan.errors import PropertyError
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import Mission
from ratherthan.model.problem import Problem, Unfolding
from ratherthan.model.syntax import Term, text_of
from ratherthan.model.temporal import chance_of

LABELS = ("goal", "hazard", "spot")


def random_model(random: Random, most_states: int = 5) -> Problem:
    """A random model with three labels and rewards of all kinds."""
    problem = random_problem(random, most_states=most_states, objective=OBJECTIVES["likeliest"])
    mdp = problem.mdp
    spot = np.array([random.random() < 0.4 for _ in range(mdp.states)])
    paid = Reward(state=np.arange(mdp.states) + 0.5, branch=np.arange(mdp.branches) * 1.0)
    fields = {name: getattr(mdp, name) for name in mdp.__dataclass_fields__}
    fields |= {"labels": {**mdp.labels, "spot": spot}, "rewards": {**mdp.rewards, "paid": paid}}
    return replace(problem, mdp=MDP(**fields))


def random_mission(random: Random, problem: Problem, *, steps: int | None = None) -> tuple[Mission, Term]:
    """A random mission; with `steps`, one that is decided after that many."""
    while True:
        term = random_path(random, LABELS, depth=2 if steps else 3)
        horizon = longest(term)
        if steps is not None and not (horizon is not None and 0 < horizon <= steps):
            continue
        try:
            said = chance_of(term, problem, maximise=True)
        except PropertyError:
            continue
        return Mission(formula=text_of(said), maximise=random.random() < 0.5), said


def unfolding_of(problem: Problem) -> Unfolding:
    assert problem.unfolding is not None
    return problem.unfolding


def chances(problem: Problem, *, maximise: bool, sweeps: int) -> np.ndarray:
    """The chances to be satisfied within some steps, by value iteration."""
    mdp = problem.mdp
    values = unfolding_of(problem).satisfied.astype(float)
    for _ in range(sweeps):
        choices = np.add.reduceat(mdp.branch_to_probability * values[mdp.branch_to_target], mdp.choice_to_branches[:-1])
        values = (np.maximum if maximise else np.minimum).reduceat(choices, mdp.state_to_choices[:-1])
    return values
