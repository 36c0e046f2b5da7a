"""Rows of a model enter, a System of equations leaves; trial values enter it, their drift with a bound of its rounding leaves.

A System has n unknowns (*nodes*). Row a of node s says x(s) = cost(a) + Σ p(a, t) x(t), where t is a node or one of two
sinks: n, whose value is 0, and n + 1, whose value is 1. A node has several rows where there is a choice. All values of
this package, bounds and checks are about such systems.

**Drift.** The drift of x along row a is D(a) = cost(a) + Σ p(a, t) (x(t) - x(s)): what is paid, and how far the value
moves. As the probabilities of a row sum to 1, D(a) ≥ 0 says x(s) ≤ cost + Σ p x, and D(a) ≤ 0 the opposite. The form with
differences is the one to compute with: staying in place contributes exactly 0, so does a set of states with one value, and
the rounding error is proportional to differences and not to values. Hence a robot that succeeds once in 1e9 attempts is
as well treated as any other.

**Rounding.** x may be given in parts, x = x₁ + x₂ + …, each of them doubles (a double and its correction give about 32
digits). With u = 2⁻⁵³, a row of k branches, computed differences δᵢ of the parts, the computed drift misses the exact one by
at most (k + 8) · 6u · (cost + Σ p Σᵢ |δᵢ|): 5u for the differences, their sum and the product, k u for the sum, and 4(k + 4) u
because the exact model is the one whose rows are the given doubles divided by their exact sum (that may miss 1 by
2(k + 4) u, the sums that the model itself was checked with by k u), r̄ being computed by such a sum, too. Products that
underflow add at most k · 2⁻¹⁰⁷⁴. Where all differences and the cost are 0, the drift is 0 exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ratherthan.model.index import Index, branches_of, build_index
from ratherthan.model.mdp import Bools, Floats

__all__ = ["ROUNDING", "System", "build_system", "drift", "exchanged", "padded", "rows_of", "two_sum"]

ROUNDING = 6 * 2.0**-53
UNDERFLOW = 1e-322

Nodes = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class System:
    """Equations x(s) = cost + Σ p x, with n nodes, m rows and k branches.

    Parameters
    ----------
    node_to_rows, row_to_branches : array of int, ``[n+1]``, ``[m+1]``
        Compressed rows; every node has a row, every row a branch.
    target : array of int, ``[k]``
        A node 0 … n-1, or n (value 0), or n+1 (value 1).
    probability : array of float, ``[k]``
    cost : array of float, ``[m]``
        At least 0.
    source : array of int, ``[m]``
        Which row of the model each row is.
    """

    node_to_rows: Nodes  # [n+1]
    row_to_branches: Nodes  # [m+1]
    target: Nodes  # [k]
    probability: Floats  # [k]
    cost: Floats  # [m]
    source: Nodes  # [m]

    @property
    def nodes(self) -> int:
        """The number of nodes, n."""
        return len(self.node_to_rows) - 1

    @property
    def rows(self) -> int:
        """The number of rows, m."""
        return len(self.row_to_branches) - 1

    @cached_property
    def row_node(self) -> Nodes:
        """The node of each row, ``[m]``."""
        return np.repeat(np.arange(self.nodes), np.diff(self.node_to_rows))

    @cached_property
    def branch_node(self) -> Nodes:
        """The node whose row each branch is of, ``[k]``."""
        return np.repeat(self.row_node, np.diff(self.row_to_branches))

    @cached_property
    def leave(self) -> Floats:
        """The probability to leave the row's node, ``[m]``: a sum of the others, not 1 minus that to stay."""
        away = np.where(self.target != self.branch_node, self.probability, 0.0)
        return np.add.reduceat(away, self.row_to_branches[:-1])

    @cached_property
    def rounding(self) -> Floats:
        """The relative rounding error of each row's drift, ``[m]``."""
        return (np.diff(self.row_to_branches) + 8) * ROUNDING

    @cached_property
    def index(self) -> Index:
        """The Index of its graph; the sinks are states n and n+1, without choices."""
        ends = np.array([self.rows, self.rows])
        return build_index(np.concatenate([self.node_to_rows, ends]), self.row_to_branches, self.target)


