"""A large system with one row per node enters, an approximate inverse leaves: elimination without subtraction, sparse LU, Krylov.

I - Q, with Q the rows of the system without their loops, each divided by its probability to leave its node, is an M-matrix
whose rows sum to what goes to the sinks. Three ways to solve with it:

* *Elimination without subtraction* (`eliminating`): every entry of the inverse keeps its relative accuracy, however slowly the
  chain leaves.
* *Sparse LU* (SuperLU, minimum degree on A + Aᵀ, diagonal pivots): needs nothing compiled, and is enough where chains leave in less
  than 1e11 steps or so; refinement wins back the digits it loses.
* *BiCGSTAB*, preconditioned by a Gauss-Seidel sweep from the sinks outward, where factors would fill: graphs without small
  separators, which mix fast.

References
----------
H. A. van der Vorst, Bi-CGSTAB, SIAM J. Sci. Stat. Comput. 13(2), 1992.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import Bools, Floats
from ratherthan.solve._kernels import Rows, sweep
from ratherthan.solve.system import System

if TYPE_CHECKING:
    from scipy.sparse import coo_array, csc_array

__all__ = ["elimination", "krylov", "sparse_lu"]

Inverse = Callable[[Floats], Floats]
Nodes = npt.NDArray[np.int64]

MOST_ITERATIONS = 400
RESIDUAL = 1e-10


def _inner(system: System) -> csc_array[Any]:
    """Return Q, ``[n, n]``."""
    from scipy.sparse import coo_array

    n, own = system.nodes, system.branch_node
    inner = (system.target < n) & (system.target != own)
    entries = system.probability[inner] / system.leave[own[inner]]
    return coo_array((entries, (own[inner], system.target[inner])), shape=(n, n)).tocsc()


def sparse_lu(system: System) -> Inverse | None:
    """Return the inverse by sparse LU, None where it fails."""
    from scipy.sparse import eye_array
    from scipy.sparse.linalg import splu

    matrix = (eye_array(system.nodes, format="csc") - _inner(system)).tocsc()
    try:
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except (RuntimeError, MemoryError):
        return None
    leave = system.leave
    return lambda right: factors.solve(right / leave)


def elimination(system: System) -> Inverse | None:
    """Return the inverse by elimination without subtraction, None where its factors would fill or a row cannot be left."""
    from ratherthan.solve.eliminating import Factored

    equations = Factored(system)
    return equations.solve if equations.follow(np.arange(system.nodes)) else None


def _rows(matrix: coo_array[Any], chosen: Bools, n: int) -> Rows:
    """Return the compressed rows of some entries of a matrix."""
    from scipy.sparse import coo_array

    entries = (matrix.data[chosen], (matrix.row[chosen], matrix.col[chosen]))
    rows = coo_array(entries, shape=(n, n)).tocsr()
    return Rows(rows.indptr.astype(np.int64), rows.indices.astype(np.int64), rows.data)


def krylov(system: System) -> Inverse | None:
    """Return the inverse by BiCGSTAB after a Gauss-Seidel sweep; it answers with NaN where it does not converge."""
    from scipy.sparse import eye_array
    from scipy.sparse.linalg import LinearOperator, bicgstab

    n, leave, order = system.nodes, system.leave, np.argsort(_levels(system), kind="stable")
    inner = _inner(system).tocsr()[order][:, order].tocoo()
    lower = _rows(inner, inner.row > inner.col, n)
    swept = compiled(sweep, len(system.target))
    before = LinearOperator((n, n), lambda right: swept(lower, right.ravel()), dtype=np.float64)
    matrix = (eye_array(n) - inner).tocsr()

    def inverse(right: Floats) -> Floats:
        scaled, found = (right / leave)[order], np.zeros(n)
        size = float(np.abs(scaled).max())  # BiCGSTAB takes small numbers for a breakdown
        if size == 0.0:
            return found
        with np.errstate(all="ignore"):  # where it breaks down, the answer is not finite, and that is seen
            unit, failed = bicgstab(matrix, scaled / size, rtol=RESIDUAL, atol=0.0, maxiter=MOST_ITERATIONS, M=before)
        found[order] = size * unit
        return np.full(n, np.nan) if failed else found

    return inverse


def _levels(system: System) -> Nodes:
    """Return how many branches each node is from a sink, ``[n]``."""
    index, n = system.index, system.nodes
    sinks = np.arange(index.states) >= n
    return graph.levels_to(index, sinks, ~sinks)[:n]
