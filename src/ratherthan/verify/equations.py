"""The open states of a frame enter, their equations leave as rows of arrays, with free end components collapsed into nodes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ratherthan.model.compiling import compiled, is_compiled
from ratherthan.model.mdp import Bools, Floats
from ratherthan.verify._kernels import drifts
from ratherthan.verify.frame import Array, Frame, slices

__all__ = ["Core", "Open", "Pair", "Rows", "core_of", "leaves", "rows_of"]

Pair = tuple[Floats, Floats]
"""Values in two parts, a large and a small one: their sum."""

ROUNDING = 1.12e-16
"""A little more than the unit roundoff of a double."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Open:
    """The open states of a frame, the choices between them, and what is known outside.

    Parameters
    ----------
    frame : Frame
    open : array of bool, ``[S]``
    rows : array of bool, ``[C]``
        The choices of open states among which the optimum is; all their branches lead to open or known states.
    known : array of float, ``[S]``
        The exact, finite value of every state that is not open.
    block : array of int, ``[S]``
        The end component that a state is collapsed into, -1 for none.
    weight : array of float, ``[C]``, optional
        A randomised policy: then nothing is chosen.
    """

    frame: Frame
    open: Bools  # [S]
    rows: Bools  # [C]
    known: Floats  # [S]
    block: Array  # [S]
    weight: Floats | None = None  # [C]


@dataclass(frozen=True, kw_only=True, eq=False)
class Rows:
    """Some choices as arrays; several of them may be mixed into one row by their weights."""

    source: Array  # [m] the state (or node) of each row
    price: Floats  # [m]
    blur: Floats  # [m] the rounding error of the price
    fading: float  # the chance that a step is the last one, whatever is chosen
    first: Array  # [m] where the entries of each row begin
    entry_row: Array  # [e]
    target: Array  # [e]
    share: Floats  # [e]

    def drift(self, x: Floats, rest: Floats | None = None) -> tuple[Floats, Floats]:
        """Return D of every row for the values x + rest, and a bound of its rounding error, ``[m]`` each.

        The error is relative to the differences, not to the values: the small `rest` is kept apart for that.
        """
        drift, size = self._drift(x, rest)
        degree = np.diff(np.append(self.first, len(self.target)))
        error = (2 * degree + 20) * ROUNDING * size + np.where(size > 0.0, degree * 1e-320, 0.0) + self.blur
        return drift, error

    def _drift(self, x: Floats, rest: Floats | None) -> tuple[Floats, Floats]:
        """Return D, and the sum of the sizes of all that it was added up of."""
        if is_compiled(len(self.target)):
            rows = self.source, self.first, self.target
            rest = np.zeros_like(x) if rest is None else rest
            return compiled(drifts, len(self.target))(rows, self.share, self.price, float(self.fading), x, rest)
        origin = self.source[self.entry_row]
        apart = x[self.target] - x[origin]
        size = np.abs(apart)
        if rest is not None:
            further = rest[self.target] - rest[origin]
            apart, size = apart + further, size + np.abs(further)
        drift: Floats = self.price + np.add.reduceat(self.share * apart, self.first)
        size = np.abs(self.price) + np.add.reduceat(self.share * size, self.first)
        if self.fading:
            ending = self.fading * x[self.source]
            drift, size = drift - ending, size + np.abs(ending)
            if rest is not None:
                ending = self.fading * rest[self.source]
                drift, size = drift - ending, size + np.abs(ending)
        return drift, size

    def priced(self, price: Floats) -> Rows:
        """Return the same rows at another price, which is taken as it is."""
        return replace(self, price=price, blur=np.zeros(len(price)))

    def some(self, which: Array) -> Rows:
        """Return some of the rows."""
        last = np.append(self.first, len(self.target))[1:]
        entry = slices(self.first[which], last[which])
        count = (last - self.first)[which]
        return Rows(
            source=self.source[which],
            price=self.price[which],
            blur=self.blur[which],
            fading=self.fading,
            first=np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.int64),
            entry_row=np.repeat(np.arange(len(which)), count),
            target=self.target[entry],
            share=self.share[entry],
        )


