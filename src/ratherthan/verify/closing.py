"""The closing sentence of an explanation and the re-checker's numbers enter, a check leaves: what holds of untold steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ratherthan.explain.explanation import Closing, Explanation
from ratherthan.model.mdp import Bools
from ratherthan.verify.interval import Order, order
from ratherthan.verify.levels import Levels
from ratherthan.verify.verdict import Check, Verdict

__all__ = ["ClosingCheck"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosingCheck:
    """Re-derives what is said of untold steps, and of decisions off the route.

    Parameters
    ----------
    told : Explanation
    levels : Levels
    reached : array of bool, ``[S]``
        What the policy reaches from the start.
    """

    told: Explanation
    levels: Levels
    reached: Bools  # [S]

    def check(self) -> Check:
        """Return the check of the closing sentence."""
        told, closing = self.told, self.told.closing
        asked = told.question.scope == "route" and "selectiveness" in told.question.factors
        if not asked or told.route_outcome not in ("arrives", "circles", "open end"):
            reason, is_open = None if closing == Closing() else "nothing can be said here", False
        else:
            untold = sorted({step.state for step in told.steps if step.critical is False})
            reason, is_open = self._untold(untold)
            off, vague = self._off_route()
            reason, is_open = reason or off, is_open or vague
        verdict = Verdict.FAILS if reason else Verdict.UNDECIDED if is_open else Verdict.HOLDS
        return Check(what="closing", where="", verdict=verdict, reason=reason or "")

    def _untold(self, untold: list[int]) -> tuple[str | None, bool]:
        """Return what is wrong with what is said of untold steps, and whether it is open."""
        closing, alpha = self.told.closing, self.told.question.alpha
        if not untold:
            empty = not closing.printed and closing.largest_difference is None
            return (None if empty else "every step is told"), False
        equal = [self._equivalent(state) for state in untold]
        if closing.largest_difference == 0.0:
            if not closing.printed:
                return "all other decisions are equivalent, but it is not said", False
            return ("not all other decisions are equivalent" if False in equal else None), None in equal
        if closing.printed != (alpha > 0 and closing.largest_difference is not None):
            return "it must be printed exactly where the largest difference is known and asked for", False
        alike = False not in equal and None not in equal and self.levels.slack < math.inf
        if alike and not self._faint(closing.largest_difference, untold):
            return "all other decisions are equivalent", False
        spreads = [self.levels.measures[0].difference(state) for state in untold]
        if closing.largest_difference is None:
            known = all(number.finite for spread in spreads for number in spread) and self.levels.slack < math.inf
            known &= any(high.lower > low.upper for high, low in spreads)  # else it is a further level that they change
            return ("the largest difference is known" if known else None), False
        low = max(0.0, *(high.lower - low.upper for high, low in spreads))
        most = max(high.upper - low.lower for high, low in spreads)
        near, coarse = 2e-6 * max(self.levels.measures[0].size, self._size(untold)), self._coarse(untold)
        if not low - near <= closing.largest_difference <= most + max(near, coarse):
            return f"the largest difference lies in [{low:.10g}, {most:.10g}], got {closing.largest_difference}", False
        return None, alike or not low - near <= closing.largest_difference <= most + near

    def _size(self, states: list[int]) -> float:
        """Return the largest finite number of some states."""
        numbers = [number for state in states for number in self.levels.measures[0].difference(state)]
        return max((abs(number.upper) for number in numbers if number.finite), default=0.0)

    def _coarse(self, states: list[int]) -> float:
        """Return how much the difference of two numbers of some states may be blurred without being a forgery."""
        blur = self.levels.measures[0].coarse(self.levels.slack)
        return (
            2.0 * max(self.levels.most_slack * self._size(states), blur)
            if math.isfinite(self.levels.slack)
            else math.inf
        )

    def _faint(self, difference: float | None, untold: list[int]) -> bool:
        """Return whether a difference may come of numbers that are not known well: so little that nobody could tell it from 0."""
        return difference is not None and difference <= self._coarse(untold)

    def _equivalent(self, state: int) -> bool | None:
        """Return whether all choices of a state have finite and equal numbers at every level that has not ended there."""
        found = [
            self._equal_at(level, state)
            for level, frame in enumerate(self.levels.frames)
            if level == 0 or frame.running[state]
        ]
        return False if False in found else None if None in found else True

    def _equal_at(self, level: int, state: int) -> bool | None:
        numbers = list(self.levels.measures[level].numbers(state).values())
        if any(number.infinite for number in numbers):
            return False
        orders = {order(x, y, self.told.question.tolerance) for i, x in enumerate(numbers) for y in numbers[i + 1 :]}
        if orders & {Order.GREATER, Order.LESS}:
            return False
        return None if Order.OPEN in orders or not all(number.finite for number in numbers) else True

    def _off_route(self) -> tuple[str | None, bool]:
        """Return what is wrong with the number of critical states off the route, and whether it is known less well than it could."""
        closing = self.told.closing
        off = self.reached.copy()
        off[list(self.told.route)] = False
        sure, maybe = self.levels.critical
        certain, possible = closing.off_route, closing.off_route + closing.off_route_open
        fitting = []
        for must, may in (self.levels.admitted, self.levels.excused):
            known = int((must & off).sum()), int((maybe & off).sum())
            reach = int((sure & off).sum()), int((may & off).sum())
            fitting.append(known[0] <= certain <= known[1] and reach[0] <= possible <= reach[1])
        if any(fitting):
            return None, not fitting[0]
        least, most, open_ = known[0], known[1], closing.off_route_open
        return f"{least} to {most} decisions off the route matter, got {certain}, and {open_} open", False
