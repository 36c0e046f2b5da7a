"""Rows with positive costs enter, nearly their optimum leaves: sweeps through windows of layers, as maps want them.

On a map the values of far places rest on those of near ones. Let the nodes lie in layers, by their distance from the goal in
steps, and solve a *window* of some dozens of layers until it is quiet; then move on by three quarters of a window. Values beyond
the window are looked at, but hardly matter yet; and slow pockets are quiet before anything that rests on them is touched.
Every node is swept some forty times, while it lies in the cache, whereas sweeps over the whole map would have to be as many as
it has layers. A sweep in place takes the best row of every node (Gauss-Seidel); some more keep to what was taken, and cost a
row each (modified policy iteration, Puterman and Shin 1978). Loops of a row to its own node are taken out beforehand.

The first pass is a fine one: as a window is quiet to a millionth of the least cost before the next one begins, one pass mostly is
enough. Else there are more, each with a finer tolerance and, where that gains little, with wider windows.

**Giving up.** Where everything rests on everything, as in random walks, windows do not help, and other methods are better. What is
left to do is guessed from what was done: a window whose sweeps gain so little, or a pass that comes forward so slowly, that
every node would be visited more often than is allowed, ends it at once; so do passes that gain nothing in windows as wide as can be.

Nothing here needs to be right for a bound to be sound: what leaves is a guess, and the check decides (`windowed`).

References
----------
M. L. Puterman, M. C. Shin, Modified Policy Iteration Algorithms for Discounted Markov Decision Problems, Management Science
24(11), 1978.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import log

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import LEAST_WORK, compiled
from ratherthan.model.mdp import Floats, Ints
from ratherthan.model.watch import look
from ratherthan.solve._kernels import Ordered, window_sweeps

__all__ = ["Sweeping", "Windows", "begin_sweeps", "sweep_on", "widened"]

Progress = Callable[[str], None]

STEP = 1.3
"""What a node is guessed to cost more than the nearest one behind it, in units of the least cost."""
SLICE = 4_000_000
"""How many branches a kernel visits between two looks at the limits, some tenths of a second."""
FIRST = 1e-6
"""The tolerance of the first pass, in units of the least cost."""
FAR = 0.1
"""What share of the layers must be behind before it is guessed from them how long a pass takes."""
PATIENCE = 30
"""After how many visits of its nodes it is guessed how long a window takes."""
LOOKS = 8
"""After how many looks at it, at least."""
POOR = 0.1
"""To what share a pass must bring the residual down."""


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

    width: int = 40
    residual: float = 5e-8
    most: int = 400


@dataclass(kw_only=True, eq=False)
class Sweeping:
    """Where the sweeps are.

    Parameters
    ----------
    values : array of float, ``[n+2]``
        Those of the nodes in the order of the layers, and of the two sinks.
    taken : array of int, ``[n]``
        The row taken at each node.
    layers : array of int
        Where each layer begins, and the end of the last.
    least : float
        The least cost.
    tolerance, residual : float
        Of the pass to come, and of the values now.
    width, visits, passes : int
        Of windows; and what was done so far.
    """

    values: Floats  # [n+2]
    taken: npt.NDArray[np.int32]  # [n]
    layers: npt.NDArray[np.int64]
    least: float
    tolerance: float
    width: int
    residual: float = float("inf")
    visits: int = 0
    passes: int = 0

    @property
    def nodes(self) -> int:
        """How many nodes there are."""
        return len(self.taken)


def begin_sweeps(level: Ints, least: float, settings: Windows) -> Sweeping:
    """Return sweeps that have not begun.

    Parameters
    ----------
    level : array of int, ``[n]``
        The distance of each node, ascending.
    least : float
        The least cost of a row.
    settings : Windows
    """
    n = len(level)
    borders = np.flatnonzero(level[1:] != level[:-1]) + 1
    layers = np.concatenate([[0], borders, [n]]).astype(np.int64)
    values = np.zeros(n + 2)
    values[n + 1] = 1.0
    return Sweeping(
        values=values,
        taken=np.zeros(n, dtype=np.int32),
        layers=layers,
        least=least,
        tolerance=FIRST * least,
        width=settings.width,
    )


def sweep_on(rows: Ordered, state: Sweeping, settings: Windows, progress: Progress | None = None) -> bool:
    """Pass once more over all windows, each finer than before; return whether that came to its end.

    Parameters
    ----------
    rows : Ordered
        All costs are positive, and a sink can be reached from every node.
    state : Sweeping
        Leaves with better values; its residual is the caller's to tell.
    settings : Windows
    progress : callable, optional
        Told now and then how far it is.
    """
    last, n = len(state.layers) - 1, state.nodes
    if state.passes > 0:
        state.tolerance = max(0.3 * settings.residual * state.least, 0.01 * state.tolerance)
    spans = (state.width, max(state.width - max(state.width // 4, 1), 1))
    wanted = (state.tolerance, STEP * state.least if state.passes == 0 else 0.0)
    at, begun, work = np.zeros(2, dtype=np.int64), state.visits, 0
    seen: list[tuple[int, float]] = []  # the visits of the window that is being swept, and the last change
    kernel, slice_ = compiled(window_sweeps, max(len(rows.target), LEAST_WORK)), SLICE // max(len(rows.target) // n, 1)
    state.passes += 1
    while at[0] < last:
        layer, budget = int(at[0]), min(slice_, settings.most * n - state.visits)
        spent, change = kernel(rows, state.layers, state.values, state.taken, at, spans, wanted, budget)
        state.visits += spent
        told = f"windowed sweeps, pass {state.passes}: {int(at[0])} of {last} layers"
        look(told)
        if progress is not None:
            progress(told)
        if at[0] == last:
            break
        if at[0] == layer:
            work += spent
            seen.append((work, change))
        else:
            work, seen = 0, []
        done = state.layers[at[0]] / n
        left = (state.visits - begun) * (1.0 / done - 1.0) if done > FAR else 0.0
        if work > PATIENCE * (state.layers[min(layer + state.width, last)] - state.layers[layer]):
            left = max(left, _visits_left(seen, state.tolerance))
        if not state.visits + left <= settings.most * n or np.isnan(change):
            return False
    return True


def _visits_left(seen: list[tuple[int, float]], tolerance: float) -> float:
    """Return how much work it takes to come to a tolerance, if it goes on as it did in the later half of the work so far.

    A row that is found late makes values jump once more: then nothing can be told yet.
    """
    later = seen[len(seen) // 2 :]
    changes = [change for _, change in later]
    if len(seen) < LOOKS or changes != sorted(changes, reverse=True):
        return 0.0
    (begun, before), (work, now) = later[0], later[-1]
    if now <= tolerance:
        return 0.0
    return log(tolerance / now) / log(now / before) * (work - begun) if now < before else np.inf


def widened(state: Sweeping, before: float) -> bool:
    """Make windows wider where a pass gained little; return whether another pass may help."""
    if not np.isfinite(state.residual):
        return False
    if state.residual > POOR * before:
        if state.width >= len(state.layers):
            return False
        state.width *= 2
    return True
