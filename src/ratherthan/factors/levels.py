"""Action values of several levels enter; the critical states leave: those where a choice matters for a level.

Definition
----------
Objectives in order (lexicographic) are compared one after the other: level k compares only the choices of a state that are
equal to the best at every level before (equal by the tolerance τ of `ratherthan.factors.compare`). A state is critical if at
some level the λmax and λmin of the choices that are compared there differ by more than the threshold. The threshold α is in
the unit of the first level and holds for it; for further levels it is 0. With one level, this is `critical_states`.

Two sets bound what is compared at a level: the choices that are equal to the best for sure, and those that may be. What
differs among the first is critical for sure; what may differ among the second is possibly critical.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ratherthan.factors.compare import TOLERANCE, exceeds
from ratherthan.factors.responsibility import Responsibility
from ratherthan.factors.selectiveness import Criticality
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.solve.levels import ended_at
from ratherthan.solve.solution import Solution

__all__ = ["Compared", "compared_at", "critical_states_of_levels"]


class Compared(NamedTuple):
    """The choices that a level compares, ``[C]`` each: for sure, and possibly; the second contains the first."""

    certain: Bools
    possible: Bools


def critical_states_of_levels(
    solution: Solution,
    measures: Sequence[Responsibility],
    *,
    alpha: float = 0.0,
    omega: bool = False,
    tolerance: float = TOLERANCE,
) -> Criticality:
    """Find the states that are critical for some level of a solution.

    Parameters
    ----------
    solution : Solution
    measures : sequence of Responsibility
        One per level: ``[responsibility(solution, objective=k) for k in range(len(solution.objectives))]``.
    alpha : float
        The threshold, at least 0, in the unit of the first level; further levels have 0.
    omega : bool
        Take the paper's impact ω instead of the action value q.
    tolerance : float
        The factor of τ.

    Returns
    -------
    Criticality
    """
    mdp = solution.problem.mdp
    certain, possible = np.zeros(mdp.states, dtype=np.bool_), np.zeros(mdp.states, dtype=np.bool_)
    for k, compared in enumerate(compared_at(solution, measures, omega=omega, tolerance=tolerance)):
        threshold = alpha if k == 0 else 0.0
        running = ~ended_at(solution, k)
        for found, chosen, which in ((certain, compared.certain, 0), (possible, compared.possible, 1)):
            high, low = _extremes(mdp, _bounds(measures[k], omega), chosen)
            several = np.add.reduceat(chosen.astype(np.int64), mdp.state_to_choices[:-1]) > 1
            found |= exceeds(high, low, threshold, tolerance)[which] & several & running
    return Criticality(certain=certain, possible=possible)


def compared_at(
    solution: Solution, measures: Sequence[Responsibility], *, omega: bool = False, tolerance: float = TOLERANCE
) -> tuple[Compared, ...]:
    """Return which choices each level compares: those equal to the best of their state at every level before.

    Parameters
    ----------
    solution, measures, omega, tolerance
        As for `critical_states_of_levels`.

    Returns
    -------
    tuple of Compared
        One per level; the first level compares all choices.
    """
    mdp = solution.problem.mdp
    every = np.ones(mdp.choices, dtype=np.bool_)
    found = [Compared(every, every)]
    for k, level in enumerate(solution.objectives[:-1]):
        compared = found[-1]
        bounds = _bounds(measures[k], omega)
        sure, maybe = (
            _beaten(mdp, bounds, chosen, maximise=level.maximise, tolerance=tolerance) for chosen in compared
        )
        ended = np.repeat(ended_at(solution, k), np.diff(mdp.state_to_choices))
        # For sure equal to the best are those that no possible member may beat; possibly equal those that no sure one beats.
        found.append(Compared(compared.certain & (~maybe[1] | ended), compared.possible & (~sure[0] | ended)))
    return tuple(found)


def _bounds(measures: Responsibility, omega: bool) -> tuple[Floats, Floats]:
    return (measures.impact_lower, measures.impact_upper) if omega else (measures.lower, measures.upper)


def _extremes(
    mdp: MDP, bounds: tuple[Floats, Floats], chosen: Bools
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Return the bounds of the largest and of the smallest number among the `chosen` choices of each state, ``[S]``."""
    starts = mdp.state_to_choices[:-1]
    low, high = (
        tuple(extreme.reduceat(np.where(chosen, bound, neutral), starts) for bound in bounds)
        for extreme, neutral in ((np.minimum, np.inf), (np.maximum, -np.inf))
    )
    return (high[0], high[1]), (low[0], low[1])


def _beaten(
    mdp: MDP, bounds: tuple[Floats, Floats], chosen: Bools, *, maximise: bool, tolerance: float
) -> tuple[Bools, Bools]:
    """Return which choices differ from the best of the `chosen` ones of their state, for sure and possibly, ``[C]``."""
    high, low = _extremes(mdp, bounds, chosen)
    sizes = np.diff(mdp.state_to_choices)
    best = tuple(np.repeat(bound, sizes) for bound in (high if maximise else low))
    larger, smaller = ((best[0], best[1]), bounds) if maximise else (bounds, (best[0], best[1]))
    return exceeds(larger, smaller, 0.0, tolerance)
