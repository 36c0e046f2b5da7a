"""Values of states enter, impacts ω and action values q of choices leave, with bounds: one step of Bellman's operator.

ω(s, a) = Σ δ(s, a, s') · ρ(s') and q(s, a) = r̄(s, a) + γ ω(s, a), with γ = 1 unless the objective is discounted. A value of ±∞ on
one branch makes the sum ±∞; 0 · ∞ does not occur, as a model has no branches of probability 0. Where one branch has ∞ and another
-∞, that wins which means that the goal is not reached for sure: arriving is demanded before anything is gathered. Bounds are
rounded outward; where all branches have one value, and nothing is paid, q is that value exactly.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ratherthan.model._kernels import compiled, is_compiled
from ratherthan.model.index import Index, index_of
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.objective import Discounted, ExpectedReward, Level, Mission, ReachAvoid
from ratherthan.solve._kernels import mean_rows
from ratherthan.solve.rewards import paid_of
from ratherthan.solve.solution import Solution
from ratherthan.solve.system import MANY, ROUNDING, UNDERFLOW, two_sum

__all__ = ["action_value_bounds", "choice_bounds", "impact_bounds", "one_step"]

Bounded = tuple[Floats, Floats, Floats]
"""Values with lower and upper bounds."""

BLOCK = 1 << 14
"""So many choices are rounded outward at a time."""


def one_step(mdp: MDP, values: Floats) -> Floats:
    """Return the impact ω of each choice, ``[C]``: the expected value of the state after it.

    Parameters
    ----------
    mdp : MDP
    values : array of float, ``[S]``
        ±∞ is a value like any other; ∞ outweighs -∞.
    """
    return _mean(mdp, index_of(mdp), values)[0]


def impact_bounds(solution: Solution, k: int = 0, *, of_policy: bool = False) -> Bounded:
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
    return _bounded(solution, k, of_policy, (False,))[0]


def action_value_bounds(solution: Solution, k: int = 0, *, of_policy: bool = False) -> Bounded:
    """Return the value q of each choice with its bounds; parameters as `impact_bounds`.

    Returns
    -------
    action_value, lower, upper : array of float, ``[C]``
    """
    return _bounded(solution, k, of_policy, (True,))[0]


def choice_bounds(solution: Solution, k: int = 0, *, of_policy: bool = False) -> tuple[Bounded, Bounded]:
    """Return the impact ω and the value q of each choice, both with their bounds: at the price of one of them.

    Parameters as `impact_bounds`.
    """
    impact, action_value = _bounded(solution, k, of_policy, (False, True))
    return impact, action_value


def _bounded(solution: Solution, k: int, of_policy: bool, paying: tuple[bool, ...]) -> list[Bounded]:
    """Return for each of `paying` paid + γ Σ p · value, or Σ p · value alone, with bounds that hold whatever was rounded."""
    mdp, level = solution.problem.mdp, solution.objectives[k]
    index = index_of(mdp)
    names = ("policy_values", "policy_lower", "policy_upper") if of_policy else ("values", "lower", "upper")
    below_wins = isinstance(level, ExpectedReward) and level.maximise
    means = [_mean(mdp, index, getattr(solution, name)[k], below_wins=below_wins) for name in names]
    found = []
    for pays in paying:
        paid = _paid(mdp, index, level) if pays else _NOTHING
        parts: Bounded = np.empty(mdp.choices), np.empty(mdp.choices), np.empty(mdp.choices)
        least, most = _range(level)
        for first in range(0, mdp.choices, BLOCK):  # in blocks that stay in the processor's cache
            block = slice(first, min(first + BLOCK, mdp.choices))
            value, lower, upper = _moved(mdp, means, paid, block)
            np.copyto(lower, np.maximum(lower, least), where=lower > -np.inf)
            np.copyto(upper, np.minimum(upper, most), where=upper < np.inf)
            for into, part in zip(parts, (np.clip(value, lower, upper), lower, upper), strict=True):
                into[block] = part
        found.append(parts)
    return found


class _Paying(NamedTuple):
    """What choices pay, ``[C]``; None where nothing is paid. `plain` is where q may be computed without rounding."""

    total: Floats | None = None
    size: Floats | None = None
    plain: Bools | None = None
    discount: float = 1.0


_NOTHING = _Paying()


def _paid(mdp: MDP, index: Index, level: Level) -> _Paying:
    """Return what the choices pay under a level."""
    if isinstance(level, ReachAvoid | Mission):
        return _NOTHING
    found, plain = paid_of(mdp, index, level.reward), None
    if isinstance(level, ExpectedReward):
        single = np.diff(mdp.choice_to_branches) == 1
        plain = found.exact & single & (mdp.branch_to_probability[mdp.choice_to_branches[:-1]] == 1.0)
    return _Paying(found.total, found.size, plain, level.discount if isinstance(level, Discounted) else 1.0)


def _moved(mdp: MDP, means: list[tuple[Floats, Floats]], paid: _Paying, block: slice) -> list[Floats]:
    """Return value, lower and upper of a block of choices, the bounds rounded outward."""
    length = np.diff(mdp.choice_to_branches[block.start : block.stop + 1])
    nothing = np.zeros(len(length))
    total_paid, size = (nothing if part is None else part[block] for part in (paid.total, paid.size))
    parts = []
    for (mean, spread), direction in zip(means, (0.0, -1.0, 1.0), strict=True):
        mean, spread = mean[block], spread[block]
        total = total_paid + paid.discount * mean
        exact = (spread == 0.0) & (size == 0.0)
        if paid.discount != 1.0:
            exact &= mean == 0.0
        with np.errstate(invalid="ignore", over="ignore"):
            if paid.plain is not None:
                exact |= paid.plain[block] & (two_sum(total_paid, mean)[1] == 0.0)
            error = (length + 8) * (ROUNDING * (size + np.abs(mean) + spread) + UNDERFLOW)
            moved = total + direction * error
        parts.append(np.where(exact | ~np.isfinite(total), total, moved))
    return parts


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
