"""A system enters that no equation solver coped with; vectors from below and from above that may pass the check leave.

Value iteration, x ← T x, with T the best row of every node and the loops of a row to its own node taken out. It is monotone,
so that started from a vector with x ≤ T x it rises, every iterate has x ≤ T x again, and the check of `certify` proves it to
be a lower bound; from x ≥ T x it falls, likewise.

* From below: x = 0. Every sweep is multiplied by 1 - γ, γ a few times the rounding error of a sweep, so that rounding cannot turn
  the inequality round.
* From above, for probabilities: x = 1, times 1 + γ. For costs there is no such vector to start with: (1 + η) x with x from
  below is tried for some η, which passes where costs are positive and x has converged.

* With signed costs there is no such vector to start with. Value iteration runs from 0, and x ∓ ε is tried for some ε, the same at
  every node, which passes where every row leads to a sink with some probability, as discounted rows do.

It ends when no value changes by more than the precision, or after the sweeps that were allowed: slow chains need about as
many as they need steps. The difference to the limit is then unknown, but the bounds hold.

References
----------
S. Haddad, B. Monmege, Interval iteration algorithm for MDPs and IMDPs, Theor. Comput. Sci. 735, 2018.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import keep, look
from ratherthan.solve.certify import never_falls, never_rises
from ratherthan.solve.policy_iteration import least_rows
from ratherthan.solve.system import System, drift, padded

__all__ = ["Sweeps", "Swept", "arriving_rows", "sweep_from_above", "sweep_from_below", "swept_between", "upper_vector"]

Nodes = npt.NDArray[np.int64]
Operator = Callable[[Floats], Floats]

RAISES = (1e-12, 1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0)


@dataclass(frozen=True, kw_only=True)
class Sweeps:
    """Settings of value iteration.

    Parameters
    ----------
    most : int
        Sweeps after which to stop.
    change : float
        The largest relative change of a value at which to stop.
    """

    most: int = 3000
    change: float = 1e-13


@dataclass(frozen=True, kw_only=True, eq=False)
class Swept:
    """Where value iteration came to, ``[n]``, and in how many sweeps."""

    values: Floats  # [n]
    sweeps: int


def sweep_from_below(system: System, maximise: bool, settings: Sweeps) -> Swept:
    """Return a vector x ≤ T x that value iteration comes to from 0."""
    shrink = 1.0 - _rounding(system)
    return _iterated(system, maximise, settings, (0.0, lambda before, after: np.maximum(before, shrink * after)))


def sweep_from_above(system: System, maximise: bool, settings: Sweeps) -> Swept:
    """Return a vector x ≥ T x that value iteration comes to from 1; for probabilities."""
    grow = 1.0 + _rounding(system)
    return _iterated(system, maximise, settings, (1.0, lambda before, after: np.minimum(before, grow * after)))


def upper_vector(system: System, below: Floats, maximise: bool, settings: Sweeps | None) -> Floats | None:
    """Return values from above if the check of x ≥ cost + P x along every row passes, else None.

    Parameters
    ----------
    system : System
    below : array of float, ``[n]``
        Values from below.
    maximise : bool
    settings : Sweeps, optional
        For probabilities: those of the sweeps from 1. For costs None.
    """
    if settings is not None:
        candidates = [sweep_from_above(system, maximise, settings).values]
    else:
        candidates = [(1.0 + share) * below for share in RAISES]
    return next((values for values in candidates if never_rises(system, values)), None)


def swept_between(system: System, settings: Sweeps, *, maximise: bool) -> tuple[Floats, Floats | None, Floats | None]:
    """Return values of a system with signed costs, and vectors below and above them that pass the checks, or None.

    The vector below is one for every policy, of a system with several rows per node as well.
    """
    values = _iterated(system, maximise, settings, (0.0, lambda _, after: after)).values
    if not np.isfinite(values).all():
        return np.zeros(system.nodes), None, None
    size = float(np.abs(values).max()) + float(system.magnitude.max())
    below = next((low for low in (values - share * size for share in RAISES) if never_falls(system, low)), None)
    above = next((high for high in (values + share * size for share in RAISES) if never_rises(system, high)), None)
    return values, below, above


def arriving_rows(system: System, maximise: bool, values: Floats) -> Nodes:
    """Return best rows of every node for given values; where they do not arrive, rows that lead to where they do, ``[n]``."""
    total, _ = drift(system, values)
    rows = least_rows(system, (-total if maximise else total) / system.leave)
    index = system.index
    sinks = np.arange(index.states) >= system.nodes
    taken = np.zeros(system.rows, dtype=np.bool_)
    taken[rows] = True
    arrives = graph.can_reach(index, sinks, ~sinks, taken)
    level = graph.levels_to(index, arrives, ~sinks)
    other = graph.first_downhill(index, level, np.ones(system.rows, dtype=np.bool_))[: system.nodes]
    return np.where(arrives[: system.nodes], rows, other)


def _rounding(system: System) -> float:
    return 4.0 * float(system.rounding.max())


def _iterated(
    system: System, maximise: bool, settings: Sweeps, start: tuple[float, Callable[[Floats, Floats], Floats]]
) -> Swept:
    """Return where x ← step(x, T x) comes to from a constant."""
    constant, step = start
    operator = _operator(system, maximise)
    values = np.full(system.nodes, constant)
    settled, sweeps = False, 0
    side = {0.0: "lower", 1.0: "upper"}[constant] if not system.signed else "guess"
    while not settled and sweeps < settings.most:
        keep(system=system, engine="value iteration", **{side: values})
        look(f"value iteration, sweep {sweeps}" if sweeps % 10 == 0 else None)
        after = step(values, operator(values))
        if not np.isfinite(after).all():  # beyond doubles, or no numbers: what was reached before is kept
            break
        settled = bool((np.abs(after - values) <= settings.change * np.abs(after)).all())
        values, sweeps = after, sweeps + 1
    return Swept(values=values, sweeps=sweeps)


def _operator(system: System, maximise: bool) -> Operator:
    """Return T."""
    from scipy.sparse import csr_array

    n, leave, begin = system.nodes, system.leave, system.node_to_rows[:-1]
    share = np.where(system.target != system.branch_node, system.probability, 0.0)
    share /= np.repeat(leave, np.diff(system.row_to_branches))
    matrix = csr_array((share, system.target, system.row_to_branches), shape=(system.rows, n + 2))
    paid = system.cost / leave
    best = np.maximum if maximise else np.minimum
    return lambda values: np.asarray(best.reduceat(paid + matrix @ padded(values, 1.0), begin))