def rows_of(problem: Open, choices: Array) -> Rows:
    """Return choices as rows, mixed by state where the policy is randomised."""
    frame, mdp = problem.frame, problem.frame.mdp
    begin, end = mdp.choice_to_branches[choices].astype(np.int64), mdp.choice_to_branches[choices + 1].astype(np.int64)
    entry = slices(begin, end)
    part = np.ones(len(choices))
    source = frame.row_state[choices]
    row = np.arange(len(choices))
    if problem.weight is not None:
        source, row = np.unique(source, return_inverse=True)
        total = np.bincount(row, weights=problem.weight[choices])
        part = problem.weight[choices] / total[row]
    entry_row = np.repeat(row, end - begin)
    return Rows(
        source=source,
        price=np.bincount(row, weights=part * frame.price[choices], minlength=len(source)).astype(np.float64),
        blur=_mixed_blur(problem, choices, row, part),
        fading=1.0 - frame.discount,
        first=np.searchsorted(entry_row, np.arange(len(source))).astype(np.int64),
        entry_row=entry_row,
        target=mdp.branch_to_target[entry].astype(np.int64),
        share=np.repeat(part, end - begin) * frame.share[entry] * frame.discount,
    )


def _mixed_blur(problem: Open, choices: Array, row: Array, part: Floats) -> Floats:
    """Return the rounding error of the prices of rows that may mix several choices, ``[m]``."""
    blur, price = problem.frame.blur[choices], np.abs(problem.frame.price[choices])
    if problem.weight is not None:
        blur = part * (blur + 16 * ROUNDING * price)
    return np.bincount(row, weights=blur).astype(np.float64)


