"""A model of responses enters, whole studies drawn from it leave: as arrays, or as an export's table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.robots.model import Ratings, ResponseModel

__all__ = ["OTHER_WORDS", "drawn_ratings", "drawn_times", "rounded"]

Floats = npt.NDArray[np.float64]
OTHER_WORDS = 20.0
"""Words of a kind of which the model tells none."""


def rounded(latent: Floats, points: int = 5) -> Floats:
    """Return numbers on the scale from 1 to 5 as ratings from 1 to `points`."""
    moved = latent if points == 5 else 1.0 + (latent - 1.0) * (points - 1) / 4.0
    ratings: Floats = np.clip(np.rint(moved), 1.0, float(points))
    return ratings


def drawn_ratings(
    item: Ratings,
    kinds: Sequence[str],
    shape: tuple[int, int, int],
    random: np.random.Generator,
    *,
    factor: float = 1.0,
) -> Floats:
    """Return ratings, ``[samples, persons, kinds, maps]``.

    Parameters
    ----------
    item : Ratings
    kinds : sequence of str
    shape : (samples, persons, maps)
    random : Generator
    factor : float
        By which differences between kinds are multiplied.
    """
    samples, persons, maps = shape
    person = random.normal(0.0, item.person, (samples, persons, 1, 1))
    kind = random.normal(0.0, item.kind, (samples, persons, len(kinds), 1))
    rest = random.normal(0.0, item.rest, (samples, persons, len(kinds), maps))
    return rounded(item.centres(kinds, factor)[:, None] + person + kind + rest)


def drawn_times(
    model: ResponseModel,
    kinds: Sequence[str],
    shape: tuple[int, int, int],
    random: np.random.Generator,
    *,
    factor: float = 1.0,
) -> Floats:
    """Return seconds, ``[samples, persons, kinds, maps]``; parameters as of `drawn_ratings`, `factor` on the log scale."""
    samples, persons, maps = shape
    time = model.time
    centres = np.log([time.centre(time.words.get(kind, OTHER_WORDS)) for kind in kinds])
    centres = centres.mean() + factor * (centres - centres.mean())
    person = random.normal(0.0, time.person, (samples, persons, 1, 1))
    kind = random.normal(0.0, time.kind, (samples, persons, len(kinds), 1))
    rest = random.normal(0.0, time.rest, (samples, persons, len(kinds), maps))
    seconds: Floats = np.exp(centres[:, None] + person + kind + rest)
    return seconds
