"""Random small problems for the laws: ties, zero costs, loops, dead ends, several goals and hazards are likely."""

from __future__ import annotations

from random import Random

import numpy as np

from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import ExpectedCost, Objective, ReachAvoid
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem

GOAL, HAZARD = '"goal"', '"hazard"'
OBJECTIVES: dict[str, Objective] = {
    "least cost": ExpectedCost(goal=GOAL, reward="cost"),
    "most cost": ExpectedCost(goal=GOAL, reward="cost", maximise=True),
    "fewest steps": ExpectedCost(goal=GOAL, reward=None),
    "likeliest": ReachAvoid(goal=GOAL),
    "safest": ReachAvoid(goal=GOAL, through=f"!{HAZARD}"),
    "least risk": ReachAvoid(goal=HAZARD, maximise=False),
}

Table = dict[int, dict[str, tuple[list[tuple[float, int]], float]]]
"""state → action → (branches as (probability, target), cost)."""


def problem_of(
    table: Table, objective: Objective, *, goals: list[int], hazards: list[int] | None = None, start: int = 0
) -> Problem:
    """Build a problem from a table a person can read."""
    actions = sorted({action for row in table.values() for action in row})
    states, choices, targets, probabilities, named, costs = [0], [0], [], [], [], []
    for state in sorted(table):
        for action, (branches, cost) in table[state].items():
            for probability, target in branches:
                targets.append(target)
                probabilities.append(probability)
            choices.append(len(targets))
            named.append(actions.index(action))
            costs.append(float(cost))
        states.append(len(named))
    mask = np.zeros((2, len(table)), dtype=bool)
    mask[0, goals] = True
    mask[1, hazards or []] = True
    mdp = MDP(
        state_to_choices=np.array(states),
        choice_to_branches=np.array(choices),
        branch_to_target=np.array(targets),
        branch_to_probability=np.array(probabilities),
        choice_to_action=np.array(named),
        actions=tuple(actions),
        labels={"goal": mask[0].copy(), "hazard": mask[1].copy()},
        rewards={"cost": Reward(choice=np.array(costs))},
        initial=np.array([start]),
    )
    return Problem(mdp=mdp, objective=objective, source="test")


def random_table(random: Random, states: int) -> Table:
    """Return a random table of rows."""
    ways = [[1.0], [0.5, 0.5], [0.9, 0.1], [0.25, 0.75], [0.2, 0.3, 0.5]]
    local = random.random() < 0.5  # chains and ladders rather than tangles
    table: Table = {}
    for state in range(states):
        row = {}
        for action in random.sample("abcd", random.choice([1, 2, 2, 3])):
            chances = random.choice(ways)
            near = [max(0, min(states - 1, state + d)) for d in (-1, 0, 1, 1, 2)]
            targets = random.choices(near if local else range(states), k=len(chances))
            row[action] = (list(zip(chances, targets, strict=True)), random.choice([0, 1, 1, 1, 2, 3]))
        table[state] = row
    return table


def random_problem(random: Random, *, most_states: int = 8, objective: Objective | None = None) -> Problem:
    """Return a random problem with at least one goal."""
    states = random.randint(2, most_states)
    special = random.sample(range(states), min(states, random.choice([1, 1, 2, 3])))
    goals, hazards = special[:1] + special[2:], special[1:2]
    wanted = objective or random.choice(list(OBJECTIVES.values()))
    return problem_of(
        random_table(random, states), wanted, goals=goals, hazards=hazards, start=random.randrange(states)
    )


def random_policy(random: Random, mdp: MDP, *, randomised: bool = False) -> Policy:
    """Return a random policy, also a bad one."""
    if not randomised:
        return Policy(choice=np.array([random.choice(mdp.choices_of(s)) for s in range(mdp.states)], dtype=np.int64))
    chance = np.zeros(mdp.choices)
    for state in range(mdp.states):
        own = list(mdp.choices_of(state))
        chosen = random.sample(own, random.randint(1, len(own)))
        shares = {1: [1.0], 2: [0.5, 0.5], 3: [0.25, 0.25, 0.5]}[len(chosen)]
        chance[chosen] = shares
    return Policy(choice=np.full(mdp.states, -1), chance=chance)
