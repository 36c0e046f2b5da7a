"""A Field whose sweeps came to no end enters; its values leave corrected by policy iteration with roughly solved equations.

One round: greedy rows π; x ← x + y with (I - P_π) y = the drift of x along π, about; a few sweeps. y is found by BiCGSTAB with a
Gauss-Seidel sweep in front, and only as good as it must be: to a hundredth of the residual of Tx - x, as a fine solve for coarse
rows is wasted (inexact policy iteration). It suits what mixes: random walks, expanders. Where the equations of a policy can be
eliminated without much fill, that is left to policy iteration with exact solves (`eliminable`), which begins where sweeps ended.

Where the rows of a policy lead to no sink its equations are singular: such rows are replaced first, by ones towards where sinks are
reached (`repaired`).

It ends when the residual is as small as wanted, and gives up when an equation is not solved in 600 steps, or twelve rounds did not halve the residual.

References
----------
D. P. Bertsekas, J. N. Tsitsiklis, An Analysis of Stochastic Shortest Path Problems, Math. Oper. Res. 16(3), 1991.
H. A. van der Vorst, Bi-CGSTAB, SIAM J. Sci. Stat. Comput. 13(2), 1992.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model._kernels import LEAST_WORK, compiled
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look
from ratherthan.solve import _kernels as shared
from ratherthan.solve.contracting.field import Field, residual_of, swept_whole
from ratherthan.solve.system import System

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["corrected", "repaired"]

Nodes = npt.NDArray[np.int64]

MOST_ROUNDS = 60
MOST_ITERATIONS = 600
MOST_VAIN = 12
SWEEPS = 1


def corrected(field: Field, wanted: float, *, unit: float, rows: Nodes | None = None) -> bool:
    """Correct the values of a field until the residual is at most `wanted`; return whether it is.

    Parameters
    ----------
    field : Field
        Its values are improved.
    wanted : float
    unit : float
        What a step costs, about: solves are at least as good as a tenth of it.
    rows : array of int, ``[n]``, optional
        With which rows of the system to begin; by default the greedy ones.
    """
    residual, best, vain = residual_of(field), np.inf, 0
    if rows is not None:
        field.values[:-2], residual = 0.0, np.inf
        _take(field, np.arange(len(field.order)), rows)
    for number in range(1, MOST_ROUNDS + 1):
        if residual <= wanted or np.isnan(residual) or vain > MOST_VAIN:
            break
        look(f"policy iteration with rough solves, round {number}: residual {residual:.1e}")
        look()
        _repair(field)
        if not _moved(field, max(0.1 * wanted, min(0.1 * unit, 0.01 * residual))):
            return False
        swept_whole(field, SWEEPS)
        residual = residual_of(field)
        vain = 0 if residual <= 0.5 * best else vain + 1
        best = min(best, residual)
    return bool(residual <= wanted)


def _moved(field: Field, tolerance: float) -> bool:
    """Move the values by a solution of their drift along the rows taken; return whether one was found."""
    n, matrix = len(field.order), _matrix(field)
    right = field.rows.cost[field.taken] + matrix @ field.values - field.values[:n]
    if not np.isfinite(right).all():
        return False
    step = _by_krylov(matrix[:, :n], right, tolerance)
    if step is None or not np.isfinite(step).all():
        return False
    field.values[:n] += step
    return True


def _matrix(field: Field) -> csr_array[Any]:
    """Return P of the rows taken, by place, ``[n, n+2]``."""
    from scipy.sparse import csr_array

    n, rows = len(field.order), field.rows
    begin, end = rows.row_to_branches[field.taken], rows.row_to_branches[field.taken + 1]
    offsets = np.concatenate([[0], np.cumsum(end - begin)])
    picked = np.arange(offsets[-1]) + np.repeat(begin - offsets[:-1], end - begin)
    return csr_array((rows.probability[picked], rows.target[picked], offsets), shape=(n, n + 2))


def _by_krylov(inner: csr_array[Any], right: Floats, tolerance: float) -> Floats | None:
    """Return y with (I - P) y = right, up to `tolerance`, by BiCGSTAB; None where it does not converge."""
    from scipy.sparse import eye_array
    from scipy.sparse.linalg import LinearOperator, bicgstab

    n, size = len(right), float(np.abs(right).max())
    if size == 0.0:
        return np.zeros(n)
    own = np.repeat(np.arange(n), np.diff(inner.indptr))
    below = inner.indices < own
    begin = np.concatenate([[0], np.cumsum(np.bincount(own[below], minlength=n))])
    lower = shared.Rows(begin, inner.indices[below].astype(np.int64), inner.data[below])
    sweep = compiled(shared.sweep, max(inner.nnz, LEAST_WORK))
    with np.errstate(all="ignore"):  # where it breaks down, the answer is not finite, and that is seen
        step, failed = bicgstab(
            eye_array(n, format="csr") - inner,
            right / size,
            rtol=0.0,
            atol=max(tolerance / size, 1e-14),
            maxiter=MOST_ITERATIONS,
            M=LinearOperator((n, n), lambda rest: sweep(lower, rest.ravel()), dtype=np.float64),
            callback=lambda _: look(),
        )
    return None if failed else size * step


def _repair(field: Field) -> None:
    """Take other rows where those taken lead to no sink."""
    rows = field.rows_taken()
    other = repaired(field.system, rows)
    _take(field, np.flatnonzero((other != rows)[field.order]), other)


def _take(field: Field, places: Nodes, rows: Nodes) -> None:
    """Take other rows of the system at some places."""
    nodes = field.order[places]
    field.taken[places] = field.rows.node_to_rows[places] + rows[nodes] - field.system.node_to_rows[nodes]


def repaired(system: System, rows: Nodes) -> Nodes:
    """Return rows that lead to the sinks from every node, those given wherever they do, ``[n]``.

    Parameters
    ----------
    system : System
    rows : array of int, ``[n]``
    """
    index, n = system.index, system.nodes
    sinks = np.arange(index.states) >= n
    taken = np.zeros(system.rows, dtype=np.bool_)
    taken[rows] = True
    arrives = graph.can_reach(index, sinks, ~sinks, taken)
    if arrives.all():
        return rows
    every = np.ones(system.rows, dtype=np.bool_)
    down = graph.first_downhill(index, graph.levels_to(index, arrives, ~sinks), every)[:n]
    found: Nodes = np.where(arrives[:n], rows, down)
    return found
