"""Texts of numbers enter; arrays of doubles leave, or the place of the first that is no number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ratherthan.io._drn_head import value_of
from ratherthan.model.mdp import Floats

__all__ = ["brackets", "numbers", "stacked"]

PLAIN = b"0123456789.eE+- "
"""What decimal numbers consist of; neither nan, inf nor 1_000 does."""


def numbers(texts: Sequence[bytes], placeholders: Mapping[bytes, float]) -> Floats | int:
    """Return finite numbers, or the index of the first text that is none.

    Parameters
    ----------
    texts : sequence of bytes
        Decimal, fractions, or placeholders.
    placeholders : mapping of bytes to float
    """
    if not b"".join(texts).translate(None, PLAIN):
        try:
            values = np.array(list(map(float, texts)), dtype=np.float64)
        except ValueError:
            values = np.array([np.nan])
        if np.isfinite(values).all():
            return values
    known = {text: value_of(text.strip(), placeholders) for text in set(texts)}
    if None in known.values():
        return next(i for i, text in enumerate(texts) if known[text] is None)
    return np.array([known[text] for text in texts], dtype=np.float64)


def brackets(texts: Sequence[bytes], placeholders: Mapping[bytes, float]) -> Floats | int:
    """Return a row of numbers for every list ``1,2.5``, filled up with 0, or the index of the first that is broken.

    Parameters
    ----------
    texts : sequence of bytes
        Without their brackets; an empty one has no numbers.
    placeholders : mapping of bytes to float
    """
    counts = np.array([text.count(b",") + 1 if text.strip() else 0 for text in texts], dtype=np.int64)
    width = int(counts.max(initial=0))
    table = np.zeros((len(texts), width))
    full = b",".join([text for text, count in zip(texts, counts.tolist(), strict=True) if count])
    values = numbers(full.split(b","), placeholders) if full else np.zeros(0)
    if isinstance(values, int):
        return int(np.searchsorted(np.cumsum(counts), values, side="right"))
    table[np.arange(width) < counts[:, np.newaxis]] = values
    return table


def stacked(tables: Sequence[Floats], width: int) -> Floats:
    """Return tables below one another, at least `width` wide, filled up with 0."""
    width = max([width, *(table.shape[1] for table in tables)])
    return np.vstack(
        [np.zeros((0, width)), *(np.pad(table, ((0, 0), (0, width - table.shape[1]))) for table in tables)]
    )