def build_system(index: Index, probability: Floats, cost: Floats, rows: Nodes, node: Nodes) -> System:
    """Return the system of some rows of a model; rows that cannot leave their node are dropped.

    Parameters
    ----------
    index : Index
    probability : array of float, ``[B]``
    cost : array of float, ``[C]``
    rows : array of int, ``[m]``
        Choices of the model.
    node : array of int, ``[S]``
        The node (or sink) of each state. Several states may share one.
    """
    own = node[index.choice_to_state[rows]]
    order = np.argsort(own, kind="stable")
    rows, own = rows[order], own[order]
    branches, offsets = branches_of(index.choice_to_branches, rows)
    target = node[index.branch_to_target[branches]]
    leaves = np.logical_or.reduceat(target != np.repeat(own, np.diff(offsets)), offsets[:-1])
    if not leaves.all():
        kept = np.repeat(leaves, np.diff(offsets))
        lengths = np.diff(offsets)[leaves]
        rows, own, branches, target = rows[leaves], own[leaves], branches[kept], target[kept]
        offsets = np.concatenate([[0], np.cumsum(lengths)])
    nodes = int(own[-1]) + 1
    return System(
        node_to_rows=np.searchsorted(own, np.arange(nodes + 1)),
        row_to_branches=offsets,
        target=target,
        probability=probability[branches],
        cost=cost[rows],
        source=rows,
    )


def rows_of(system: System, rows: Nodes) -> System:
    """Return the system with one row per node: that of following a policy.

    Parameters
    ----------
    system : System
    rows : array of int, ``[n]``
        The row taken at each node.
    """
    branches, offsets = branches_of(system.row_to_branches, rows)
    return System(
        node_to_rows=np.arange(system.nodes + 1),
        row_to_branches=offsets,
        target=system.target[branches],
        probability=system.probability[branches],
        cost=system.cost[rows],
        source=system.source[rows],
    )


def padded(values: Floats, one: float) -> Floats:
    """Return values of the nodes with those of the two sinks, 0 and `one`, behind them."""
    return np.concatenate([values, [0.0, one]])


def drift(system: System, *parts: Floats, cost: Floats | None = None, one: float = 1.0) -> tuple[Floats, Floats]:
    """Return the drift of x, the sum of `parts`, along every row, and a bound of its rounding error.

    Parameters
    ----------
    system : System
    *parts : array of float, ``[n]``
        At the sinks the first part is 0 and `one`, the others are 0.
    cost : array of float, ``[m]``, optional
        Other costs than the system's.
    one : float
        The value of the second sink.

    Returns
    -------
    drift, error : array of float, ``[m]``
        The exact drift is within ``drift ± error``.
    """
    own, begin = system.branch_node, system.row_to_branches[:-1]
    step, size = np.zeros(len(own)), np.zeros(len(own))
    for part in parts:
        further = padded(part, one)[system.target] - part[own]
        step += further
        size += np.abs(further)
        one = 0.0
    paid = system.cost if cost is None else cost
    total = paid + np.add.reduceat(system.probability * step, begin)
    share = system.probability * size
    weight = np.abs(paid) + np.add.reduceat(share, begin)
    moved: Bools = weight > 0.0
    if ((share == 0.0) & (size > 0.0)).any():  # a product vanished that is not 0
        moved = moved | np.logical_or.reduceat(size > 0.0, begin)
    return total, system.rounding * weight + np.where(moved, np.diff(system.row_to_branches) * UNDERFLOW, 0.0)


def exchanged(system: System, values: Floats) -> Floats:
    """Return Σ p (x(s) + x(t)) over the branches of each row that leave its node, ``[m]``.

    The rounding of x itself, times this, is how finely the drift of x can be told at all.

    Parameters
    ----------
    system : System
    values : array of float, ``[n]``
        At least 0.
    """
    away = np.where(system.target != system.branch_node, system.probability, 0.0)
    after = np.add.reduceat(away * padded(values, 0.0)[system.target], system.row_to_branches[:-1])
    mean: Floats = system.leave * values[system.row_node] + after
    return mean


def two_sum(high: Floats, low: Floats) -> tuple[Floats, Floats]:
    """Return high + low as a double and its rounding error, exactly (Knuth)."""
    total = high + low
    back = total - high
    return total, (high - (total - back)) + (low - back)
