"""An optimum of probabilities in two parts enters; margins leave with which bounds can be proved, above and below it.

As in `margins`, v ∓ g passes a check if g(s) ≥ δ(a) - relief(a) + Σ p(a, t) g(t) for the rows a of every node s, with δ a few errors of
the drift of v, and relief how much worse than v a row is. The least such g is that of a system of the same kind, solved by policy
iteration from the best rows. Here δ is some 1e-31 of what a step changes, and what two doubles cannot tell of v itself; so g is
narrow even where the policy that collects the most of it wanders for 1e15 steps.

* *Against all policies* (the upper bound of a largest value): the relief of a row is its gap.
* *For all policies of tied rows* (the lower one): δ has their gap besides, they have no relief, and other rows do not count.

Nothing here needs to be right for a bound to be sound: the check decides.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.watch import look
from ratherthan.solve.certify import never_falls, never_rises
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.policy_iteration import least_rows
from ratherthan.solve.system import System, two_sum
from ratherthan.solve.trapped.exact import exact_drift, exact_sum
from ratherthan.solve.trapped.traps import PLATEAUS, Trapped, on_plateaus

__all__ = ["TIES", "bound_of_all", "bound_on_plateaus", "margin_of_tied", "tied_rows"]

Nodes = npt.NDArray[np.int64]
Pair = tuple[Floats, Floats]
Progress = Callable[[str], None]

SCALES = (1.0, 64.0)
MOST_ROUNDS = 30
MOST_LEVELS = 4
"""How often plateaus are looked for among plateaus."""
FLOOR = 1e-300
"""Added to δ where it is positive, so that it does not vanish in products of probabilities."""
REFINEMENTS = 2
WIDEST = 1e-3
"""Above which size a margin is of no use."""
NARROW = 1e-14
"""Above which size the margin of a policy is not taken: it wanders about where other tied rows do not."""
TIES = (1e-20, 0.0, None)
"""Up to which share of the value a row may be worse and be tied; None for the solver's own rows alone. The first that can be proved."""


def tied_rows(system: System, found: Trapped, share: float | None) -> Bools:
    """Return which rows cannot be told from the best, up to a share of the value, ``[m]``."""
    tied = np.zeros(system.rows, dtype=np.bool_)
    if share is not None:
        tied = np.abs(found.drift) <= share * np.abs(found.high)[system.row_node] + 4.0 * found.error
    tied[found.rows] = True
    return tied


def bound_on_plateaus(
    systems: tuple[System, System], own: Nodes, found: Trapped, maximise: bool, progress: Progress | None = None
) -> Floats | None:
    """Return the bound that no policy beats, ``[N]``, with plateaus of one height after the other; None if none is proved.

    What is collapsed may lead into each other with hardly a change, too: so plateaus are looked for among plateaus.

    Parameters
    ----------
    systems : tuple of System
        With end components collapsed, and as it is.
    own : array of int, ``[N]``
        The node of the first that each node of the second is collapsed into.
    found : Trapped
        The optimum of the first, nearly.
    maximise : bool
    progress : callable, optional
    """
    core, whole = systems
    for share in PLATEAUS:
        made, best, into = core, found, own
        for _ in range(MOST_LEVELS):
            look()
            smooth = on_plateaus(made, best, share, maximise, progress)
            if smooth is None:
                break
            further, node, best = smooth
            into = node[into]
            bound = bound_of_all(further, whole, into, best, maximise)
            if bound is not None:
                return bound
            if further.nodes == made.nodes:
                break
            made = further
    return None


def bound_of_all(core: System, whole: System, node: Nodes, found: Trapped, maximise: bool) -> Floats | None:
    """Return the bound that no policy can beat, ``[N]``: upper for a largest, lower for a least value; None if it is not proved.

    Parameters
    ----------
    core, whole : System
    node : array of int, ``[N]``
        As for `certify.optimum_bound`.
    found : Trapped
    maximise : bool
    """
    gap = -found.drift if maximise else found.drift
    for scale in SCALES:
        needed = scale * (2.0 * found.error + np.maximum(-gap, 0.0))
        margin = _margin(core, needed, np.maximum(gap, 0.0), found.equations, found.rows)
        if margin is None:
            continue
        sign = 1.0 if maximise else -1.0
        high, low = exact_sum((found.high, found.low), (sign * margin[0], sign * margin[1]))
        high, low = high[node], low[node]
        if maximise and bool((high >= 0.0).all()) and never_rises(whole, high, low):
            return np.nextafter(high, np.inf)
        if not maximise and never_falls(whole, high, low):
            return np.maximum(np.nextafter(high, -np.inf), 0.0)
    return None


def margin_of_tied(core: System, found: Trapped, several: Bools, first: int = 0) -> tuple[Bools, Floats | None]:
    """Return which rows are tied, ``[m]``, and a margin with which bounds of the policy taken of them may be proved, ``[n]``, or None.

    Parameters
    ----------
    core : System
    found : Trapped
    several : array of bool, ``[n]``
        The nodes that stand for several states, each of which may take another tied row; the others take the first one.
    first : int
        Which of `TIES` to begin with.
    """
    for share in TIES[first:]:
        tied = tied_rows(core, found, share)
        candidates = np.flatnonzero(tied)
        rows = candidates[np.searchsorted(candidates, core.node_to_rows[:-1])]
        taken = tied & several[core.row_node]
        taken[rows] = True
        needed = np.where(taken, 2.0 * found.error + np.abs(found.drift), 0.0)
        margin = _margin(core, needed, np.where(taken, 0.0, 1.0), found.equations, rows)
        if margin is not None and float(margin[0].max()) <= NARROW:
            return tied, margin[0] + margin[1]
    return tied, None


def _margin(core: System, needed: Floats, relief: Floats, equations: Factored, rows: Nodes) -> Pair | None:
    """Return g with g ≥ needed - relief + P g along every row, about, in two parts, ``[n]``; None if none is found that is of use."""
    needed = needed + np.where(needed > 0.0, FLOOR, 0.0)
    for _ in range(MOST_ROUNDS):
        if not equations.follow(rows):
            return None
        margin = _collected(equations, (2.0 * needed - relief)[rows])
        if not margin[0].max() <= WIDEST:
            return None
        short = needed - relief + exact_drift(core, *margin, one=0.0)[0]
        best = least_rows(core, -short)
        better = np.where(short[best] > 0.0, best, rows)
        if (better == rows).all():
            return margin
        rows = better
    return None


def _collected(equations: Factored, pay: Floats) -> Pair:
    """Return the expected sum of `pay` along the rows that are followed, in two parts; below 0 is 0."""
    chain = equations.chain
    assert chain is not None
    high, low = equations.solve(pay), np.zeros(chain.nodes)
    for _ in range(REFINEMENTS):
        rest = pay + exact_drift(chain, high, low, one=0.0)[0]
        high, low = two_sum(high, low + equations.solve(rest))
    positive = high > 0.0
    return np.where(positive, high, 0.0), np.where(positive, low, 0.0)
