"""A graph enters; what is reached from some states without passing one state leaves: many such searches, the most part done once.

Choose a root r, and let F be a tree of ways from r to all that it reaches, and B a tree of ways to r from all that reach it.

* A state outside the subtree of s in F is reached from r without s: the way in the tree does not pass s. What else r reaches
  without s lies in the subtree: it is found by a search within it, which begins at its states with a branch from outside of it, s excepted.
* A state outside the subtree of s in B reaches r without s, likewise.

So if one of the states from which a search begins lies outside the subtree of s in B, then all that r reaches without s is
found, without a look at it; only what lies beyond is searched, besides the subtree. Otherwise everything is searched. Either
way it is exact; the roots decide the speed alone. Any tree will do: here, one of shortest ways.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ratherthan.model.compiling import compiled
from ratherthan.model.mdp import Bools
from ratherthan.verify._kernels import spread_beyond
from ratherthan.verify.frame import Array

__all__ = ["Around", "around"]

ROOTS = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rows:
    """The edges of a graph in rows by state."""

    first: Array  # [S+1]
    target: Array  # [E]


@dataclass(frozen=True, eq=False)
class _Tree:
    """A tree of ways from a root: the subtree of s is ``order[place[s] : place[s] + size[s]]``; `place` is -1 outside of the tree."""

    order: Array  # states in the order in which they are first met going down
    place: Array  # [S]
    size: Array  # [S]

    def span(self, state: int) -> tuple[int, int]:
        """Return where a subtree begins and ends in the order; (0, 0) where the state is not in the tree."""
        place = int(self.place[state])
        return (place, place + int(self.size[state])) if place >= 0 else (0, 0)

    def under(self, state: int) -> Array:
        """Return the states of a subtree, the state itself first; none where it is not in the tree."""
        low, high = self.span(state)
        return self.order[low:high]


_NO_TREE = _Tree(*(np.zeros(0, dtype=np.int64),) * 3)


@dataclass(frozen=True, kw_only=True, eq=False)
class Around:
    """A graph with trees from and to some roots.

    Parameters
    ----------
    rows, back : _Rows
        The edges, forwards and backwards.
    roots : tuple of int
    away, home : tuple of _Tree
        From each root, and to it.
    """

    rows: _Rows
    back: _Rows
    roots: tuple[int, ...]
    away: tuple[_Tree, ...]
    home: tuple[_Tree, ...]

    def found(self, without: int, begin: Array) -> Bools:
        """Return what is reached from the states `begin` without passing one state, ``[S]``; they are found, too, but not it."""
        root, more = self._search(without, begin)
        if root is None:
            found = np.zeros(len(self.rows.first) - 1, dtype=np.bool_)
        else:
            found = self.away[root].place >= 0
            found[self.away[root].under(without)] = False
        found[more] = True
        return found

    def sums(self, without: int, begin: Array, weights: Array) -> Array:
        """Return the sums of some weights, ``[S, K]``, over what `found` returns, ``[K]``."""
        root, more = self._search(without, begin)
        total: Array = weights[more].sum(axis=0)
        if root is not None:
            low, high = self.away[root].span(without)
            ahead = self._ahead(root, weights)
            total += ahead[-1] - (ahead[high] - ahead[low])
        return total

    def _search(self, without: int, begin: Array) -> tuple[int | None, Array]:
        """Return the root whose tree is found but for what lies under a state, and what is found besides."""
        begin = begin[begin != without]
        root = self._near(without, begin)
        tree = _NO_TREE if root is None else self.away[root]
        place = self._nowhere if root is None else tree.place
        low, high = (0, 0) if root is None else tree.span(without)
        mark, stamp, queue = self._room
        stamp[0] += 1
        count = compiled(spread_beyond, len(self.rows.target))(
            (self.rows.first, self.rows.target),
            (self.back.first, self.back.target),
            (tree.order, place, low, high),
            begin,
            without,
            mark,
            int(stamp[0]),
            queue,
        )
        return root, queue[:count]

    def _near(self, without: int, begin: Array) -> int | None:
        """Return the root, of those that one of `begin` reaches without a state, that loses least without it; None for none."""
        best, least = None, 0
        for k, root in enumerate(self.roots):
            if root == without:
                continue
            place, (low, high) = self.home[k].place[begin], self.home[k].span(without)
            lost = int(self.away[k].size[without]) if self.away[k].place[without] >= 0 else 0
            outside = (place >= 0) & ((place < low) | (place >= high))
            if (best is None or lost < least) and outside.any():
                best, least = k, lost
        return best

    @cached_property
    def _room(self) -> tuple[Array, Array, Array]:
        """Marks of states, the last stamp that was used for them, and a queue: shared by all searches."""
        count = len(self.rows.first) - 1
        return np.zeros(count, dtype=np.int64), np.zeros(1, dtype=np.int64), np.zeros(count, dtype=np.int64)

    @cached_property
    def _nowhere(self) -> Array:
        return np.full(len(self.rows.first) - 1, -1, dtype=np.int64)

    @cached_property
    def _kept(self) -> dict[int, tuple[Array, Array]]:
        """For each root: weights, and their running sums in the order of its tree."""
        return {}

    def _ahead(self, root: int, weights: Array) -> Array:
        """Return the sums of the weights of the first states in a tree's order, ``[n+1, K]``."""
        known = self._kept.get(root)
        if known is None or known[0] is not weights:
            sums = np.zeros((len(self.away[root].order) + 1, weights.shape[1]), dtype=np.int64)
            np.cumsum(weights[self.away[root].order], axis=0, out=sums[1:])
            known = self._kept[root] = weights, sums
        return known[1]


