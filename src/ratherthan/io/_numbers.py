"""Whole numbers and fractions of any width enter, int64 and double arrays leave, exact or rounded to the nearest."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError

__all__ = ["doubles_of_rationals"]

EXACT = 2**53
"""Whole numbers up to here are doubles, so that their quotient is rounded once only."""


def doubles_of_rationals(
    numerators: npt.NDArray[np.uint64], denominators: npt.NDArray[np.uint64]
) -> npt.NDArray[np.float64]:
    """Return fractions as the nearest doubles.

    Parameters
    ----------
    numerators, denominators : array of uint64, ``[N, L]``
        Words of 64 bits, the least first; numerators in two's complement, denominators unsigned and not 0.

    Raises
    ------
    SourceError
        Where a denominator is 0, or a fraction is too large for a double.
    """
    zero = ~denominators.any(axis=1)
    if zero.any():
        raise SourceError(
            f"A fraction must not have the denominator 0, but entry {int(zero.argmax())} has. Write the file anew."
        )
    top = numerators[:, 0].view(np.int64)
    small = (np.abs(top.astype(np.float64)) < EXACT) & (denominators[:, 0] < EXACT)
    if numerators.shape[1] > 1:
        sign = np.where(top < 0, np.uint64(2**64 - 1), np.uint64(0))
        small &= (numerators[:, 1:] == sign[:, np.newaxis]).all(axis=1) & ~denominators[:, 1:].any(axis=1)
    values = np.empty(len(top))
    np.divide(top, denominators[:, 0], out=values, where=small)
    wide = np.flatnonzero(~small)
    if len(wide):
        pairs, inverse = np.unique(np.hstack([numerators[wide], denominators[wide]]), axis=0, return_inverse=True)
        values[wide] = np.array([_quotient(pair) for pair in pairs])[inverse.reshape(-1)]
    return values


def _quotient(pair: npt.NDArray[np.uint64]) -> float:
    half = len(pair) // 2
    numerator = int.from_bytes(pair[:half].astype("<u8").tobytes(), "little", signed=True)
    denominator = int.from_bytes(pair[half:].astype("<u8").tobytes(), "little")
    try:
        return numerator / denominator
    except OverflowError:
        raise SourceError("A fraction must fit into a double, but one is too large. Scale the rewards down.") from None
