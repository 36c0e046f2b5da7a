"""The choices tied at all levels so far enter; where one policy attains all of these levels leaves, and what is left unknown elsewhere.

A level is bounded over the policies that attain the levels before. To take tied choices is not enough for that: who keeps the
chance to arrive but goes round for ever does not arrive. Such a level *needs arrival*: the largest probability, the least cost, a
reward until a goal. Then a policy attains all levels from a state if it takes choices tied at all of them and surely reaches an
end of those that need arrival: the value is a martingale under it, and at the end it is what was promised. Where there is no
such policy, a later level may be the better the longer the first one is put off, and no plan attains it: only the side that no
policy can exceed is known. What is best at the levels after it, nobody knows at all.

The same holds where a level is infinitely good: all choices that lead there are tied, and not all of them attain it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ratherthan.model.mdp import Bools
from ratherthan.verify.frame import Frame
from ratherthan.verify.values import Band

__all__ = ["attaining", "hopeless_in", "leading_to", "must_end", "over_of", "unbounded_in", "without"]


def needs_arrival(frame: Frame) -> bool:
    """Return whether tied choices alone do not attain a level."""
    if not frame.costs:
        return frame.maximise
    return not frame.endless and (frame.demanding or not frame.maximise)


def over_of(first: Frame) -> Bools:
    """Return where the run ends for all levels after the first, ``[S]``."""
    chance = not first.costs and first.maximise
    return ~first.running | ~first.can_arrive if chance else ~first.running


def must_end(first: Frame, later: Frame) -> Frame:
    """Return a later level over the policies alone that attain the first, which end for sure if that needs arrival."""
    return replace(later, ending=True) if needs_arrival(first) else later


def unbounded_in(frame: Frame, best: Band) -> Bools:
    """Return where a level is, or may be, infinitely good, ``[S]``."""
    if not frame.costs or frame.endless or not (frame.maximise or frame.demanding):
        return np.zeros(frame.mdp.states, dtype=np.bool_)
    found: Bools = (best.upper == np.inf) if frame.maximise else (best.lower == -np.inf)
    return found & frame.running


def hopeless_in(frame: Frame, best: Band) -> Bools:
    """Return where a level comes to infinitely much whatever is done, ``[S]``: nothing needs to be attained for that."""
    if not frame.costs or frame.endless or (frame.maximise and not frame.demanding):
        return np.zeros(frame.mdp.states, dtype=np.bool_)
    missed = -np.inf if frame.maximise else np.inf
    found: Bools = (best.lower == missed) & (best.upper == missed)
    return found


def leading_to(frame: Frame, states: Bools, rows: Bools) -> Bools:
    """Return from where some of the states can be reached along rows where the first level goes on, ``[S]``."""
    return frame.reach(states, frame.running, rows) if states.any() else states


def attaining(frames: Sequence[Frame], rows: Bools) -> Bools:
    """Return from where one policy attains all of some levels, for sure, ``[S]``.

    Parameters
    ----------
    frames : sequence of Frame
        The first level and those after it, of which the last is in question.
    rows : array of bool, ``[C]``
        The choices tied at all of them.
    """
    first, needing = frames[0], [frame for frame in frames[:-1] if needs_arrival(frame)]
    if not needing:
        return np.ones(first.mdp.states, dtype=np.bool_)
    if needing[0] is first:
        ends = over_of(first)
    else:
        ends = np.logical_and.reduce([~frame.running for frame in frames if needs_arrival(frame)])
    return first.sure(ends, ~ends, rows)


def without(band: Band, worse: Bools, both: Bools, *, maximise: bool) -> Band:
    """Return bounds that say nothing on the worse side of some states, and nothing at all of others."""
    lower = np.where(both | (worse & maximise), -np.inf, band.lower)
    upper = np.where(both | (worse & (not maximise)), np.inf, band.upper)
    return Band(lower=lower, upper=upper, silent=band.silent)
