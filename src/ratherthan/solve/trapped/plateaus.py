"""A system of probabilities with approximate values enters; the same system leaves with near end components collapsed.

A *near end component* is a set of nodes in which a policy can stay for very long: a room with a hazard behind a long corridor, say, that
is entered only after twenty slips in a row. Its values differ by no more than the chance to be lost, 1e-20. A bound against
all policies must let that one wander for 1e20 steps, and whatever a step leaves to rounding is collected as often.

So take a *plateau*: let rows be flat whose steps change the value by less than a share θ of it on average, Σ p |v(t) - v(s)| ≤ θ v(s),
leave out of them the branches that change it by more, and let K be an end component of what is left. Collapsed into one node,
K has the rows of all its nodes that can leave it. In the system that results movement within K is free of charge and of risk:
its largest value is no smaller than that of the system, its least no larger, and both hardly differ. And a bound that
passes the check on it, laid flat over K, passes it on the system: a row that stays in K changes nothing, exactly, and one that
leaves K is a row of the collapsed node.

Only the upper bound of a largest value and the lower bound of a least one are found so: the other is attained by a policy of
the system as it is. The two then differ by what the plateaus have smoothed out.

Nothing here needs to be right for a bound to be sound: the check decides, on the states as they are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model.index import build_index
from ratherthan.model.mdp import Floats
from ratherthan.solve.system import System, build_system

__all__ = ["flattened"]

Nodes = npt.NDArray[np.int64]


def flattened(system: System, high: Floats, low: Floats, share: float) -> tuple[System, Nodes] | None:
    """Return the system with its plateaus collapsed, and the node of each node and sink, ``[n+2]``; None if there are none.

    The `source` of its rows are the rows of the system.

    Parameters
    ----------
    system : System
    high, low : array of float, ``[n]``
        Values in two parts.
    share : float
        θ.
    """
    component = _plateaus(system, high, low, share)
    if not (component >= 0).any():
        return None
    found = _collapsed(system, component)
    if found is None:
        return None
    made, node = found
    inside = np.arange(made.nodes + 2) < made.nodes
    closed, _ = graph.end_components(made.index, inside, np.ones(made.rows, dtype=np.bool_))
    if (closed >= 0).any():  # plateaus that lead into each other for sure
        found = _collapsed(made, closed[: made.nodes])
        return None if found is None else (replace(found[0], source=made.source[found[0].source]), found[1][node])
    return made, node


def _collapsed(system: System, component: Nodes) -> tuple[System, Nodes] | None:
    """Return the system with components collapsed, and the node of each node and sink, ``[n+2]``; None if one is never left."""
    n = system.nodes
    members = np.flatnonzero(component >= 0)
    representative = np.arange(n)
    first = np.full(int(component.max()) + 1, n)
    np.minimum.at(first, component[members], members)
    representative[members] = first[component[members]]
    kept = representative == np.arange(n)
    count = int(np.count_nonzero(kept))
    node = np.empty(n + 2, dtype=np.int64)
    node[:n][kept] = np.arange(count)
    node[:n] = node[representative]
    node[n:] = count, count + 1
    made = build_system(system.index, system.probability, system.cost, np.arange(system.rows), node, given=system.given)
    if len(np.unique(made.row_node)) < count:
        return None
    return made, node


def _plateaus(system: System, high: Floats, low: Floats, share: float) -> Nodes:
    """Return the plateau of each node, -1 for none, ``[n]``."""
    n, begin = system.nodes, system.row_to_branches[:-1]
    own, size = system.branch_node, np.abs(high)
    inner = system.target < n
    target = np.where(inner, system.target, own)
    step = np.abs((high[target] - high[own]) + (low[target] - low[own]))
    step[~inner] = np.where(system.target[~inner] == n, size[own[~inner]], np.abs(1.0 - size[own[~inner]]))
    mean = np.add.reduceat(system.probability * step, begin)
    flat = np.flatnonzero(mean <= share * size[system.row_node])
    chosen = np.zeros(system.rows, dtype=np.bool_)
    chosen[flat] = True
    branch = np.repeat(chosen, np.diff(system.row_to_branches)) & inner & (step <= share * size[own])
    lengths = np.add.reduceat(branch.astype(np.int64), begin)[flat]
    own_of_flat = system.row_node[flat]
    graph_of_flat = build_index(
        np.searchsorted(own_of_flat, np.arange(n + 1)),
        np.concatenate([[0], np.cumsum(lengths)]),
        system.target[branch],
    )
    inside = np.zeros(n, dtype=np.bool_)
    inside[own_of_flat] = True
    component, internal = graph.end_components(graph_of_flat, inside, lengths > 0)
    several = np.bincount(component[component >= 0], minlength=int(component.max(initial=-1)) + 1) > 1
    del internal
    return np.where((component >= 0) & np.append(several, False)[component], component, -1)
