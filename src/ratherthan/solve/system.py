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

Where parts of a cost have different signs they may cancel. Its error is then in proportion to the sum of their absolute
values, its *size*, which takes the place of the cost above.

**No rounding.** Along a row of one branch, D = cost + x(t) - x(s) is often exact, with whole numbers always. It is told by the
rounding errors of the two sums, which are doubles again (Knuth), and both 0 then (`certain_drift`).

**Discount.** A discounted row is a row like any other: its branches have the probabilities γp, and with 1 - γ it goes to the
sink of value 0. So D(a) = cost + γ Σ p (x(t) - x(s)) - (1 - γ) x(s). Each of γp and 1 - γ is rounded once; the k + 21 of the
6(k + 8) u that the sum above does not need leave room for that u and for the one more branch. Every run is absorbed.

A product γp (or that of p with the share of a random choice) below the least normal double is rounded by up to 2⁻¹⁰⁷⁵, which may be
all of it. The drift then misses the exact one by as much times δ besides, for each such branch (`System.faint`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled, is_compiled
from ratherthan.model.index import Index, branches_of, build_index
from ratherthan.model.mdp import Bools, Floats
from ratherthan.solve._kernels import drift_rows, gather_rows

__all__ = ["ROUNDING", "System", "build_system", "certain_drift", "drift", "exchanged", "padded", "rows_of", "two_sum"]

ROUNDING = 6 * 2.0**-53
UNDERFLOW = 1e-322
NORMAL = 2.0**-1022
"""Below it doubles are rounded by more than a share of themselves."""
MANY = 30_000
"""From how many branches on compiled loops are worth loading."""

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
        At least 0 unless `signed`.
    source : array of int, ``[m]``
        Which row of the model each row is.
    size : array of float, ``[m]``, optional
        What the rounding error of `cost` is in proportion to; its absolute value by default.
    signed : bool
        Whether costs, and values, may be below 0.
    exact : array of bool, ``[m]``, optional
        Which costs were computed without rounding; none by default.
    given : bool
        Whether all probabilities are doubles of the model as they stand, so that nothing was rounded but what they sum to.
    """

    node_to_rows: Nodes  # [n+1]
    row_to_branches: Nodes  # [m+1]
    target: Nodes  # [k]
    probability: Floats  # [k]
    cost: Floats  # [m]
    source: Nodes  # [m]
    size: Floats | None = None  # [m]
    signed: bool = False
    exact: Bools | None = None  # [m]
    given: bool = False

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
    def magnitude(self) -> Floats:
        """The size of each row's cost, ``[m]``."""
        return np.abs(self.cost) if self.size is None else self.size

    @cached_property
    def rounding(self) -> Floats:
        """The relative rounding error of each row's drift, ``[m]``."""
        return (np.diff(self.row_to_branches) + 8) * ROUNDING

    @cached_property
    def faint(self) -> Nodes:
        """The branches whose probability was computed, and may have lost more than a share of itself to rounding."""
        return np.zeros(0, dtype=np.int64) if self.given else np.flatnonzero(self.probability < NORMAL)

    @cached_property
    def index(self) -> Index:
        """The Index of its graph; the sinks are states n and n+1, without choices."""
        ends = np.array([self.rows, self.rows])
        return build_index(np.concatenate([self.node_to_rows, ends]), self.row_to_branches, self.target)


def build_system(
    index: Index,
    probability: Floats,
    cost: Floats,
    rows: Nodes,
    node: Nodes,
    *,
    size: Floats | None = None,
    exact: Bools | None = None,
    signed: bool = False,
    discount: float = 1.0,
    given: bool = False,
) -> System:
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
    size, exact : array, ``[C]``, optional
    signed : bool
        As in System.
    discount : float
        With what a row goes to the sink of value 0 besides: 1 - γ.
    given : bool
        As in System; of `probability`.
    """
    own = node[index.choice_to_state[rows]]
    if (np.diff(own) < 0).any():
        order = np.argsort(own, kind="stable")
        rows, own = rows[order], own[order]
    kept, offsets, target, chance = _gathered(index, probability, rows, own, node, loops=discount < 1.0)
    rows, own = rows[kept], own[kept]
    nodes = int(own[-1]) + 1
    if discount < 1.0:
        ends = offsets[1:]
        target, chance = np.insert(target, ends, nodes), np.insert(discount * chance, ends, 1.0 - discount)
        offsets = offsets + np.arange(len(offsets))
    return System(
        node_to_rows=np.searchsorted(own, np.arange(nodes + 1)),
        row_to_branches=offsets,
        target=target,
        probability=chance,
        cost=cost[rows],
        source=rows,
        size=None if size is None else size[rows],
        signed=signed,
        exact=None if exact is None else exact[rows],
        given=given and discount == 1.0,
    )


def _gathered(
    index: Index, probability: Floats, rows: Nodes, own: Nodes, node: Nodes, *, loops: bool
) -> tuple[Nodes, Nodes, Nodes, Floats]:
    """Return which rows leave their node (with `loops`: all), and their branches: offsets, targets and probabilities."""
    if not loops and is_compiled(index.work) and index.work > MANY:
        graph = index.choice_to_branches, index.branch_to_target
        return compiled(gather_rows, index.work)(rows, own, graph, probability, node)
    branches, offsets = branches_of(index.choice_to_branches, rows)
    target = node[index.branch_to_target[branches]]
    leaves = np.logical_or.reduceat(target != np.repeat(own, np.diff(offsets)), offsets[:-1])
    if loops or leaves.all():
        return np.arange(len(rows)), offsets, target, probability[branches]
    kept = np.repeat(leaves, np.diff(offsets))
    offsets = np.concatenate([[0], np.cumsum(np.diff(offsets)[leaves])])
    return np.flatnonzero(leaves), offsets, target[kept], probability[branches[kept]]


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
        size=None if system.size is None else system.size[rows],
        signed=system.signed,
        exact=None if system.exact is None else system.exact[rows],
        given=system.given,
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
    found = _drift_of_many if len(system.target) > MANY and is_compiled(len(system.target)) else _drift_of_few
    total, error = found(system, parts, cost, one)
    return total, error + _lost_to_rounding(system, parts, one) if len(system.faint) else error


def _drift_of_few(system: System, parts: tuple[Floats, ...], cost: Floats | None, one: float) -> tuple[Floats, Floats]:
    """Return the same as `drift`, but for what faint branches lose."""
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
    weight = (system.magnitude if cost is None else np.abs(paid)) + np.add.reduceat(share, begin)
    moved: Bools = weight > 0.0
    if ((share == 0.0) & (size > 0.0)).any():  # a product vanished that is not 0
        moved = moved | np.logical_or.reduceat(size > 0.0, begin)
    return total, system.rounding * weight + np.where(moved, np.diff(system.row_to_branches) * UNDERFLOW, 0.0)


def _drift_of_many(system: System, parts: tuple[Floats, ...], cost: Floats | None, one: float) -> tuple[Floats, Floats]:
    """Return the same as `_drift_of_few`, computed by a compiled loop: in another order, within the same bound of its error."""
    values = np.array([padded(part, one if number == 0 else 0.0) for number, part in enumerate(parts)])
    paid, size = (system.cost, system.magnitude) if cost is None else (cost, np.abs(cost))
    kernel = compiled(drift_rows, len(system.target))
    total, weight, moved = kernel(
        system.row_node, system.row_to_branches, system.target, system.probability, (paid, size), values
    )
    return total, system.rounding * weight + np.where(moved, np.diff(system.row_to_branches) * UNDERFLOW, 0.0)


def _lost_to_rounding(system: System, parts: tuple[Floats, ...], one: float) -> Floats:
    """Return what the drift along every row may miss as probabilities of faint branches were rounded, ``[m]``."""
    row = np.searchsorted(system.row_to_branches, system.faint, side="right") - 1
    own, target = system.row_node[row], system.target[system.faint]
    lost = np.zeros(system.rows)
    for number, part in enumerate(parts):
        step = np.abs(padded(part, one if number == 0 else 0.0)[target] - part[own])
        lost += np.bincount(row, UNDERFLOW * step, minlength=system.rows)
    return lost


def certain_drift(system: System, values: Floats) -> tuple[Floats, Bools]:
    """Return the drift of x along every row that is certain, and where that was computed without rounding, ``[m]`` each.

    A row is certain if it has one branch, of probability 1. With whole numbers, say, everything is exact there.

    Parameters
    ----------
    system : System
    values : array of float, ``[n]``
    """
    first = system.row_to_branches[:-1]
    certain = (np.diff(system.row_to_branches) == 1) & (system.probability[first] == 1.0)
    if system.exact is not None:
        certain &= system.exact
    step, lost = two_sum(padded(values, 1.0)[system.target[first]], -values[system.row_node])
    total, more = two_sum(step, system.cost)
    exact: Bools = certain & (lost == 0.0) & (more == 0.0)
    return total, exact


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
