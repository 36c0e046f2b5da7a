"""Equations enter, vectors that may be bounds leave: nothing here is trusted, a Bellman sweep decides (`sweeps`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ratherthan.model.compiling import is_compiled
from ratherthan.model.mdp import Floats
from ratherthan.verify.equations import ROUNDING, Core, Pair, Rows
from ratherthan.verify.frame import Array
from ratherthan.verify.settling import Judge, offered

__all__ = ["Budget", "search"]

Solver = Callable[[Floats], Floats]

DENSE = 400
EASY, LARGE = 20_000_000, 50_000
"""What needs more numbers than this, or has more entries, is swept before anything is solved."""
BETWEEN = 100
FINE_ROUNDS = 6
MOST_ROUNDS = 30
SCALES = (1.0, 64.0, 4096.0, 262144.0)


@dataclass(frozen=True, kw_only=True)
class Budget:
    """How much work the re-checker may do before it leaves a number open.

    Parameters
    ----------
    exact : int
        Up to so many open states are solved in exact fractions.
    sweeps : int
        Sweeps in which it is looked for where more and more can be gathered.
    rounds : int
        Linear solves of policy iteration.
    fill : int
        No linear system is solved that may need more numbers than this.
    """

    exact: int = 40
    sweeps: int = 3000
    rounds: int = 60
    fill: int = 200_000_000


def search(core: Core, budget: Budget, judge: Judge) -> Array | None:
    """Offer candidates to a judge until there is nothing better to offer.

    Parameters
    ----------
    core : Core
    budget : Budget
    judge : callable
        Given values of nodes, and the rows of a policy or None for what no policy can beat: whether they are a bound, and
        whether the bounds that were found are near enough to each other.

    Returns
    -------
    array of int, ``[n]``, or None
        The rows of a policy that looks better than all, but never leaves the open states from some node.
    """
    entries = len(core.rows.target)
    large = core.count > DENSE and entries >= LARGE and is_compiled(entries)
    fill = _fill(core) if core.count > DENSE and not large else 0
    if (large or fill > EASY) and offered(core, judge):
        return None
    if large:
        fill = _fill(core)
    return _solved(core, budget, judge) if fill <= budget.fill else None


def _toward(core: Core) -> float:
    """Return the sign of a price shift that helps the bound no policy can beat: lower for a least, upper for a largest value."""
    return 1.0 if core.problem.frame.maximise else -1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class _Sweeper:
    """Value iteration by products with one sparse matrix; staying in a node is divided out beforehand."""

    core: Core
    matrix: Any  # [m, n] the probability to go from each row to each other node, given that the node is left
    outside: Floats  # [m] what the known values outside give

    @staticmethod
    def of(core: Core) -> _Sweeper:
        from scipy.sparse import csr_array

        rows = core.rows
        target = core.node[rows.target]
        chance = rows.share / core.leaving[rows.entry_row]
        inside = (target >= 0) & (target != core.owner[rows.entry_row])
        away = np.where(target < 0, chance * core.problem.known[rows.target], 0.0)
        return _Sweeper(
            core=core,
            matrix=csr_array(
                (chance[inside], (rows.entry_row[inside], target[inside])), shape=(len(core.owner), core.count)
            ),
            outside=np.add.reduceat(away, rows.first),
        )

    def best(self, price: Floats, y: Floats) -> Array:
        """Return the best row of each node."""
        return self.core.best(self.outside + price / self.core.leaving + self.matrix @ y)

    def swept(self, price: Floats, y: Floats, times: int) -> Array:
        """Return the best rows after some sweeps from `y`."""
        fixed = self.outside + price / self.core.leaving
        reduce = np.maximum.reduceat if self.core.problem.frame.maximise else np.minimum.reduceat
        for _ in range(times):
            y = reduce(fixed + self.matrix @ y, self.core.begin)
        return self.best(price, y)


def _solved(core: Core, budget: Budget, judge: Judge) -> Array | None:
    """Offer what policy iteration finds, moved apart by margins that grow until the checks pass."""
    rows = core.outward_rows()
    found = None if rows is None else _policy_iteration(core, rows, budget.rounds)
    if found is None or isinstance(found, np.ndarray):
        return found
    y, rows, solver = found
    drift, error = core.rows.drift(*core.spread_pair(y))
    finest = 1024.0 * ROUNDING**2 * np.abs(y[0])[core.owner] + 1e-300  # what a value in two parts can tell apart
    beaten = attained = False
    for scale in SCALES:
        if not beaten:
            slack = scale * (4.0 * error + finest + np.maximum(_toward(core) * drift, 0.0))
            margin = _largest_sum(core, slack, np.minimum(_toward(core) * drift, 0.0), (rows, solver))
            beaten = margin is not None and judge(_moved(y, margin, _toward(core)), None)[0]
        if not attained:
            slack = scale * (4.0 * error + finest + np.abs(drift))
            margin = _refined(core.rows.some(rows).priced(2.0 * slack[rows]), solver, core, 0.0)
            attained = judge(_moved(y, margin, -_toward(core)), rows)[0]
        if beaten and attained:
            return None
    return None


def _moved(y: Pair, margin: Pair, sign: float) -> Pair:
    """Return y + sign · margin; what the sum of the large parts loses goes to the small one (Knuth's two-sum)."""
    large, further = y[0], sign * margin[0]
    total = large + further
    back = total - large
    return total, y[1] + sign * margin[1] + ((large - (total - back)) + (further - back))


def _largest_sum(core: Core, slack: Floats, gap: Floats, policy: tuple[Array, Solver]) -> Pair | None:
    """Return g with g ≥ slack + gap + P g along every row, by policy iteration; a gap is negative where a row is worse.

    Where the values do not differ the slack is tiny, and may be less than the rounding of g: it is raised to that. And rows
    may be so near to each other that rounding makes the iteration go round: then g is raised there instead.
    """
    rows, solver = policy
    further = np.zeros(core.count)
    for turn in range(MOST_ROUNDS):
        margin = _refined(core.rows.some(rows).priced((2.0 * slack + gap)[rows] + further), solver, core, 0.0)
        if not np.isfinite(margin).all():
            return None
        drift, error = core.rows.priced(slack).drift(*core.spread_pair(margin, 0.0))
        short = drift + gap
        worst = core.largest(short)
        rising, coarse = short[worst] > 0.0, 8.0 * error > slack
        if not rising.any() and not coarse.any():
            return margin
        slack = np.where(coarse, 16.0 * error, slack)
        if turn >= FINE_ROUNDS:
            near = rising & (short[worst] <= 1e-6 * margin[0])
            further = np.where(near, further + 2.0 * short[worst], further)
            rising &= ~near
        if rising.any():
            rows = np.where(rising, worst, rows)
            following = _solver(core, rows)
            if following is None or not core.absorbed(rows):
                return None
            solver = following
    return None


def _policy_iteration(core: Core, rows: Array, rounds: int) -> tuple[Pair, Array, Solver] | Array | None:
    """Improve a policy until nothing is better by more than rounding, and a little further; None where that fails.

    Returned is a policy alone where it would be better, but never leaves the open states.
    """
    sweeper = _Sweeper.of(core) if core.count > DENSE else None
    further = FINE_ROUNDS
    for _ in range(rounds):
        solver = _solver(core, rows)
        if solver is None:
            return None
        y = _refined(core.rows.some(rows), solver, core)
        if not np.isfinite(y).all():
            return None
        drift, error = core.rows.drift(*core.spread_pair(y))
        best = core.best(drift / core.leaving)
        gain = np.where(best == rows, 0.0, _toward(core) * drift[best] - np.abs(drift[rows]))
        coarse = gain > 8.0 * error[best] + 32.0 * np.spacing(np.abs(y[0]))
        fine = gain > 8.0 * error[best] + 1024.0 * ROUNDING**2 * np.abs(y[0])
        if not fine.any() or (not coarse.any() and further == 0):
            return y, rows, solver
        rows = np.where(fine, best, rows)
        if not coarse.any():
            further -= 1
        elif sweeper is not None:
            swept = sweeper.swept(core.rows.price, y[0], BETWEEN)
            rows = swept if core.absorbed(swept) else rows
        if not core.absorbed(rows):
            return rows
    return None


def _refined(rows: Rows, solver: Solver, core: Core, known: float | None = None) -> Pair:
    """Solve the equations of a policy, and correct the solution by what it misses, in a second part beside it."""
    zero = np.zeros(core.count)
    large, small = solver(rows.drift(core.spread(zero, known))[0]), zero
    for _ in range(3):
        small = small + solver(rows.drift(*core.spread_pair((large, small), known))[0])
        total = large + small
        large, small = total, small - (total - large)
    return large, small


def _fill(core: Core) -> int:
    """Return how many numbers the factors of a policy's equations need at most, in a good order of the nodes."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    target = core.node[core.rows.target]
    inside = target >= 0
    where = core.owner[core.rows.entry_row[inside]], target[inside]
    pattern = csr_array((np.ones(len(where[0]), dtype=np.int8), where), shape=(core.count, core.count))
    place = np.empty(core.count, dtype=np.int64)
    place[reverse_cuthill_mckee(csr_array(pattern + pattern.T), symmetric_mode=True)] = np.arange(core.count)
    first = np.arange(core.count)
    np.minimum.at(first, place[where[0]], place[where[1]])
    np.minimum.at(first, place[where[1]], place[where[0]])
    return 2 * int((np.arange(core.count) - first).sum())


def _solver(core: Core, chosen: Array) -> Solver | None:
    """Return a solver of (I - P) y = b for a policy, None where the matrix cannot be factorised."""
    rows = core.rows.some(chosen)
    target = core.node[rows.target]
    inside = (target >= 0) & (target != rows.entry_row)
    if core.count <= DENSE:
        matrix = np.zeros((core.count, core.count))
        np.add.at(matrix, (rows.entry_row[inside], target[inside]), -rows.share[inside])
        np.fill_diagonal(matrix, core.leaving[chosen])
        try:
            inverse = np.linalg.inv(matrix)
        except np.linalg.LinAlgError:
            return None
        return lambda b: np.asarray(inverse @ b)
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    nodes = np.arange(core.count)
    data = np.concatenate([-rows.share[inside], core.leaving[chosen]])
    where = np.concatenate([rows.entry_row[inside], nodes]), np.concatenate([target[inside], nodes])
    try:
        factors = splu(
            csc_array((data, where), shape=(core.count, core.count)),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except (RuntimeError, MemoryError):
        return None
    return lambda b: np.asarray(factors.solve(b))
