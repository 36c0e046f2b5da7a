"""The numbers of all levels enter; which choices each level compares leaves, and which states are critical.

Definition
----------
Objectives in order are compared one after the other: level k compares only the choices of a state that are equal to the best at
every level before it that has not ended there. A state is critical if at some level the largest and the smallest number of what
is compared differ by more than the threshold: α at the first level, 0 further on.

As numbers are known by their bounds, two sets bound what a level compares: the choices that are equal to the best for sure,
and those that may be. What differs among the first is critical for sure; what may differ among the second may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ratherthan.model.mdp import MDP, Bools
from ratherthan.verify.frame import Frame
from ratherthan.verify.interval import Ends, all_above

__all__ = ["Compared", "Critical", "compared", "critical", "extremes"]


class Compared(NamedTuple):
    """The choices that a level compares, for sure and possibly, ``[C]`` each."""

    sure: Bools
    maybe: Bools


class Critical(NamedTuple):
    """The states that are critical for sure, and those that may be, ``[S]`` each."""

    sure: Bools
    maybe: Bools


def compared(frames: Sequence[Frame], ends: Sequence[Ends], tolerance: float) -> list[Compared]:
    """Return which choices each level compares.

    Parameters
    ----------
    frames : sequence of Frame
        One per level.
    ends : sequence of pairs of arrays, ``[C]``
        The bounds of the numbers of each level.
    tolerance : float
        The factor of τ.
    """
    every = np.ones(frames[0].mdp.choices, dtype=np.bool_)
    found = [Compared(every, every)]
    for frame, own in zip(frames[:-1], ends[:-1], strict=True):
        before = found[-1]
        ended = ~frame.running[frame.row_state]
        beaten_for_sure = _beaten(frame, own, before.sure, tolerance)[0]
        perhaps_beaten = _beaten(frame, own, before.maybe, tolerance)[1]
        found.append(Compared(before.sure & (~perhaps_beaten | ended), before.maybe & (~beaten_for_sure | ended)))
    return found


def _beaten(frame: Frame, own: Ends, group: Bools, tolerance: float) -> tuple[Bools, Bools]:
    """Return which choices the best of a group beats for sure, and which it may beat, ``[C]`` each."""
    high, low = extremes(frame.mdp, own, group)
    count = np.diff(frame.mdp.state_to_choices)
    best = high if frame.maximise else low
    top = np.repeat(best[0], count), np.repeat(best[1], count)
    return all_above(top, own, 0.0, tolerance) if frame.maximise else all_above(own, top, 0.0, tolerance)


def extremes(mdp: MDP, ends: Ends, group: Bools) -> tuple[Ends, Ends]:
    """Return the bounds of the largest and of the smallest number of a group in each state, ``[S]``."""
    begin = mdp.state_to_choices[:-1]
    high = [np.maximum.reduceat(np.where(group, end, -np.inf), begin) for end in ends]
    low = [np.minimum.reduceat(np.where(group, end, np.inf), begin) for end in ends]
    return (high[0], high[1]), (low[0], low[1])


def critical(frames: Sequence[Frame], ends: Sequence[Ends], alpha: float, tolerance: float) -> Critical:
    """Return which states are critical.

    Parameters
    ----------
    frames, ends, tolerance
        As in `compared`.
    alpha : float
        The threshold of the first level.
    """
    mdp = frames[0].mdp
    sure, maybe = np.zeros(mdp.states, dtype=np.bool_), np.zeros(mdp.states, dtype=np.bool_)
    for k, (frame, own, groups) in enumerate(zip(frames, ends, compared(frames, ends, tolerance), strict=True)):
        for found, group, which in ((sure, groups.sure, 0), (maybe, groups.maybe, 1)):
            several = np.add.reduceat(group.astype(np.int64), mdp.state_to_choices[:-1]) > 1
            high, low = extremes(mdp, own, group)
            found |= all_above(high, low, alpha if k == 0 else 0.0, tolerance)[which] & several & frame.running
    return Critical(sure, maybe)
