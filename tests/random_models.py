"""Random small problems for the laws: ties, zero costs, loops, dead ends, several goals and hazards are likely."""

from __future__ import annotations

from random import Random

import numpy as np

from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Lexicographic,
    Mission,
    Objective,
    ReachAvoid,
)
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

SIGNED: dict[str, Objective] = {
    "most reward": ExpectedReward(goal=GOAL, reward="gain"),
    "least reward": ExpectedReward(goal=GOAL, reward="gain", maximise=False),
    "most in the long run": Discounted(reward="gain", discount=0.9),
    "least in the long run": Discounted(reward="gain", discount=0.5, maximise=False),
    "far sighted": Discounted(reward="gain", discount=0.999),
    "least weighted cost": ExpectedCost(goal=GOAL, reward="cost + 2.5 * toll"),
    "most weighted reward": ExpectedReward(goal=GOAL, reward="3 * gain + 0.5 * toll"),
}
"""With rewards of both signs, discounts and weights."""
MISSIONS: dict[str, Objective] = {
    "in time": Mission(formula=f"F<=3 {GOAL}"),
    "late": Mission(formula=f"F<=2 {HAZARD}", maximise=False),
    "in order": Mission(formula=f"F ({HAZARD} & (F {GOAL}))"),
    "both": Mission(formula=f"(F {HAZARD}) & (F {GOAL})"),
}
"""What takes memory."""
LEVELS: dict[str, Objective] = {
    "safest, then cheapest": Lexicographic(
        levels=(ReachAvoid(goal=GOAL, through=f"!{HAZARD}"), ExpectedCost(goal=GOAL, reward="cost"))
    ),
    "cheapest, then least toll": Lexicographic(
        levels=(ExpectedCost(goal=GOAL, reward="cost"), ExpectedCost(goal=GOAL, reward="toll"))
    ),
    "fewest steps, then most gain": Lexicographic(
        levels=(ExpectedCost(goal=GOAL, reward=None), ExpectedReward(goal=GOAL, reward="gain"))
    ),
    "three in a row": Lexicographic(
        levels=(
            ReachAvoid(goal=GOAL, through=f"!{HAZARD}"),
            ExpectedCost(goal=GOAL, reward="toll"),
            ExpectedCost(goal=GOAL, reward="cost"),
        )
    ),
    "in time, then cheapest": Lexicographic(
        levels=(Mission(formula=f"F<=3 {GOAL}"), ExpectedCost(goal=GOAL, reward="cost"))
    ),
    "safest, then least risk": Lexicographic(levels=(ReachAvoid(goal=GOAL), ReachAvoid(goal=HAZARD, maximise=False))),
    "least risk, then the long run": Lexicographic(
        levels=(ReachAvoid(goal=HAZARD, maximise=False), Discounted(reward="gain", discount=0.75))
    ),
    "two long runs": Lexicographic(
        levels=(Discounted(reward="cost", discount=0.5, maximise=False), Discounted(reward="gain", discount=0.75))
    ),
    "toll, then gain": Lexicographic(
        levels=(ExpectedCost(goal=GOAL, reward="toll"), ExpectedReward(goal=GOAL, reward="gain"))
    ),
}
"""Several levels."""

Table = dict[int, dict[str, tuple[list[tuple[float, int]], float]]]
"""state → action → (branches as (probability, target), cost)."""


def problem_of(
    table: Table,
    objective: Objective,
    *,
    goals: list[int],
    hazards: list[int] | None = None,
    start: int = 0,
    rewards: dict[str, Reward] | None = None,
) -> Problem:
    """Build a problem from a table a person can read, with further rewards beside its cost."""
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
        rewards={"cost": Reward(choice=np.array(costs)), **(rewards or {})},
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


def further_rewards(random: Random, table: Table) -> dict[str, Reward]:
    """Return a reward of both signs ("gain", on states, choices or branches) and a second cost ("toll")."""
    choices = sum(len(row) for row in table.values())
    branches = sum(len(spread) for row in table.values() for spread, _ in row.values())
    amounts = [0.0, 0.0, -1.0, -1.0, 1.0, 2.0, -3.0, 0.1] if random.random() < 0.5 else [-1.0, -1.0, -2.0, 0.0, 0.5]
    where = random.choice(["choice", "choice", "state", "branch"])
    count = {"state": len(table), "choice": choices, "branch": branches}[where]
    gain = {where: np.array(random.choices(amounts, k=count))}
    if random.random() < 0.2:
        gain["state"] = np.array(random.choices([-1.0, 0.0, 1.0], k=len(table)))
    toll = np.array(random.choices([0.0, 0.0, 1.0, 1.0, 0.25], k=choices))
    return {"gain": Reward(**gain), "toll": Reward(choice=toll)}


def random_rich_problem(random: Random, *, most_states: int = 8, objective: Objective) -> Problem:
    """Return a random problem with further rewards, at least one goal and mostly a hazard."""
    states = random.randint(2, most_states)
    special = random.sample(range(states), min(states, random.choice([1, 2, 2, 3])))
    table = random_table(random, states)
    return problem_of(
        table,
        objective,
        goals=special[:1] + special[2:],
        hazards=special[1:2],
        start=random.randrange(states),
        rewards=further_rewards(random, table),
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
