"""Random models whose costs are positive, with dead ends, loops in place, states that may fail, and costs of many sizes."""

from __future__ import annotations

from random import Random

import numpy as np

from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.problem import Problem


def random_network(random: Random, *, states: int, goals: bool = True, far: float = 0.15) -> Problem:
    """Return a random problem: mostly near neighbours, a share of `far` ones."""
    choices, branches, target, chance, cost, action = [0], [0], [], [], [], []
    for state in range(states):
        count = random.randrange(1, 4)
        for name in random.sample(range(4), count):
            found = {}
            for _ in range(random.randrange(1, 4)):
                near = random.random() >= far
                other = state + random.randrange(-3, 5) if near else random.randrange(states)
                found[min(max(other, 0), states - 1)] = random.choice([1.0, 2.0, 5.0])
            if random.random() < 0.3:
                found[state] = random.choice([1.0, 20.0])
            total = sum(found.values())
            target += sorted(found)
            chance += [found[other] / total for other in sorted(found)]
            branches.append(len(target))
            cost.append(random.choice([1.0, 1.0, 2.5, 0.3]))
            action.append(name)
        choices.append(len(cost))
    goal = np.zeros(states, dtype=np.bool_)
    if goals:
        goal[[random.randrange(states) for _ in range(random.randrange(1, 3))]] = True
    mdp = MDP(
        state_to_choices=np.array(choices),
        choice_to_branches=np.array(branches),
        branch_to_target=np.array(target),
        branch_to_probability=np.array(chance),
        choice_to_action=np.array(action),
        actions=("north", "east", "south", "west"),
        labels={"goal": goal},
        rewards={"cost": Reward(choice=np.array(cost))},
        initial=np.array([0]),
    )
    return Problem(mdp=mdp, objective=ExpectedCost(goal='"goal"', reward="cost"))