def around(count: int, origin: Array, target: Array) -> Around:
    """Return a graph prepared for searches.

    Parameters
    ----------
    count : int
        How many states there are.
    origin, target : array of int, ``[E]``
        Its edges, by origin.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    matrix = csr_array((np.ones(len(origin), dtype=np.int8), (origin, target)), shape=(count, count))
    matrix.sum_duplicates()
    turned = matrix.T.tocsr()
    _, part = connected_components(matrix, directed=True, connection="strong")
    members = np.flatnonzero(part == np.bincount(part).argmax())
    roots = tuple(dict.fromkeys(int(members[len(members) * (2 * k + 1) // (2 * ROOTS)]) for k in range(ROOTS)))
    rows, back = (_Rows(first=m.indptr.astype(np.int64), target=m.indices.astype(np.int64)) for m in (matrix, turned))
    return Around(
        rows=rows,
        back=back,
        roots=roots,
        away=tuple(_tree(matrix, root) for root in roots),
        home=tuple(_tree(turned, root) for root in roots),
    )


def _tree(matrix: Any, root: int) -> _Tree:
    """Return a tree of shortest ways from a root."""
    from scipy.sparse.csgraph import breadth_first_order

    found = breadth_first_order(matrix, root, directed=True, return_predecessors=True)
    met, parent = found[0].astype(np.int64), found[1].astype(np.int64)
    count = len(parent)
    depth = _depths(met, parent, count)
    size = np.zeros(count, dtype=np.int64)
    size[met] = 1
    bounds = np.concatenate([[0], np.flatnonzero(np.diff(depth[met])) + 1, [len(met)]])
    layers = [met[a:b] for a, b in pairwise(bounds.tolist())]
    for layer in reversed(layers[1:]):  # from the deepest layer up: each adds to its parent
        np.add.at(size, parent[layer], size[layer])
    place = np.full(count, -1, dtype=np.int64)
    place[root] = 0
    for layer in layers[1:]:  # siblings stand together in the order in which they are met, each after those before it
        above = parent[layer]
        total = np.cumsum(size[layer]) - size[layer]
        starts = np.append(True, above[1:] != above[:-1])
        total -= np.repeat(total[starts], np.diff(np.append(np.flatnonzero(starts), len(layer))))
        place[layer] = place[above] + 1 + total
    order = np.empty(len(met), dtype=np.int64)
    order[place[met]] = met
    return _Tree(order=order, place=place, size=size)


def _depths(met: Array, parent: Array, count: int) -> Array:
    """Return how far from the root each state lies in a tree that was met layer by layer."""
    depth = np.zeros(count, dtype=np.int64)
    end, layer = 1, 0
    number = np.full(count, -1, dtype=np.int64)
    number[met] = np.arange(len(met))
    above = number[parent[met[1:]]]  # rises: states are met in the order of their parents
    while end < len(met):
        layer += 1
        following = 1 + int(np.searchsorted(above, end, side="left"))
        depth[met[end:following]] = layer
        end = following
    return depth
