"""Values of a largest probability enter that could not be bounded from above; a bound for a limited number of steps leaves.

Let x ≥ 0 with x = 1 at the goal, and let no row a gain more than δ on it, Σ p(a, t) x(t) ≤ x(s) + δ. Then under every policy

    P(the goal is reached within H steps) ≤ x + H δ.

By induction on H: for H = 0 it is 0 or 1. With H + 1 steps it is the mean of what H steps attain from the next state, so at
most Σ p (x(t) + H δ) ≤ x(s) + (H + 1) δ. So values that are right to rounding, δ = 1e-15, tell that no plan of a hundred thousand steps does
better by more than 1e-10. Nothing is told of longer plans: where a policy can wander safely for ever, hardly losing anything,
any δ adds up. Hence such a number is no bound of the value, and no claim rests on it.

H is the largest power of ten up to a hundred thousand with H δ at most 1e-7.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ratherthan.model.mdp import Floats
from ratherthan.solve.system import System, drift
from ratherthan.solve.trapped.exact import exact_drift, is_exact

__all__ = ["Horizon", "within_steps"]

STEPS = (100_000, 10_000, 1_000)
LOSS = 1e-7
"""The most that H steps may add."""


class Horizon(NamedTuple):
    """A bound of the probability to arrive within so many steps, whatever the policy."""

    steps: int
    upper: Floats


def within_steps(system: System, values: Floats) -> Horizon | None:
    """Return an upper bound of the largest probability to arrive within a number of steps, ``[n]``; None if none is near `values`.

    Parameters
    ----------
    system : System
        The states as they are, with all their choices that can leave them.
    values : array of float, ``[n]``
        Between 0 and 1.
    """
    if not (np.isfinite(values).all() and (values >= 0.0).all() and (values <= 1.0).all()):
        return None
    rise = _largest_rise(system, values)
    steps = next((steps for steps in STEPS if steps * rise <= LOSS), None)
    if steps is None:
        return None
    return Horizon(steps, np.minimum(np.nextafter(values + np.nextafter(steps * rise, np.inf), np.inf), 1.0))


def _largest_rise(system: System, values: Floats) -> float:
    """Return a number that no row gains more than."""
    total, error = drift(system, values)
    rise = float(np.maximum(total + error, 0.0).max())
    if is_exact(system):
        total, error = exact_drift(system, values, np.zeros(system.nodes))
        sums = np.add.reduceat(system.probability, system.row_to_branches[:-1])
        # That is the drift times what the row sums to, which is 1 but for rounding.
        rise = min(rise, float(np.maximum(total + error, 0.0).max()) / (float(sums.min()) * (1.0 - 1e-9)))
    return float(np.nextafter(rise, np.inf)) if rise > 0.0 else rise
