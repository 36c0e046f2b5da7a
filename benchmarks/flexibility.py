"""How fast the decisions that many choices leave open are counted, against one search per choice."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.harness import Case
from benchmarks.models import slippery_map
from ratherthan.factors.constrictiveness import Search, constrictiveness
from ratherthan.factors.landmarks import landmarks, tree_weights
from ratherthan.factors.selectiveness import Criticality
from ratherthan.model.index import index_of

SIDE = 300
CHOICES = 400
SEARCHED = 40
"""One search per choice is timed on so many of the choices; the ratio is for these."""


def cases() -> list[Case]:
    mdp = slippery_map(SIDE).mdp
    ended = mdp.labels["goal"]
    some = (np.random.default_rng(1).random(mdp.states) < 0.5) & ~ended
    critical = Criticality(certain=some, possible=some)
    route = np.linspace(0, mdp.choices - 1, CHOICES).astype(np.int64)
    weight = np.diff(mdp.state_to_choices).astype(np.int64) * some

    def together() -> object:
        index = index_of(mdp)
        known = landmarks(index, ended, index.choice_to_state[route].astype(np.int64))
        return tree_weights(index, known, route, (weight, weight))

    def one_by_one() -> object:
        return constrictiveness(mdp, critical, ended, route[:SEARCHED].tolist(), search=Search(horizon=mdp.states))

    def prepared() -> Callable[[], object]:
        index = index_of(mdp)
        known = landmarks(index, ended, index.choice_to_state[route].astype(np.int64))
        return lambda: tree_weights(index, known, route, (weight, weight))

    return [
        Case(name=f"one search each, {SEARCHED} choices", run=one_by_one, peer=True),
        Case(name=f"landmarks, {CHOICES} choices, with preparation", run=together),
        Case(name=f"landmarks, {CHOICES} choices, prepared", run=prepared()),
    ]
