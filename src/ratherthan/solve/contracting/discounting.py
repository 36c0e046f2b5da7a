"""A discounted Field enters; its values leave, swept until all of them move alike.

**Equation.** x(s) = best over rows of cost + γ Σ p x. T contracts: |Tx - x*| ≤ γ |x - x*| in the largest difference, which for γ near 1
is slow. But for any constant k the step Tx - x of x + k is less by (1 - γ) k. So with d and e the least and the largest step of all
nodes, x + d / (1 - γ) and x + e / (1 - γ) are bounds of the optimum (MacQueen 1966, Porteus 1971), and x moves by their mean at
once, at the end. (To move it after every few sweeps in place, too, does not converge: these leave steps that are not alike.)

**Sweeps** go through all nodes there and back, in place; one that chooses is followed by nine that keep to what was chosen. Where the
discounted runs end in layers (at states where nothing is paid any more) windows of layers come first. When that would take too many
sweeps, because γ is near 1, equations are solved instead, roughly (`corrections`): for those a mode that all
nodes share is one number among many.

**Termination.** (e - d) / 2 ≤ wanted (1 - γ) max |x|, or as little as rounding permits.

References
----------
J. MacQueen, A Modified Dynamic Programming Method for Markovian Decision Problems, J. Math. Anal. Appl. 14, 1966.
E. L. Porteus, Some Bounds for Discounted Sequential Decision Processes, Management Science 18(1), 1971.
"""

from __future__ import annotations

import numpy as np

from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look
from ratherthan.solve.contracting.corrections import corrected
from ratherthan.solve.contracting.field import Field, swept, swept_whole
from ratherthan.solve.system import System, drift

__all__ = ["discounted_values"]


SWEEPS = 5
"""Sweeps there and back between two looks at the steps."""
MOST_LOOKS = 24
"""After how many looks sweeps end; and how many there may be to go for sweeps to be worth it."""
ROUNDING = 4e-15
"""Up to which share of the values steps can be told."""
SLOW = 0.75
"""Which share of the bounds' width is left after some sweeps where equations are better solved."""


def discounted_values(field: Field, discount: float, wanted: float) -> bool:
    """Bring the values of a field to within about `wanted` of the optimum; return whether they are.

    Parameters
    ----------
    field : Field
        Of a discounted system.
    discount : float
        γ.
    wanted : float
        Half the largest difference of the bounds that the steps give, relative to the largest value.
    """
    ends = 1.0 - discount
    unit = float(np.abs(field.system.cost).max())
    share = max(wanted, ROUNDING / ends)
    if len(field.layers) > 3:
        swept(field, 0.1 * wanted * unit, unit=unit)
    before = np.inf
    for _ in range(MOST_LOOKS):
        half = _half(field, ends)
        look(f"discounted sweeps: within {half:.1e}")
        if half <= share * _largest(field) or not _soon(half, before, share * _largest(field)):
            break
        before = half
        swept_whole(field, SWEEPS)
    if not half <= share * _largest(field):
        tolerance = share * ends * max(_largest(field), unit)
        if not np.isfinite(tolerance) or not corrected(field, tolerance, unit=unit):
            return False
    return _half(field, ends, shift=True) <= 4.0 * share * _largest(field)


def _soon(half: float, before: float, wanted: float) -> bool:
    """Return whether sweeps will end soon, if they go on as between the last two looks."""
    if not np.isfinite(half):
        return False
    return before == np.inf or (half < before and np.log(half / wanted) <= MOST_LOOKS * np.log(before / half))


def _largest(field: Field) -> float:
    """Return the largest absolute value."""
    return float(np.abs(field.values[:-2]).max())


def _half(field: Field, ends: float, *, shift: bool = False) -> float:
    """Return half the difference of the bounds that the steps give; with `shift` move the values between them."""
    least, most = _steps(field.system, field.of_nodes(), field.sign)
    if shift:
        field.values[:-2] += 0.5 * (least + most) / ends
    return 0.5 * (most - least) / ends


def _steps(system: System, values: Floats, sign: float) -> tuple[float, float]:
    """Return the least and the largest step Tx - x of all nodes, as of a system to be made small."""
    total, _ = drift(system, values)
    step = np.minimum.reduceat(sign * total, np.asarray(system.node_to_rows[:-1], dtype=np.int64))
    return float(step.min()), float(step.max())
