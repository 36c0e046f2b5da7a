"""Slack that every row needs enters, a margin around approximate values leaves that `certify` can try.

Let v be approximate values, δ(a) a few times the rounding error of its drift along row a (and |drift| itself where it is on the
wrong side), and relief(a) ≥ 0 the drift on the right side: how much worse than v the row is. v ∓ g passes the check if

    g(s) ≥ δ(a) - relief(a) + Σ p(a, t) g(t)   for every row a of every node s.

The least such g is the largest expected sum of δ - relief over all policies. It is the same kind of system again, solved by
policy iteration from the rows that are tight for v, with 2δ in the place of δ, so that a factor of 2 is left for the errors
of the solve. Only rows that are nearly tight ever matter, as relief is paid at every use. A policy that wanders for 1e9 steps
near an end component collects 1e9 · 1e-16 and no more: the margin is as wide as rounding requires there, and not elsewhere.

The margin is a vector of doubles, so its own rounding shows in its drift: that is added to δ before the second solve, and once more
where the drift of the margin itself cannot be told from its error (where nothing is paid and all values are the same, say).

Nothing here needs to be right for a bound to be sound: the check decides.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Floats
from ratherthan.solve.linear import Inverse, solve_chain
from ratherthan.solve.policy_iteration import least_rows
from ratherthan.solve.system import System, drift, exchanged, rows_of

__all__ = ["margin_of"]

Nodes = npt.NDArray[np.int64]

FLOOR = 1e-300
"""Added to δ where it is positive, so that it does not vanish in products of probabilities."""
MOST_ROUNDS = 30


def margin_of(
    system: System, slack: Floats, relief: Floats, start: tuple[Nodes, Inverse], most: float
) -> Floats | None:
    """Return g with g ≥ slack - relief + P g along every row, about; None if none is found.

    Parameters
    ----------
    system : System
    slack, relief : array of float, ``[m]``
        At least 0.
    start : tuple
        Rows with little relief, from which the sinks are reached, ``[n]``, and an approximate solver of their equations.
    most : float
        Above which size a margin is of no use.

    Returns
    -------
    array of float, ``[n]``, or None
    """
    rows, inverse = start
    needed = slack + np.where(slack > 0.0, FLOOR, 0.0)
    noise = np.zeros(system.rows)
    for _ in range(MOST_ROUNDS):
        chain = rows_of(system, rows)
        for _ in range(2):
            collected = _collected(chain, inverse, (2.0 * (needed + noise) - relief)[rows])
            if collected is None or collected.max() > most:
                return None
            margin = collected
            noise = system.rounding * exchanged(system, margin)
        short, _ = drift(system, margin, cost=needed - relief, one=0.0)
        best = least_rows(system, -short)
        rises = short[best] > 0.0
        if not rises.any():
            left, wrong = drift(system, margin, cost=slack - relief, one=0.0)
            doubtful = left + wrong > 0.0
            if not doubtful.any():
                return margin
            needed = needed + np.where(doubtful, 4.0 * wrong, 0.0)
            continue
        better = np.where(rises, best, rows)
        if (better == rows).all():
            return margin
        rows = better
        solved = solve_chain(rows_of(system, rows))
        if solved is None:
            return None
        inverse = solved.inverse
    return None


def _collected(chain: System, inverse: Inverse, pay: Floats) -> Floats | None:
    """Return the expected sum of `pay` along a chain, refined once; None where it is not finite."""
    total = inverse(pay)
    if not np.isfinite(total).all():
        return None
    rest, _ = drift(chain, total, cost=pay, one=0.0)
    refined: Floats = np.maximum(total + inverse(rest), 0.0)
    return refined if np.isfinite(refined).all() else None
