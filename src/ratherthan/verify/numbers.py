"""A number of an explanation and the re-checker's bounds of it enter, what is wrong with it leaves."""

from __future__ import annotations

import math

from ratherthan.verify.interval import Bounds, Interval
from ratherthan.verify.levels import Levels
from ratherthan.verify.measure import GROSS, Measures

__all__ = ["FAINT", "VAGUE", "disagreement", "vague"]

VAGUE = 1e-6
"""By which share of a number the bounds known here may reach beyond those of the evidence and still confirm it."""
FAINT = 1e-3
"""Where signs may differ, no number need be known better than one of this share of the largest."""


def disagreement(claimed: Interval, own: Bounds, levels: Levels, measures: Measures, *, silent: bool) -> str | None:
    """Return how a number disagrees with the model, None where it does not.

    A number whose bounds are somewhat wider than they need be is only vague; one whose bounds say next to nothing is wrong.

    Parameters
    ----------
    claimed : Interval
    own : Bounds
    levels : Levels
        Of the explanation: whether its policy was given, and how well it must know its numbers.
    measures : Measures
        Which know how large numbers are here.
    silent : bool
        Whether it rests on what the policy does where it says nothing.
    """
    value = getattr(claimed, "value", claimed.lower)
    if not claimed.lower <= value <= claimed.upper:
        return f"must lie between its bounds, got {value!r} and [{claimed.lower!r}, {claimed.upper!r}]"
    if not own.meets(claimed):
        return f"lies in [{own.lower:.12g}, {own.upper:.12g}], got [{claimed.lower:.12g}, {claimed.upper:.12g}]"
    if levels.given and (claimed.lower, claimed.upper) == (-math.inf, math.inf):
        return None  # it is said that nothing is known, as where the policy says nothing
    if silent:
        return "is not known: the policy that is listed says nothing of a state it comes to"
    if not own.covers(claimed, levels.most_slack, measures.coarse(levels.slack) / GROSS):
        return f"is known better than to lie in [{claimed.lower:.12g}, {claimed.upper:.12g}]"
    return None


def vague(claimed: Interval, own: Bounds, levels: Levels, measures: Measures) -> bool:
    """Return whether a number is not confirmed as it is told: known too little here or there, or too far from what is known.

    Parameters
    ----------
    claimed, own, levels, measures
        As in `disagreement`.
    """
    size = measures.size
    if own.vague(claimed, VAGUE, FAINT * size) or _told_nothing(claimed, own, levels, size):
        return True
    value = getattr(claimed, "value", claimed.lower)
    known = own.finite and math.isfinite(value)
    return known and size > 0.0 and not own.widened(VAGUE, FAINT * size).contains(Bounds(value, value))


def _told_nothing(claimed: Interval, own: Bounds, levels: Levels, size: float) -> bool:
    """Return whether less is told of a number than whoever knows it well would tell."""
    unknown = levels.given and (claimed.lower, claimed.upper) == (-math.inf, math.inf)
    return not unknown and not own.covers(claimed, levels.slack, size)
