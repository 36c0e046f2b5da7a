"""The graph of a policy and a start enter; the probability that the policy ever comes to each of some states leaves.

With P the moves of the policy between the states that it may leave for ever and y = e_start + Pᵀ y, how often it comes to s in
expectation, the probability to come to s at all is y(s) / G(s, s), where G = (I - P)⁻¹ counts how often it comes back, itself
included: 1 where no way leads back. In a part of the graph that the policy cannot leave each state is visited with the probability
of getting there (Kemeny, Snell, Finite Markov Chains, 1960, chapter 3). These numbers order sentences, no claim rests on them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from ratherthan.explain.route import PolicyGraph
from ratherthan.model.mdp import Bools, Floats

__all__ = ["chances_to_visit"]

Numbers = npt.NDArray[np.int64]
MOST_DENSE = 400
"""Up to how many states matrices are dense."""


def chances_to_visit(graph: PolicyGraph, start: int, states: Sequence[int]) -> list[float]:
    """Return the probability to come to each of some states from a start.

    Parameters
    ----------
    graph : PolicyGraph
    start : int
    states : sequence of int
        That can be reached from the start.
    """
    reached = np.flatnonzero(graph.reachable(start))
    node = np.full(graph.states, -1, dtype=np.int64)
    node[reached] = np.arange(len(reached))
    inside = np.flatnonzero(node[graph.origin] >= 0)
    origin, target, chance = node[graph.origin[inside]], node[graph.target[inside]], graph.probability[inside]
    part = _parts(len(reached), origin, target)
    kept = np.ones(int(part.max()) + 1, dtype=np.bool_)
    kept[part[origin[part[origin] != part[target]]]] = False  # a part that nothing leaves
    first, own = int(node[start]), node[np.asarray(states, dtype=np.int64)]
    if kept[part[first]]:
        return [float(same) for same in part[own] == part[first]]
    passing = ~kept[part]
    visits = np.zeros(len(reached))
    visits[passing] = _solver(passing, (origin, target, chance), transposed=True)(_unit(passing, first))
    into = passing[origin] & ~passing[target]
    entered = np.bincount(part[target[into]], weights=visits[origin[into]] * chance[into], minlength=len(kept))
    size = np.bincount(part, minlength=len(kept))
    back: dict[int, float] = {}
    for place in dict.fromkeys(own.tolist()):
        if passing[place] and size[part[place]] > 1:
            back[place] = 1.0
    _count_returns(back, part, (origin, target, chance))
    found = [visits[at] / back.get(at, 1.0) if passing[at] else entered[part[at]] for at in own.tolist()]
    return [min(1.0, max(0.0, float(share))) for share in found]


def _count_returns(back: dict[int, float], part: Numbers, edges: tuple[Numbers, Numbers, Floats]) -> None:
    """Put in how often each state is visited that the policy begins in: a way back stays within its part of the graph."""
    by_part: dict[int, list[int]] = {}
    for place in back:
        by_part.setdefault(int(part[place]), []).append(place)
    for number, places in by_part.items():
        members = part == number
        solve = _solver(members, edges, transposed=False)
        for place in places:
            column = _unit(members, place)
            back[place] = float(solve(column)[int(np.argmax(column))])


def _unit(inside: Bools, place: int) -> Floats:
    found = np.zeros(len(inside))
    found[place] = 1.0
    return found[inside]


def _parts(count: int, origin: Numbers, target: Numbers) -> Numbers:
    """Return the strongly connected part of each state."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    matrix = csr_array((np.ones(len(origin)), (origin, target)), shape=(count, count))
    _, part = connected_components(matrix, directed=True, connection="strong")
    return np.asarray(part, dtype=np.int64)


def _solver(inside: Bools, edges: tuple[Numbers, Numbers, Floats], *, transposed: bool) -> Callable[[Floats], Floats]:
    """Return what solves (I - P) x = b, or (I - Pᵀ) x = b, among some states."""
    origin, target, chance = edges
    node = np.cumsum(inside) - 1
    within = inside[origin] & inside[target]
    row, column, share, count = node[origin[within]], node[target[within]], chance[within], int(inside.sum())
    if transposed:
        row, column = column, row
    if count <= MOST_DENSE:
        dense = np.eye(count) - np.bincount(row * count + column, weights=share, minlength=count**2).reshape(
            count, count
        )
        return lambda right: np.asarray(np.linalg.solve(dense, right), dtype=np.float64)
    from scipy.sparse import coo_array, csc_array
    from scipy.sparse.linalg import splu

    every = np.arange(count)
    entries = (
        np.concatenate([np.ones(count), -share]),
        (np.concatenate([every, row]), np.concatenate([every, column])),
    )
    factors = splu(csc_array(coo_array(entries, shape=(count, count))))
    return lambda right: np.asarray(factors.solve(right), dtype=np.float64)
