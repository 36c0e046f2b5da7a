"""MDP and Objective enter, a Solution leaves: values, policy, Outcome. certify gives the bounds and trusts no solver."""

from ratherthan.solve.bellman import action_value_bounds, impact_bounds, one_step
from ratherthan.solve.policy_iteration import PolicyIteration
from ratherthan.solve.rewards import expected_reward
from ratherthan.solve.solution import Outcome, Solution
from ratherthan.solve.solver import arrival, evaluate, solve
from ratherthan.solve.sweeps import Sweeps

__all__ = [
    "Outcome",
    "PolicyIteration",
    "Solution",
    "Sweeps",
    "action_value_bounds",
    "arrival",
    "evaluate",
    "expected_reward",
    "impact_bounds",
    "one_step",
    "solve",
]
