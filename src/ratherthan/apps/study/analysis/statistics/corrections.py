"""Several p values or persons enter, values corrected for their number or intervals by resampling leave.

Holm's (1979) step-down correction keeps the chance of a single false finding among m tests at the level: the i-th smallest p is
multiplied by m − i + 1, and none becomes smaller than the one before it.

An interval by resampling draws whole persons with replacement, as the answers of one person belong together, and takes the
2.5 % and 97.5 % points of the statistic over the samples (Efron and Tibshirani 1993). The draws are the same every time.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

__all__ = ["LEAST", "MOST", "SAMPLES", "holm", "interval_of", "resampled"]

Floats = npt.NDArray[np.float64]
SAMPLES = 2000
SEED = 20240501
LEAST, MOST = 5, 20_000
"""With fewer persons samples are too much alike; with more they take too long, and are not what is uncertain."""


def holm(values: Sequence[float | None]) -> list[float | None]:
    """Return p values by Holm's correction, in the same order; None stays None and does not count.

    Examples
    --------
    >>> holm([0.01, 0.04, None, 0.03])
    [0.03, 0.06, None, 0.06]
    """
    known = sorted((value, place) for place, value in enumerate(values) if value is not None)
    corrected: list[float | None] = [None] * len(values)
    reached = 0.0
    for i, (value, place) in enumerate(known):
        reached = max(reached, min(1.0, value * (len(known) - i)))
        corrected[place] = reached
    return corrected


@functools.lru_cache(maxsize=2)
def resampled(persons: int, samples: int = SAMPLES, seed: int = SEED) -> Floats:
    """Return how often each person is drawn in each sample, ``[samples, persons]``; each row sums to `persons`."""
    random = np.random.default_rng(seed)
    drawn = random.multinomial(persons, np.full(persons, 1.0 / persons), size=samples)
    weights: Floats = drawn.astype(np.float64)
    weights.flags.writeable = False
    return weights


def interval_of(statistic: Callable[[Floats], Floats], persons: int) -> tuple[Floats, Floats] | None:
    """Return the 95 % interval of a statistic by resampling persons.

    Parameters
    ----------
    statistic : callable
        Takes weights ``[samples, persons]`` and returns ``[samples, ...]``; samples that give no number are left out.
    persons : int

    Returns
    -------
    tuple of array or None
        None with fewer than `LEAST` or more than `MOST` persons, or where more than one sample in ten gives no number.
    """
    if not LEAST <= persons <= MOST:
        return None
    weights = resampled(persons)
    rows = max(2, 4_000_000 // persons)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.concatenate([statistic(weights[i : i + rows]) for i in range(0, SAMPLES, rows)])
    flat = found.reshape(len(found), -1)
    good = np.isfinite(flat).all(axis=1)
    if good.mean() < 0.9:
        return None
    low, high = np.quantile(flat[good], [0.025, 0.975], axis=0)
    return low.reshape(found.shape[1:]), high.reshape(found.shape[1:])
