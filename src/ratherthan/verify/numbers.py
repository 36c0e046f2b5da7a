"""A number of an explanation and the re-checker's bounds of it enter, what is wrong with it leaves."""

from __future__ import annotations

import math

from ratherthan.verify.interval import Bounds, Interval
from ratherthan.verify.levels import Levels

__all__ = ["FAINT", "VAGUE", "disagreement", "vague"]

VAGUE = 1e-6
"""By which share of a number the bounds known here may reach beyond those of the evidence and still confirm it."""
FAINT = 1e-3
"""Where signs may differ, no number need be known better than one of this share of the largest."""


def disagreement(claimed: Interval, own: Bounds, levels: Levels, size: float, *, silent: bool) -> str | None:
    """Return how a number disagrees with the model, None where it does not.

    Parameters
    ----------
    claimed : Interval
    own : Bounds
    levels : Levels
        Of the explanation: whether its policy was given, and how well it must know its numbers.
    size : float
        The size of numbers where signs may differ, else 0.
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
    if not own.covers(claimed, levels.slack, size):
        return f"is known better than to lie in [{claimed.lower:.12g}, {claimed.upper:.12g}]"
    return None


def vague(claimed: Interval, own: Bounds, size: float) -> bool:
    """Return whether a number is not confirmed as it is told: known too little here, or told too far from what is known.

    Parameters
    ----------
    claimed, own, size
        As in `disagreement`.
    """
    if own.vague(claimed, VAGUE, FAINT * size):
        return True
    value = getattr(claimed, "value", claimed.lower)
    known = own.finite and math.isfinite(value)
    return known and size > 0.0 and not own.widened(VAGUE, FAINT * size).contains(Bounds(value, value))
