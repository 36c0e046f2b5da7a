"""A policy enters; what it reaches and earns, with proved bounds, leaves.

Under a policy a model is a Markov chain: a state's row mixes the rows of its choices. The graph of the chain decides where
the goal is reached with probability 0 or 1, and where nothing is paid on the way; the rest is one linear system, from every
state of which the run is absorbed (without cycles: one backward pass, `layered`). With the expected cost, a state that reaches the goal with probability below 1 has the
value ∞, whatever it pays; with the reward gathered until a goal that must be reached it has the value -∞.

A state of which the policy says nothing must not be reached. Where it is not reached from the initial states, it and all
states that may lead to it are left undecided: lower bound -∞, upper bound ∞.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.errors import PolicyError
from ratherthan.model import graph
from ratherthan.model.index import Index, branches_of, build_index
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.policy import Policy
from ratherthan.solve.certify import Parts, Tight, chain_bounds, never_falls, never_rises, outward
from ratherthan.solve.goal import Goal, Kind
from ratherthan.solve.layered import layered_bounds
from ratherthan.solve.linear import solve_chain
from ratherthan.solve.rewards import SMALLEST
from ratherthan.solve.sweeps import Sweeps, sweep_from_below, swept_between, upper_vector
from ratherthan.solve.system import System, build_system

SOME = 3000
"""Up to how many states the equations of a chain are solved at once, and to the last digit."""

__all__ = ["Chain", "Evaluated", "Guess", "chain_of", "evaluated", "nodes_of", "refuse_unsaid"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain:
    """A model under a policy: one row per state, empty where the policy says nothing.

    Parameters
    ----------
    index : Index
        Its graph; choice s is the row of state s.
    probability : array of float, ``[K]``
    cost, size : array of float, ``[S]``
    costly, exact : array of bool, ``[S]``
        Where something is paid, and where that was not rounded.
    said : array of bool, ``[S]``
        Where the policy says something.
    given : bool
        Whether it takes one choice everywhere, so that its probabilities are those of the model as they stand.
    """

    index: Index
    probability: Floats  # [K]
    cost: Floats  # [S]
    size: Floats  # [S]
    costly: Bools  # [S]
    exact: Bools  # [S]
    said: Bools  # [S]
    given: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluated:
    """The values of a policy with bounds; `open` is where they were computed, elsewhere they are exact; undecided where `lost`."""

    values: Floats  # [S]
    lower: Floats  # [S]
    upper: Floats  # [S]
    open: Bools  # [S]
    lost: Bools  # [S]
    solves: int


def chain_of(goal: Goal, policy: Policy) -> Chain:
    """Return the model under a policy."""
    index = goal.index
    if policy.chance is None:
        weights = np.zeros(index.choices)
        weights[policy.choice[policy.choice >= 0]] = 1.0
    else:
        weights = policy.chance
    sums = np.add.reduceat(weights, index.state_to_choices[:-1])
    taken = np.flatnonzero(weights > 0.0)
    state = index.choice_to_state[taken]
    share = weights[taken] / sums[state]
    branches, offsets = branches_of(index.choice_to_branches, taken)
    lengths = np.diff(offsets)
    row_to_branches = np.zeros(index.states + 1, dtype=np.int64)
    np.cumsum(np.bincount(state, weights=lengths, minlength=index.states).astype(np.int64), out=row_to_branches[1:])
    chain = build_index(np.arange(index.states + 1), row_to_branches, index.branch_to_target[branches])
    cost = np.bincount(state, weights=share * goal.cost[taken], minlength=index.states)
    size = np.bincount(state, weights=share * goal.size[taken], minlength=index.states)
    costly = np.zeros(index.states, dtype=np.bool_)
    costly[state[goal.costly[taken]]] = True
    return Chain(
        index=chain,
        probability=goal.probability[branches] * np.repeat(share, lengths),
        cost=np.where(costly, cost if goal.signed else np.maximum(cost, SMALLEST), 0.0),
        size=np.where(costly, size, 0.0),
        costly=costly,
        exact=np.bincount(state[goal.exact[taken] & (share == 1.0)], minlength=index.states) == 1,
        said=sums > 0.0,
        given=bool((share == 1.0).all()),
    )


def refuse_unsaid(goal: Goal, chain: Chain) -> None:
    """Raise PolicyError where the chain reaches, from the initial states, one of which the policy says nothing."""
    mdp = goal.mdp
    start = np.zeros(mdp.states, dtype=np.bool_)
    start[mdp.initial] = True
    unsaid = graph.reached_from(chain.index, start, ~goal.running) & goal.running & ~chain.said
    if not unsaid.any():
        return
    state = int(np.argmax(unsaid))
    called = f"{state} ('{mdp.names[state]}')" if mdp.names.named else str(state)
    some = ", ".join(f"'{mdp.action_name(choice)}'" for choice in mdp.choices_of(state)[:5])
    raise PolicyError(
        f"A policy must say what to do in every state that it reaches, but it says nothing of state {called}"
        f"{_more(unsaid)}. Add a line for it with one of its actions: {some}.",
        state=state,
    )


def _more(states: Bools) -> str:
    others = int(np.count_nonzero(states)) - 1
    return f" and {others} more" if others else ""


class Guess(NamedTuple):
    """Values in two parts, with a margin, that may pass the check as they are."""

    high: Floats  # [S]
    low: Floats  # [S]
    margin: Floats  # [S]


def evaluated(goal: Goal, chain: Chain, guess: Guess | None = None) -> Evaluated:
    """Return the values of the chain with proved bounds.

    Parameters
    ----------
    goal : Goal
    chain : Chain
    guess : Guess, optional
        What to check before anything is solved.

    Returns
    -------
    Evaluated
        Undecided states have the bounds -∞ and ∞ and the value 0.
    """
    index, running = chain.index, goal.running
    lost = graph.can_reach(index, running & ~chain.said, running)
    possible = graph.can_reach(index, goal.target, goal.through)
    sure = graph.cannot_miss(index, goal.target, goal.through)
    if goal.kind is Kind.DISCOUNTED:
        open_ = graph.can_reach(index, running & chain.costly, running) & running & ~lost
        fixed = np.zeros(index.states)
    elif goal.counts_cost:
        pays = graph.can_reach(index, sure & running & chain.costly, sure & running)
        open_ = sure & pays & ~lost
        fixed = np.where(sure, 0.0, goal.unreached)
    else:
        open_ = possible & ~sure & ~lost
        fixed = np.where(sure, 1.0, 0.0)
    lower, upper, solves = fixed.copy(), fixed.copy(), 0
    if open_.any():
        with np.errstate(all="ignore"):  # numbers beyond doubles become ±∞ or NaN, which no check lets pass
            fixed[open_], lower[open_], upper[open_] = _computed(goal, chain, open_, fixed, guess)
        solves = 1
    fixed[lost], lower[lost], upper[lost] = 0.0, -np.inf, np.inf
    return Evaluated(values=fixed, lower=lower, upper=upper, open=open_, lost=lost, solves=solves)


def nodes_of(open_: Bools, fixed: Floats) -> npt.NDArray[np.int64]:
    """Return the node of each state, ``[S]``: open states are numbered, the others are the sinks of their value, 0 or 1."""
    count = int(np.count_nonzero(open_))
    node = np.where(fixed == 1.0, count + 1, count)
    node[open_] = np.arange(count)
    return node


def _computed(
    goal: Goal, chain: Chain, open_: Bools, fixed: Floats, guess: Guess | None
) -> tuple[Floats, Floats, Floats]:
    """Return the values of the open states and their bounds."""
    system = build_system(
        chain.index,
        chain.probability,
        chain.cost,
        np.flatnonzero(open_),
        nodes_of(open_, fixed),
        size=chain.size,
        exact=chain.exact,
        signed=goal.signed,
        discount=goal.discount,
        given=chain.given,
    )
    least, most = _widest(goal, system.nodes)
    plain = layered_bounds(system, goal.maximise, most=np.inf if goal.counts_cost else 1.0)
    if plain is not None and plain.narrow:
        return plain
    if plain is not None:
        least, most = plain.lower, plain.upper
    if guess is not None:
        parts, margin = Parts(guess.high[open_], guess.low[open_]), guess.margin[open_]
        if never_falls(system, *parts, -margin) and never_rises(system, *parts, margin):
            lower, upper = outward(parts, margin, signed=system.signed)
            lower, upper = np.maximum(lower, least), np.minimum(upper, most)
            return np.clip(parts.high + parts.low, lower, upper), lower, upper
    at_size = _at_size(goal, system)
    if at_size is not None:
        return at_size[0], np.maximum(at_size[1], least), np.minimum(at_size[2], most)
    solved = solve_chain(system)
    if solved is None:
        return _swept(goal, system, (least, most))
    tight = Tight(Parts(solved.high, solved.low), np.arange(system.nodes), solved.inverse, solved.scale)
    proved = chain_bounds(system, tight)
    if not goal.counts_cost and (proved[0] is None or proved[1] is None):
        proved = _past_traps(system, proved)
    lower = least if proved[0] is None else np.maximum(proved[0], least)
    upper = most if proved[1] is None else np.minimum(proved[1], most)
    return np.clip(solved.high + solved.low, lower, upper), lower, upper


def _past_traps(system: System, proved: tuple[Floats | None, Floats | None]) -> tuple[Floats | None, Floats | None]:
    """Return the bounds of a chain of probabilities that lingers, those that are proved already where there are such."""
    from ratherthan.solve.trapped.chains import chain_past_traps

    found = chain_past_traps(system)
    if found is None:
        return proved
    lower, upper = (ours if theirs is None else theirs for ours, theirs in zip(found, proved, strict=True))
    return lower, upper


def _at_size(goal: Goal, system: System) -> tuple[Floats, Floats, Floats] | None:
    """Return values and bounds of a chain with many states by sweeps, None where these do not suit."""
    if not goal.counts_cost or system.nodes <= SOME:
        return None
    from ratherthan.solve.contracting import chain_bounds_at_size

    return chain_bounds_at_size(system, goal.maximise, goal.discount)


def _widest(goal: Goal, count: int) -> tuple[Floats, Floats]:
    """Return the bounds that hold without a proof."""
    return np.full(count, -np.inf if goal.signed else 0.0), np.full(count, np.inf if goal.counts_cost else 1.0)


def _swept(goal: Goal, system: System, widest: tuple[Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    """Return values and bounds by value iteration, where no equation solver coped with the system."""
    settings, (least, most) = Sweeps(), widest
    if goal.signed:
        values, below, above = swept_between(system, settings, maximise=goal.maximise)
        return values, least if below is None else below, most if above is None else above
    swept = sweep_from_below(system, goal.maximise, settings)
    lower = swept.values if never_falls(system, swept.values) else least
    above = upper_vector(system, swept.values, goal.maximise, None if goal.counts_cost else settings)
    return swept.values, lower, most if above is None else np.minimum(above, most)
