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
            reason = reason or self._off_route()
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
        if False not in equal and None not in equal and self.levels.slack < math.inf:
            return "all other decisions are equivalent", False
        spreads = [self.levels.measures[0].difference(state) for state in untold]
        if closing.largest_difference is None:
            known = all(number.finite for spread in spreads for number in spread) and self.levels.slack < math.inf
            known &= any(high.lower > low.upper for high, low in spreads)  # else it is a further level that they change
            return ("the largest difference is known" if known else None), False
        low = max(0.0, *(high.lower - low.upper for high, low in spreads))
        most = max(high.upper - low.lower for high, low in spreads)
        size = self.levels.measures[0].size
        near = 2e-6 * max(size, *(abs(number.upper) for spread in spreads for number in spread))
        if not low - near <= closing.largest_difference <= most + near:
            return f"the largest difference lies in [{low:.10g}, {most:.10g}], got {closing.largest_difference}", False
        return None, False

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

    def _off_route(self) -> str | None:
        """Return what is wrong with the number of critical states off the route."""
        closing = self.told.closing
        off = self.reached.copy()
        off[list(self.told.route)] = False
        (sure, maybe), (must, may) = self.levels.critical, self.levels.admitted
        known = int((must & off).sum()), int((maybe & off).sum())
        reach = int((sure & off).sum()), int((may & off).sum())
        certain, possible = closing.off_route, closing.off_route + closing.off_route_open
        if known[0] <= certain <= known[1] and reach[0] <= possible <= reach[1]:
            return None
        return (
            f"{known[0]} to {known[1]} decisions off the route matter, got {certain}, and {closing.off_route_open} open"
        )
