"""A system enters; values that nearly solve it leave, swept in place or corrected by a Krylov solve: the engine of this room.

Let T be Bellman's operator of a system, its rows divided by the probability to leave their node: x(s) = min over rows a of
cost(a) + Σ p(a, t) x(t); where the most is wanted costs and values are turned round. Two ways lead to x with |Tx - x| small:

* **Windows** (`swept`). The nodes lie in layers by their distance from the sinks. A window of some dozens of layers is swept in
  place until no value changes by more than a tolerance, a sweep that chooses being followed by up to three that keep to what was
  chosen (Puterman and Shin 1978); then the next window, half a window on. Passes are repeated with finer tolerances. It needs no
  sign of costs. It gives up when a pass gains less than a factor of 10 with windows of all widths, or when every node was
  visited more often than allowed: where everything rests on everything sweeps do not help.
* **Corrections** (`corrections`): policy iteration whose equations are solved roughly, by Krylov's method or sparse LU.

Neither promises anything; x is a guess until `proof` has checked it.

References
----------
M. L. Puterman, M. C. Shin, Modified Policy Iteration Algorithms for Discounted Markov Decision Problems, Management Science 24(11),
1978.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model._kernels import LEAST_WORK, compiled
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look
from ratherthan.solve._kernels import Ordered, ordered_rows
from ratherthan.solve.contracting._kernels import first_values, gaps_of, relax_all, relax_windows
from ratherthan.solve.system import System, rows_of

__all__ = ["BRIEFLY", "Field", "begin_with", "field_of", "residual_of", "swept", "swept_whole"]

Nodes = npt.NDArray[np.int64]

WIDTH = 80
"""Layers in a window, at first."""
SLICE = 20_000_000
"""How many branches are visited between two looks at the limits."""
MOST_VISITS = 400.0
"""How often every node may be visited on average, where it helps."""
FEW_VISITS = 100.0
"""How often where all layers lie in one window."""
BRIEFLY = 80.0
"""How often where equations can be eliminated instead."""
MOST_AT_ONCE = 150.0
"""How often in one pass."""
MOST_PASSES = 14


@dataclass(frozen=True, kw_only=True, eq=False)
class Field:
    """A system in the order of its layers, and the values that it has now (arrays that change).

    Parameters
    ----------
    system : System
    sign : float
        -1 where the most is wanted.
    rows : Ordered
    order : array of int, ``[n]``
        The node at each place.
    layers : array of int
        The first place of each layer, and n.
    values : array of float, ``[n+2]``
        By place; the last two are those of the sinks.
    taken : array of int, ``[n]``
        The row taken at each place, a number into `rows`.
    """

    system: System
    sign: float
    rows: Ordered
    order: Nodes
    layers: Nodes
    values: Floats
    taken: Nodes

    @property
    def work(self) -> int:
        """The number of branches, as many as are worth compiling for in any case: where this room is used it is for many."""
        return max(len(self.rows.target), LEAST_WORK)

    @property
    def flat(self) -> bool:
        """Whether all nodes lie in one window, or nearly."""
        return len(self.layers) <= WIDTH

    def of_nodes(self) -> Floats:
        """The values by node, as the system means them, ``[n]``."""
        found = np.empty(len(self.order))
        found[self.order] = self.sign * self.values[:-2]
        return found

    def set_to(self, values: Floats) -> None:
        """Take values by node."""
        self.values[:-2] = self.sign * values[self.order]

    def take(self, rows: Nodes) -> None:
        """Take rows of the system, one per node."""
        self.taken[:] = self.rows.node_to_rows[:-1] + (rows - self.system.node_to_rows[:-1])[self.order]

    def rows_taken(self) -> Nodes:
        """Return the row of the system taken at each node, ``[n]``."""
        found = np.empty(len(self.order), dtype=np.int64)
        offset = self.taken - self.rows.node_to_rows[:-1]
        found[self.order] = self.system.node_to_rows[self.order] + offset
        return found


def field_of(system: System, maximise: bool, *, discounted: bool = False, cost: Floats | None = None) -> Field:
    """Return a system in the order of its layers, with first values.

    Parameters
    ----------
    system : System
    maximise : bool
    discounted : bool
        Whether the last branch of every row is the one that a discount adds; layers are then those without it.
    cost : array of float, ``[m]``, optional
        Other costs than the system's.
    """
    n, sign = system.nodes, -1.0 if maximise else 1.0
    level = _levels(system, discounted)
    order = np.argsort(level, kind="stable")
    rank = np.arange(n + 2)
    rank[order] = np.arange(n)
    paid = system.cost if cost is None else cost
    begin, branches, target = (
        np.asarray(part, dtype=np.int64) for part in (system.node_to_rows, system.row_to_branches, system.target)
    )
    work = max(len(target), LEAST_WORK)
    offsets = np.zeros(len(begin), dtype=np.int64), np.zeros(len(branches), dtype=np.int64)
    kernel = compiled(ordered_rows, work)
    rows = kernel((begin, branches, target), system.probability, sign * paid, (order, rank), offsets)
    values, taken = np.zeros(n + 2), np.zeros(n, dtype=np.int64)
    values[n + 1] = sign
    compiled(first_values, work)(rows, values, taken)
    layers = np.concatenate([[0], np.cumsum(np.bincount(level - 1))]).astype(np.int64)
    return Field(system=system, sign=sign, rows=rows, order=order, layers=layers, values=values, taken=taken)


def _levels(system: System, discounted: bool) -> Nodes:
    """Return the distance of every node from the sinks, from 1 on, ``[n]``; one more than all others where there is none."""
    n = system.nodes
    index = system.index
    sinks = np.arange(n + 2) >= n
    if discounted:
        far = np.zeros(n + 2, dtype=np.bool_)
        others = np.ones(len(system.target), dtype=np.bool_)
        others[np.asarray(system.row_to_branches[1:]) - 1] = False
        near = system.branch_node[others & (system.target >= n)]
        if not len(near):
            return np.ones(n, dtype=np.int64)
        far[near] = True
        level = graph.levels_to(index, far, ~sinks)[:n] + 1
    else:
        level = graph.levels_to(index, sinks, ~sinks)[:n]
    found: Nodes = np.where(level > 0, level, max(int(level.max()), 0) + 1).astype(np.int64)
    return found


def residual_of(field: Field) -> float:
    """Return max |Tx - x|, with the loops of rows taken out; NaN or ∞ where values are not finite."""
    if not np.isfinite(field.values).all():
        return np.inf
    return float(compiled(gaps_of, field.work)(field.rows, field.values, field.taken, np.empty(len(field.order))))


def begin_with(field: Field, rows: Nodes, *, unit: float) -> bool:
    """Take about the values of a policy that arrives, by sweeps; return whether these came to an end.

    From there sweeps improve step by step, and every greedy policy on the way arrives as well. From other values they may go astray: a
    place that seems to be paid for is believed until its neighbours have unlearnt it.

    Parameters
    ----------
    field : Field
        Its values are set.
    rows : array of int, ``[n]``
        Of the system, one per node.
    unit : float
        What a step costs, about.
    """
    chain = field_of(rows_of(field.system, rows), field.sign < 0.0)
    done = swept(chain, 0.1 * unit, unit=1e3 * unit)
    if done:
        field.set_to(chain.of_nodes())
    return done


def swept(
    field: Field,
    wanted: float,
    tolerance: Floats | None = None,
    *,
    unit: float,
    finer: float = 0.01,
    visits: float | None = None,
) -> bool:
    """Sweep windows until the residual is at most `wanted`; return whether it is.

    Parameters
    ----------
    field : Field
        Its values are improved.
    wanted : float
        With a `tolerance`, relative to it.
    tolerance : array of float, ``[n]``, optional
        By node: what each may still change by, where that is not the same everywhere.
    unit : float
        What a step costs, about: the first pass is as coarse as that.
    finer : float
        How much smaller changes may be from pass to pass.
    visits : float, optional
        How often every node may be visited on average.
    """
    fine = np.ones(len(field.order)) if tolerance is None else tolerance[field.order]
    coarse = max(1e-3 * unit, 0.3 * wanted)
    left = (visits or (FEW_VISITS if field.flat else MOST_VISITS)) * len(field.order)
    once, most = MOST_AT_ONCE * len(field.order), int(np.iinfo(np.int32).max if visits is None else 0.5 * visits)
    width, residual = WIDTH, np.inf
    for number in range(1, MOST_PASSES + 1):
        least = np.maximum(coarse * fine, 1e-16 * np.abs(field.values[:-2]))
        left -= _passed(field, least, width, min(left, once), most)
        before, residual = residual, _relative(field, fine)
        look(f"sweeps, pass {number}: residual {residual:.1e}")
        if residual <= wanted or not np.isfinite(residual) or left <= 0:
            break
        if residual > 0.1 * before:
            if width > len(field.layers):
                break
            width *= 4
        coarse = max(0.3 * wanted, finer * coarse)
    return bool(residual <= wanted)


def _relative(field: Field, fine: Floats) -> float:
    """Return the largest |Tx - x|, in units of `fine`."""
    if not np.isfinite(field.values).all():
        return np.inf
    gaps = np.empty(len(field.order))
    compiled(gaps_of, field.work)(field.rows, field.values, field.taken, gaps)
    return float((np.abs(gaps) / fine).max())


def _passed(field: Field, tolerance: Floats, width: int, left: float, most: int) -> float:
    """Pass through all windows, a slice of work at a time, each swept at most so often; return how many nodes were visited."""
    n, kernel = len(field.order), compiled(relax_windows, field.work)
    once = max(int(SLICE * n / max(field.work, 1)), 1000)
    layer, keeping, made, spent = 0, 0, 0, 0.0
    while layer < len(field.layers) - 1 and spent < left:
        look()
        place, limits = (layer, keeping, made), (width, most, once)
        turn = kernel(field.rows, field.layers, field.values, field.taken, tolerance, place, limits)
        layer, keeping, made, spent = turn.layer, turn.keeping, turn.made, spent + turn.spent
    return spent


def swept_whole(field: Field, times: int) -> None:
    """Sweep everything some times: once choosing, and nine times back and forth keeping to that."""
    kernel = compiled(relax_all, field.work)
    for _ in range(times):
        look()
        kernel(field.rows, field.values, field.taken)
