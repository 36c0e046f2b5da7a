"""Choices that were split enter, estimates of what their search trees weigh leave, with a known error: they prove nothing.

Each decision (a choice of a critical state) gets a rank of its own at random. Of all the decisions that a component leads to,
the k smallest ranks are kept; the sketch of a union is the k smallest of both. If R is the k-th smallest rank of n decisions
among U in all, n is about U (k-1)/(R-1), without bias and with a standard error of n/√(k-2). Fewer than k decisions are all in
the sketch, and their number is exact.

Choices whose trees share much share the error, too: close estimates cannot be put in order.

References
----------
E. Cohen, Size-Estimation Framework with Applications to Transitive Closure and Reachability, J. Comput. Syst. Sci. 55(3), 1997.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.factors.counting._kernels import merge_sketches
from ratherthan.factors.counting.closure import Split
from ratherthan.factors.counting.ground import Components, Ground
from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look, room_for

__all__ = ["KEPT", "estimated"]

Counts = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.int32]

KEPT = 256
"""How many ranks a sketch keeps, k."""
SLICE = 1 << 14
"""How many sketches are merged between two looks."""


def estimated(
    ground: Ground, found: Split, weight: Counts, *, kept: int = KEPT, seed: int = 0
) -> tuple[Floats, Floats]:
    """Estimate the weights of the search trees of choices that were split.

    Parameters
    ----------
    ground : Ground
    found : Split
    weight : array of int, ``[S]``
    kept : int
        How many ranks a sketch keeps, at least 3.
    seed : int
        Of the ranks.

    Returns
    -------
    estimate, error : array of float, ``[N]``
        The error as a share of the estimate; 0 where the number is exact.
    """
    parts = ground.components
    top = int(found.roots.max(initial=-1)) + 1
    onward_from, onward = ground.onward
    units = int(weight.sum())
    room_for(4 * kept * top + 24 * units, f"Estimating with {kept} ranks for each of {top} components")
    own_from, own = _ranks(parts, weight, seed)
    sketch, held = np.empty((top, kept), dtype=np.int32), np.zeros(top, dtype=np.int32)
    kernel = compiled(merge_sketches, ground.work)
    for first in range(0, top, SLICE):
        look("Estimating the decisions left open")
        last = min(first + SLICE, top)
        rows = onward_from[first : last + 1], onward
        kernel(rows, (own_from[first : last + 1], own), (sketch, held), (sketch[first:last], held[first:last]))
    count = len(found.roots_from) - 1
    largest, filled = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    nothing = np.zeros(SLICE + 1, dtype=np.int64), np.zeros(0, dtype=np.int32)
    for first in range(0, count, SLICE):
        look("Estimating the decisions left open")
        last = min(first + SLICE, count)
        made = np.zeros((last - first, kept), dtype=np.int32), np.zeros(last - first, dtype=np.int32)
        kernel((found.roots_from[first : last + 1], found.roots), nothing, (sketch, held), made)
        filled[first:last] = made[1]
        largest[first:last] = made[0][:, -1]
    full = filled == kept
    guess = units * (kept - 1) / np.maximum(largest, 1)  # ranks are counted from 0: R - 1 is the rank
    estimate: Floats = np.where(full, np.maximum(guess, kept), filled.astype(np.float64))
    estimate += found.lower
    return estimate, np.where(full, 1.0 / np.sqrt(kept - 2), 0.0)


def _ranks(parts: Components, weight: Counts, seed: int) -> tuple[Counts, Numbers]:
    """Return the ranks of the units of each component, ascending, in rows."""
    count = len(parts.members_from) - 1
    owner = np.repeat(parts.component[parts.members], weight[parts.members])
    rank = np.random.default_rng(seed).permutation(len(owner)).astype(np.int32)
    order = np.lexsort((rank, owner))
    begin = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(np.bincount(owner, minlength=count), out=begin[1:])
    return begin, rank[order]
