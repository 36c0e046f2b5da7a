"""A Problem enters, a Solution leaves: the optimum with its policy (`solve`), or a given policy against it (`evaluate`).

The straight line: what is wanted is resolved on the model (`goal`), for a mission on the product with what must be remembered;
the graph decides what it can (`task`); the rest becomes a system with end components collapsed (`system`); policy iteration
solves it (`policy_iteration`), or one backward pass where it has no cycles (`layered`); of the choices that cannot be told from the best the policy takes the first listed with which it
arrives (`tied`), and is evaluated (`chain`); the bounds are proved (`certify`). Several objectives in order go this way one
after the other, each on the choices that the ones before leave (`lexicographic`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ratherthan.errors import PropertyError
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.objective import Level, Lexicographic, Mission, Objective, levels_of
from ratherthan.model.policy import Policy, check_policy
from ratherthan.model.problem import Problem
from ratherthan.model.watch import phase, watching
from ratherthan.solve.chain import Chain, Evaluated, chain_of, evaluated, refuse_unsaid
from ratherthan.solve.goal import Goal, goal_of, reaching
from ratherthan.solve.lexicographic import ordered, over_after
from ratherthan.solve.optimum import Method, Optimum
from ratherthan.solve.precise import FINEST, PRECISION, aiming, precision_wanted
from ratherthan.solve.solution import Outcome, Solution
from ratherthan.solve.stopped import finishing, keeping
from ratherthan.solve.wanted import objective_of

__all__ = ["arrival", "evaluate", "sharpened", "solve", "unfolded_for"]

Progress = Callable[[str], None]
FINER = 1e-3
ENOUGH = 0.9
"""Which share of the widths may be left for bounds to count as narrower."""
STEPWISE = ("sweeps", "rough")
"""What the names of methods contain that come nearer step by step."""


def solve(
    problem: Problem,
    objective: Objective | None = None,
    *,
    precision: float | None = None,
    method: Method | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Return the optimal values with proved bounds, and an optimal policy.

    Parameters
    ----------
    problem : Problem
    objective : Objective, optional
        The problem's own by default.
    precision : float, optional
        The relative width of bounds that is wanted, 1e-6 by default; where it is not reached, the outcome says so.
    method : PolicyIteration or Sweeps, optional
        The solver and its settings. By default the program chooses.
    progress : callable, optional
        Called with a short text now and then.

    Returns
    -------
    Solution
        Among the optimal policies the one that takes, in every state, the first listed of the best choices with which it
        still attains the optimum. For a mission, its `problem` is the product; a lexicographic objective has a row of values
        per level.

    Raises
    ------
    PropertyError
        If there is no objective, or it does not fit the model (an unknown reward, a negative one …).
    StoppedError
        If a limit is reached (`ratherthan.watching`); its `solution` has the bounds that were proved by then.
    """
    wanted = objective_of(problem, objective)
    problem, levels = unfolded_for(problem, wanted), levels_of(wanted)
    precision = precision_wanted() if precision is None else precision
    aim = precision if len(levels) == 1 else min(precision, PRECISION)  # which choices are tied takes more to tell
    with aiming(aim), keeping(problem, levels), watching(tell=progress):
        found = ordered(problem, levels, method, progress)
    good, bad = found.goals[0].ends
    horizon = found.best[0].horizon
    bounds = [
        _facing(goal, best.values, best.lower, best.upper) for goal, best in zip(found.goals, found.best, strict=True)
    ]
    attained = [
        _facing(goal, got.values, got.lower, got.upper) for goal, got in zip(found.goals, found.attained, strict=True)
    ]
    values, lower, upper = map(np.stack, zip(*bounds, strict=True))
    policy_values, policy_lower, policy_upper = map(np.stack, zip(*attained, strict=True))
    return Solution(
        problem=problem,
        objectives=levels,
        values=values,
        lower=lower,
        upper=upper,
        policy=Policy(choice=found.choice),
        given=False,
        policy_values=policy_values,
        policy_lower=policy_lower,
        policy_upper=policy_upper,
        goal=good,
        hazard=bad,
        can_arrive=found.best[0].task.can_arrive,
        outcome=_worst([_outcome(goal, best, precision) for goal, best in zip(found.goals, found.best, strict=True)]),
        engine=", ".join(dict.fromkeys(best.engine for best in found.best)),
        sweeps=sum(best.solves for best in found.best),
        residual=max(best.residual for best in found.best),
        horizon=None if horizon is None else horizon.steps,
        within=None if horizon is None else horizon.upper,
        precision=precision,
    )


def sharpened(solution: Solution, progress: Progress | None = None) -> Solution | None:
    """Return the same solution with narrower bounds, None where there is no hope of any.

    Parameters
    ----------
    solution : Solution
        Only of sweeps, or of roughly solved equations, there is more to be had; others gave what doubles can tell.
    progress : callable, optional
    """
    stepwise = any(way in solution.engine for way in STEPWISE)
    if solution.precision <= FINEST or not stepwise or solution.outcome not in (Outcome.CERTIFIED, Outcome.STOPPED):
        return None
    finer = max(FINER * solution.precision, FINEST)
    wanted = Lexicographic(levels=solution.objectives) if len(solution.objectives) > 1 else solution.objectives[0]
    if solution.given:
        found = evaluate(solution.problem, solution.policy, wanted, precision=finer, progress=progress)
    else:
        found = solve(solution.problem, wanted, precision=finer, progress=progress)
    return found if _widths(found) < ENOUGH * _widths(solution) else None


