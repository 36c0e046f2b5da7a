"""An explanation with few sentences and the re-checker's numbers enter, checks leave: which steps are told, and what of the others is said.

Which steps one sentence can tell is a matter of the text, and the text is known to be that of the data (`document`). What is checked
here is that there are no more sentences than were asked for and no fewer than could be, that those are told that rank highest by the
numbers that are given for it, that these numbers are the model's, and what is said of the steps that are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ratherthan.errors import ExplanationError
from ratherthan.explain.explanation import Explanation, LeftOut, Rank, Step
from ratherthan.narrate import sentences
from ratherthan.verify.detours import Sweeps
from ratherthan.verify.interval import Bounds, Interval, Order, order
from ratherthan.verify.levels import Levels
from ratherthan.verify.verdict import Check, Verdict
from ratherthan.verify.visits import chance_to_visit

__all__ = ["FewCheck"]

DIGITS = 6
NEAR, FAR = 2e-5, 1e-3
"""Up to which share of the numbers that it is a difference of a rank agrees with the model, and from which on it does not."""

Flaw = tuple[str | None, bool]
"""What is wrong, and whether it is open."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FewCheck:
    """Checks which steps are told.

    Parameters
    ----------
    told : Explanation
    levels : Levels
    """

    told: Explanation
    levels: Levels

    def checks(self) -> list[Check]:
        """Return a check of what is told, one for each rank, and one of what is left out."""
        if self.told.question.at_most is None:
            return [self._check("told", (self._nothing(), False))]
        found = [self._check("told", (self._selection(), False))]
        found += self._ranks()
        found.append(self._check("left out", self._left_out()))
        return found

    def _ranks(self) -> list[Check]:
        """Return a check for each rank; those that are left open are one."""
        ranked = [(at, step.rank) for at, step in enumerate(self.told.steps) if step.rank is not None]
        found = [self._check("rank", self._rank(at, rank), self.told.steps[at]) for at, rank in ranked]
        is_open = sum(check.verdict is Verdict.UNDECIDED for check in found)
        kept = [check for check in found if check.verdict is not Verdict.UNDECIDED]
        if is_open:
            reason = f"{is_open} of {len(ranked)} were not found anew: bounds leave them open, or it would take too much work"
            kept.append(Check(what="rank", where="", verdict=Verdict.UNDECIDED, reason=reason))
        return kept

    def _check(self, what: str, flaw: Flaw, step: Step | None = None) -> Check:
        reason, is_open = flaw
        verdict = Verdict.FAILS if reason else Verdict.UNDECIDED if is_open else Verdict.HOLDS
        name = "" if step is None else self.levels.first.mdp.names[step.state]
        return Check(
            what=what, where=name, verdict=verdict, reason=reason or "", state=None if step is None else step.state
        )

    def _nothing(self) -> str | None:
        """Return what is wrong where nobody asked for few sentences."""
        left = self.told.closing.left_out is not None
        if left or any(not step.told or step.rank is not None for step in self.told.steps):
            return "a step is left out, though it was not asked for few sentences"
        return None

    # -- which steps are told

    @property
    def _selective(self) -> bool:
        return "selectiveness" in self.told.question.factors

    @cached_property
    def _mattering(self) -> list[int]:
        return [at for at, step in enumerate(self.told.steps) if not self._selective or step.critical is not False]

    @cached_property
    def _groups(self) -> tuple[tuple[int, ...], ...]:
        """The steps that one sentence could tell: those that the text joins where it tells all that matters."""
        every = replace(self.told, steps=tuple(replace(step, told=True) for step in self.told.steps))
        try:
            told = sentences(every)
        except (KeyError, ValueError, TypeError, IndexError, AttributeError) as error:
            raise ExplanationError(f"All that matters must be such that it can be told: {error}.") from None
        return tuple(sentence.steps for sentence in told if sentence.number is not None)

    def _selection(self) -> str | None:
        """Return what is wrong with which steps are told."""
        told, steps = self.told.question, self.told.steps
        assert told.at_most is not None
        left = {at for at, step in enumerate(steps) if not step.told}
        if not left <= set(self._mattering):
            return "a step is left out that does not matter"
        if any(0 < len(left & set(group)) < len(group) for group in self._groups):
            return "only a part of what one sentence could tell is told"
        kept = [group for group in self._groups if not left & set(group)]
        if len(kept) != min(told.at_most, len(self._groups)):
            return f"{min(told.at_most, len(self._groups))} sentences about steps must be told, got {len(kept)}"
        ranked = {at for at, step in enumerate(steps) if step.rank is not None}
        if ranked != (set(self._mattering) if left and told.ranking != "place" else set()):
            return "exactly where some are left out those that matter must have a rank"
        order_ = sorted(self._groups, key=lambda group: (min(self._key(at) for at in group), group))
        if sorted(order_[: len(kept)]) != sorted(kept):
            return "those that are told are not those that rank highest"
        return None

    def _key(self, at: int) -> tuple[int, float]:
        rank = self.told.steps[at].rank
        return (0, 0.0) if rank is None else (rank.level, -float(f"{abs(rank.size):.{DIGITS}g}"))

    # -- what they are ranked by

    def _rank(self, at: int, rank: Rank) -> Flaw:
        """Return what is wrong with the rank of a step."""
        if self.told.question.ranking == "detour":
            return self._detour(at, rank)
        if self.told.question.ranking == "place":
            return "in the order of the route nothing has a rank", False
        own = self._spread(self.told.steps[at])
        if own is None or not rank.settled:
            return None, True
        level, low, high = own
        if self.told.question.ranking == "expected":
            chance = chance_to_visit(self.levels.first, self.levels.weight, self.told.start, self.told.steps[at].state)
            if chance is None:
                return None, True
            low, high = (end * chance if chance > 0 else 0.0 for end in (low, high))
        return self._agrees(rank, level, low, high, max(abs(low), abs(high)))

    def _agrees(self, rank: Rank, level: int, low: float, high: float, size: float) -> Flaw:
        if rank.level != level:
            return f"it differs first at level {level + 1}, got level {rank.level + 1}", False
        if low == high == rank.size:
            return None, False
        if math.isinf(low) or math.isinf(rank.size):
            return f"it is {low:.10g}, got {rank.size}", False
        if low - NEAR * size <= rank.size <= high + NEAR * size:
            return None, False
        far = not low - FAR * size <= rank.size <= high + FAR * size
        return (f"it lies in [{low:.10g}, {high:.10g}], got {rank.size:.10g}" if far else None), True

    def _spread(self, step: Step) -> tuple[int, float, float] | None:
        """Return the level at which the numbers of a step differ first, and bounds of the difference; None where it is open."""
        choices, levels = self.levels.first.mdp.choices_of(step.state), self.levels
        for level in range(len(levels.frames)):
            sure, maybe = (mask[choices.start : choices.stop] for mask in levels.compared[level])
            group = [choice for choice, hit in zip(choices, sure, strict=True) if hit]
            if level and (not levels.frames[level].running[step.state] or len(group) < 2):
                continue
            if not (sure == maybe).all():
                return None
            high, low = levels.measures[level].spread(group)
            found = order(high, low, levels.asked.tolerance)
            if found is Order.EQUAL:
                continue
            if found is Order.OPEN:
                return None
            most, least = high.upper - low.lower, high.lower - low.upper
            return level, min(least, most), most
        return len(levels.frames) - 1, 0.0, 0.0

    @cached_property
    def _sweeps(self) -> list[Sweeps]:
        """What finds detours under each level."""
        levels = self.levels
        return [
            Sweeps(frame=frame, best=best, rows=compared.maybe if level else np.ones_like(compared.maybe))
            for level, (frame, best, compared) in enumerate(
                zip(levels.frames, levels.best, levels.compared, strict=True)
            )
        ]

    def _detour(self, at: int, rank: Rank) -> Flaw:
        """Return what is wrong with the detour that is given for a step."""
        step, levels = self.told.steps[at], self.levels
        route, last = np.array(self.told.route[: at + 1], dtype=np.int64), len(levels.frames) - 1
        if len(levels.first.mdp.choices_of(step.state)) == 1:
            return self._agrees(rank, last, 0.0, 0.0, 0.0)
        for level in range(len(levels.frames)):
            if level and not levels.frames[level].running[step.state]:
                return None, True
            found = self._sweeps[level].value(route, step.state, step.choice)
            own = levels.measures[level].number(step.choice)
            if found is None or not (own.finite or own.infinite) or (level and math.isinf(found.value)):
                return None, True
            taken = own.lower if own.infinite else (own.lower + own.upper) / 2
            sign = -1.0 if levels.frames[level].maximise else 1.0
            loss = 0.0 if found.value == taken else sign * (found.value - taken)
            size = max((abs(x) for x in (found.value, taken) if math.isfinite(x)), default=0.0)
            if rank.level > level and math.isfinite(loss) and abs(loss) <= 10 * levels.asked.tolerance * size:
                continue  # nothing, or next to nothing, at this level
            if rank.settled and rank.level == level < last and abs(rank.size) <= self._nearly_nothing(taken):
                return f"it does not differ at level {level + 1}, and the next must be looked at", False
            if not rank.settled:
                low = rank.level == level and rank.size <= loss + NEAR * size
                return (None if low or not found.sure else f"it is at most {loss:.10g}, got {rank.size:.10g}"), not low
            flaw, is_open = self._agrees(rank, level, loss, loss, size if math.isfinite(size) else 0.0)
            return (flaw, is_open) if found.sure else (None, flaw is not None or is_open)
        return None, True

    def _nearly_nothing(self, taken: float) -> float:
        return 0.1 * self.levels.asked.tolerance * abs(taken) if math.isfinite(taken) else 0.0

    # -- what is left out

    def _left_out(self) -> Flaw:
        """Return what is wrong with what is said of the steps that are not told."""
        states = [step.state for step in self.told.steps if not step.told]
        left = self.told.closing.left_out
        asked = bool(states) and self._selective and self.told.route_outcome in ("arrives", "circles", "open end")
        if left is None or not asked:
            return (None if (left is None) == (not asked) else "it must say what is left out where something is"), False
        if left.steps != len(states):
            return f"{len(states)} steps are left out, got {left.steps}", False
        if len(left.largest) != len(self.levels.frames):
            return "the largest difference must be given for each level", False
        flaws = [
            self._unsure(left, states),
            *(self._largest(left, level, states) for level in range(len(left.largest))),
        ]
        return next((reason for reason, _ in flaws if reason), None), any(is_open for _, is_open in flaws)

    def _unsure(self, left: LeftOut, states: list[int]) -> Flaw:
        sure = maybe = 0
        for high, low in self._differences(0, states):
            sure += self._one_infinite(0, high, low)
            maybe += self._one_infinite(0, high, low) or not all(end.finite or end.infinite for end in (high, low))
        if sure <= left.unsure <= maybe:
            return None, sure != maybe
        return f"at {sure} to {maybe} of them an action is not sure to arrive, got {left.unsure}", False

    def _one_infinite(self, level: int, high: Interval, low: Interval) -> bool:
        frame = self.levels.frames[level]
        demanding = frame.costs and not frame.endless and (frame.demanding or not frame.maximise)
        ends = [math.isinf(end.lower) and end.lower == end.upper for end in (high, low)]
        return demanding and ends[0] != ends[1]

    def _differences(self, level: int, states: list[int]) -> Iterator[tuple[Bounds, Bounds]]:
        running = self.levels.frames[level].running
        return (self.levels.measures[level].difference(state) for state in states if level == 0 or running[state])

    def _largest(self, left: LeftOut, level: int, states: list[int]) -> Flaw:
        """Return what is wrong with the largest difference at a level."""
        told, low, most, size = left.largest[level], 0.0, 0.0, 0.0
        for high, least in self._differences(level, states):
            if level == 0 and self._one_infinite(level, high, least):
                continue
            if order(high, least, self.levels.asked.tolerance) is Order.EQUAL:
                continue
            low = max(low, high.lower - least.upper)
            most = max(most, high.upper - least.lower)
            size = max([size, *(abs(x.upper) for x in (high, least) if math.isfinite(x.upper))])
        near = NEAR * max(size, self.levels.measures[level].size)
        if told is None:
            known = math.isfinite(most) and self.levels.slack < math.inf
            return ("it is known by how much they differ" if known and most > near else None), known
        if told < low - near:
            return f"they differ by {low:.10g} at least, got {told:.10g}", False
        coarse = math.inf if math.isinf(self.levels.slack) else 2.0 * self.levels.most_slack * size
        coarse = max(near, coarse, self.levels.measures[level].coarse(self.levels.slack))
        return (
            f"they differ by {most:.10g} at most, got {told:.10g}" if told > most + coarse else None
        ), told > most + near
