"""A system and one row per node enter, again and again with some rows changed; what solves their equations leaves.

The graph of one policy falls into strong components, most of them small, also where the graph of all choices is one component:
a policy seldom leads back. I - Q is eliminated without subtraction component by component (`sparse` has the reasons and the
references), and a component's factors depend on nothing but the rows of its own nodes. So from one policy to the next only
those components are eliminated again in which a row changed, or that fell apart or grew together. In policy iteration that
is nearly all of the work in the first rounds, and hardly any in the last ones.

Inside a component the order is that of minimum degree on the symmetric pattern (of SuperLU); nodes with very many branches, such as
a collapsed end component that lies along a whole map, go last, where they fill one row and one column.

It gives up where the factors of a component would fill: graphs without small separators, which sweeps and Krylov methods solve.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled, strong_components
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look
from ratherthan.solve._kernels import Rows, eliminate, elimination_tree, fill_of
from ratherthan.solve.system import System, rows_of
from ratherthan.solve.trapped._kernels import Pool, same_components, substitute_nodes

__all__ = ["Factored"]

Nodes = npt.NDArray[np.int64]

MOST_FILL = 150
"""Entries per row that factors may have."""
LEAST_FILL = 3_000_000
"""Up to how many entries they may have in any case."""
MOST_LEVEL_FILL = 4_000
"""Entries per row that they may have in the order of levels, which is by far not the best, to be tried at all."""
HUB = 20.0
"""How many times the mean number of branches make a node a hub."""
WASTE = 3
"""How many times the live factors the arrays may hold before all are made anew."""


class Factored:
    """The equations of one row per node of a system, factored.

    Parameters
    ----------
    system : System
        None of whose nodes a policy stays at for ever.
    level : array of int, ``[n]``
        How many branches each node is from a sink.
    """

    def __init__(self, system: System, level: Nodes) -> None:
        n = system.nodes
        self.system, self.level, self.work = system, level, len(system.target)
        self.rows = np.full(n, -1, dtype=np.int64)
        self.chain: System | None = None
        self.component = np.arange(n)
        self.rank = np.zeros(n, dtype=np.int64)
        self.eliminated = 0
        self._empty()

    def _empty(self) -> None:
        """Forget all factors."""
        n = self.system.nodes
        nowhere = np.zeros(0, dtype=np.int64)
        self.pool = Pool(
            low_from=np.zeros(n, dtype=np.int64),
            low_end=np.zeros(n, dtype=np.int64),
            low_to=nowhere,
            low=np.zeros(0),
            high_from=np.zeros(n, dtype=np.int64),
            high_end=np.zeros(n, dtype=np.int64),
            high_to=nowhere,
            high=np.zeros(0),
            kept=np.ones(n),
        )
        self.rows = np.full(n, -1, dtype=np.int64)

    def follow(self, rows: Nodes) -> bool:
        """Take `rows`, the row of each node, and say whether their equations could be factored.

        Parameters
        ----------
        rows : array of int, ``[n]``
        """
        look()
        system, n = self.system, self.system.nodes
        chain = rows_of(system, rows)
        share: Floats = (
            np.where(chain.target != chain.branch_node, chain.probability, 0.0) / chain.leave[chain.branch_node]
        )
        component = _components(chain, self.work)
        live = int((self.pool.low_end - self.pool.low_from).sum() + (self.pool.high_end - self.pool.high_from).sum())
        if len(self.pool.low) + len(self.pool.high) > max(WASTE * live, LEAST_FILL):
            self._empty()
        if self.chain is None or (self.rows == -1).all():
            anew = np.ones(n, dtype=np.bool_)
        else:
            same = compiled(same_components, self.work)(self.component, component, rows != self.rows)
            anew = ~same[component]
        self.chain, self.component, self.rows = chain, component, rows
        self._matrix = (chain.row_to_branches, chain.target, share)
        if anew.any() and not self._eliminated(np.flatnonzero(anew), share):
            return False
        sequence = np.lexsort((self.rank, component))
        sizes = np.bincount(component)
        self._sequence = sequence, np.concatenate([[0], np.cumsum(sizes)])
        return True

    def solve(self, right: Floats) -> Floats:
        """Return x = right + P x along the rows that are followed, ``[n]``."""
        assert self.chain is not None
        kernel = compiled(substitute_nodes, self.work)
        found: Floats = kernel(
            *self._sequence,
            self.component,
            self._matrix,
            self.pool,
            np.asarray(right, dtype=np.float64) / self.chain.leave,
        )
        return found

    def _eliminated(self, nodes: Nodes, share: Floats) -> bool:
        """Eliminate the components that `nodes` consist of, and keep the factors; return whether that went well."""
        chain, component, n = self.chain, self.component, self.system.nodes
        assert chain is not None
        self.eliminated += len(nodes)
        chosen = np.zeros(n, dtype=np.bool_)
        chosen[nodes] = True
        own = chain.branch_node
        inner = chosen[own] & (chain.target < n) & (chain.target != own)
        inner[inner] = component[own[inner]] == component[chain.target[inner]]
        out: Floats = np.bincount(own, weights=np.where(inner, 0.0, share), minlength=n).astype(np.float64)
        self.pool.low_end[nodes] = self.pool.low_from[nodes]
        self.pool.high_end[nodes] = self.pool.high_from[nodes]
        self.pool.kept[nodes] = out[nodes]  # right where nothing else of the component is led to: its rows sum to 1
        self.rank[nodes] = 0
        knotted = np.zeros(n, dtype=np.bool_)
        knotted[own[inner]] = True
        within = np.flatnonzero(knotted)
        if not len(within):
            return True
        number = np.full(n, -1)
        number[within] = np.arange(len(within))
        rows, columns = number[own[inner]], number[chain.target[inner]]
        entry: Floats = share[inner]
        rank = _minimum_degree(rows, columns, self.level[within], self.work)
        if rank is None:
            return False
        order = np.lexsort((rank, component[within]))
        return self._kept(within[order], (rows, columns, entry), order, out)

    def _kept(self, nodes: Nodes, entries: tuple[Nodes, Nodes, Floats], order: Nodes, out: Floats) -> bool:
        """Factor the entries inside components, of which `nodes` are the nodes in order, and keep what comes of it."""
        m = len(nodes)
        place = np.empty(m, dtype=np.int64)
        place[order] = np.arange(m)
        rows, columns = place[entries[0]], place[entries[1]]
        pattern = symmetric_pattern(rows, columns, m)
        parent = compiled(elimination_tree, self.work)(*pattern)
        most = max(MOST_FILL * m, LEAST_FILL)
        fill = compiled(fill_of, self.work)(*pattern, parent, most)
        if fill > most:
            return False
        look()
        factors = compiled(eliminate, self.work)(
            *pattern, parent, _compressed(rows, columns, entries[2], m), out[nodes], fill
        )
        if not (factors.kept > 0.0).all():
            return False
        self.rank[nodes] = np.arange(m)
        pool = self.pool
        lows, highs = int(factors.low_from[-1]), int(factors.high_from[-1])
        pool.low_from[nodes], pool.low_end[nodes] = (part + len(pool.low) for part in _edges(factors.low_from))
        pool.high_from[nodes], pool.high_end[nodes] = (part + len(pool.high) for part in _edges(factors.high_from))
        pool.kept[nodes] = factors.kept
        self.pool = pool._replace(
            low_to=np.concatenate([pool.low_to, nodes[factors.low_to[:lows]]]),
            low=np.concatenate([pool.low, factors.low[:lows]]),
            high_to=np.concatenate([pool.high_to, nodes[factors.high_to[:highs]]]),
            high=np.concatenate([pool.high, factors.high[:highs]]),
        )
        return True


def _edges(offsets: Nodes) -> tuple[Nodes, Nodes]:
    """Return where each row begins and ends."""
    return offsets[:-1], offsets[1:]


def _components(chain: System, work: int) -> Nodes:
    """Return the strong component of each node, numbered after those it leads to, ``[n]``."""
    n = chain.nodes
    inside = np.ones(n + 2, dtype=np.bool_)
    inside[n:] = False
    component = np.full(n + 2, -1, dtype=np.int64)
    begin = np.concatenate([np.arange(n + 1), [n, n]])
    kernel = compiled(strong_components, work)
    kernel(
        begin,
        chain.row_to_branches,
        chain.target,
        np.ones(n, dtype=np.bool_),
        np.arange(n),
        inside,
        component,
        0,
    )
    return component[:n]


def _minimum_degree(rows: Nodes, columns: Nodes, level: Nodes, work: int) -> Nodes | None:
    """Return the rank of each variable in the elimination of a pattern, hubs last; None where factors would fill."""
    from scipy.sparse import coo_array, eye_array
    from scipy.sparse.linalg import splu

    m = len(level)
    degree = np.bincount(rows, minlength=m) + np.bincount(columns, minlength=m)
    hub = degree > max(HUB, HUB * float(degree.mean()))
    rank = np.where(hub, m, 0)
    plain = np.flatnonzero(~hub)
    number = np.full(m, -1)
    number[plain] = np.arange(len(plain))
    kept = ~hub[rows] & ~hub[columns]
    one, other = number[rows[kept]], number[columns[kept]]
    if not len(one):
        return rank
    if _fills(-level[plain], one, other, work):
        return None
    shape = (len(plain), len(plain))
    matrix = 8.0 * eye_array(len(plain)) - coo_array((np.full(len(one), 0.001), (one, other)), shape=shape)
    found = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    rank[plain] = found.perm_c
    return rank


def _fills(level: Nodes, rows: Nodes, columns: Nodes, work: int) -> bool:
    """Return whether the factors of a pattern would fill by far, by the order of `level`."""
    m = len(level)
    place = np.empty(m, dtype=np.int64)
    place[np.argsort(level, kind="stable")] = np.arange(m)
    pattern = symmetric_pattern(place[rows], place[columns], m)
    parent = compiled(elimination_tree, work)(*pattern)
    most = max(MOST_LEVEL_FILL * m, 10_000_000)
    return compiled(fill_of, work)(*pattern, parent, most) > most


def symmetric_pattern(rows: Nodes, columns: Nodes, n: int) -> tuple[Nodes, Nodes]:
    """Return the rows of the symmetric pattern with entries at (rows, columns) and (columns, rows)."""
    made = _compressed(np.concatenate([rows, columns]), np.concatenate([columns, rows]), np.ones(2 * len(rows)), n)
    return made.begin, made.column


def _compressed(rows: Nodes, columns: Nodes, entries: Floats, n: int) -> Rows:
    """Return the compressed rows of a matrix."""
    from scipy.sparse import coo_array

    made: Any = coo_array((entries, (rows, columns)), shape=(n, n)).tocsr()
    return Rows(made.indptr.astype(np.int64), made.indices.astype(np.int64), made.data)
