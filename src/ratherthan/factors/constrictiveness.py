"""Choices and the critical states enter; how many decisions each choice leaves open leaves.

Definition
----------
ε(s,a) = Σ |A(u)| over u ∈ T(s,a) ∩ S_c (Chen, Boggess, Feng 2020, section III-B): the larger, the more decisions are left,
the less constrictive and the *more flexible* the choice. The search tree T(s,a) starts at the successors of (s,a) and
follows every choice of every state reached; states where the objective has ended are leaves. The search never returns to s
(a path of a search tree repeats no state): staying in place and driving back are no new options. So T(s,a) is the set of
states reachable from the successors of (s,a) in the graph without s, each counted once.

Where criticality is open the count has two bounds: open states counted, and not counted.

Method: one breadth-first search per choice; a choice costs one pass over the branches it reaches.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.factors._kernels import tree_weight
from ratherthan.factors.selectiveness import Criticality
from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import MDP, Bools, Floats

__all__ = ["Constrictiveness", "Search", "constrictiveness", "search_tree"]

States = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Search:
    """Settings of the search.

    Parameters
    ----------
    horizon : int, optional
        At most so many steps after the choice itself; None is without end.
    toward_goal : bool
        Beyond the choice itself, follow only branches to strictly better values.
    """

    horizon: int | None = None
    toward_goal: bool = False


@dataclass(frozen=True, kw_only=True)
class Constrictiveness:
    """How many decisions a choice leaves open: between `lower` and `upper`, equal unless criticality is open somewhere."""

    lower: int
    upper: int

    @property
    def count(self) -> int | None:
        """The count ε where it is decided, else None."""
        return self.lower if self.lower == self.upper else None


def constrictiveness(
    mdp: MDP,
    critical: Criticality,
    ended: Bools,
    choices: Iterable[int],
    *,
    search: Search = Search(),
    better: Floats | None = None,
) -> dict[int, Constrictiveness]:
    """Count the decisions that each of `choices` leaves open.

    Parameters
    ----------
    mdp : MDP
    critical : Criticality
        S_c of the same values, impact and α.
    ended : array of bool, ``[S]``
    choices : iterable of int
    search : Search
    better : array of float, ``[S]``, optional
        Needed for ``Search(toward_goal=True)``: a number per state that falls on the way to better values.

    Returns
    -------
    dict of int to Constrictiveness
    """
    weight = np.diff(mdp.state_to_choices).astype(np.int64)
    certain, possible = weight * critical.certain, weight * critical.possible
    rows = mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target
    mark, queue = np.zeros(mdp.states, dtype=np.int64), np.zeros(mdp.states, dtype=np.int64)
    horizon = -1 if search.horizon is None else search.horizon
    values = better if search.toward_goal and better is not None else np.zeros(0)
    kernel = compiled(tree_weight, mdp.branches)
    counts = {}
    for stamp, choice in enumerate(choices, start=1):
        branches = mdp.branches_of(choice)
        own, room = (branches.start, branches.stop), (mark, queue, stamp)
        found = kernel(mdp.state_of(choice), own, rows, ended, certain, possible, room, horizon, values)
        counts[choice] = Constrictiveness(lower=int(found.certain), upper=int(found.possible))
    return counts


def search_tree(
    mdp: MDP,
    ended: Bools,
    choice: int,
    *,
    search: Search = Search(),
    better: Floats | None = None,
) -> States:
    """Return the states of T(s,a) in breadth-first order, each once.

    Parameters and notes as in `constrictiveness`.
    """
    root = mdp.state_of(choice)
    seen = np.zeros(mdp.states, dtype=bool)
    seen[root] = True
    frontier = _fresh(mdp.branch_to_target[mdp.branches_of(choice)].astype(np.int64), seen)
    layers = [frontier]
    steps = 0
    while len(frontier) and (search.horizon is None or steps < search.horizon):
        origin, target = _branches_from(mdp, frontier[~ended[frontier]])
        if search.toward_goal and better is not None:
            target = target[better[target] < better[origin]]
        frontier = _fresh(target, seen)
        layers.append(frontier)
        steps += 1
    return np.concatenate(layers)


def _fresh(targets: States, seen: Bools) -> States:
    """Return the targets not seen yet, in the order of their first appearance, and mark them seen."""
    targets = targets[~seen[targets]]
    _, first = np.unique(targets, return_index=True)
    fresh = targets[np.sort(first)]
    seen[fresh] = True
    return fresh


def _branches_from(mdp: MDP, states: States) -> tuple[States, States]:
    """Return origin and target of every branch of every choice of `states`."""
    first = mdp.choice_to_branches[mdp.state_to_choices[states]].astype(np.int64)
    last = mdp.choice_to_branches[mdp.state_to_choices[states + 1]].astype(np.int64)
    counts = last - first
    total = int(counts.sum())
    offsets = (
        np.repeat(first - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts) if total else np.zeros(0, np.int64)
    )
    branches = offsets + np.arange(total)
    return np.repeat(states, counts), mdp.branch_to_target[branches].astype(np.int64)
