"""Where a matrix has entries enters; an order to eliminate its variables in leaves, with the fill of its factors, if that is small.

Inside a component that of Cuthill and McKee, reversed, if it fills little, else that of minimum degree on the symmetric pattern
(of SuperLU). Variables with very many entries, such as a collapsed end component that lies along a whole map, go last, where they
fill one row and one column. Factors are counted before they are made (Liu 1990).

References
----------
A. George, J. W. H. Liu, Computer Solution of Large Sparse Positive Definite Systems, Prentice-Hall, 1981.
J. W. H. Liu, The role of elimination trees in sparse factorization, SIAM J. Matrix Anal. Appl. 11(1), 1990.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled
from ratherthan.model.watch import look
from ratherthan.solve.eliminating._kernels import elimination_tree, fill_of, symmetric_rows

__all__ = ["LEAST_FILL", "Order", "by_component", "ordered"]

Nodes = npt.NDArray[np.int64]

LITTLE_FILL = 4
"""Entries per row up to which no better order is looked for."""
MOST_FILL = 150
"""Entries per row that factors may have."""
MOST_FIRST_FILL = 600
"""Entries per row that they may have in the first order, which is not the best, for another one to be tried."""
LEAST_FILL = 3_000_000
"""Up to how many entries they may have in any case: a dense block of so many takes a second or so."""
HUB = 20.0
"""How many times the mean number of branches make a node a hub."""


class Order(NamedTuple):
    """An order of elimination: the variable at each place, the place of each, the pattern in that order, and its fill."""

    order: Nodes
    place: Nodes
    pattern: tuple[Nodes, Nodes, Nodes]  # row_from, columns, parent
    fill: int


def ordered(rows: Nodes, columns: Nodes, component: Nodes, work: int) -> Order | None:
    """Return an order of elimination, component by component and hubs last; None where factors would fill."""
    m = len(component)
    degree = np.bincount(rows, minlength=m) + np.bincount(columns, minlength=m)
    hub = degree > max(HUB, HUB * float(degree.mean()))
    rank = np.where(hub, m, 0)
    plain = np.flatnonzero(~hub)
    number = np.full(m, -1)
    number[plain] = np.arange(len(plain))
    kept = ~hub[rows] & ~hub[columns]
    one, other = number[rows[kept]], number[columns[kept]]
    if len(one):
        rank[plain] = _cuthill_mckee(one, other, len(plain), work)
    first = _placed(rows, columns, by_component(component, rank), max(MOST_FIRST_FILL * m, LEAST_FILL), work)
    if first is None or first.fill <= LITTLE_FILL * m or not len(one):
        return first
    look()
    rank[plain] = _minimum_degree(one, other, len(plain))
    most = max(MOST_FILL * m, LEAST_FILL)
    best = _placed(rows, columns, by_component(component, rank), min(most, first.fill), work)
    if best is None and first.fill <= most:
        return first
    return best


def _placed(rows: Nodes, columns: Nodes, order: Nodes, most: int, work: int) -> Order | None:
    """Return an order with its pattern and how many entries factors have; None where these are more than `most`."""
    m = len(order)
    place = np.empty(m, dtype=np.int64)
    place[order] = np.arange(m)
    pattern = compiled(symmetric_rows, work)(place[rows], place[columns], m)
    parent = compiled(elimination_tree, work)(*pattern)
    fill = compiled(fill_of, work)(*pattern, parent, most)
    return None if fill > most else Order(order, place, (*pattern, parent), fill)


def _cuthill_mckee(rows: Nodes, columns: Nodes, n: int, work: int) -> Nodes:
    """Return the rank of each variable in the reversed order of Cuthill and McKee."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    begin, where = compiled(symmetric_rows, work)(rows, columns, n)
    pattern: Any = csr_array(
        (np.ones(len(where), dtype=np.int8), where.astype(np.int32), begin.astype(np.int32)), shape=(n, n)
    )
    rank = np.empty(n, dtype=np.int64)
    rank[reverse_cuthill_mckee(pattern, symmetric_mode=True)] = np.arange(n)
    return rank


def _minimum_degree(rows: Nodes, columns: Nodes, n: int) -> Nodes:
    """Return the rank of each variable in an order of minimum degree, SuperLU's; of its factors nothing is wanted, nor kept."""
    from scipy.sparse import coo_array, eye_array
    from scipy.sparse.linalg import spilu

    matrix = 8.0 * eye_array(n) - coo_array((np.full(len(rows), 0.001), (rows, columns)), shape=(n, n))
    found = spilu(
        matrix.tocsc(),
        drop_tol=1.0,
        fill_factor=1.0,
        drop_rule="basic",
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    rank: Nodes = found.perm_c.astype(np.int64)
    return rank


def by_component(component: Nodes, rank: Nodes) -> Nodes:
    """Return the variables by component, those of one by rank."""
    order: Nodes = np.lexsort((rank, component))
    return order
