"""The equations of nodes enter; vectors that may be bounds leave: sweeps through windows of layers, for systems that are large.

How
---
Nodes are put in the order in which a search backwards from the outside meets them, layer by layer; what a value rests on has mostly
come before. A window of layers is swept, in place, until its values rest; after each sweep that chooses, some keep to what was chosen,
which is a policy evaluated on the way. Then the window moves on by half its width. Passes are repeated, with wider windows where they
gain little, until one sweep of everything changes no value by more than it may. Staying in a node is divided out beforehand.

What is offered
---------------
Where every row costs something, values that are nearly right become bounds by *scaling*. With D(c) = r(c) + P x - x,

    r + P (1 ± η) x - (1 ± η) x = (1 ± η) D ∓ η r,

so a share η with η (r - D) ≥ |D| + rounding in all rows on the side that matters is enough: (1 - η) x never falls, (1 + η) x never
rises (for a least cost; for a largest, the other way round along one policy). Elsewhere the equations are solved once more for prices
*shifted* a little in favour of the check, by a share of the value, on the rows of a policy that leads outside: of rows that are nearly
as good as the best, a search from the outside takes those by which it meets a node, so that nobody goes round for ever.

It is given up when that took more than the work permitted, or a pass of everything gains nothing; then others may try.

References
----------
D. P. Bertsekas, J. N. Tsitsiklis, An Analysis of Stochastic Shortest Path Problems, Math. Oper. Res. 16(3), 1991.
M. L. Puterman, M. C. Shin, Modified Policy Iteration Algorithms for Discounted Markov Decision Problems, Manag. Sci. 24(11), 1978.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ratherthan.model.compiling import compiled, is_compiled
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.watch import look
from ratherthan.verify._kernels import Table, arranged, largest_gap, outwards, settle
from ratherthan.verify.equations import Core, Pair
from ratherthan.verify.frame import Array

__all__ = ["Judge", "offered"]

Judge = Callable[[Pair, Array | None], tuple[bool, bool]]

SHARP = 1e-9
"""Where scaling is possible: by which share of the least price of a node its value may still change."""
SHIFT = 2e-13
"""Elsewhere: by which share of its value prices are shifted; it may still change by a quarter of that."""
FLOOR = 2e-15
"""No value is known better than up to this share of itself."""
WIDEST = 1e-3
"""A larger share is no scaling."""
WORK, PLAIN_WORK = 8_000_000_000, 1_000_000
"""How many entries are gone through at most, compiled and not."""
SLICE = 40_000_000
"""After so many entries it is looked whether to go on."""
FIRST_WIDTH = 40
KEEP = 3
COARSE = 1e6
"""The first pass is so much looser."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _System:
    """y = min over the rows of a node of fixed + P y, the sign turned where the largest is wanted, nodes in the order of a search."""

    table: Table
    fixed: Floats  # [m]
    outer: Bools  # [m] whether a row may lead outside
    order: Array  # [n] which node of the core each one is
    number: Array  # [m] and which row
    starts: Array  # where the layers begin, from the outside inwards
    near: Floats  # [n] a value may still change by so much
    floor: float  # and by this share of itself

    def restored(self, y: Floats) -> Floats:
        """Return values in the order of the core."""
        found = np.empty_like(y)
        found[self.order] = y
        return found

    def rows(self, taken: Array) -> Array:
        """Return rows as those of the core, in its order."""
        found = np.empty_like(taken)
        found[self.order] = self.number[taken]
        return found

    @property
    def work(self) -> int:
        """How many entries there are."""
        return len(self.table.target)

    def largest_gap(self, y: Floats) -> tuple[float, Array]:
        """Return what one sweep of everything would change, in units of what it may, and the best rows."""
        taken = self.table.begin[:-1].copy()
        gap = compiled(largest_gap, self.work)(self.table, self.fixed, y, self.near, self.floor, taken)
        return float(gap), taken

    def settled(self, y: Floats | None, work: float) -> Floats | None:
        """Return what sweeps from `y`, or from nothing, come to; None where that takes too much work or leads nowhere."""
        known = 0 if y is None else len(y)
        y, taken = np.zeros(len(self.near)) if y is None else y.copy(), self.table.begin[:-1].copy()
        run, layers = compiled(settle, self.work), len(self.starts) - 1
        width, loose, before = min(FIRST_WIDTH, layers), COARSE, np.inf
        while work > 0:
            layer = 0
            while layer < layers and work > 0:
                look()
                place = (layer, width, KEEP, int(min(SLICE, work)), known)
                turn = run(self.table, self.fixed, self.starts, y, taken, self.near, place, (loose, self.floor))
                if turn.layer < 0:
                    return None
                layer, known, work = turn.layer, turn.known, work - turn.spent
            gap = self.largest_gap(y)[0]
            work -= self.work
            if gap <= 1.0:
                return y
            if not gap < 0.5 * before:
                if width == layers and loose <= 0.1 and not gap < before:
                    return None
                width = min(2 * width, layers)
            before, loose = gap, 0.5 if loose >= 1.0 else 0.5 * loose
        return None

    def priced(self, shift: Floats) -> _System:
        """Return the same with rows that cost more by `shift`."""
        return replace(self, fixed=self.fixed + shift)

    def narrowed(self, rows: Array) -> _System:
        """Return the same with one row for each node."""
        first, last = self.table.first[rows], self.table.first[rows + 1]
        count = last - first
        ends = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        entry = np.repeat(first - ends[:-1], count) + np.arange(ends[-1])
        table = Table(
            begin=np.arange(len(rows) + 1), first=ends, target=self.table.target[entry], share=self.table.share[entry]
        )
        return replace(self, table=table, fixed=self.fixed[rows])