@dataclass(frozen=True, kw_only=True, eq=False)
class Core:
    """The open states with free end components collapsed into nodes: n nodes, m rows in the order of the nodes.

    Node n stands for all that is known: its rows are none, and targets outside are kept by `known`.
    """

    problem: Open
    every: Rows
    node: Array  # [S]
    count: int
    rows: Rows  # source and target are states of the original
    number: Array  # [m] the row of `every`
    owner: Array  # [m] its node
    begin: Array  # [n] where the rows of each node begin
    leaving: Floats  # [m] the probability to leave the node

    def spread(self, y: Floats, known: float | None = None) -> Floats:
        """Return the values of nodes as values of states, ``[S]``; what is known outside may be replaced by one number."""
        x = self.problem.known.copy() if known is None else np.full(len(self.problem.known), known)
        x[self.problem.open] = y[self.node[self.problem.open]]
        return x

    def spread_pair(self, pair: Pair, known: float | None = None) -> tuple[Floats, Floats]:
        """Return values in two parts as values of states, ``[S]`` each; the known ones have no second part."""
        return self.spread(pair[0], known), self.spread(pair[1], 0.0)

    def sizes(self, y: Floats) -> Floats:
        """Return by what the values of nodes are measured: their own size, and the largest where signs may differ, ``[n]``."""
        size = np.abs(y)
        return np.full_like(size, size.max(initial=0.0)) if self.problem.frame.signed else size

    def largest(self, worth: Floats) -> Array:
        """Return the row of each node that is worth most, the first of several, ``[n]``."""
        most = np.maximum.reduceat(worth, self.begin)
        hits = np.flatnonzero(worth >= most[self.owner])
        return hits[np.searchsorted(self.owner[hits], np.arange(self.count))]

    def best(self, worth: Floats) -> Array:
        """Return the best row of each node, ``[n]``: the first of the smallest (the largest, when maximising)."""
        return self.largest(worth if self.problem.frame.maximise else -worth)

    def narrowed(self, rows: Array) -> Core:
        """Return the same nodes with one row each."""
        return replace(
            self,
            rows=self.rows.some(rows),
            number=self.number[rows],
            owner=np.arange(self.count),
            begin=np.arange(self.count),
            leaving=self.leaving[rows],
        )

    def _levels(self, rows: Rows, owner: Array) -> Array:
        """Return for each node the first row with a branch to a node nearer to the outside, -1 where there is none."""
        target = self.node[rows.target]
        order = np.argsort(target, kind="stable")
        begin = np.searchsorted(target[order], np.arange(self.count + 1))
        taken = np.full(self.count, -1, dtype=np.int64)
        hit = np.arange(len(owner)) if rows.fading else np.unique(rows.entry_row[target < 0])
        while len(hit):
            hit = hit[taken[owner[hit]] < 0]
            fresh, where = np.unique(owner[hit], return_index=True)
            taken[fresh] = hit[where]
            hit = np.unique(rows.entry_row[order[slices(begin[fresh], begin[fresh + 1])]])
        return taken

    def outward_rows(self) -> Array | None:
        """Return a row for each node: a policy that leaves the open states with probability 1, by layers."""
        taken = self._levels(self.rows, self.owner)
        return taken if (taken >= 0).all() else None

    def absorbed(self, rows: Array) -> bool:
        """Return whether from every node the outside is reached with positive probability, hence with probability 1."""
        return bool((self._levels(self.rows.some(rows), np.arange(self.count)) >= 0).all())

    def policy(self, rows: Array) -> Array | None:
        """Return the rows of `every` that a policy takes, one per state; None unless it leaves the open states for sure."""
        problem, frame = self.problem, self.problem.frame
        taken = np.full(frame.mdp.states, -1, dtype=np.int64)
        source = self.every.source
        exits = self.number[rows]
        taken[source[exits]] = exits
        inner = np.ones(len(source), dtype=np.bool_)
        inner[self.number] = False
        if problem.weight is None:
            self._inwards(taken, np.flatnonzero(inner))
        if (taken[problem.open] < 0).any():
            return None
        chosen = taken[problem.open]
        return chosen if leaves(problem, self.every.some(chosen)) else None

    def _inwards(self, taken: Array, inner: Array) -> None:
        """Choose for the states of a collapsed component a free row that leads nearer to its exit."""
        if not len(inner):
            return
        rows = self.every.some(inner)
        while True:
            open_rows = taken[rows.source] < 0
            hit = np.unique(rows.entry_row[(taken[rows.target] >= 0) & open_rows[rows.entry_row]])
            if not len(hit):
                return
            states, where = np.unique(rows.source[hit], return_index=True)
            taken[states] = inner[hit[where]]


def leaves(problem: Open, rows: Rows) -> bool:
    """Return whether a policy, one row per open state, leaves the open states with probability 1."""
    if rows.fading:
        return True
    out = ~problem.open
    order = np.argsort(rows.target, kind="stable")
    begin = np.searchsorted(rows.target[order], np.arange(len(out) + 1))
    frontier = np.unique(rows.target[out[rows.target]])
    while len(frontier):
        into = rows.source[rows.entry_row[order[slices(begin[frontier], begin[frontier + 1])]]]
        frontier = np.unique(into[~out[into]])
        out[frontier] = True
    return bool(out.all())


def core_of(problem: Open, every: Rows) -> Core:
    """Collapse the free end components."""
    opened = np.flatnonzero(problem.open)
    label = np.where(problem.block >= 0, problem.block, np.arange(len(problem.block)))[opened]
    names, local = np.unique(label, return_inverse=True)
    node = np.full(len(problem.block), -1, dtype=np.int64)
    node[opened] = local
    outward = node[every.target] != node[every.source][every.entry_row]
    leaving = np.bincount(every.entry_row, every.share * outward, len(every.source)).astype(np.float64) + every.fading
    number = np.flatnonzero(leaving > 0)
    number = number[np.argsort(node[every.source[number]], kind="stable")]
    rows = every.some(number)
    owner = node[rows.source]
    return Core(
        problem=problem,
        every=every,
        node=node,
        count=len(names),
        rows=rows,
        number=number,
        owner=owner,
        begin=np.searchsorted(owner, np.arange(len(names))).astype(np.int64),
        leaving=leaving[number],
    )