def _widths(solution: Solution) -> float:
    """Return the sum of the widths of all bounds that are finite."""
    finite = np.isfinite(solution.lower) & np.isfinite(solution.upper)
    return float((solution.upper[finite] - solution.lower[finite]).sum())


def evaluate(
    problem: Problem,
    policy: Policy,
    objective: Objective | None = None,
    *,
    precision: float | None = None,
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
    PropertyError, StoppedError
        As for `solve`.
    """
    wanted = objective_of(problem, objective)
    product = unfolded_for(problem, wanted)
    if len(policy.choice) != product.mdp.states or product is problem:
        check_policy(problem.mdp, policy)
    levels, policy = levels_of(wanted), _lifted(policy, product)
    precision = precision_wanted() if precision is None else precision
    check_policy(product.mdp, policy)
    with phase("checking the policy"):
        first = _chain(product, levels[0], policy)
        refuse_unsaid(*first)
    with finishing(None, policy):
        best = solve(product, wanted, precision=precision, method=method, progress=progress)
    over, found = None, []
    with aiming(precision), finishing(best, policy), watching(tell=progress):
        for level in levels:
            goal, chain = first if over is None else _chain(product, level, policy, over)
            found.append((goal, evaluated(goal, chain)))
            over = over_after(levels[0], goal, best.can_arrive) if over is None else over
    values, lower, upper = map(
        np.stack, zip(*(_facing(goal, got.values, got.lower, got.upper) for goal, got in found), strict=True)
    )
    outcome = _worst([_outcome(goal, got, precision) for goal, got in found])
    return replace(
        best,
        policy=policy,
        given=True,
        policy_values=values,
        policy_lower=lower,
        policy_upper=upper,
        outcome=best.outcome if outcome is Outcome.CERTIFIED else outcome,
        sweeps=best.sweeps + sum(got.solves for _, got in found),
    )


def unfolded_for(problem: Problem, objective: Objective) -> Problem:
    """Return the problem on which an objective is solved: for a mission the product with what must be remembered.

    Parameters
    ----------
    problem : Problem
        If it is that product already, it is returned.
    objective : Objective

    Raises
    ------
    PropertyError
        If a mission is not the first of several objectives: the run on its product ends with it.
    """
    first, *others = levels_of(objective)
    for number, level in enumerate(others, 2):
        if isinstance(level, Mission):
            raise PropertyError(
                f"Of several properties only the first may be one that needs memory, got '{level.text}' as number {number}. "
                "Put it first.",
                text=level.text,
            )
    if not isinstance(first, Mission):
        return problem
    from ratherthan.model.product import unfolded

    product = unfolded(problem, first)
    return product if objective is first else replace(product, objective=objective)


def _lifted(policy: Policy, product: Problem) -> Policy:
    """Return a policy of the model as one on the product; one that is on the product as it is."""
    if len(policy.choice) == product.mdp.states:
        return policy
    from ratherthan.model.product import lifted

    return lifted(policy, product)


def _chain(problem: Problem, level: Level, policy: Policy, over: Bools | None = None) -> tuple[Goal, Chain]:
    """Return what a level wants, and the model under a policy."""
    goal = goal_of(problem, level, over)
    return goal, chain_of(goal, policy)


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
    wanted = reaching(mdp, goal, ~hazard | goal)
    found = evaluated(wanted, chain_of(wanted, policy))
    return found.lower, found.upper


def _facing(goal: Goal, values: Floats, lower: Floats, upper: Floats) -> tuple[Floats, Floats, Floats]:
    """Return values and bounds as the objective means them, which a mirrored goal turns round."""
    return (0.0 - values, 0.0 - upper, 0.0 - lower) if goal.mirrored else (values, lower, upper)


def _outcome(goal: Goal, found: Optimum | Evaluated, precision: float) -> Outcome:
    """Return how far values are proved: to `precision` everywhere, on one side, in part, or not at all.

    Values that may have either sign are small by chance: their bounds are seen in relation to the largest of them, and to what is
    paid at once.
    """
    decided = np.ones(len(found.lower), dtype=np.bool_)
    if isinstance(found, Evaluated):  # what a policy is silent about is no matter of proof
        decided = ~found.lost
    lower, upper = found.lower[decided], found.upper[decided]
    exact = lower == upper
    finite = np.isfinite(lower) & np.isfinite(upper)
    with np.errstate(invalid="ignore"):
        size = np.abs(upper)
        if goal.signed:
            size = np.full(
                len(upper), max(np.abs(part).max(initial=0.0) for part in (lower[finite], upper[finite], goal.cost))
            )
        near = exact | (finite & (upper - lower <= precision * size))
    if near.all():
        return Outcome.CERTIFIED
    bounded_above = (upper < np.inf) | exact
    bounded_below = (lower > (-np.inf if goal.signed else 0.0)) | exact
    if (bounded_above & bounded_below).all():
        limited = isinstance(found, Optimum) and found.horizon is not None
        return Outcome.HORIZON if limited else Outcome.STOPPED
    if goal.mirrored:
        bounded_above, bounded_below = bounded_below, bounded_above
    if bounded_above.all():
        return Outcome.UPPER_ONLY
    return Outcome.LOWER_ONLY if bounded_below.all() else Outcome.UNCERTIFIED


def _worst(outcomes: list[Outcome]) -> Outcome:
    """Return the first outcome that is not certified, else that all are."""
    return next((outcome for outcome in outcomes if outcome is not Outcome.CERTIFIED), Outcome.CERTIFIED)