def _sign(core: Core) -> float:
    return -1.0 if core.problem.frame.maximise else 1.0


def _system(core: Core) -> _System | None:
    """Return the equations of the nodes; None where some of them cannot lead outside."""
    rows = core.rows
    target = core.node[rows.target]
    chance = rows.share / core.leaving[rows.entry_row]
    beyond = target < 0
    inside = ~beyond & (target != core.owner[rows.entry_row])
    paid = np.where(beyond, chance * core.problem.known[rows.target], 0.0)
    fixed = _sign(core) * (np.add.reduceat(paid, rows.first) + rows.price / core.leaving)
    outer = np.logical_or.reduceat(beyond, rows.first) | (rows.fading > 0.0)
    count = np.bincount(rows.entry_row[inside], minlength=len(core.owner))
    table = Table(
        begin=np.append(core.begin, len(core.owner)).astype(np.int64),
        first=np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
        target=target[inside].astype(np.int32),
        share=chance[inside],
    )
    order, starts, _ = compiled(outwards, len(chance))(table, outer, np.ones(len(outer), dtype=np.bool_))
    if len(order) < core.count:
        return None
    table, number = compiled(arranged, len(chance))(table, order)
    return _System(
        table=Table(*table),
        fixed=fixed[number],
        outer=outer[number],
        order=order,
        number=number,
        starts=starts,
        near=np.zeros(core.count),
        floor=FLOOR,
    )


def offered(core: Core, judge: Judge) -> bool:
    """Offer a judge what sweeps come to; return whether that is enough.

    Parameters
    ----------
    core : Core
    judge : callable
        As in `ratherthan.verify.candidates.search`.
    """
    system = _system(core)
    if system is None:
        return False
    work = WORK if is_compiled(system.work) else PLAIN_WORK
    least = np.minimum.reduceat((core.rows.price - core.rows.blur) / core.leaving, core.begin)[system.order]
    if core.problem.frame.costs and not core.problem.frame.signed and bool((least > 0.0).all()):
        system = replace(system, near=SHARP * least)
        found = system.settled(None, work)
        return found is not None and _scaled(core, system, found, judge)
    return _shifted(core, system, judge, work)


def _scaled(core: Core, system: _System, y: Floats, judge: Judge) -> bool:
    """Offer values made smaller and larger by the least share that the checks need."""
    taken = system.rows(system.largest_gap(y)[1])
    y = _sign(core) * system.restored(y)
    toward = -_sign(core)
    drift, error = core.rows.drift(*core.spread_pair((y, np.zeros(core.count))))
    first = _share(toward * drift, error, core.rows.price - drift)
    second = _share(-toward * drift[taken], error[taken], (core.rows.price - drift)[taken])
    if not max(first, second) <= WIDEST:
        return False
    return judge(_times(y, toward * first), None)[0] and judge(_times(y, -toward * second), taken)[1]


def _share(wrong: Floats, error: Floats, gain: Floats) -> float:
    """Return the share by which values must be scaled so that no row moves the wrong way by more than the rounding."""
    miss = wrong + 2.5 * error
    hit = miss > 0.0
    if not hit.any():
        return 0.0
    if not (gain[hit] > 0.0).all():
        return np.inf
    return float((miss[hit] / gain[hit]).max()) * (1 + 1e-9)


def _times(y: Floats, share: float) -> Pair:
    """Return y · (1 + share) in two parts, the second of which keeps what the first one loses."""
    further = share * y
    total = y + further
    back = total - y
    return total, (y - (total - back)) + (further - back)


def _shifted(core: Core, system: _System, judge: Judge, work: float) -> bool:
    """Offer what sweeps come to with prices that are shifted towards either side."""
    signed, y = core.problem.frame.signed, None
    for share in (1e-6, 1.0) if signed else (1.0,):  # how large values of both signs are is known when they are
        largest = float(np.abs(system.fixed if y is None else y).max()) if signed else 0.0
        near = np.full(core.count, max(0.25 * SHIFT / share * largest, 1e-300))
        system = replace(system, near=near, floor=0.0 if signed else 0.25 * SHIFT)
        y = system.settled(y, work)
        if y is None:
            return False
    assert y is not None
    size = SHIFT * np.maximum(core.sizes(y), 1e-300)
    taken = _leading_out(system, y)
    bound = system.priced(-np.repeat(size, np.diff(system.table.begin))).settled(y, work)
    if taken is None or bound is None or not judge(_whole(core, system, bound), None)[0]:
        return False
    reached = system.narrowed(taken).priced(size).settled(y, work)
    return reached is not None and judge(_whole(core, system, reached), system.rows(taken))[1]


def _whole(core: Core, system: _System, y: Floats) -> Pair:
    """Return values as the core has them, with no second part."""
    return _sign(core) * system.restored(y), np.zeros(core.count)


def _leading_out(system: _System, y: Floats) -> Array | None:
    """Return for each node a row among those that are nearly the best, so that all of them lead outside; None for none."""
    table = system.table
    row = np.repeat(np.arange(len(table.first) - 1), np.diff(table.first))
    worth = system.fixed + np.bincount(row, weights=table.share * y[table.target], minlength=len(table.first) - 1)
    best = np.minimum.reduceat(worth, table.begin[:-1])
    bound = best + 4.0 * (system.near + system.floor * np.abs(best))
    near = worth <= np.repeat(bound, np.diff(table.begin))
    order, _, taken = compiled(outwards, system.work)(table, system.outer, near)
    return taken if len(order) == len(y) else None
