"""Values of states enter, impacts ω and action values q of choices leave, with bounds: one step of Bellman's operator.

ω(s, a) = Σ δ(s, a, s') · ρ(s') and q(s, a) = r̄(s, a) + γ ω(s, a), with γ = 1 unless the objective is discounted. A value of ±∞ on
one branch makes the sum ±∞; 0 · ∞ does not occur, as a model has no branches of probability 0. Where one branch has ∞ and another
-∞, that wins which means that the goal is not reached for sure: arriving is demanded before anything is gathered. Bounds are
rounded outward; where all branches have one value, and nothing is paid, q is that value exactly.
"""

from __future__ import annotations

import numpy as np

from ratherthan.model._kernels import compiled, is_compiled
from ratherthan.model.index import Index, index_of
from ratherthan.model.mdp import MDP, Floats
from ratherthan.model.objective import Discounted, ExpectedReward, Level, Mission, ReachAvoid
from ratherthan.solve._kernels import mean_rows
from ratherthan.solve.rewards import paid_of
from ratherthan.solve.solution import Solution
from ratherthan.solve.system import MANY, ROUNDING, UNDERFLOW, two_sum

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
    return _bounded(solution, k, of_policy)


def action_value_bounds(solution: Solution, k: int = 0, *, of_policy: bool = False) -> tuple[Floats, Floats, Floats]:
    """Return the value q of each choice with its bounds; parameters as `impact_bounds`.

    Returns
    -------
    action_value, lower, upper : array of float, ``[C]``
    """
    return _bounded(solution, k, of_policy, paying=True)


def _bounded(solution: Solution, k: int, of_policy: bool, *, paying: bool = False) -> tuple[Floats, Floats, Floats]:
    """Return paid + γ Σ p · value, or Σ p · value alone, with bounds that hold whatever was rounded."""
    mdp, level = solution.problem.mdp, solution.objectives[k]
    index = index_of(mdp)
    names = ("policy_values", "policy_lower", "policy_upper") if of_policy else ("values", "lower", "upper")
    paid, size, discount = np.zeros(mdp.choices), np.zeros(mdp.choices), 1.0
    plain = np.zeros(mdp.choices, dtype=np.bool_)  # where q may be computed without rounding
    if paying and not isinstance(level, ReachAvoid | Mission):
        found = paid_of(mdp, index, level.reward)
        paid, size = found.total, found.size
        discount = level.discount if isinstance(level, Discounted) else 1.0
        if isinstance(level, ExpectedReward):
            single = np.diff(mdp.choice_to_branches) == 1
            plain = found.exact & single & (mdp.branch_to_probability[mdp.choice_to_branches[:-1]] == 1.0)
    below_wins = isinstance(level, ExpectedReward) and level.maximise
    sums = []
    for name, direction in zip(names, (0.0, -1.0, 1.0), strict=True):
        mean, spread = _mean(mdp, index, getattr(solution, name)[k], below_wins=below_wins)
        total = paid + discount * mean
        exact = (spread == 0.0) & (size == 0.0) & ((discount == 1.0) | (mean == 0.0))
        with np.errstate(invalid="ignore", over="ignore"):
            exact |= plain & (two_sum(paid, mean)[1] == 0.0)
            error = (np.diff(mdp.choice_to_branches) + 8) * (ROUNDING * (size + np.abs(mean) + spread) + UNDERFLOW)
            moved = total + direction * error
        sums.append(np.where(exact | ~np.isfinite(total), total, moved))
    value, lower, upper = sums
    least, most = _range(level)
    lower, upper = (
        np.where(lower > -np.inf, np.maximum(lower, least), lower),
        np.where(upper < np.inf, np.minimum(upper, most), upper),
    )
    return np.clip(value, lower, upper), lower, upper


def _range(level: Level) -> tuple[float, float]:
    """Return between which numbers all values of a level lie."""
    if isinstance(level, ReachAvoid | Mission):
        return 0.0, 1.0
    return (-np.inf, np.inf) if isinstance(level, Discounted | ExpectedReward) else (0.0, np.inf)


def _mean(mdp: MDP, index: Index, values: Floats, *, below_wins: bool = False) -> tuple[Floats, Floats]:
    """Return Σ p · value of each choice, and Σ p · |value - that of the first branch|; both ``[C]``."""
    if mdp.branches > MANY and is_compiled(mdp.branches):
        kernel = compiled(mean_rows, mdp.branches)
        return kernel(mdp.choice_to_branches, mdp.branch_to_target, mdp.branch_to_probability, values, below_wins)
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
    if below_wins:
        mean = np.where(below, -np.inf, np.where(above, np.inf, mean))
    else:
        mean = np.where(above, np.inf, np.where(below, -np.inf, mean))
    return mean, np.where(above | below, 0.0, spread)
