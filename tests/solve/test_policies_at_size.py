"""Given policies, good and bad, on models that are taken for large ones: bounds against exact fractions."""

from __future__ import annotations

import importlib
from fractions import Fraction
from random import Random
from typing import Any

import numpy as np
import pytest
from exact import level_values
from random_models import GOAL, Table, problem_of, random_table

from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, Level
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve import evaluate
from ratherthan.solve.system import System

pytestmark = pytest.mark.kernels
ROOM = "ratherthan.solve.contracting"
contraction, chains, rooms, chain = (
    importlib.import_module(name) for name in (ROOM + ".contraction", ROOM + ".chains", ROOM, "ratherthan.solve.chain")
)
LEVELS: tuple[Level, ...] = (
    ExpectedCost(goal=GOAL, reward="cost"),
    ExpectedReward(goal=GOAL, reward="cost"),
    Discounted(reward="cost", discount=0.9),
)
QUARTERS = ([1.0], [0.5, 0.5], [0.75, 0.25], [0.25, 0.25, 0.5])


@pytest.fixture
def proved(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Let sweeps have the first turn, however few states there are; tell how often they proved something."""
    told: list[bool] = []

    def watched(system: System, maximise: bool, discount: float) -> Any:
        found = chains.chain_bounds_at_size(system, maximise, discount)
        told.append(found is not None)
        return found

    monkeypatch.setattr(contraction, "FEWEST", 1)
    monkeypatch.setattr(contraction, "is_compiled", lambda _: True)
    monkeypatch.setattr(chain, "SOME", 0)
    monkeypatch.setattr(rooms, "chain_bounds_at_size", watched)
    return told


def random_problem(random: Random, level: Level) -> Problem:
    """Some states, one goal or two, prices that may be 0, or below it where the level permits that."""
    prices = [0, 0, 1, 2, 3] if isinstance(level, ExpectedCost) else [-3, -2, -1, 0, 1]
    table: Table = {}
    for state, row in random_table(random, random.randint(2, 6)).items():
        table[state] = {action: (branches, random.choice(prices)) for action, (branches, _) in row.items()}
    return problem_of(table, level, goals=random.sample(range(len(table)), random.choice([1, 1, 2])))


def random_shares(random: Random, mdp: MDP) -> list[dict[int, float]]:
    """A policy that may mix a state's choices, in quarters."""
    shares = []
    for state in range(mdp.states):
        own = list(mdp.choices_of(state))
        weights = random.choice([some for some in QUARTERS if len(some) <= len(own)])
        shares.append(dict(zip(random.sample(own, len(weights)), weights, strict=True)))
    return shares


def mixed(problem: Problem, shares: list[dict[int, float]]) -> Problem:
    """The model with one choice a state, which is the policy's mixture: exact, as quarters are."""
    mdp, paid = problem.mdp, problem.mdp.rewards["cost"].choice
    assert paid is not None
    offsets, targets, chances, costs = [0], [], [], []
    for own in shares:
        for choice, share in own.items():
            branches = mdp.branches_of(choice)
            targets += mdp.branch_to_target[branches].tolist()
            chances += (share * mdp.branch_to_probability[branches]).tolist()
        offsets.append(len(targets))
        costs.append(sum(share * float(paid[choice]) for choice, share in own.items()))
    chain = MDP(
        state_to_choices=np.arange(mdp.states + 1),
        choice_to_branches=np.array(offsets),
        branch_to_target=np.array(targets),
        branch_to_probability=np.array(chances),
        initial=mdp.initial,
        labels=dict(mdp.labels),
        rewards={"cost": Reward(choice=np.array(costs))},
    )
    return Problem(mdp=chain, objective=problem.objective)


def policy_of(mdp: MDP, shares: list[dict[int, float]]) -> Policy:
    """The same as a policy: without chances where it never mixes."""
    if all(len(own) == 1 for own in shares):
        return Policy(choice=np.array([next(iter(own)) for own in shares]))
    chance = np.zeros(mdp.choices)
    for own in shares:
        for choice, share in own.items():
            chance[choice] = share
    return Policy(choice=np.full(mdp.states, -1), chance=chance)


@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
@pytest.mark.parametrize("seed", range(40))
def test_the_value_of_any_policy_lies_within_its_bounds(seed: int, level: Level, proved: list[bool]) -> None:
    random = Random(seed)
    problem = random_problem(random, level)
    shares = random_shares(random, problem.mdp)
    given = evaluate(problem, policy_of(problem.mdp, shares))
    alone = mixed(problem, shares)
    true: list[Fraction | float] = level_values(alone, level, [range(1)] * alone.mdp.states, set())
    for value, lower, upper in zip(true, given.policy_lower[0].tolist(), given.policy_upper[0].tolist(), strict=True):
        assert lower <= value <= upper
        assert lower == upper or upper - lower <= 1e-6 * max(1.0, abs(upper))


@pytest.mark.parametrize("level", LEVELS, ids=lambda level: level.text)
def test_sweeps_prove_most_chains(level: Level, proved: list[bool]) -> None:
    for seed in range(30):
        random = Random(seed)
        problem = random_problem(random, level)
        evaluate(problem, policy_of(problem.mdp, random_shares(random, problem.mdp)))
    assert sum(proved) > 0.8 * len(proved) > 0


def test_going_round_for_ever_is_worth_nothing_at_any_size(proved: list[bool]) -> None:
    table: Table = {
        0: {"on": ([(1.0, 1)], 1), "back": ([(1.0, 0)], 1)},
        1: {"on": ([(1.0, 2)], 1), "back": ([(1.0, 0)], 1)},
    }
    table[2] = {"stay": ([(1.0, 2)], 0)}
    problem = problem_of(table, ExpectedCost(goal=GOAL, reward="cost"), goals=[2])
    circles = evaluate(problem, Policy(choice=np.array([0, 3, 4])))
    assert circles.policy_lower[0].tolist() == circles.policy_upper[0].tolist() == [np.inf, np.inf, 0.0]


def test_what_sweeps_say_wrongly_is_not_believed(monkeypatch: pytest.MonkeyPatch, proved: list[bool]) -> None:
    rightly = chains.valued

    def wrongly(field: Any, *rest: Any) -> Any:
        way = rightly(field, *rest)
        field.values[:-2] *= 0.5
        return way

    monkeypatch.setattr(chains, "valued", wrongly)
    level = LEVELS[0]
    for seed in range(20):
        random = Random(seed)
        problem = random_problem(random, level)
        shares = random_shares(random, problem.mdp)
        given = evaluate(problem, policy_of(problem.mdp, shares))
        true = level_values(mixed(problem, shares), level, [range(1)] * problem.mdp.states, set())
        for value, lower, upper in zip(
            true, given.policy_lower[0].tolist(), given.policy_upper[0].tolist(), strict=True
        ):
            assert lower <= value <= upper
