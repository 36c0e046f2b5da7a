"""Action values with bounds enter; the critical states leave: those where a choice matters.

Definition
----------
S_c = {s : λmax_s - λmin_s > α + τ} with a threshold α ≥ 0 in the objective's unit (Chen, Boggess, Feng 2020, section
III-A; τ is the tolerance of `ratherthan.factors.compare`). A state with one choice is never critical; ∞ - finite = ∞ is;
where all choices are infinite nothing is left to choose and the difference is 0. Where the objective has ended no state is
critical. Where the bounds do not decide, criticality is *open*.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ratherthan.factors.compare import TOLERANCE, exceeds
from ratherthan.factors.responsibility import Responsibility
from ratherthan.model.mdp import MDP, Bools

__all__ = ["Criticality", "critical_states"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Criticality:
    """Which states are critical.

    Parameters
    ----------
    certain : array of bool, ``[S]``
        Critical for sure.
    possible : array of bool, ``[S]``
        Critical, or open; contains `certain`.
    """

    certain: Bools  # [S]
    possible: Bools  # [S]

    def of(self, state: int) -> bool | None:
        """Return True, False, or None where the bounds leave it open."""
        if self.certain[state]:
            return True
        return None if self.possible[state] else False


def critical_states(
    mdp: MDP,
    measures: Responsibility,
    ended: Bools,
    *,
    alpha: float = 0.0,
    omega: bool = False,
    tolerance: float = TOLERANCE,
) -> Criticality:
    """Find the critical states.

    Parameters
    ----------
    mdp : MDP
    measures : Responsibility
    ended : array of bool, ``[S]``
        Where the objective has ended.
    alpha : float
        The threshold, at least 0.
    omega : bool
        Take the paper's impact ω instead of the action value q.
    tolerance : float
        The factor of τ.

    Returns
    -------
    Criticality
    """
    lower, upper = (measures.impact_lower, measures.impact_upper) if omega else (measures.lower, measures.upper)
    starts = mdp.state_to_choices[:-1]
    high = np.maximum.reduceat(lower, starts), np.maximum.reduceat(upper, starts)
    low = np.minimum.reduceat(lower, starts), np.minimum.reduceat(upper, starts)
    certain, possible = exceeds(high, low, alpha, tolerance)
    open_to_choice = (np.diff(mdp.state_to_choices) > 1) & ~ended
    return Criticality(certain=certain & open_to_choice, possible=possible & open_to_choice)
