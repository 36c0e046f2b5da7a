"""Choices, weights and an Effort enter; their Counts leave: this decides which method counts what, and when to stop.

1. Where all streets run both ways, `pieces` answers everything in one pass.
2. Elsewhere searches go from choice to choice; landmarks spare them what they share, and more landmarks are made while the
   searches still take long.
3. When they have cost as much as one of the following would, or a good share of the work granted, the `closure` counts what it
   can: most choices among small strong components.
4. The rest is searched `together`, 512 choices at a time.

All of them are exact, so which one counted a choice cannot be seen in the number. Whatever the work granted does not suffice
for is not counted: its bounds are 0 and the weight of all states.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.factors.counting._kernels import near_weights
from ratherthan.factors.counting.closure import Split, closure_visits, split, weigh_roots
from ratherthan.factors.counting.effort import Counts, Effort
from ratherthan.factors.counting.ground import Ground
from ratherthan.factors.counting.pieces import sums_of, weigh_pieces
from ratherthan.factors.counting.sketches import estimated
from ratherthan.factors.counting.together import TOGETHER, Together, together_visits
from ratherthan.factors.landmarks import CHUNK, LANDMARKS, Weigher, landmark_at, next_root, slice_visits
from ratherthan.model._kernels import compiled
from ratherthan.model.watch import look

__all__ = ["count_all", "count_near"]

Numbers = npt.NDArray[np.int64]

LONG = 4
"""From how many passes over all states on it is worth looking for something better than searching on."""
FEW = 12
"""Up to how many searches all over a model, in all questions together, no landmark is worth making."""
SHARE = 4
"""Of the work that is left, searching by turns may have cost so much before what shares more is tried: one part in so many."""


class _Table:
    """What was counted so far, and with how much work."""

    def __init__(self, ground: Ground, choices: Numbers, weights: tuple[Numbers, Numbers], effort: Effort) -> None:
        self.ground, self.choices, self.weights, self.effort = ground, choices, weights, effort
        self.states = ground.states_of(choices)
        self.lower = np.zeros(len(choices), dtype=np.int64)
        self.upper = np.full(len(choices), int(weights[1].sum()), dtype=np.int64)
        self.counted = np.zeros(len(choices), dtype=np.bool_)
        self.spent = 0

    @property
    def left(self) -> int | None:
        """The visits that are left, None where as many as it takes are granted."""
        return None if self.effort.visits is None else self.effort.visits - self.spent

    @property
    def over(self) -> bool:
        """Whether all work is spent."""
        return self.left is not None and self.left <= 0

    def put(self, rows: Numbers, lower: Numbers, upper: Numbers, spent: int) -> None:
        """Note what was counted of some rows."""
        self.lower[rows], self.upper[rows], self.counted[rows] = lower, upper, True
        self.spent += spent

    def tell(self) -> None:
        """Say how far it is."""
        look(f"Counting the decisions left open: {int(self.counted.sum())} of {len(self.choices)} choices")

    def counts(self) -> Counts:
        """Return what there is, without estimates."""
        return Counts(
            choices=self.choices,
            lower=self.lower,
            upper=self.upper,
            counted=self.counted,
            visits=self.spent,
            estimate=np.zeros(len(self.choices)),
            error=np.zeros(len(self.choices)),
            estimated=np.zeros(len(self.choices), dtype=np.bool_),
        )


def count_all(ground: Ground, choices: Numbers, weights: tuple[Numbers, Numbers], effort: Effort) -> Counts:
    """Weigh the search trees of some choices.

    Parameters
    ----------
    ground : Ground
    choices : array of int, ``[N]``
    weights : pair of arrays of int, ``[S]``
        Those of the states that count for sure, and of all that may count.
    effort : Effort
    """
    table = _Table(ground, choices, weights, effort)
    if table.over:
        return _with_estimates(table)
    pieces = ground.pieces
    if pieces is not None and not weights[1][pieces.ends].any():
        rows = ground.rows[1], ground.rows[2]
        sums = ground.once("pieces", weights, lambda: sums_of(pieces, weights))
        found = weigh_pieces(pieces, rows, (choices, table.states), sums, ground.work)
        table.put(np.arange(len(choices)), *found, spent=ground.states)
        return table.counts()
    if not _search(table):
        _close(table)
        _together(table)
    return _with_estimates(table)


def count_near(
    ground: Ground, choices: Numbers, weights: tuple[Numbers, Numbers], effort: Effort, horizon: int
) -> Counts:
    """Weigh the search trees of some choices as far as `horizon` steps after the choice; else as in `count_all`."""
    table = _Table(ground, choices, weights, effort)
    kernel = compiled(near_weights, ground.work)
    rows = ground.rows[1], ground.rows[2], ground.leaving_from, ground.leaving
    most = slice_visits(ground)
    room = np.zeros(ground.states, dtype=np.int64), np.empty(ground.states, dtype=np.int32)
    at = 0
    while at < len(choices) and not table.over:
        budget = most if table.left is None else min(most, table.left)
        part = slice(at, at + CHUNK)
        lower, upper, done, spent = kernel(
            choices[part], table.states[part], rows, *weights, (*room, at + 1), horizon, budget
        )
        table.put(np.arange(at, at + done), lower[:done], upper[:done], spent)
        table.tell()
        at += done
    return table.counts()


def _search(table: _Table) -> bool:
    """Search from choice to choice; return False if there is a better way to go on."""
    ground, known = table.ground, table.ground.landmarks
    todo = np.flatnonzero(~table.counted)
    if not known and (len(todo) > FEW or ground.searched[0] > FEW * ground.states):
        _more(table, todo)
    weigher = Weigher(ground, known, table.weights)
    at, since, begun, total = 0, 0, 0, 0
    more, cost = True, -1
    while at < len(todo) and not table.over:
        part = todo[at : at + CHUNK]
        lower, upper, spent = weigher.weigh(table.choices[part], table.states[part], table.left)
        table.put(part[: len(lower)], lower, upper, spent)
        table.tell()
        at, since, total = at + len(lower), since + spent, total + spent
        ground.searched[0] += spent
        ahead = since * (len(todo) - at) // (at - begun)
        if min(since, ahead) <= LONG * ground.states:
            continue
        more = more and _more(table, todo[at:])
        if more:
            weigher, since, begun = Weigher(ground, known, table.weights), 0, at
            continue
        if cost < 0:
            closing = closure_visits(ground, len(todo) - at, table.weights[1])
            cost = min(closing, together_visits(ground, len(todo) - at))
        if cost <= ahead and total >= (cost if table.left is None else min(cost, table.left // SHARE)):
            return False
    return True


def _more(table: _Table, todo: Numbers) -> bool:
    """Make one more landmark for what is to be counted; return False where that would not help."""
    known = table.ground.landmarks
    root = next_root(table.ground, known, table.states[todo]) if len(known) < LANDMARKS else None
    if root is not None:
        known.append(landmark_at(table.ground, root))
    return root is not None


def _close(table: _Table) -> None:
    """Count what the closure can count, if that is worth it."""
    todo, found = _split(table)
    cost = closure_visits(table.ground, len(found.roots), table.weights[1])
    affordable = table.left is None or cost <= table.left
    if len(todo) and affordable and cost <= together_visits(table.ground, len(todo)):
        table.put(todo, *weigh_roots(table.ground, found, table.weights), spent=cost)


def _together(table: _Table) -> None:
    """Search from many choices at once, until all work is spent."""
    todo = np.flatnonzero(~table.counted)
    parts = table.ground.components
    todo = todo[np.lexsort((table.states[todo], parts.component[table.states[todo]]))]  # neighbours share the most
    searcher = Together(table.ground, table.weights)
    for first in range(0, len(todo), TOGETHER):
        if table.over:
            return
        table.tell()
        part = todo[first : first + TOGETHER]
        table.put(part, *searcher.weigh(table.choices[part], table.states[part]))


def _split(table: _Table) -> tuple[Numbers, Split]:
    """Return which of the choices not counted could be split, and their parts."""
    todo = np.flatnonzero(~table.counted)
    found = split(table.ground, table.choices[todo], table.states[todo], table.weights)
    done = found.done
    length = np.diff(found.roots_from)[done]  # the others have no roots
    roots_from = np.zeros(len(length) + 1, dtype=np.int64)
    np.cumsum(length, out=roots_from[1:])
    return todo[done], Split(done[done], roots_from, found.roots, found.lower[done], found.upper[done])


def _with_estimates(table: _Table) -> Counts:
    """Return what there is, with estimates of the rest where they are wanted."""
    counts = table.counts()
    if not table.effort.estimate or table.counted.all():
        return counts
    todo, found = _split(table)
    estimate, error = estimated(table.ground, found, table.weights[0])
    counts.estimate[todo], counts.error[todo], counts.estimated[todo] = estimate, error, True
    return counts
