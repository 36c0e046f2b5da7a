"""A mapping of states to actions enters, rows of state, action and probability leave."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ratherthan.errors import PolicyError

__all__ = ["SUM_TOLERANCE", "Row", "Rows", "mapping_rows", "probability"]

SUM_TOLERANCE = 1e-6
"""How far the probabilities of a state may be from 1 in a file; what is nearer is rescaled to 1."""

Row = tuple[Any, Any, float]
"""A state, an action, and its probability: NaN where it is certain."""


class Rows(list[Row]):
    """What a policy says, row by row."""


def mapping_rows(source: Mapping[Any, Any], what: str) -> Rows:
    """Return state, action and probability out of a mapping."""
    rows = Rows()
    for state, said in source.items():
        if isinstance(said, Mapping):
            if not said:
                raise PolicyError(f"{what} must give an action at state {state!r}, got none. Leave the state out.")
            rows += [(state, action, probability(chance, state, what)) for action, chance in said.items()]
        else:
            rows.append((state, said, np.nan))
    return rows


def probability(given: Any, state: Any, what: str) -> float:
    """Return a probability, or raise PolicyError where it is none."""
    number = isinstance(given, int | float | np.integer | np.floating) and not isinstance(given, bool)
    if not number or not 0 <= given <= 1 + SUM_TOLERANCE:
        raise PolicyError(f"{what} must give probabilities between 0 and 1, got {given!r} at state {state!r}.")
    return float(given)
