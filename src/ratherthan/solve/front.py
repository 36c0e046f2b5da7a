"""Two costs enter; the plans that are best for some weighting of them leave, by chords.

What all policies can attain is a convex polygon (of all mixtures of plans), and the plans that are best for some weights w > 0
are the vertices of its lower left border. *Search by chords* (Cohon 1978; Aneja and Nair 1979): begin with the least of either
cost. For two neighbouring points a, b, solve with the weights that make a and b equally good, w = (a₂ - b₂, b₁ - a₁). Either the
best is below the chord, and is a new point between them; or it is not, and the chord is part of the border: nothing lies
below it, which the lower bound of that solve proves, up to the tolerance. The two ends with which it begins are best for one cost
alone, and another point may be as good in that and better in the other: it takes the end's place. Where it does so at
both ends it is the whole border. Each solve finds a point or closes a chord, so that n
points take at most 2 n solves. Points within a relative 1e-6 of a chord count as on it.

In f₁ + W f₂ the plan is best for every W between the slopes of the chords beside it.

References
----------
J. L. Cohon, Multiobjective Programming and Planning, Academic Press, 1978.
Y. P. Aneja, K. P. K. Nair, Bicriteria Transportation Problem, Management Science 25(1), 1979.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ratherthan.model.mdp import Floats
from ratherthan.solve.weighing import Found, Weighing

__all__ = ["Chord", "Front", "Point", "equal"]

SAME = 1e-6
"""Costs that differ by less than this, relative to the larger, count as equal."""
FLAT = 1e-7
"""How far below a chord a point must be to be a new one, relative to the triangle over the chord."""


@dataclass(kw_only=True, eq=False)
class Point:
    """A plan, its two costs, and for which weights W of the second cost it is proved to be best: none where low > high."""

    found: Found
    first: float
    second: float
    low: float
    high: float

    def replaces(self, other: Point) -> None:
        """Take the weights of a point that this one is as good as in one cost and better than in the other, wherever that is best."""
        self.low, self.high = min(self.low, other.low), max(self.high, other.high)


@dataclass(kw_only=True, eq=False)
class Chord:
    """Two neighbouring points; closed where nothing lies below it."""

    left: Point
    right: Point
    closed: bool = False
    least: float = -np.inf  # a proved lower bound of first + W second, where closed

    @property
    def weight(self) -> float:
        """W for which both ends are equally good."""
        return (self.right.first - self.left.first) / (self.left.second - self.right.second)


def equal(x: float, y: float, doubt: float = 0.0) -> bool:
    """Return whether two costs count as equal; `doubt` is how far their bounds leave them open."""
    return abs(x - y) <= SAME * max(abs(x), abs(y)) + doubt


@dataclass(kw_only=True, eq=False)
class Front:
    """The border between two costs, as far as it is known.

    Parameters
    ----------
    weighing : Weighing
    pair : tuple of int
        Which two objectives.
    chords : list of Chord
        From the left (least first cost) to the right; none where one point is best for both.
    alone : Point, optional
        That point.
    least : tuple of float
        Proved lower bounds of either cost.
    """

    weighing: Weighing
    pair: tuple[int, int]
    chords: list[Chord] = field(default_factory=list)
    alone: Point | None = None
    least: tuple[float, float] = (-np.inf, -np.inf)

    @staticmethod
    def begun(weighing: Weighing, pair: tuple[int, int]) -> Front | None:
        """Return the front with its two ends; None where no policy is sure to arrive."""
        front = Front(weighing=weighing, pair=pair)
        left, right = front._best(1.0, 0.0), front._best(0.0, 1.0)
        if left is None or right is None:
            return None
        front.least = left.found.least, right.found.least
        if left.second <= right.second or equal(left.second, right.second, front._doubt(1, left, right)):
            front.alone, left.high = left, np.inf if left.low == 0.0 else left.high
        elif right.first <= left.first or equal(left.first, right.first, front._doubt(0, left, right)):
            front.alone, right.low = right, 0.0 if right.high == np.inf else right.low
        else:
            front.chords = [Chord(left=left, right=right)]
        return front

    @property
    def points(self) -> list[Point]:
        """The points from left to right."""
        if self.alone is not None:
            return [self.alone]
        return [self.chords[0].left, *(chord.right for chord in self.chords)]

    @property
    def open(self) -> list[Chord]:
        """The chords below which there may be more, the widest first."""
        found = [chord for chord in self.chords if not chord.closed]
        return sorted(
            found, key=lambda c: (c.right.first - c.left.first) * (c.left.second - c.right.second), reverse=True
        )

    def refine(self, chord: Chord) -> None:
        """Close a chord, or part it at a new point below it."""
        left, right = chord.left, chord.right
        across, down = right.first - left.first, left.second - right.second
        size = max(across, down)
        first, second = down / size, across / size
        if not (first > 0.0 and second > 0.0):  # one end is hardly better in one cost, or the costs are too far apart
            chord.closed, chord.least = True, -np.inf
            return
        point = self._best(first, second)
        assert point is not None  # the ends do arrive
        here = first * point.first + second * point.second
        chord_level = min(first * p.first + second * p.second for p in (left, right))
        doubt = first * self._doubt(0, left, right, point) + second * self._doubt(1, left, right, point)
        if here < chord_level - FLAT * (first * across + second * down) - doubt and self._fits(chord, point):
            self._part(chord, point)
        else:
            chord.closed, chord.least = True, point.found.least / first
            if chord_level - point.found.least <= SAME * max(abs(chord_level), first * across + second * down):
                left.high = max(left.high, chord.weight)
                right.low = min(right.low, chord.weight)

    def _instead(self, chord: Chord, point: Point) -> tuple[bool, bool]:
        """Return whether a point below a chord can take the place of its left end, and of its right end.

        Only the ends of the border can be beaten so: each of them is best for one cost, and perhaps not for the other. An end
        in between is best for a weighting of both.
        """
        left, right = chord.left, chord.right
        as_near = point.first <= left.first or equal(point.first, left.first, self._doubt(0, left, point))
        as_low = point.second <= right.second or equal(point.second, right.second, self._doubt(1, right, point))
        return (
            chord is self.chords[0] and as_near and point.second < left.second,
            chord is self.chords[-1] and as_low and point.first < right.first,
        )

    def _fits(self, chord: Chord, point: Point) -> bool:
        """Return whether a point is between the ends of a chord, or in the place of one or both of them."""
        for_left, for_right = self._instead(chord, point)
        after = for_left or (chord.left.first < point.first and point.second < chord.left.second)
        before = for_right or (point.first < chord.right.first and chord.right.second < point.second)
        return after and before

    def _part(self, chord: Chord, point: Point) -> None:
        """Put a point between the ends of a chord, or in the place of those that it is better than."""
        at = self.chords.index(chord)
        for_left, for_right = self._instead(chord, point)
        parts = []
        if for_left:
            point.replaces(chord.left)
        else:
            parts.append(Chord(left=chord.left, right=point))
        if for_right:
            point.replaces(chord.right)
        else:
            parts.append(Chord(left=point, right=chord.right))
        self.chords[at : at + 1] = parts
        if not self.chords:
            self.alone = point

    def border(self) -> list[Point]:
        """Return the vertices that are known, from left to right: without ends that another is as good as, or on a chord."""
        kept: list[Point] = []
        points = self.points
        doubts = [self._doubt(which, *points) for which in (0, 1)]
        for point in points:
            while kept and equal(kept[-1].first, point.first, doubts[0]):
                point.replaces(kept.pop())  # as good in the first, better in the second
            if kept and equal(kept[-1].second, point.second, doubts[1]):
                kept[-1].high = max(kept[-1].high, point.high)
                continue
            if len(kept) > 1 and _on_chord(kept[-2], kept[-1], point):
                kept.pop()
            kept.append(point)
        return kept

    def closed(self, left: Point, right: Point) -> bool:
        """Return whether it is known that nothing lies below the line from one point of the border to the next."""
        weight = (right.first - left.first) / (left.second - right.second)
        return left.high >= weight * (1 - SAME) and right.low <= weight * (1 + SAME)

    def _best(self, first: float, second: float) -> Point | None:
        weights: Floats = np.zeros(len(self.weighing.objectives))
        weights[list(self.pair)] = first, second
        found = self.weighing.best(weights)
        if found is None:
            return None
        weight = second / first if first else np.inf
        costs = found.costs[list(self.pair)]
        value = float(weights[list(self.pair)] @ costs)
        proved = value - found.least <= SAME * max(abs(value), float(weights[list(self.pair)] @ np.abs(costs)))
        low, high = (weight, weight) if proved else (np.inf, -np.inf)
        return Point(found=found, first=float(costs[0]), second=float(costs[1]), low=low, high=high)

    def _doubt(self, which: int, *points: Point) -> float:
        """Return how far the bounds of the points leave one of the costs open."""
        return 2.0 * max(float(point.found.doubt[self.pair[which]]) for point in points)


def _on_chord(left: Point, middle: Point, right: Point) -> bool:
    """Return whether a point lies on the line between two others, as far as numbers tell."""
    across, down = right.first - left.first, left.second - right.second
    below = down * (left.first - middle.first) + across * (left.second - middle.second)
    return below <= SAME * across * down
