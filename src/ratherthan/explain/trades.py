"""A plan under several objectives enters; how the choice taken compares with another under all of them together leaves.

Claims
------
With "better", "worse", "equal" or "open" for each objective, by the bounds of q^π (`ratherthan.explain.further`):

* better on all: better under one at least, worse under none, and every comparison is decided
* trade: better under one at least and worse under one at least, whatever is open
* dominated: worse under one at least, better under none, and every comparison is decided
* indifferent: equal under all
* open: what the bounds leave between these
"""

from __future__ import annotations

from collections.abc import Sequence

from ratherthan.explain.claims import relation_of
from ratherthan.explain.explanation import Judged, Trade
from ratherthan.explain.further import View

__all__ = ["trade_of"]


def trade_of(views: Sequence[View], state: int, taken: int, other: int, *, tolerance: float) -> Trade:
    """Return how a choice compares with another one.

    Parameters
    ----------
    views : sequence of View
        The plan under each objective.
    state, taken, other : int
        Two choices of the state.
    tolerance : float
        The factor of τ.
    """
    judged = []
    for number, view in enumerate(views):
        own, foil = view.measured(state, taken), view.measured(state, other)
        relation = relation_of(own.number, foil.number, maximise=view.objective.maximise, tolerance=tolerance)
        judged.append(Judged(objective=number, taken=own, other=foil, relation=relation))
    claim = _claim({one.relation for one in judged})
    return Trade(claim=claim, against=(judged[0].other.action,), judged=tuple(judged))


def _claim(relations: set[str]) -> str:
    """Return the claim that a set of relations supports."""
    if {"better", "worse"} <= relations:
        return "trade"
    if "open" in relations:
        return "open"
    if "better" in relations:
        return "better on all"
    return "dominated" if "worse" in relations else "indifferent"
