"""The policy that an explanation lists enters; how often it takes each choice leaves, and checks of the list and of each step."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ratherthan.explain.explanation import Explanation, Step
from ratherthan.model.mdp import Bools, Floats
from ratherthan.verify.frame import Array, Frame
from ratherthan.verify.interval import never_above, order_all
from ratherthan.verify.levels import Levels
from ratherthan.verify.numbers import FAINT
from ratherthan.verify.paths import Moves, moves_of
from ratherthan.verify.values import Band
from ratherthan.verify.verdict import Check, Verdict

__all__ = ["PolicyCheck"]

SHARES = 1e-9
"""How far the shares of a randomised policy may be from 1 in a state."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PolicyCheck:
    """Checks the policy that is listed, which is the one explained.

    Parameters
    ----------
    frame : Frame
    told : Explanation
    initial : set of int
        The initial states of the model.
    """

    frame: Frame
    told: Explanation
    initial: frozenset[int]

    @cached_property
    def weight(self) -> Floats:
        """How often the policy takes each choice of its state, ``[C]``; 0 throughout a state where nothing is said."""
        weight, rows = np.zeros(self.frame.mdp.choices), self.told.policy.rows
        known = (rows.choice >= 0) & (rows.choice < len(weight))  # what is not is told by `entries`
        weight[rows.choice[known]] = rows.share[known]
        return weight

    @cached_property
    def said(self) -> Bools:
        """Where the policy says what to do, ``[S]``."""
        said = np.zeros(self.frame.mdp.states, dtype=np.bool_)
        said[self.frame.row_state[self.weight > 0]] = True
        return said

    @cached_property
    def moves(self) -> Moves:
        """The moves of the policy."""
        return moves_of(self.frame, self.weight)

    def reached(self, states: Iterable[int]) -> Bools:
        """Return what the policy reaches from some states, ``[S]``."""
        found = np.zeros(self.frame.mdp.states, dtype=np.bool_)
        for state in states:
            if not found[state]:
                found = self.moves.reached(state, found)
        return found

    def entries(self) -> Check:
        """Check that the list is a policy of the model, where the explanation can lead."""
        reason = self._entry() or self._extent()
        verdict = Verdict.FAILS if reason else Verdict.HOLDS
        return Check(what="policy", where="", verdict=verdict, reason=reason or "")

    def _entry(self) -> str | None:
        """Return what is wrong with an entry of the list."""
        mdp, rows = self.frame.mdp, self.told.policy.rows
        first, last = mdp.state_to_choices[rows.state], mdp.state_to_choices[rows.state + 1]
        foreign = (rows.choice < first) | (rows.choice >= last)
        beyond = ~((rows.share > 0.0) & (rows.share <= 1.0))
        shared = (rows.share != 1.0) & (not self.told.policy.given)
        odd = np.flatnonzero(foreign | beyond | shared)
        if len(odd):
            state, choice, share = rows[int(odd[0])]
            own = mdp.choices_of(state)
            if choice not in own:
                return f"state {state} has the choices {own.start} to {own.stop - 1}, got {choice}"
            if not 0.0 < share <= 1.0:
                return f"a share must be above 0 and at most 1, got {share} at state {state}"
            return f"the optimum takes one choice in each state, got a share of {share} at state {state}"
        if (np.diff(rows.choice) <= 0).any():
            return "choices must be listed once, in the order of the model"
        total = np.bincount(rows.state, weights=rows.share, minlength=mdp.states)
        wrong = np.flatnonzero((total != 0.0) & (np.abs(total - 1.0) > SHARES))
        return f"the shares of state {wrong[0]} must sum to 1, got {total[wrong[0]]:.10g}" if len(wrong) else None

    def _extent(self) -> str | None:
        """Return what is listed though it is never reached, or not listed though it is."""
        frame, told = self.frame, self.told
        roots = self._roots()
        reached = self.reached(roots)
        needed = reached & frame.running
        if told.policy.given and told.question.policy_values:
            for state in roots:
                if not reached[state] or frame.running[state]:
                    reached |= frame.explored(state)
        odd = np.flatnonzero(self.said & ~(reached & frame.running))
        if len(odd):
            return f"state {odd[0]} is listed but never reached, or nothing is left to do there"
        silent = np.flatnonzero(needed & ~self.said)
        if told.policy.given:  # it need not say anything where it never comes to from an initial state
            silent = silent[self.reached([told.start])[silent]] if told.start in self.initial else silent[:0]
        return f"state {silent[0]} is reached, but the policy says nothing of it" if len(silent) else None

    def _roots(self) -> list[int]:
        """Return the states from which the policy must be listed: all that the explanation rests on, and what alternatives lead to."""
        mdp, told = self.frame.mdp, self.told
        roots = {told.start, *told.route, *told.circle, *told.in_the_way}
        for step in told.steps:
            roots |= {step.state} | {state for claim in step.claims for state, _, _ in claim.evidence.follows}
            for row in (row for trade in step.trades for row in (trade.judged[0].taken, trade.judged[0].other)):
                roots |= set(map(int, mdp.branch_to_target[mdp.branches_of(row.choice)]))
        return sorted(roots)

    def attains(self, levels: Levels) -> Check:
        """Check that the optimal policy is one: its values are the optimum wherever it is listed, at every level."""
        undecided = False
        for level, (frame, best, followed) in enumerate(zip(levels.frames, levels.best, levels.followed, strict=True)):
            where = np.flatnonzero(self.said & frame.running & ~levels.unbounded(level))
            size = levels.measures[level].size
            apart, is_open = _apart(best, followed, where, self.told.question.tolerance, size)
            undecided |= is_open
            if apart is not None:
                name = self.frame.mdp.names[apart]
                reason = f"it is not optimal{_nth(level)}: another does better from state {apart}"
                return Check(what="optimum", where=name, state=apart, verdict=Verdict.FAILS, reason=reason)
        return Check(what="optimum", where="", verdict=Verdict.UNDECIDED if undecided else Verdict.HOLDS)

    def step(self, step: Step) -> Check:
        """Check that a step takes the policy's choice, as often as it says."""
        reason = self._taken(step)
        verdict = Verdict.FAILS if reason else Verdict.HOLDS
        name = self.frame.mdp.names[step.state]
        return Check(what="choice", where=name, state=step.state, verdict=verdict, reason=reason or "")

    def _taken(self, step: Step) -> str | None:
        mdp, weight = self.frame.mdp, self.weight
        if not self.frame.running[step.state]:
            return "the objective has ended here"
        own = mdp.choices_of(step.state)
        if weight[step.choice] == 0.0:
            return f"the policy takes {[mdp.action_name(c) for c in own if weight[c] > 0]}, got '{step.action}'"
        if step.share != weight[step.choice]:
            return f"it is taken with a share of {weight[step.choice]}, got {step.share}"
        if self.told.question.scope == "state" and step.choice != max(own, key=lambda c: (weight[c], -c)):
            return "the policy takes another choice more often"
        return None


def _nth(level: int) -> str:
    return f" at level {level + 1}" if level else ""


def _apart(best: Band, followed: Band, where: Array, tolerance: float, size: float) -> tuple[int | None, bool]:
    """Return a state where two bands differ, None for none, and whether it is open anywhere if they do.

    Where signs may differ, a value near 0 may miss the optimum by what is little beside the others, and that leaves it open.
    """
    ends = (best.lower[where], best.upper[where]), (followed.lower[where], followed.upper[where])
    more, less = order_all(*ends, tolerance)
    with np.errstate(invalid="ignore"):
        gap = np.maximum(ends[0][0] - ends[1][1], ends[1][0] - ends[0][1])
    faint = np.isfinite(gap) & (gap <= tolerance * size)
    apart = np.flatnonzero((more | less) & ~faint)
    same = never_above(*ends, tolerance) & never_above(ends[1], ends[0], tolerance)
    with np.errstate(invalid="ignore"):
        same |= np.maximum(ends[0][1] - ends[1][0], ends[1][1] - ends[0][0]) <= tolerance * FAINT * size
    return (int(where[apart[0]]) if len(apart) else None), not bool(same.all())
