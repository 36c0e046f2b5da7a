"""Values of a task's system enter, bounds that one rounded sweep has confirmed leave: which margin to put around them.

Let g(a) be the gap of row a, its drift with the sign that makes the best rows of a node have about 0 and all others more; e(a) the
bound of its rounding. A row is *near* if its gap is within the residual of the best. Values x with a margin m, at every node,

    m(s) ≥ e(a) - g(a) + Σ p(a, t) m(t)  for all rows,   m(s) ≥ e(a) + g(a) + Σ p(a, t) m(t)  for near rows,

pass both checks of `certify`: x - m and x + m are bounds, one of them for every policy, the other for policies of near rows. Which m:

* **A constant**, where sums are discounted: the second term is then less by (1 - γ) m. m = 2 max(|g| + 2e) / (1 - γ).
* **A share of x**, where every row pays something above 0: h x falls by h cost(a) more than the drift of x says, along every row. h is
  the largest (|g| + 2e) / cost, m = h x.
* **What is collected**, in general (costs of 0, rewards of both signs): m is the largest expected sum of pay(a), 2 (|g| + 2e) along near
  rows and e - g, below 0, along others. It is the same kind of system as that of x, and found by the same sweeps, but
  roughly: half of pay is room for errors. It is finite where no policy goes round among near rows for ever. Where one does, nothing
  comes out (m is not found, or the check refuses it), and equations are solved instead.

The construction with a longest run of free steps, for costs of 0, is the third: free rows that are near are the only ones along
which slack is collected without being paid for.

Nothing in here has to be right for the bounds to be sound: `never_falls` and `never_rises` decide on the states as they are, and the
graph decides that the policy arrives.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats
from ratherthan.solve.certify import Parts, never_falls, never_rises, nowhere_negative, outward
from ratherthan.solve.contracting.corrections import corrected, repaired
from ratherthan.solve.contracting.eliminated import collected
from ratherthan.solve.contracting.field import field_of, swept
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.system import System, drift

__all__ = ["Gaps", "bounded_by", "gaps_of", "margins_for"]

Nodes = npt.NDArray[np.int64]

TIE = 4.0
"""Up to how many residuals a row may fall behind the best and be near it."""
ROOM = 1.0 + 1e-6
COARSE = 1e5
TINY = 1e-9
"""Which share of the largest slack a node has at least."""


class Gaps(NamedTuple):
    """How rows stand to values: gaps, their rounding errors, which rows are near, and the largest residual of a node."""

    gap: Floats  # [m]
    error: Floats  # [m]
    near: Bools  # [m]
    residual: float

    @property
    def slack(self) -> Floats:
        """What a margin has to make up for along near rows, ``[m]``."""
        return np.abs(self.gap) + 2.0 * self.error


def gaps_of(system: System, values: Floats, maximise: bool, finest: int = 0) -> Gaps:
    """Return how the rows of a system stand to values.

    Parameters
    ----------
    system : System
    values : array of float, ``[n]``
    maximise : bool
    finest : int
        From 1 on ties are finer, from 2 on only best rows are near.
    """
    total, error = drift(system, values)
    gap = -total if maximise else total
    least = np.minimum.reduceat(gap, np.asarray(system.node_to_rows[:-1], dtype=np.int64))
    residual = float(np.abs(least).max())
    behind = gap - least[system.row_node]
    room = (TIE if finest == 0 else 1.0) * residual + 4.0 * error if finest < 2 else np.zeros(len(gap))
    return Gaps(gap, error, behind <= room, residual)


def margins_for(
    system: System,
    values: Floats,
    gaps: Gaps,
    discount: float,
    *,
    sweeping: bool = True,
    exact: tuple[Factored, Nodes] | None = None,
) -> Floats | None:
    """Return a margin around values that is worth a try, ``[n]``; None where none was found.

    Parameters
    ----------
    system : System
    values : array of float, ``[n]``
    gaps : Gaps
    discount : float
        1 where nothing is discounted.
    sweeping : bool
        Whether sweeps led to the values, and will to a margin.
    exact : tuple, optional
        Equations that led to the values, and the rows to begin with: they will lead to a margin.
    """
    slack = gaps.slack
    if not (np.isfinite(gaps.residual) and np.isfinite(slack[gaps.near]).all()):  # beyond what doubles hold
        return None
    if discount < 1.0:
        return np.full(system.nodes, 2.0 * float(slack[gaps.near].max()) / (1.0 - discount))
    if not system.signed and system.cost.min() > 0.0:
        falls = np.where(gaps.near, slack, 2.0 * gaps.error - gaps.gap)
        share = float((np.maximum(falls, 0.0) / system.cost).max()) * ROOM + 1e-15
        if share < 1e-3:
            return share * ROOM * np.abs(values)
    return _collected(system, gaps, sweeping, exact)


def _collected(system: System, gaps: Gaps, sweeping: bool, exact: tuple[Factored, Nodes] | None) -> Floats | None:
    """Return the largest expected sum of slack, about; None where there is none, or sweeps come to no end."""
    begin = np.asarray(system.node_to_rows[:-1], dtype=np.int64)
    slack = gaps.slack
    slack = np.maximum(slack, TINY * float(slack[gaps.near].max()) + 1e-300)
    pay = 2.0 * slack
    if exact is not None:
        equations, rows = exact
        behind = gaps.error - gaps.gap
        pay = np.where(gaps.near, pay, behind + gaps.error)
        return collected(equations, pay, np.where(gaps.near, slack, behind), rows)
    near = np.where(gaps.near, pay / system.leave, np.inf)
    tolerance = 0.25 * np.minimum.reduceat(near, begin)
    other = 2.0 * gaps.error - gaps.gap + 2.0 * tolerance[system.row_node] * system.leave
    pay = np.where(gaps.near, pay, other)
    field = field_of(system, maximise=True, cost=pay)
    field.values[-1] = 0.0
    if not sweeping or not swept(field, 1.0, tolerance, unit=COARSE):
        candidates = np.flatnonzero(gaps.near)
        first = repaired(system, candidates[np.searchsorted(candidates, begin)])
        if not corrected(field, float(tolerance.min()), unit=float(pay.max()), rows=first):
            return None
    return np.maximum(field.of_nodes(), 0.0)


def bounded_by(whole: System, values: Floats, margin: Floats, maximise: bool) -> Floats | None:
    """Return the bound that no policy beats, if values and margin pass the check on the states as they are, else None.

    Parameters
    ----------
    whole : System
        With all allowed rows.
    values, margin : array of float, ``[N]``
    maximise : bool
    """
    parts = Parts(values, np.zeros(len(values)))
    lower, upper = outward(parts, margin, signed=whole.signed)
    if maximise:
        fine = (whole.signed or nowhere_negative(parts, margin)) and never_rises(whole, values, margin)
        return upper if fine else None
    return lower if never_falls(whole, values, -margin) else None
