"""Values of states enter, impacts ω and action values q of choices leave, with bounds: one step of Bellman's operator.

ω(s, a) = Σ δ(s, a, s') · ρ(s') and q(s, a) = r̄(s, a) + ω(s, a). A value of ∞ on one branch makes the sum ∞; 0 · ∞ does not
occur, as a model has no branches of probability 0. Bounds are rounded outward; where all branches have one value, and nothing is
paid, q is that value exactly.
"""

from __future__ import annotations

import numpy as np

from ratherthan.model.index import Index, index_of
from ratherthan.model.mdp import MDP, Floats
from ratherthan.model.objective import ExpectedCost
from ratherthan.solve.rewards import expected_reward
from ratherthan.solve.solution import Solution
from ratherthan.solve.system import ROUNDING, UNDERFLOW

__all__ = ["action_value_bounds", "impact_bounds", "one_step"]


def one_step(mdp: MDP, values: Floats) -> Floats:
    """Return the impact ω of each choice, ``[C]``: the expected value of the state after it.

    Parameters
    ----------
    mdp : MDP
    values : array of float, ``[S]``
        ±∞ is a value like any other; ∞ outweighs -∞.
    """
    return _mean(mdp, index_of(mdp), values)[0]


def impact_bounds(solution: Solution, k: int = 0, *, of_policy: bool = False) -> tuple[Floats, Floats, Floats]:
    """Return the impact ω of each choice with its bounds.

    Parameters
    ----------
    solution : Solution
    k : int
        Which objective.
    of_policy : bool
        Whether values are those of the solution's policy, ρ^π, instead of the optimum ρ.

    Returns
    -------
    impact, lower, upper : array of float, ``[C]``
    """
    nothing = np.zeros(solution.problem.mdp.choices)
    return _bounded(solution, nothing, k, of_policy)


def action_value_bounds(solution: Solution, k: int = 0, *, of_policy: bool = False) -> tuple[Floats, Floats, Floats]:
    """Return the value q of each choice with its bounds; parameters as `impact_bounds`.

    Returns
    -------
    action_value, lower, upper : array of float, ``[C]``
    """
    mdp, objective = solution.problem.mdp, solution.objectives[k]
    paid = expected_reward(mdp, objective.reward) if isinstance(objective, ExpectedCost) else np.zeros(mdp.choices)
    return _bounded(solution, paid, k, of_policy)


def _bounded(solution: Solution, paid: Floats, k: int, of_policy: bool) -> tuple[Floats, Floats, Floats]:
    """Return paid + Σ p · value with bounds that hold whatever was rounded."""
    mdp = solution.problem.mdp
    index = index_of(mdp)
    names = ("policy_values", "policy_lower", "policy_upper") if of_policy else ("values", "lower", "upper")
    sums = []
    for name, direction in zip(names, (0.0, -1.0, 1.0), strict=True):
        mean, spread = _mean(mdp, index, getattr(solution, name)[k])
        total = paid + mean
        exact = (spread == 0.0) & (paid == 0.0)
        with np.errstate(invalid="ignore", over="ignore"):
            error = (np.diff(mdp.choice_to_branches) + 8) * (
                ROUNDING * (np.abs(paid) + np.abs(mean) + spread) + UNDERFLOW
            )
            moved = total + direction * error
        sums.append(np.where(exact | ~np.isfinite(total), total, moved))
    value, lower, upper = sums
    most = np.inf if isinstance(solution.objectives[k], ExpectedCost) else 1.0
    lower, upper = (
        np.where(lower > -np.inf, np.maximum(lower, 0.0), lower),
        np.where(upper < np.inf, np.minimum(upper, most), upper),
    )
    return np.clip(value, lower, upper), lower, upper


def _mean(mdp: MDP, index: Index, values: Floats) -> tuple[Floats, Floats]:
    """Return Σ p · value of each choice, and Σ p · |value - that of the first branch|; both ``[C]``."""
    begin = mdp.choice_to_branches[:-1]
    after = values[mdp.branch_to_target]
    first = after[begin]
    with np.errstate(invalid="ignore"):
        step = mdp.branch_to_probability * (after - first[index.branch_to_choice])
    finite = np.isfinite(step)
    step[~finite] = 0.0
    mean = first + np.add.reduceat(step, begin)
    spread = np.add.reduceat(np.abs(step), begin)
    below = np.logical_or.reduceat(after == -np.inf, begin)
    above = np.logical_or.reduceat(after == np.inf, begin)
    mean = np.where(above, np.inf, np.where(below, -np.inf, mean))
    return mean, np.where(above | below, 0.0, spread)
