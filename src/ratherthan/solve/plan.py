"""A policy and several objectives enter; a Plan leaves: what it attains from the start, with proved bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ratherthan.model import graph
from ratherthan.model.index import index_of
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.objective import Level
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve.chain import chain_of, evaluated
from ratherthan.solve.goal import goal_of

__all__ = ["Plan", "certified", "partings"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A policy and what it attains from the start.

    Parameters
    ----------
    policy : Policy
    values, lower, upper : array of float, ``[K]``
        Its value for every objective, with proved bounds.
    weights : tuple, ``[K]``
        For every objective but the first, the least and the largest W for which the plan is known to be best for the first
        objective and W times this one (less W times it, where one is kept small and the other gathered); None where that is
        not known of any.
    """

    policy: Policy
    values: Floats  # [K]
    lower: Floats  # [K]
    upper: Floats  # [K]
    weights: tuple[tuple[float, float] | None, ...]

    def best_for(self, objective: int, weights: tuple[float, float] | None) -> Plan:
        """Return the plan with the weights of one objective for which it is best."""
        known = list(self.weights)
        known[objective] = weights
        return replace(self, weights=tuple(known))


def certified(problem: Problem, objectives: Sequence[Level], start: int, policy: Policy) -> Plan:
    """Return what a policy attains, with proved bounds.

    Parameters
    ----------
    problem : Problem
    objectives : sequence of objectives, ``[K]``
        Totals of rewards.
    start : int
    policy : Policy
    """
    found = []
    for objective in objectives:
        goal = goal_of(problem, objective)
        got = evaluated(goal, chain_of(goal, policy))
        value, lower, upper = (float(part[start]) for part in (got.values, got.lower, got.upper))
        found.append((0.0 - value, 0.0 - upper, 0.0 - lower) if goal.mirrored else (value, lower, upper))
    values, lowers, uppers = np.array(found).T
    return Plan(policy=policy, values=values, lower=lowers, upper=uppers, weights=(None,) * len(found))


def partings(mdp: MDP, policies: tuple[Policy, Policy], start: int, ended: Bools) -> tuple[int, ...]:
    """Return the states where two policies without chance part: they come there by the same choices, and go on differently.

    Parameters
    ----------
    mdp : MDP
    policies : tuple of Policy
    start : int
    ended : array of bool, ``[S]``
        Where nothing is taken any more.
    """
    one, other = (policy.choice for policy in policies)
    begin = np.zeros(mdp.states, dtype=np.bool_)
    begin[start] = True
    apart = (one != other) & ~ended
    taken = np.zeros(mdp.choices, dtype=np.bool_)
    taken[one[one >= 0]] = True
    reached = graph.reached_from(index_of(mdp), begin, ended | apart, taken)
    return tuple(np.flatnonzero(reached & apart).tolist())
