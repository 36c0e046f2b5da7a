"""A system and one row per node enter, again and again with some rows changed; what solves their equations leaves.

I - Q, with Q the rows without their loops, each divided by its probability to leave its node, is an M-matrix whose rows sum to what goes
to the sinks. Its diagonal is never stored but is the sum of the rest of its row and of what leaves, so that nothing cancels and
every entry of the inverse keeps its relative accuracy, however slowly the chain leaves (Grassmann, Taksar and Heyman 1985; O'Cinneide
1993).

The graph of one policy falls into strong components, most of them small, also where the graph of all choices is one component:
a policy seldom leads back. They are eliminated one by one, each after those it leads to, and a component's factors depend on
nothing but the rows of its own nodes. So from one policy to the next only those components are eliminated again in which a row
changed, or that fell apart or grew together. In policy iteration that is nearly all of the work in the first rounds, and hardly
any in the last ones.

**Giving up.** Factors are counted before they are made (`ordering`). Where they are too many, nothing is eliminated: graphs without
small separators, which sweeps and Krylov methods solve. Elimination itself goes slice by slice, between which limits are looked at,
and ends after so many steps.

References
----------
W. K. Grassmann, M. I. Taksar, D. P. Heyman, Regenerative Analysis and Steady State Distributions for Markov Chains,
Oper. Res. 33(5), 1985.  C. A. O'Cinneide, Entrywise perturbation theory and error analysis for Markov chains, Numer. Math. 65,
1993.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled, strong_components
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look
from ratherthan.solve.eliminating._kernels import (
    Factors,
    Pool,
    Rows,
    Scratch,
    eliminate_rows,
    same_components,
    substitute_nodes,
)
from ratherthan.solve.eliminating.ordering import LEAST_FILL, Order, by_component, ordered
from ratherthan.solve.system import System, rows_of

__all__ = ["Factored"]

Nodes = npt.NDArray[np.int64]

WASTE = 3
"""How many times the live factors the arrays may hold before all are made anew."""
SLICE = 100_000_000
"""Steps of elimination between two looks, some tenths of a second."""
MOST_STEPS = 5_000_000_000
"""Steps after which elimination is given up, some ten seconds."""


class Factored:
    """The equations of one row per node of a system, factored.

    Parameters
    ----------
    system : System
        None of whose nodes a policy stays at for ever.
    """

    def __init__(self, system: System) -> None:
        n = system.nodes
        self.system, self.work = system, len(system.target)
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
        if self.chain is not None and np.array_equal(rows, self.rows):
            return True
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
            self._empty()
            return False
        sizes = np.bincount(component)
        self._sequence = by_component(component, self.rank), np.concatenate([[0], np.cumsum(sizes)])
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
        found = ordered(rows, columns, component[within], self.work)
        return found is not None and self._kept(within[found.order], (rows, columns, entry), found, out)

    def _kept(self, nodes: Nodes, entries: tuple[Nodes, Nodes, Floats], found: Order, out: Floats) -> bool:
        """Factor the entries inside components, of which `nodes` are the nodes in order, and keep what comes of it."""
        rows, columns = found.place[entries[0]], found.place[entries[1]]
        factors = _factors(found, _compressed(rows, columns, entries[2], len(nodes)), out[nodes], self.work)
        if factors is None:
            return False
        self.rank[nodes] = np.arange(len(nodes))
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


def _factors(found: Order, near: Rows, out: Floats, work: int) -> Factors | None:
    """Return the factors of some entries in an order, None where a row cannot be left or there is too much to do."""
    m = len(out)
    factors = Factors(
        low_from=np.zeros(m + 1, dtype=np.int64),
        low_to=np.zeros(found.fill, dtype=np.int64),
        low=np.zeros(found.fill),
        high_from=np.zeros(m + 1, dtype=np.int64),
        high_to=np.zeros(found.fill, dtype=np.int64),
        high=np.zeros(found.fill),
        kept=np.zeros(m),
    )
    scratch = Scratch(np.zeros(m), _none(m), _none(m), np.zeros(m, dtype=np.int64), np.zeros(m, dtype=np.int64))
    at, steps, kernel = np.zeros(3, dtype=np.int64), 0, compiled(eliminate_rows, work)
    while at[0] < m:
        look()
        if steps > MOST_STEPS:
            return None
        steps += kernel(found.pattern, near, out, factors, scratch, at, SLICE)
    return factors if (factors.kept > 0.0).all() else None


def _none(n: int) -> Nodes:
    """Return -1, n times."""
    return np.full(n, -1, dtype=np.int64)


def _edges(offsets: Nodes) -> tuple[Nodes, Nodes]:
    """Return where each row begins and ends."""
    return offsets[:-1], offsets[1:]


def _components(chain: System, work: int) -> Nodes:
    """Return the strong component of each node, numbered after those it leads to, ``[n]``."""
    n = chain.nodes
    inside = np.ones(n + 2, dtype=np.bool_)
    inside[n:] = False
    component = np.full(n + 2, -1, dtype=np.int64)
    ends = np.array([n, n])
    compiled(strong_components, work)(
        np.concatenate([chain.node_to_rows, ends]),
        chain.row_to_branches,
        chain.target,
        np.ones(n, dtype=np.bool_),
        np.arange(n),
        inside,
        component,
        0,
    )
    return component[:n]


def _compressed(rows: Nodes, columns: Nodes, entries: Floats, n: int) -> Rows:
    """Return the compressed rows of a matrix."""
    from scipy.sparse import coo_array

    made: Any = coo_array((entries, (rows, columns)), shape=(n, n)).tocsr()
    return Rows(made.indptr.astype(np.int64), made.indices.astype(np.int64), made.data)
