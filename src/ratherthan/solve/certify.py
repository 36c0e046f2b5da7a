"""Approximate values enter, proved bounds leave: one check by Bellman's operator, whoever computed the values.

Let D(a) be the drift of x along row a (`system`), computed with a bound e(a) of its rounding error. What is proved rests on
the graph part of the task (which states have the value 0, 1 or ∞, where a policy arrives) and on one of two checks of a
finite vector x that takes the exact values at the sinks:

* ``never_falls``: D(a) - e(a) ≥ 0 for every row of every node, hence x ≤ cost + P x under every policy;
* ``never_rises``: D(a) + e(a) ≤ 0 for every row of every node, hence x ≥ cost + P x under every policy.

*A given policy* (one row per node; from every node the sinks are reached with probability 1, by the graph). By
induction x ≤ E[cost of k steps] + E[x(Xₖ)], and what is not yet absorbed vanishes as x is bounded. So never_falls proves
x ≤ ρ^π, and never_rises x ≥ ρ^π.

*Least expected cost.* Any policy that arrives uses only rows of the system and is absorbed with probability 1: never_falls
over all rows gives x ≤ E[cost] for each of them, hence x ≤ ρ. This holds on the states as they are; the collapsed end
components serve to find x, not to believe it. Upper: ρ ≤ ρ^π for a policy that arrives.

*Least probability.* The open states hold no end component, so every policy is absorbed: never_falls proves x ≤ ρ.

*Largest expected cost, largest probability.* If x ≥ 0 and never_rises over all rows, then for every policy
x ≥ E[cost of k steps] + E[x(Xₖ)] ≥ E[cost of k steps] + P[sink 1 within k steps], hence x ≥ ρ. Lower: ρ ≥ ρ^π.

*Sums of rewards of either sign.* Every policy that counts is absorbed after a finite expected number of steps (`gathering`), so
never_rises over all rows proves x ≥ ρ for a largest value, and never_falls x ≤ ρ for a least, whatever the signs of x and of
what is paid. So it is for discounted sums, where every policy is absorbed.

*Probabilities of a model as they stand.* A check that fails is made again with drifts of some thirty digits (`trapped.exact`), of values
and margin rounded to two doubles. Bounds are rounded outward by more than that (`outward`).

The vectors to check are the solver's values and a margin below or above them, found in `margins` from linear solves. A
vector that fails is tried again with a wider margin or given up, never reported.

References
----------
Bounds by inductive vectors are also those of A. Hartmanns, B. L. Kaminski, Optimistic Value Iteration, CAV 2020; compare
T. Quatmann, J.-P. Katoen, Sound Value Iteration, CAV 2018.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Floats
from ratherthan.solve.linear import Inverse
from ratherthan.solve.margins import margin_of
from ratherthan.solve.system import System, certain_drift, drift
from ratherthan.solve.trapped.exact import exact_drift, is_exact

__all__ = [
    "Parts",
    "Tight",
    "chain_bounds",
    "chain_margin",
    "fits",
    "never_falls",
    "never_rises",
    "optimum_bound",
    "outward",
]

Nodes = npt.NDArray[np.int64]

SCALES = (1.0, 16.0, 1024.0)
MOST_PARTS = 3
"""High and low part of values, and a margin."""


class Parts(NamedTuple):
    """Values in two parts, their sum."""

    high: Floats  # [n]
    low: Floats  # [n]


class Tight(NamedTuple):
    """What a solver found on a system: values, rows that are tight for them, and what solves the equations of these rows."""

    values: Parts
    rows: Nodes  # [n]
    inverse: Inverse
    scale: Floats | None = None  # [n], as in Solved

    @property
    def widest(self) -> float:
        """Which margin is too wide to be of use."""
        return 1e3 * float((self.values.high if self.scale is None else self.scale).max())


def never_falls(system: System, *parts: Floats) -> bool:
    """Return whether x, the sum of `parts`, provably satisfies x ≤ cost + P x along every row."""
    total, error = drift(system, *parts)
    return bool((total - error >= 0.0).all()) or _exactly(system, parts, 1.0)


def never_rises(system: System, *parts: Floats) -> bool:
    """Return whether x, the sum of `parts`, provably satisfies x ≥ cost + P x along every row."""
    total, error = drift(system, *parts)
    return bool((total + error <= 0.0).all()) or _exactly(system, parts, -1.0)


def _exactly(system: System, parts: tuple[Floats, ...], sign: float) -> bool:
    """Return whether x passes the check with drifts in two parts, where these can be had: x is then `parts` rounded to two."""
    if not is_exact(system) or len(parts) > MOST_PARTS:
        return False
    low = parts[1] if len(parts) > 1 else np.zeros(system.nodes)
    total, error = exact_drift(system, parts[0], low + parts[2] if len(parts) == MOST_PARTS else low)
    return bool((sign * total - error >= 0.0).all())


def fits(system: System, values: Floats, sign: float) -> bool:
    """Return whether x itself passes a check: it never falls (sign 1), or never rises (-1), provably or without rounding.

    Where signed sums cancel, x may be 0, and no margin around it is small. It need not be rounded, though.
    """
    total, error = drift(system, values)
    plain, exact = certain_drift(system, values)
    return bool(((sign * total - error >= 0.0) | (exact & (sign * plain >= 0.0))).all())


def nowhere_negative(values: Parts, margin: Floats) -> bool:
    """Return whether values + margin is provably at least 0 everywhere."""
    total = values.high + np.nextafter(values.low + margin, -np.inf)
    return bool((total >= 0.0).all())


def outward(values: Parts, margin: Floats, *, signed: bool = False) -> tuple[Floats, Floats]:
    """Return values - margin and values + margin, rounded outward; below 0 is 0 where no value is negative."""
    lower = np.nextafter(values.high + np.nextafter(values.low - margin, -np.inf), -np.inf)
    upper = np.nextafter(values.high + np.nextafter(values.low + margin, np.inf), np.inf)
    return lower if signed else np.maximum(lower, 0.0), upper


def chain_bounds(system: System, found: Tight) -> tuple[Floats | None, Floats | None]:
    """Return proved bounds of the values of a system with one row per node, None for one that cannot be proved.

    Parameters
    ----------
    system : System
        From every node the sinks are reached with probability 1.
    found : Tight
        An approximate solution.

    Returns
    -------
    lower, upper : array of float, ``[n]``, or None
    """
    plain = found.values.high + found.values.low
    if system.signed and fits(system, plain, 1.0) and fits(system, plain, -1.0):
        return plain, plain
    lower, upper = None, None
    for scale in SCALES:
        margin = chain_margin(system, found, scale)
        if margin is None:
            break
        below, above = outward(found.values, margin, signed=system.signed)
        if lower is None and never_falls(system, *found.values, -margin):
            lower = below
        if upper is None and never_rises(system, *found.values, margin):
            upper = above
        if lower is not None and upper is not None:
            break
    return lower, upper


def chain_margin(system: System, found: Tight, scale: float = 1.0) -> Floats | None:
    """Return a margin around the values of a system with one row per node that is worth a try, ``[n]``, or None."""
    total, error = drift(system, *found.values)
    slack = scale * (np.abs(total) + 2.0 * error)
    return margin_of(system, slack, np.zeros(system.rows), (found.rows, found.inverse), found.widest)


def optimum_bound(core: System, whole: System, node: Nodes, found: Tight, maximise: bool) -> Floats | None:
    """Return the bound that no policy can beat: lower for a least, upper for a largest value; None if it is not proved.

    Parameters
    ----------
    core : System
        With end components collapsed.
    whole : System
        The open states as they are, with all allowed choices: what the bound is checked on.
    node : array of int, ``[N]``
        The node of the core that each node of `whole` is collapsed into.
    found : Tight
        An approximate optimum of `core`.
    maximise : bool

    Returns
    -------
    array of float, ``[N]``, or None
    """
    total, error = drift(core, *found.values)
    gap = -total if maximise else total
    values = Parts(found.values.high[node], found.values.low[node])
    if core.signed and fits(whole, values.high + values.low, -1.0 if maximise else 1.0):
        return values.high + values.low
    for scale in SCALES:
        slack = scale * (2.0 * error + np.maximum(-gap, 0.0))
        collapsed = margin_of(core, slack, np.maximum(gap, 0.0), (found.rows, found.inverse), found.widest)
        if collapsed is None:
            return None
        margin = collapsed[node]
        lower, upper = outward(values, margin, signed=core.signed)
        if maximise:
            if (core.signed or nowhere_negative(values, margin)) and never_rises(whole, *values, margin):
                return upper
        elif never_falls(whole, *values, -margin):
            return lower
    return None
