"""The system of one policy enters, with many nodes, that counts costs or rewards; its values leave with proved bounds.

With one row per node there is nothing to choose, and the same ways lead to values as for an optimum (`contraction`): sweeps through
windows; where these come to no end, as a run lingers somewhere, the equations themselves, component by component (`eliminating`);
where factors would fill, a Krylov method. The margin around them is found and checked in the same way, too (`proof`).
"""

from __future__ import annotations

import numpy as np

from ratherthan.model.mdp import Floats
from ratherthan.solve.certify import Parts, never_falls, never_rises, outward
from ratherthan.solve.contracting.contraction import (
    ENOUGH,
    EXACT,
    FINER,
    ROUGH,
    TRIES,
    is_large,
    largest_share,
    unit_of,
    valued,
)
from ratherthan.solve.contracting.field import Field, field_of
from ratherthan.solve.contracting.proof import gaps_of, margins_for
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.precise import width_aimed_at
from ratherthan.solve.system import System

__all__ = ["chain_bounds_at_size"]

Bounds = tuple[Floats, Floats, Floats]
"""Values, and bounds below and above them."""


def chain_bounds_at_size(system: System, maximise: bool, discount: float) -> Bounds | None:
    """Return the values of a system with one row per node and proved bounds, None where these are not proved.

    Parameters
    ----------
    system : System
        From every node the sinks are reached with probability 1.
    maximise : bool
        It makes no difference.
    discount : float

    Returns
    -------
    values, lower, upper : array of float, ``[n]``
        The narrowest that were proved, where they are not as narrow as was aimed at.
    """
    if not is_large(system):
        return None
    field = field_of(system, maximise, discounted=discount < 1.0)
    unit, aim = unit_of(system), width_aimed_at()
    wanted = aim * unit
    best: Bounds | None = None
    way: str | None = None
    equations = Factored(system) if discount == 1.0 else None
    for _ in range(TRIES):
        way = valued(field, discount, wanted, unit, (way, equations))
        found = None if way is None else _around(field, discount, way, equations)
        if found is None:
            break
        best = found
        if _relative(system, found) <= ENOUGH * aim:
            break
        wanted *= FINER
    return best


def _around(field: Field, discount: float, way: str, equations: Factored | None) -> Bounds | None:
    """Return the values of a field with one row per node and proved bounds, None where these are not proved."""
    system = field.system
    values = field.of_nodes() if system.signed else np.maximum(field.of_nodes(), 0.0)
    gaps = gaps_of(system, values, field.sign < 0.0)
    exact = (equations, np.arange(system.nodes)) if equations is not None and way == EXACT else None
    margin = margins_for(system, values, gaps, discount, sweeping=way != ROUGH, exact=exact)
    if margin is None or not (never_falls(system, values, -margin) and never_rises(system, values, margin)):
        return None
    lower, upper = outward(Parts(values, np.zeros(len(values))), margin, signed=system.signed)
    return np.clip(values, lower, upper), lower, upper


def _relative(system: System, found: Bounds) -> float:
    """Return the largest relative width of bounds."""
    values, lower, upper = found
    size = np.abs(values)
    if system.signed:
        size = np.full(len(values), max(float(size.max()), float(np.abs(system.cost).max())))
    return largest_share(upper - lower, size)
