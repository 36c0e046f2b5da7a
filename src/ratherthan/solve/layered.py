"""A system without cycles enters; bounds of its optimum, proved by one pass, leave.

Let the nodes of a system lie in layers: each leads to nodes of layers below it and to sinks only. So it is with step-bounded
missions, whose memory counts down, and on every graph without a cycle. Then the equations need no iteration: from the sinks
on, the best value of a node follows from values that are known,

    x(s) = best over rows a of s of  cost(a) + Σ p(a, t) x(t).

The pass runs twice, rounding down and rounding up. With lower ≤ x ≤ upper for the nodes before, and as the right side rises
with every x(t), the same holds for the next: by induction both are bounds, of the largest as of the least value. Nothing is
to be checked afterwards. Every policy is absorbed, so the solution of the equations is the optimum; with one row per node it is
the value of a policy.

**Rounding.** With t₁ the likeliest target, or the one of the least value, whichever leaves less to rounding, it is computed as
x(t₁) + (cost + Σ p (x(t) - x(t₁))). What stands in parentheses is a drift
(`system`) with x(t₁) in the place of x(s), and has its rounding error: in proportion to differences, not to values, and 0 where all
values are the same and nothing is paid. What the last sum loses is known (`two_sum`) and added. So the width of the bounds grows by
some 1e-15 of what a step changes, per layer. Where that is wide all the same (values that cancel) equations are solved besides,
and the better of both bounds counts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import Floats
from ratherthan.solve._kernels import backward_pass, sinks_first
from ratherthan.solve.system import ROUNDING, System

__all__ = ["Layered", "layered_bounds", "swept_bounds"]


Nodes = npt.NDArray[np.int64]

NARROW = 1e-10
"""Up to which width, relative to its value, an equation solver has nothing to add to a bound."""


class Layered(NamedTuple):
    """The best values of a system without cycles, with proved bounds."""

    values: Floats  # [n]
    lower: Floats  # [n]
    upper: Floats  # [n]

    @property
    def narrow(self) -> bool:
        """Whether the bounds are as narrow as any."""
        return bool((self.upper - self.lower <= NARROW * np.abs(self.values)).all())


def layered_bounds(system: System, maximise: bool, *, most: float = np.inf) -> Layered | None:
    """Return the best value of every node with bounds, None where nodes lead round in a cycle, or to themselves.

    Parameters
    ----------
    system : System
    maximise : bool
    most : float
        What no value exceeds.

    Returns
    -------
    Layered, or None
        None also where numbers exceed the range of doubles, or probabilities were rounded to less than it.
    """
    if len(system.faint):
        return None
    wide = _wide(system)
    order = compiled(sinks_first, len(system.target))(wide[1][wide[0]], wide[2])
    if len(order) < system.nodes:
        return None
    lower, upper = (
        _passed(system, order, np.full(system.nodes, direction * np.inf), direction, maximise)
        for direction in (-1.0, 1.0)
    )
    if not (np.isfinite(lower) & np.isfinite(upper)).all():
        return None
    if not system.signed:
        lower, upper = np.maximum(lower, 0.0), np.minimum(upper, most)
    return Layered(np.clip(lower + 0.5 * (upper - lower), lower, upper), lower, upper)


def swept_bounds(system: System, lower: Floats, upper: Floats, maximise: bool) -> tuple[Floats, Floats]:
    """Return bounds of the best value of every node after a pass over all nodes, no wider than they were.

    What a choice pays exactly is then told exactly, where the bounds had to leave room for rounding elsewhere. A bound that is not
    finite everywhere is left.
    """
    order = np.arange(system.nodes)
    if len(system.faint):
        return lower, upper
    if np.isfinite(lower).all():
        lower = _passed(system, order, lower, -1.0, maximise)
    if np.isfinite(upper).all():
        upper = _passed(system, order, upper, 1.0, maximise)
    return lower, upper


def _wide(system: System) -> tuple[Nodes, Nodes, Nodes]:
    """Return the rows of a system in one width of integers: one compiled kernel serves all."""
    begin, branches, target = (
        np.asarray(part, dtype=np.int64) for part in (system.node_to_rows, system.row_to_branches, system.target)
    )
    return begin, branches, target


def _passed(system: System, order: Nodes, known: Floats, direction: float, maximise: bool) -> Floats:
    """Return a bound of all nodes, improved node by node in an order."""
    exact = system.magnitude == 0.0
    if system.signed and system.exact is not None:
        exact |= system.exact
    paid = (system.cost, system.magnitude, exact)
    kernel = compiled(backward_pass, len(system.target))
    found: Floats = kernel(_wide(system), system.probability, paid, order, known, ROUNDING, direction, maximise)
    return found[: system.nodes]
