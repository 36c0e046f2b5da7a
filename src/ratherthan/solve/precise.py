"""How narrow bounds are wanted enters, for a block of code; methods that come nearer step by step ask how far they shall go.

The *precision* is the relative width of bounds that a user wants, 1e-6 by default. Two values are compared with a tolerance of a millionth
themselves, so that methods aim at a thousandth of the precision: then the bounds decide nearly every comparison. Methods that give
all digits at once do not ask. Where a comparison that a sentence needs stays open, it is solved again, more precisely (`sharpened`
in `solver`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from ratherthan.errors import QuestionError

__all__ = ["FINEST", "PRECISION", "aiming", "precision_wanted", "width_aimed_at"]

PRECISION = 1e-6
FINEST = 1e-10
"""Below which precision doubles have little to add."""
SHARE = 1e-3
NARROWEST, WIDEST = 1e-13, 1e-4

_precision: ContextVar[float] = ContextVar("ratherthan.precision", default=PRECISION)


@contextmanager
def aiming(precision: float | None) -> Iterator[None]:
    """Want bounds of a relative width in the block; None changes nothing.

    Raises
    ------
    QuestionError
        If it is no number between 0 and 1.
    """
    if precision is None:
        yield
        return
    if not 0.0 < precision < 1.0:
        raise QuestionError(
            f"A precision must lie between 0 and 1, both excluded, such as 1e-6, got {precision:g}.",
            precision=precision,
        )
    token = _precision.set(float(precision))
    try:
        yield
    finally:
        _precision.reset(token)


def precision_wanted() -> float:
    """Return the relative width of bounds that is wanted."""
    return _precision.get()


def width_aimed_at() -> float:
    """Return the relative width of bounds that a method which comes nearer step by step shall try to reach."""
    return min(max(SHARE * _precision.get(), NARROWEST), WIDEST)
