"""A system with one row per node enters, its solution leaves: as a double and a correction, far more exact than one solve.

x = cost + P x is solved in the form (I - D⁻¹ P') x = D⁻¹ b, where P' has no diagonal, D is the probability to leave each
node (a sum of the other branches, not 1 minus the diagonal) and b holds the costs and the branches to the sink of value 1.
An *Inverse* is anything that solves it approximately. Up to some hundred nodes it is the dense inverse matrix (numpy alone), or
elimination without subtraction where that is not good enough: every entry keeps its relative accuracy, however slowly the chain
leaves (Grassmann, Taksar and Heyman 1985; O'Cinneide 1993). For larger systems see `sparse`.

*Refinement.* r = drift of x; x ← x + A⁻¹ r, x kept in two doubles. As the drift is computed from differences, it is small in
relation to what happens locally, and the limit is not the accuracy of one solve but that of the drift. It ends when the
drift is within its own rounding error everywhere, or has not fallen by half for some steps.

References
----------
W. K. Grassmann, M. I. Taksar, D. P. Heyman, Regenerative Analysis and Steady State Distributions for Markov Chains,
Oper. Res. 33(5), 1985.  N. J. Higham, Accuracy and Stability of Numerical Algorithms, SIAM, 2002, chapter 12.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ratherthan.model._kernels import is_compiled
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look
from ratherthan.solve.system import System, drift, exchanged, two_sum

__all__ = ["GRAIN", "MOST_DENSE", "Inverse", "Method", "Solved", "methods_for", "solve_chain"]

Inverse = Callable[[Floats], Floats]


class Method(NamedTuple):
    """A way to build an approximate inverse, and whether all its entries have relative accuracy."""

    build: Callable[[System], Inverse | None]
    entrywise: bool = False
    name: str = "a direct solve"


MOST_DENSE = 400
"""Up to how many nodes matrices are dense."""
SMALL = 6000
"""Up to how many nodes elimination runs in time without being compiled."""
GRAIN = 2.0**-102
"""How finely values in two parts are told, relative to their size, with some room."""
FEW_STEPS = 1e11
"""Expected numbers of steps above which an inverse is not trusted without a look."""
SETTLED = 0.1
"""Up to which drift the expected number of steps counts as solved."""
MOST_DOUBT = 1e-9
"""Up to which relative uncertainty a refined solution is preferred to an accurate first solve."""
GOOD = 4.0
"""Up to how many rounding errors of drift no other method is tried."""
MOST_REFINEMENTS = 15
MOST_VAIN = 2


class Solved(NamedTuple):
    """The solution of a system with one row per node, in two parts, and what solves it again."""

    high: Floats  # [n]
    low: Floats  # [n]
    inverse: Inverse
    method: Method
    exactness: float  # the largest drift, in units of its rounding error; ∞ where the chain leaves too slowly to tell
    scale: Floats | None = None  # [n], of values with signs: the expected sum of absolute payments
    failed: tuple[str, ...] = ()  # the names of methods tried before that gave no numbers

    @property
    def size(self) -> Floats:
        """How large the numbers are that the values are made of, ``[n]``: the values themselves where none is negative."""
        return self.high if self.scale is None else self.scale


def methods_for(system: System) -> tuple[Method, ...]:
    """Return the methods to try on a system with one row per node, the fastest first.

    Parameters
    ----------
    system : System
        The methods serve all systems of its size and kind.
    """
    if system.nodes <= MOST_DENSE:
        return (
            Method(_dense, name="a dense inverse"),
            Method(_dense_elimination, entrywise=True, name="dense elimination"),
        )
    from ratherthan.solve import sparse

    elimination = Method(sparse.elimination, entrywise=True, name="sparse elimination")
    krylov = Method(sparse.krylov, name="BiCGSTAB")
    if is_compiled(len(system.target)):
        return (elimination, krylov)
    lu = Method(sparse.sparse_lu, name="sparse LU")
    return (lu, elimination) if system.nodes <= SMALL else (lu, krylov)


def solve_chain(system: System, methods: tuple[Method, ...] | None = None) -> Solved | None:
    """Return the solution of a system with one row per node, None where no method finds a finite one.

    Parameters
    ----------
    system : System
        From every node a sink can be reached.
    methods : tuple, optional
        What to try; found by `methods_for` by default.
    """
    best: Solved | None = None
    failed: tuple[str, ...] = ()
    for method in methods_for(system) if methods is None else methods:
        look()
        inverse = method.build(system)
        if inverse is None:
            continue
        found = _refined(system, method, inverse)
        if found is None:
            failed += (method.name,)
        elif best is None or found.exactness <= best.exactness:
            best = found._replace(failed=failed)
        if best is not None and (method.entrywise or best.exactness <= GOOD):
            break
    return best


def _refined(system: System, method: Method, inverse: Inverse) -> Solved | None:
    """Return the solution by refinement from 0, None where it is not finite.

    Where a chain leaves so slowly that the equation of its expected number of steps is not solved, any value that is constant on
    the slow part has little drift. Then refinement tells nothing, and the first solve stands if its entries are accurate one by one.
    """
    high, low = np.zeros(system.nodes), np.zeros(system.nodes)
    total = drift(system, high)[0]
    slow = not method.entrywise and not _settled(system, inverse)
    best: Solved | None = None
    vain, scale = 0, _scale(system, inverse)
    for _ in range(MOST_REFINEMENTS):
        look()
        step = inverse(total)
        if not np.isfinite(step).all():
            return best
        high, low = two_sum(high, low + step)
        total, error = drift(system, high, low)
        error += GRAIN * exchanged(system, np.abs(high))
        ratio = np.divide(np.abs(total), error, out=np.zeros_like(total), where=total != 0.0)
        exactness = np.inf if slow else float(ratio.max())
        if best is None:
            first = best = Solved(high, low, inverse, method, exactness, scale)
        elif exactness < best.exactness:
            vain = vain if exactness > 0.5 * best.exactness else 0
            best = Solved(high, low, inverse, method, exactness, scale)
        vain += 1
        if slow or best.exactness <= 1.0 or vain > MOST_VAIN:
            break
    if best is not None and method.entrywise:
        doubt = inverse(np.abs(total) + error)
        if not (doubt <= MOST_DOUBT * best.size).all():
            return first._replace(exactness=np.inf)
    return best


def _scale(system: System, inverse: Inverse) -> Floats | None:
    """Return the expected sum of absolute payments along a chain, None where no payment is negative."""
    return np.abs(inverse(system.magnitude)) if system.signed else None


def _settled(system: System, inverse: Inverse) -> bool:
    """Return whether an inverse solves the equation of the expected number of steps, which are less than 1e11, or about."""
    ones = np.ones(system.nodes)
    steps = inverse(ones)
    if not np.isfinite(steps).all():
        return False
    return bool(steps.max() < FEW_STEPS) or bool(np.abs(drift(system, steps, cost=ones, one=0.0)[0]).max() < SETTLED)


def _matrix(system: System) -> Floats:
    """Return D⁻¹ P' as a dense matrix, ``[n, n]``."""
    n, own = system.nodes, system.branch_node
    inner = (system.target < n) & (system.target != own)
    where = own[inner] * n + system.target[inner]
    entries = system.probability[inner] / system.leave[own[inner]]
    dense: Floats = np.bincount(where, weights=entries, minlength=n * n).astype(np.float64).reshape(n, n)
    return dense


def _dense(system: System) -> Inverse | None:
    """Return the dense inverse."""
    try:
        inverse = np.linalg.inv(np.eye(system.nodes) - _matrix(system))
    except np.linalg.LinAlgError:
        return None
    leave = system.leave
    return lambda right: inverse @ (right / leave)


def _dense_elimination(system: System) -> Inverse | None:
    """Return the inverse by elimination without subtraction: Σ of the other entries of a row takes the diagonal's place."""
    n, leave = system.nodes, system.leave
    ends = np.where(system.target >= n, system.probability, 0.0)
    out = np.add.reduceat(ends, system.row_to_branches[:-1]) / leave
    inner = _matrix(system)
    right = np.eye(n)
    for k in range(n):
        inner[k, k] = 0.0
        kept = inner[k].sum() + out[k]
        if not kept > 0.0:
            return None
        inner[k] /= kept
        out[k] /= kept
        right[k] /= kept
        column = inner[:, k].copy()
        column[k] = 0.0
        moved = np.flatnonzero(column)
        inner[moved] += column[moved, None] * inner[k]
        out[moved] += column[moved] * out[k]
        right[moved] += column[moved, None] * right[k]
        inner[moved, k] = 0.0
    return lambda values: right @ (values / leave)
