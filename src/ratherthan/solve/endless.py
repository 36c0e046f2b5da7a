"""Rows of a system that never arrive enter; the nodes leave where more and more is gathered with them, which is proved.

With one row per node, the nodes from which no sink can be reached end in *classes*: sets that are never left and in which
each node is reached from each. In a class the mean reward per step is Σ π(s) r(s), with π > 0 its stationary distribution.
For any vector h the mean of its drift D under π is the mean reward, as π P = π. So D > 0 on all of the class proves a mean above
0, whatever h is. A good h has a drift that is the mean, everywhere: with c a node of the class, u(s) the expected reward and
t(s) the expected number of steps until c, g = u(c) / t(c) after one round from c, it is h = u - g t (h(c) = 0).

The classes are end components of the system: what is gathered there has no bound, nor has it where they can be reached.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model.index import branches_of
from ratherthan.model.mdp import Bools
from ratherthan.solve.linear import solve_chain
from ratherthan.solve.system import System, drift, rows_of

__all__ = ["rising_nodes", "stuck_nodes"]

Nodes = npt.NDArray[np.int64]


def stuck_nodes(system: System, rows: Nodes) -> Bools | None:
    """Return the nodes from which no sink is reached by `rows`, ``[n]``; None where there are none."""
    index = system.index
    sinks = np.arange(index.states) >= system.nodes
    taken = np.zeros(system.rows, dtype=np.bool_)
    taken[rows] = True
    stuck = ~graph.can_reach(index, sinks, ~sinks, taken)[: system.nodes]
    return stuck if stuck.any() else None


def rising_nodes(system: System, rows: Nodes, stuck: Bools) -> Bools | None:
    """Return the nodes of the classes of `rows` that provably gather more and more, ``[n]``; None where there are none.

    Parameters
    ----------
    system : System
    rows : array of int, ``[n]``
    stuck : array of bool, ``[n]``
        From where no sink is reached by `rows`.
    """
    index = system.index
    taken = np.zeros(system.rows, dtype=np.bool_)
    taken[rows] = True
    inside = np.append(stuck, [False, False])
    component, _ = graph.end_components(index, inside, taken)
    rising = np.zeros(system.nodes, dtype=np.bool_)
    for number in range(int(component.max()) + 1):
        members = np.flatnonzero(component == number)
        rising[members] = _rises(system, rows, members)
    return rising if rising.any() else None


def _rises(system: System, rows: Nodes, members: Nodes) -> bool:
    """Return whether the mean reward of a class is provably above 0."""
    chain = _class(system, rows, members)
    if chain.nodes == 1:
        potential = (np.zeros(1), np.zeros(1))
    else:
        others = np.arange(1, chain.nodes)
        rest = rows_of(chain, others)  # the first node is the sink of value 0
        moved = np.where(rest.target == 0, chain.nodes - 1, rest.target - 1)
        rest = replace(rest, node_to_rows=np.arange(chain.nodes), target=moved)
        gathered, steps = solve_chain(rest), solve_chain(_counting(rest))
        if gathered is None or steps is None:
            return False
        first = slice(int(chain.row_to_branches[0]), int(chain.row_to_branches[1]))
        targets, chances = chain.target[first], chain.probability[first]
        once = chain.cost[0] + chances @ np.append(0.0, gathered.high)[targets]
        gain = once / (1.0 + chances @ np.append(0.0, steps.high)[targets])
        potential = (np.append(0.0, gathered.high - gain * steps.high), np.append(0.0, gathered.low))
    total, error = drift(chain, *potential)
    return bool((total - error > 0.0).all())


def _class(system: System, rows: Nodes, members: Nodes) -> System:
    """Return the rows of the nodes of a class, numbered from 0, as a system without sinks."""
    own = rows[members]
    branches, offsets = branches_of(system.row_to_branches, own)
    return System(
        node_to_rows=np.arange(len(members) + 1),
        row_to_branches=offsets,
        target=np.searchsorted(members, system.target[branches]),
        probability=system.probability[branches],
        cost=system.cost[own],
        source=system.source[own],
        size=system.magnitude[own],
        signed=True,
    )


def _counting(system: System) -> System:
    """Return the system with 1 paid in every row."""
    return replace(system, cost=np.ones(system.rows), size=np.ones(system.rows), signed=False)
