"""A policy enters; how often each choice is taken from one start, in expectation, leaves; and a policy from such numbers.

With P the chain of a policy and s the start, y = e_s + γ Pᵀ y counts how often each state is visited before the end, and
x(s, a) = y(s) · policy(s, a) how often each choice is taken. Every total of the policy is linear in x: Σ x · r̄. A mixture of such
numbers, l · x₁ + (1 - l) · x₂, is that of the policy x / Σ x, which remembers nothing and earns the mixture of what the two
earn (Puterman 1994, section 6.9). The numbers are those of one solve, not proved: what rests on them is evaluated afterwards.

References
----------
M. L. Puterman, Markov Decision Processes, Wiley, 1994.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model.index import branches_of, index_of
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.policy import Policy

__all__ = ["frequencies", "mixed"]

Nodes = npt.NDArray[np.int64]

MOST_DENSE = 400
"""Up to how many states matrices are dense."""


def frequencies(mdp: MDP, policy: Policy, start: int, ended: Bools, discount: float = 1.0) -> Floats | None:
    """Return how often each choice is taken from a start, ``[C]``.

    Parameters
    ----------
    mdp : MDP
    policy : Policy
    start : int
    ended : array of bool, ``[S]``
        Where nothing is taken any more.
    discount : float
        Of what is taken after k steps, ``discount ** k`` counts.

    Returns
    -------
    array of float, or None
        None where the policy is not sure to end, and nothing is discounted.
    """
    index, weights = index_of(mdp), policy.weights(mdp)
    taken = weights > 0.0
    begin = np.zeros(mdp.states, dtype=np.bool_)
    begin[start] = True
    inside = graph.reached_from(index, begin, ended, taken) & ~ended
    if discount == 1.0 and not graph.can_reach(index, ended, ~ended, taken)[inside].all():
        return None
    states = np.flatnonzero(inside)
    node = np.full(mdp.states, -1, dtype=np.int64)
    node[states] = np.arange(len(states))
    choices = np.flatnonzero(taken & inside[index.choice_to_state])
    branches, offsets = branches_of(index.choice_to_branches, choices)
    lengths = np.diff(offsets)
    source = np.repeat(node[index.choice_to_state[choices]], lengths)
    target = node[index.branch_to_target[branches]]
    share = discount * np.repeat(weights[choices], lengths) * mdp.branch_to_probability[branches]
    visits = _visits(len(states), int(node[start]), discount, (source, target, share))
    found = np.zeros(mdp.choices)
    found[choices] = weights[choices] * visits[node[index.choice_to_state[choices]]]
    return np.maximum(found, 0.0) if np.isfinite(found).all() else None


def _visits(count: int, start: int, discount: float, entries: tuple[Nodes, Nodes, Floats]) -> Floats:
    """Return y of y = e_start + Pᵀ y, the entries of P given as rows, columns (-1 outside) and values, discounted."""
    source, target, share = entries
    right = np.zeros(count)
    if start < 0:
        return right
    right[start] = 1.0
    other = target != source
    # 1 - γ P(s, s) without the difference, which cancels where a state is left slowly: γ Σ P(s, t) + 1 - γ.
    leave = np.bincount(source[other], weights=share[other], minlength=count) + (1.0 - discount)
    kept = other & (target >= 0)
    source, target, share = source[kept], target[kept], share[kept]
    if count <= MOST_DENSE:
        flat = np.bincount(target * count + source, weights=share, minlength=count * count)
        try:
            return np.asarray(np.linalg.solve(np.diag(leave) - flat.reshape(count, count), right), dtype=np.float64)
        except np.linalg.LinAlgError:
            return np.full(count, np.nan)
    from scipy.sparse import coo_array, csc_array
    from scipy.sparse.linalg import splu

    own = np.arange(count)
    rows, columns = np.concatenate([own, target]), np.concatenate([own, source])
    matrix = coo_array((np.concatenate([leave, -share]), (rows, columns)), shape=(count, count))
    try:
        solved: Floats = splu(csc_array(matrix)).solve(right)
    except RuntimeError:  # exactly singular in doubles
        return np.full(count, np.nan)
    return solved


def mixed(mdp: MDP, first: tuple[Policy, Floats], second: tuple[Policy, Floats], share: float) -> Policy:
    """Return the policy that takes choices as often as two others do in mixture.

    Parameters
    ----------
    mdp : MDP
    first, second : tuple of Policy and array of float, ``[C]``
        With how often they take each choice.
    share : float
        Of the first, between 0 and 1.

    Returns
    -------
    Policy
        Where neither comes it does as the second.
    """
    weights = share * first[1] + (1.0 - share) * second[1]
    owner = index_of(mdp).choice_to_state
    visits = np.bincount(owner, weights=weights, minlength=mdp.states)
    kept = visits > 0.0
    chance = np.where(kept[owner], weights / np.where(kept, visits, 1.0)[owner], second[0].weights(mdp))
    sure = np.bincount(owner, weights=chance > 0.0, minlength=mdp.states) == 1
    choice = np.full(mdp.states, -1, dtype=np.int64)
    alone = np.flatnonzero((chance > 0.0) & sure[owner])
    choice[owner[alone]] = alone
    return Policy(choice=choice, chance=None if sure.all() else chance)
