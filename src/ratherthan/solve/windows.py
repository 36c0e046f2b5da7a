"""A system of positive costs enters, nearly its optimum leaves: sweeps through windows of layers, as maps want them.

On a map the values of far places rest on those of near ones. Let the nodes lie in layers, by their distance from the sinks in
steps, and solve a *window* of some dozens of layers until it is quiet; then move on by half a window. Values beyond
the window are looked at, but hardly matter yet; and slow pockets are quiet before anything that rests on them is touched.
Every node is swept some sixty times, while it lies in the cache, whereas sweeps over the whole map would have to be as many as
it has layers. A sweep in place takes the best row of every node (Gauss-Seidel); some more keep to what was taken, and cost a
row each (modified policy iteration, Puterman and Shin 1978). Loops of a row to its own node are taken out beforehand.

The passes are repeated, each with a finer tolerance and where that gains little with wider windows, until the residual
max |Tv - v| is small against the least cost. It gives up when it has visited every node more often than it was allowed: where
everything rests on everything, as in random walks, windows do not help, and equations are solved instead.

Nothing here needs to be right for a bound to be sound: what leaves is a guess, and the check decides (`certify`).

References
----------
M. L. Puterman, M. C. Shin, Modified Policy Iteration Algorithms for Discounted Markov Decision Problems, Management Science
24(11), 1978.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ratherthan.model import graph
from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import Floats
from ratherthan.solve._kernels import ordered_rows, window_pass, window_residual
from ratherthan.solve.system import System

__all__ = ["Windowed", "Windows", "sweep_windows"]

Progress = Callable[[str], None]

MOST_PASSES = 12
STEP = 1.3
"""What a node is guessed to cost more than the nearest one behind it, in units of the least cost."""


@dataclass(frozen=True, kw_only=True)
class Windows:
    """Settings of windowed sweeps.

    Parameters
    ----------
    width : int
        Layers in a window, at first.
    residual : float
        The residual to come to, relative to the least cost.
    most : int
        How many visits of each node on average are allowed.
    """

    width: int = 80
    residual: float = 1e-8
    most: int = 400


class Windowed(NamedTuple):
    """Where the sweeps came to: values, visits per node, and whether they converged."""

    values: Floats  # [n]
    visits: float
    converged: bool


def sweep_windows(system: System, settings: Windows, progress: Progress | None = None) -> Windowed:
    """Return nearly the least expected costs of a system.

    Parameters
    ----------
    system : System
        All costs are positive, and a sink can be reached from every node.
    settings : Windows
    progress : callable, optional
        Told now and then how far it is.
    """
    n = system.nodes
    sinks = np.arange(n + 2) >= n
    level = graph.levels_to(system.index, sinks, ~sinks)[:n]
    order = np.argsort(level, kind="stable")
    rank = np.arange(n + 2)
    rank[order] = np.arange(n)
    layers = np.concatenate([[0], np.cumsum(np.bincount(level - 1))])
    rows = compiled(ordered_rows, len(system.target))(
        (system.node_to_rows, system.row_to_branches, system.target), system.probability, system.cost, order, rank
    )
    values, taken = np.zeros(n + 2), np.zeros(n, dtype=np.int32)
    values[n + 1] = 1.0
    least = float(system.cost.min())
    wanted, left, width = settings.residual * least, settings.most * n, settings.width
    tolerance, step, residual = 1e-3 * least, STEP * least, np.inf
    kernel = compiled(window_pass, len(system.target))
    for number in range(1, MOST_PASSES + 1):
        left -= kernel(rows, layers, values, taken, width, tolerance, step, left)
        if left < 0:
            break
        before, residual = residual, float(compiled(window_residual, len(system.target))(rows, values))
        if progress is not None:
            progress(f"windowed sweeps, pass {number}: residual {residual:.1e}")
        if residual <= wanted or not np.isfinite(residual):
            break
        if residual > 0.1 * before:
            width *= 2
        step, tolerance = 0.0, max(0.3 * wanted, 0.01 * tolerance)
    found = np.empty(n)
    found[order] = values[:n]
    return Windowed(found, settings.most - left / n, bool(residual <= wanted))
