"""A system of probabilities enters, its optimum leaves: values in two parts, best rows, and what solves their equations.

Maps with traps are hard for sweeps: a policy may wander about safely for 1e5 steps before it dares to pass a hazard, so that values settle
after as many sweeps, and what seems settled is not. They are hard for bounds, too, as a policy may wander near an end component
for far longer and lose hardly anything. Equations do not mind, and the graph of one policy has small strong components.

1. *Sweeps* in place, in the order of distance from the end that is wanted, from 0 on: they find nearly the right rows at next to no
   cost.
2. *Policy iteration* (Howard 1960): the equations of the present rows are solved (`eliminating`), and some sweeps start from their
   solution. It lies below the largest value and above the least, so every sweep goes the right way, and every row that changes
   is better. A change must gain more than a share of the value that shrinks from round to round, so that only components are
   eliminated anew in which something was to be gained. It ends when no row gains anything that doubles can tell.
3. *In two parts*: the solution is refined with drifts of some thirty digits (`exact`), and rows change by what these tell, until
   nothing is gained there, either. So the last rows are right where a step gains 1e-20, and a policy that takes 1e15 such steps
   finds nothing left to gain. Without this no bound against all policies could be proved.

As end components are collapsed beforehand, every policy is absorbed with probability 1 and all equations have one solution.

It gives up where factors would fill (then other methods are tried), and after so many rounds. Nothing here needs to be right for
a bound to be sound: the check decides (`certify`).

References
----------
R. A. Howard, Dynamic Programming and Markov Processes, MIT Press, 1960.
M. L. Puterman, M. C. Shin, Modified Policy Iteration Algorithms for Discounted Markov Decision Problems, Management Science
24(11), 1978.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model._kernels import compiled, is_compiled
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look
from ratherthan.solve._kernels import Ordered, ordered_rows
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.policy_iteration import best_rows, least_rows
from ratherthan.solve.system import System, drift, exchanged, two_sum
from ratherthan.solve.trapped._kernels import sweep_rows
from ratherthan.solve.trapped.exact import GRAIN, exact_drift
from ratherthan.solve.trapped.plateaus import flattened

__all__ = ["PLATEAUS", "Trapped", "Traps", "avoid_traps", "improved_in_two_parts", "on_plateaus"]

Nodes = npt.NDArray[np.int64]
Progress = Callable[[str], None]

FIRST_SWEEPS = 100
"""Sweeps before the first equations."""
SLICE = 20_000_000
"""Branches to sweep over between two looks."""
PLAIN = 200_000
"""Branches to sweep over at most where sweeps are not compiled: the rest is left to equations."""
COARSE, FINE = 1e-3, 1e-13
"""The share of a value that a row must gain to change, in the first round and at last."""
FINER = 0.003
"""By what that is multiplied from round to round."""
CAUTION = 4.0
"""How many errors of a drift a gain must be, where drifts are in two parts."""
PLATEAUS = (1e-14, 1e-16, 1e-12, 1e-18)
"""Up to which share of the value steps of a plateau change it, the next one if the one before came to nothing."""
MOST_REFINEMENTS = 12
MOST_EXACT = 30
"""After how many solutions in two parts to stop."""


@dataclass(frozen=True, kw_only=True)
class Traps:
    """Settings of policy iteration with sweeps.

    Parameters
    ----------
    most_rounds : int
        After how many solutions of equations to stop.
    sweeps : int
        Sweeps between two of them.
    """

    most_rounds: int = 60
    sweeps: int = 12


@dataclass(frozen=True, kw_only=True, eq=False)
class Trapped:
    """What was found; nothing is promised.

    Parameters
    ----------
    high, low : array of float, ``[n]``
        The values, in two parts.
    rows : array of int, ``[n]``
        Best rows.
    drift, error : array of float, ``[m]``
        The drift of the values along every row, and a bound of its error.
    equations : Factored
        Follows `rows`.
    rounds : int
        How many times equations were solved.
    """

    high: Floats  # [n]
    low: Floats  # [n]
    rows: Nodes  # [n]
    drift: Floats  # [m]
    error: Floats  # [m]
    equations: Factored
    rounds: int


def avoid_traps(
    system: System, maximise: bool, settings: Traps | None = None, progress: Progress | None = None
) -> Trapped | None:
    """Return the largest or least probabilities of a system, None where its equations could not be factored.

    Parameters
    ----------
    system : System
        Without end components, and such that `is_exact`.
    maximise : bool
    settings : Traps, optional
    progress : callable, optional
        Told now and then how far it is.
    """
    settings = settings or Traps()
    swept = _Sweeps(system, maximise)
    equations = Factored(system)
    swept.run(FIRST_SWEEPS, COARSE)
    number = _iterated(swept, equations, (COARSE, settings), progress)
    found = None if number == 0 else improved_in_two_parts(system, maximise, equations, most=1)
    return None if found is None else replace(found, rounds=number)


def _iterated(
    swept: _Sweeps, equations: Factored, how: tuple[float, Traps], progress: Progress | None, told: str = ""
) -> int:
    """Solve and sweep in turn until no row gains anything that doubles can tell; return how often, 0 where it cannot be solved."""
    share, settings = how
    for number in range(1, settings.most_rounds + 1):
        if progress is not None:
            progress(f"policy iteration past traps{told}, round {number}")
        if not equations.follow(swept.rows):
            return 0
        values = _solved(equations)
        if values is None:
            return 0
        share = max(FINER * share, FINE)
        swept.start(values)
        if swept.run(settings.sweeps, share) == 0 and share == FINE:
            break
    return number


class _Sweeps:
    """The rows of a system in the order of distance from the end that is wanted, values, and the rows taken."""

    def __init__(self, system: System, maximise: bool) -> None:
        n = system.nodes
        self.system, self.sign = system, 1.0 if maximise else -1.0
        ends = np.arange(n + 2) >= n
        wanted = np.arange(n + 2) == (n + 1 if maximise else n)
        distance = graph.levels_to(system.index, wanted, ~ends)[:n]
        self.order = np.argsort(distance, kind="stable")
        rank = np.arange(n + 2)
        rank[self.order] = np.arange(n)
        rows = (system.node_to_rows, system.row_to_branches, system.target)
        kernel = compiled(ordered_rows, len(system.target))
        offsets = np.zeros(n + 1, dtype=np.int32), np.zeros(system.rows + 1, dtype=np.int32)
        self.ordered: Ordered = kernel(rows, system.probability, system.cost, (self.order, rank), offsets)
        self.values = np.zeros(n + 2)
        self.values[n + 1] = 1.0
        self.taken = self.ordered.node_to_rows[:-1].astype(np.int32)

    def start(self, values: Floats, rows: Nodes | None = None) -> None:
        """Take values of the nodes to sweep from, ``[n]``, and rows, if they are other than the last ones."""
        self.values[: len(self.order)] = values[self.order]
        if rows is not None:
            place = (rows - self.system.node_to_rows[:-1])[self.order]
            self.taken = (self.ordered.node_to_rows[:-1] + place).astype(np.int32)

    def run(self, sweeps: int, gain: float) -> int:
        """Sweep; return at how many nodes the row changed."""
        before, work = self.taken.copy(), len(self.ordered.target)
        kernel = compiled(sweep_rows, work)
        if not is_compiled(work):
            sweeps = max(1, min(sweeps, PLAIN // work))
        at_once = max(1, min(sweeps, SLICE // work))
        made = 0
        while made < sweeps:
            look()
            rows = self.ordered
            offsets = rows.node_to_rows, rows.row_to_branches
            _, moving, _ = kernel(
                *offsets, rows.target, rows.probability, self.values, self.taken, self.sign, gain, at_once
            )
            made += at_once
            if moving == 0:
                break
        return int(np.count_nonzero(before != self.taken))

    @property
    def rows(self) -> Nodes:
        """The row taken at each node, ``[n]``."""
        rows = np.empty(len(self.order), dtype=np.int64)
        rows[self.order] = self.system.node_to_rows[self.order] + (self.taken - self.ordered.node_to_rows[:-1])
        return rows


def _solved(equations: Factored) -> Floats | None:
    """Return the solution of the equations in doubles, refined once; None where it is not one of probabilities."""
    chain = equations.chain
    assert chain is not None
    start = np.zeros(chain.nodes)
    values = equations.solve(drift(chain, start)[0])
    values = np.clip(values + equations.solve(drift(chain, values)[0]), 0.0, 1.0)
    return values if np.isfinite(values).all() else None


def improved_in_two_parts(
    system: System, maximise: bool, equations: Factored, most: int = MOST_EXACT, progress: Progress | None = None
) -> Trapped | None:
    """Return the optimum in two parts, from the rows that `equations` follow on; None where it cannot be solved.

    Parameters
    ----------
    system : System
    maximise : bool
    equations : Factored
        Of the system.
    most : int
        After how many solutions to stop; 1 for those of the present rows.
    progress : callable, optional
    """
    sign = -1.0 if maximise else 1.0
    best: Trapped | None = None
    for number in range(1, most + 1):
        values = refined_values(equations)
        if values is None:
            return best
        high, low = values
        total, error = exact_drift(system, high, low)
        error += GRAIN * exchanged(system, high)
        best = Trapped(
            high=high, low=low, rows=equations.rows, drift=total, error=error, equations=equations, rounds=number
        )
        if number == most:
            break
        doubt = np.abs(equations.solve((np.abs(total) + error)[equations.rows]))
        wide = drift(system, doubt, cost=np.zeros(system.rows), one=0.0)[1] / system.rounding
        rows = best_rows(system, sign * total, CAUTION * (error + wide), equations.rows)
        changed = int(np.count_nonzero(rows != equations.rows))
        if progress is not None:
            progress(f"policy iteration past traps, in two parts: {changed} of {system.nodes} choices improved")
        if changed == 0:
            break
        if not equations.follow(rows):
            return best
    return best


def on_plateaus(
    system: System, found: Trapped, share: float, maximise: bool, progress: Progress | None = None
) -> tuple[System, Nodes, Trapped] | None:
    """Return the system with plateaus collapsed, the node of each node, and its optimum in two parts; None if it is not solved.

    Parameters
    ----------
    system : System
    found : Trapped
        Its optimum, nearly.
    share : float
        Up to which share of the value a step on a plateau changes it.
    maximise : bool
    progress : callable, optional
    """
    flat = flattened(system, found.high, found.low, share)
    made, node = (system, np.arange(system.nodes + 2)) if flat is None else flat
    equations = found.equations
    if flat is None:
        if not equations.follow(found.rows):
            return None
    else:
        best = np.maximum if maximise else np.minimum
        values = np.full(made.nodes, -np.inf if maximise else np.inf)
        best.at(values, node[: system.nodes], found.high)
        if not equations.follow(found.rows):
            return None
        rows = _rows_towards_ends(made, node[: system.nodes], found.rows, equations.solve(np.ones(system.nodes)))
        swept = _Sweeps(made, maximise)
        equations = Factored(made)
        swept.start(values, rows)
        if _iterated(swept, equations, (FINE, Traps()), progress, " on plateaus") == 0:
            return None
    smooth = improved_in_two_parts(made, maximise, equations, progress=progress)
    return None if smooth is None else (made, node, smooth)


def _rows_towards_ends(made: System, node: Nodes, rows: Nodes, steps: Floats) -> Nodes:
    """Return for every node of a system with plateaus the row of that member which has the fewest steps to go, ``[n]``.

    With h the expected number of `steps` of a policy of the system as it was, and the least of its members' for a plateau, every row
    taken so leads to less on average, by 1: the rows arrive, in so many steps at most, and lose nothing that could be told.
    """
    nearest = np.lexsort((steps, node))
    first = nearest[np.searchsorted(node[nearest], np.arange(made.nodes))]
    wanted = rows[first]
    taken = made.source == wanted[made.row_node]
    return least_rows(made, np.where(taken, -1.0 - made.leave, -made.leave))


def refined_values(equations: Factored) -> tuple[Floats, Floats] | None:
    """Return the solution of the equations in two parts, None where it is not finite.

    Refinement ends when no drift is larger than its error, or none has become smaller by half.
    """
    chain = equations.chain
    assert chain is not None
    high, low = np.zeros(chain.nodes), np.zeros(chain.nodes)
    total, least, kept = exact_drift(chain, high, low)[0], np.inf, (high, low)
    for _ in range(MOST_REFINEMENTS):
        step = equations.solve(total)
        if not np.isfinite(step).all():
            return None
        high, low = two_sum(high, low + step)
        total, error = exact_drift(chain, high, low)
        error += GRAIN * exchanged(chain, np.abs(high))
        ratio = float(np.divide(np.abs(total), error, out=np.zeros_like(total), where=total != 0.0).max())
        if not ratio < least:
            break
        stuck = ratio > 0.5 * least
        least, kept = ratio, (high, low)
        if ratio <= 1.0 or stuck:
            break
    return kept if np.isfinite(least) else None
