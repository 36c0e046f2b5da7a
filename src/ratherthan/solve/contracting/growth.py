"""A system of rewards enters; the nodes leave where a policy gathers more and more for ever, which is proved.

**Definition.** A set R of nodes that a policy never leaves, each reached from each, pays g per step on average. With g > 0 the sum until
a goal that can be reached from R has no bound.

**What is proved.** For any vector x the mean of D(s) = r(s) + Σ p (x(t) - x(s)) under the stationary distribution of R is g. So D above
its rounding error everywhere in R, for whatever x, proves g > 0 (as in `endless`, where x comes from equations).

**Where x comes from.** R lies in a maximal end component with a row that pays something above 0. There x is swept, in place and back and forth,
over the rows that stay; the steps of a sweep tend to what a round gathers, and are positive where it does. Some damped steps x ← x + ½ (Tx - x)
follow, which make steps alike, as sweeps in place leave nodes with a step of 0. Loops of a row to its own node are taken out, which
changes how long a step takes and not what sign g has.

**Termination.** When D is above its error on a set that the best rows never leave; when Tx - x is nowhere above 0, which says that no
policy gathers anything; or after so many sweeps: then nothing is known.

References
----------
M. L. Puterman, Markov Decision Processes, Wiley 1994, chapter 8.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model._kernels import compiled
from ratherthan.model.index import branches_of
from ratherthan.model.mdp import Bools
from ratherthan.model.watch import look
from ratherthan.solve.contracting._kernels import gaps_of
from ratherthan.solve.contracting.field import Field, field_of, swept_whole
from ratherthan.solve.system import System, drift

__all__ = ["growing_nodes"]

Nodes = npt.NDArray[np.int64]

MOST_TURNS = 60
SWEEPS = 3
STEPS = 6


def growing_nodes(system: System) -> Bools | None:
    """Return the nodes of sets where more and more is gathered, ``[n]``; None where none is found.

    Parameters
    ----------
    system : System
        Of which the most is wanted.
    """
    members, inner = _paid_components(system)
    if inner is None:
        return None
    field = field_of(inner, maximise=True)
    field.values[:] = 0.0
    for turn in range(1, MOST_TURNS + 1):
        look(f"end components that pay, turn {turn}")
        swept_whole(field, SWEEPS)
        gaps = _damped(field)
        if not gaps.min() < 0.0 or not np.isfinite(field.values).all():
            return None
        rising = _proved(inner, field)
        if rising.any():
            found = np.zeros(system.nodes, dtype=np.bool_)
            found[members[rising]] = True
            return found
        field.values[:-2] -= field.values[:-2].max()
    return None


def _paid_components(system: System) -> tuple[Nodes, System | None]:
    """Return the nodes of end components with a row that pays, and the rows that stay there as a system; None if there are none."""
    index, n = system.index, system.nodes
    inside = np.arange(index.states) < n
    component, internal = graph.end_components(index, inside, np.ones(system.rows, dtype=np.bool_))
    paying = internal & (system.cost > 0.0)
    if not paying.any():
        return np.zeros(0, dtype=np.int64), None
    paid = np.zeros(int(component.max()) + 2, dtype=np.bool_)  # the last one is for no component
    paid[component[index.choice_to_state[paying]]] = True
    members = np.flatnonzero(paid[component[:n]])
    kept = np.flatnonzero(internal & paid[component[index.choice_to_state]])
    number = np.full(n + 2, -1)
    number[members] = np.arange(len(members))
    branches, offsets = branches_of(np.asarray(system.row_to_branches, dtype=np.int64), kept)
    own = number[index.choice_to_state[kept]]
    return members, System(
        node_to_rows=np.searchsorted(own, np.arange(len(members) + 1)),
        row_to_branches=offsets,
        target=number[system.target[branches]],
        probability=system.probability[branches],
        cost=system.cost[kept],
        source=system.source[kept],
        size=system.magnitude[kept],
        signed=True,
    )


def _damped(field: Field) -> npt.NDArray[np.float64]:
    """Make steps alike; return the last ones, of a system to be made small."""
    gaps = np.empty(len(field.order))
    for _ in range(STEPS):
        compiled(gaps_of, field.work)(field.rows, field.values, field.taken, gaps)
        field.values[:-2] += 0.5 * gaps
    compiled(gaps_of, field.work)(field.rows, field.values, field.taken, gaps)
    return gaps


def _proved(inner: System, field: Field) -> Bools:
    """Return the nodes of sets that the rows taken never leave, with drifts above their errors, ``[n]``."""
    total, error = drift(inner, field.of_nodes())
    taken = np.zeros(inner.rows, dtype=np.bool_)
    rows = field.rows_taken()
    taken[rows] = True
    above = np.append((total - error)[rows] > 0.0, [False, False])
    component, _ = graph.end_components(inner.index, above, taken)
    found: Bools = component[: inner.nodes] >= 0
    return found
