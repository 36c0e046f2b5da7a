"""A large system with one row per node enters, an approximate inverse leaves: elimination without subtraction, sparse LU, Krylov.

I - Q, with Q the rows of the system without their loops, each divided by its probability to leave its node, is an M-matrix
whose rows sum to what goes to the sinks. Three ways to solve with it:

* *Elimination without subtraction*: the diagonal is never stored but is the sum of the rest of its row and of what leaves, so that
  nothing cancels and every entry of the inverse keeps its relative accuracy, however slowly the chain leaves (Grassmann, Taksar,
  Heyman 1985; O'Cinneide 1993). It goes strong component by strong component, each after those it leads to: only inside
  them can factors fill, and most chains of policies have small ones. Inside, it follows the minimum degree order that SuperLU finds,
  nodes with very many branches last.
* *Sparse LU* (SuperLU, minimum degree on A + Aᵀ, diagonal pivots): needs nothing compiled, and is enough where chains leave in less
  than 1e11 steps or so; refinement wins back the digits it loses.
* *BiCGSTAB*, preconditioned by a Gauss-Seidel sweep from the sinks outward, where factors would fill: graphs without small
  separators, which mix fast.

Whether factors would fill is estimated by counting those of the order by breadth-first levels from the sinks, which costs no
more than the limit allows.

References
----------
W. K. Grassmann, M. I. Taksar, D. P. Heyman, Regenerative Analysis and Steady State Distributions for Markov Chains,
Oper. Res. 33(5), 1985.  C. A. O'Cinneide, Entrywise perturbation theory and error analysis for Markov chains, Numer. Math. 65,
1993.  J. W. H. Liu, The role of elimination trees in sparse factorization, SIAM J. Matrix Anal. Appl. 11(1), 1990.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model._kernels import compiled, strong_components
from ratherthan.model.mdp import Bools, Floats
from ratherthan.solve._kernels import Rows, eliminate, elimination_tree, fill_of, substitute, sweep
from ratherthan.solve.system import System

if TYPE_CHECKING:
    from scipy.sparse import coo_array, csc_array

__all__ = ["elimination", "fills", "krylov", "sparse_lu"]

Inverse = Callable[[Floats], Floats]
Nodes = npt.NDArray[np.int64]

MOST_FILL = 600
"""Entries per row that factors in the order of levels may have to be tried first."""
MOST_FILL_IN_ALL = 3_000_000
"""Up to how many entries they may have in any case: a dense block of so many takes a second or so."""
HUB = 20.0
"""How many times the mean number of branches make a node a hub."""
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
    n, leave, component = system.nodes, system.leave, _components(system)
    order = _order(system, component)
    if order is None:
        return None
    position = np.empty(n, dtype=np.int64)
    position[order] = np.arange(n)
    inner = _inner(system).tocsr()[order][:, order].tocoo()
    block = component[order]
    inside = block[inner.row] == block[inner.col]
    pattern = _symmetric(inner.row[inside], inner.col[inside], n)
    work = len(system.target)
    parent = compiled(elimination_tree, work)(*pattern)
    fill = compiled(fill_of, work)(*pattern, parent, np.iinfo(np.int64).max)
    near, far = _rows(inner, inside, n), _rows(inner, ~inside, n)
    ends = np.where(system.target >= n, system.probability, 0.0)
    out = (np.add.reduceat(ends, system.row_to_branches[:-1]) / leave)[order]
    out += np.bincount(inner.row[~inside], weights=inner.data[~inside], minlength=n)
    factors = compiled(eliminate, work)(*pattern, parent, near, out, fill)
    if not (factors.kept > 0.0).all():
        return None
    blocks = np.concatenate([[0], np.flatnonzero(np.diff(block)) + 1, [n]])
    solve = compiled(substitute, work)
    return lambda right: solve(blocks, factors, far, (right / leave)[order])[position]


def _components(system: System) -> Nodes:
    """Return the strong component of each node, numbered after those it leads to, ``[n]``."""
    index, n = system.index, system.nodes
    inside = np.arange(index.states) < n
    component = np.full(index.states, -1, dtype=np.int64)
    every = np.ones(system.rows, dtype=np.bool_)
    compiled(strong_components, index.work)(
        index.state_to_choices,
        index.choice_to_branches,
        index.branch_to_target,
        every,
        np.arange(n),
        inside,
        component,
        0,
    )
    return component[:n]


def _order(system: System, component: Nodes) -> Nodes | None:
    """Return the nodes in the order of elimination, ``[n]``; None where factors would fill."""
    from scipy.sparse import coo_array, eye_array
    from scipy.sparse.linalg import splu

    n, own = system.nodes, system.branch_node
    inner = (system.target < n) & (system.target != own)
    inner[inner] = component[own[inner]] == component[system.target[inner]]
    rows, columns = own[inner], system.target[inner]
    degree = np.bincount(rows, minlength=n) + np.bincount(columns, minlength=n)
    hub = degree > max(HUB, HUB * float(degree.mean()))
    rank = np.where(hub, n, 0)
    knotted = np.flatnonzero((degree > 0) & ~hub)
    if len(knotted):
        number = np.full(n, -1)
        number[knotted] = np.arange(len(knotted))
        kept = ~hub[rows] & ~hub[columns]
        one, other = number[rows[kept]], number[columns[kept]]
        if fills(-_levels(system)[knotted], one, other):
            return None
        shape = (len(knotted), len(knotted))
        matrix = 2.0 * eye_array(len(knotted)) - coo_array((system.probability[inner][kept], (one, other)), shape=shape)
        minimum_degree = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        rank[knotted] = minimum_degree.perm_c
    order: Nodes = np.lexsort((rank, component))
    return order


def fills(level: Nodes, rows: Nodes, columns: Nodes) -> bool:
    """Return whether the factors of a pattern would fill, by the order of `level`.

    Parameters
    ----------
    level : array of int, ``[n]``
    rows, columns : array of int
        Where the entries are.
    """
    n = len(level)
    position = np.empty(n, dtype=np.int64)
    position[np.argsort(level, kind="stable")] = np.arange(n)
    pattern = _symmetric(position[rows], position[columns], n)
    parent = compiled(elimination_tree, len(rows))(*pattern)
    most = max(MOST_FILL * n, MOST_FILL_IN_ALL)
    return compiled(fill_of, len(rows))(*pattern, parent, most) > most


def _symmetric(rows: Nodes, columns: Nodes, n: int) -> tuple[Nodes, Nodes]:
    """Return the rows of the symmetric pattern with entries at (rows, columns) and (columns, rows)."""
    from scipy.sparse import coo_array

    where = (np.concatenate([rows, columns]), np.concatenate([columns, rows]))
    both = coo_array((np.ones(len(where[0])), where), shape=(n, n)).tocsr()
    return both.indptr.astype(np.int64), both.indices.astype(np.int64)


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
