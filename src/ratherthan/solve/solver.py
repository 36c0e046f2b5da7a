"""A Problem enters, a Solution leaves: the optimum with its policy (`solve`), or a given policy against it (`evaluate`).

The straight line: the graph decides what it can (`task`); the rest becomes a system with end components collapsed (`system`);
policy iteration solves it (`policy_iteration`); of the choices that cannot be told from the best the policy takes the first
listed with which it arrives (`tied`), and is evaluated (`chain`); the bounds are proved (`certify`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ratherthan.model.index import index_of
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.objective import Objective
from ratherthan.model.policy import Policy, check_policy
from ratherthan.model.problem import Problem
from ratherthan.solve.chain import chain_of, evaluated, refuse_unsaid
from ratherthan.solve.optimum import Method, optimum
from ratherthan.solve.policy_iteration import PolicyIteration
from ratherthan.solve.solution import Outcome, Solution
from ratherthan.solve.task import Goal, goal_of, objective_of, task_of

__all__ = ["arrival", "evaluate", "solve"]

Progress = Callable[[str], None]

PRECISION = 1e-6


def solve(
    problem: Problem,
    objective: Objective | None = None,
    *,
    precision: float = PRECISION,
    method: Method | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Return the optimal values with proved bounds, and an optimal policy.

    Parameters
    ----------
    problem : Problem
    objective : Objective, optional
        The problem's own by default.
    precision : float
        The relative width of bounds that is wanted; where it is not reached, the outcome says so.
    method : PolicyIteration or Sweeps, optional
        The solver and its settings; policy iteration by default.
    progress : callable, optional
        Called with a short text now and then.

    Returns
    -------
    Solution
        Among the optimal policies the one that takes, in every state, the first listed of the best choices with which it
        still attains the optimum.

    Raises
    ------
    PropertyError
        If there is no objective, or it does not fit the model (an unknown reward, a negative one …).
    """
    wanted = objective_of(problem, objective)
    goal = goal_of(problem, wanted)
    task = task_of(goal)
    best = optimum(task, method or PolicyIteration(), progress)
    good, bad = goal.ends
    attained = best.attained
    return Solution(
        problem=problem,
        objectives=(wanted,),
        values=best.values[None],
        lower=best.lower[None],
        upper=best.upper[None],
        policy=Policy(choice=best.choice),
        given=False,
        policy_values=attained.values[None],
        policy_lower=attained.lower[None],
        policy_upper=attained.upper[None],
        goal=good,
        hazard=bad,
        can_arrive=task.can_arrive,
        outcome=_outcome(best.lower, best.upper, precision),
        engine=best.engine,
        sweeps=best.solves,
        residual=best.residual,
    )


def evaluate(
    problem: Problem,
    policy: Policy,
    objective: Objective | None = None,
    *,
    precision: float = PRECISION,
    method: Method | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Return the values of a given policy beside the optimum, both with proved bounds.

    Parameters
    ----------
    problem : Problem
    policy : Policy
        Randomised or not. What it says where the objective has ended does not matter.
    objective, precision, method, progress : optional
        As for `solve`.

    Returns
    -------
    Solution
        With ``given`` true. States from which the policy may come to one that it says nothing of, but that are not reached
        from the initial states, are undecided: their policy bounds are -∞ and ∞.

    Raises
    ------
    PolicyError
        If the policy does not fit the model, or says nothing of a state that it reaches.
    PropertyError
        As for `solve`.
    """
    check_policy(problem.mdp, policy)
    wanted = objective_of(problem, objective)
    goal = goal_of(problem, wanted)
    chain = chain_of(goal, policy)
    refuse_unsaid(goal, chain)
    best = solve(problem, wanted, precision=precision, method=method, progress=progress)
    followed = evaluated(goal, chain)
    decided = followed.lower > -np.inf
    outcome = _outcome(followed.lower[decided], followed.upper[decided], precision)
    return replace(
        best,
        policy=policy,
        given=True,
        policy_values=followed.values[None],
        policy_lower=followed.lower[None],
        policy_upper=followed.upper[None],
        outcome=best.outcome if outcome is Outcome.CERTIFIED else outcome,
        sweeps=best.sweeps + followed.solves,
    )


def arrival(source: Problem | MDP, policy: Policy, goal: Bools, hazard: Bools) -> tuple[Floats, Floats]:
    """Return proved bounds of the probability to reach a goal under a policy, without passing a hazard.

    Parameters
    ----------
    source : Problem or MDP
    policy : Policy
    goal, hazard : array of bool, ``[S]``

    Returns
    -------
    lower, upper : array of float, ``[S]``
        -∞ and ∞ where the policy may come to a state that it says nothing of.
    """
    mdp = source.mdp if isinstance(source, Problem) else source
    check_policy(mdp, policy)
    wanted = Goal(
        mdp=mdp,
        index=index_of(mdp),
        maximise=True,
        counts_cost=False,
        target=goal,
        through=~hazard | goal,
        cost=np.zeros(mdp.choices),
        costly=np.zeros(mdp.choices, dtype=np.bool_),
    )
    found = evaluated(wanted, chain_of(wanted, policy))
    return found.lower, found.upper


def _outcome(lower: Floats, upper: Floats, precision: float) -> Outcome:
    """Return how far values are proved: to `precision` everywhere, on one side, in part, or not at all."""
    exact = lower == upper
    with np.errstate(invalid="ignore"):
        near = exact | (np.isfinite(upper) & (upper - lower <= precision * upper))
    if near.all():
        return Outcome.CERTIFIED
    bounded_above = (upper < np.inf) | exact
    if (bounded_above & (lower > 0.0) | exact).all():
        return Outcome.STOPPED
    if bounded_above.all():
        return Outcome.UPPER_ONLY
    return Outcome.LOWER_ONLY if ((lower > 0.0) | exact).all() else Outcome.UNCERTIFIED
