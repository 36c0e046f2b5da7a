"""A model and an objective enter; what it wants leaves, resolved on the model: a Goal. With what the graph decides: a Task."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import numpy.typing as npt

from ratherthan.errors import PropertyError
from ratherthan.model.formula import states_where
from ratherthan.model.index import Index, branches_of, build_index, index_of
from ratherthan.model.mdp import MDP, Bools, Floats, Ints
from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Level,
    Mission,
    ReachAvoid,
)
from ratherthan.model.problem import Problem
from ratherthan.solve.rewards import SMALLEST, costs_of, paid_of
from ratherthan.solve.system import ROUNDING

__all__ = ["Goal", "Kind", "Task", "goal_of", "mission_sets", "reaching", "restricted"]

Choices = npt.NDArray[np.int64]


class Kind(Enum):
    """What a value is."""

    PROBABILITY = "the probability to reach the target"
    COST = "the expected sum of what is paid until the target, of numbers that are nowhere negative"
    REWARD = "the largest expected sum of what is paid until the target, which must be reached"
    DISCOUNTED = "the expected discounted sum of what is paid"


@dataclass(frozen=True, kw_only=True, eq=False)
class Goal:
    """What an objective wants, resolved on a model.

    Parameters
    ----------
    mdp : MDP
        For names only; the rows are those of `index`.
    index : Index
    probability : array of float, ``[B]``
    kind : Kind
    maximise : bool
    target, through : array of bool, ``[S]``
        Where to, and through which states a run may pass before; a run ends at targets and where neither holds.
    cost : array of float, ``[C]``
        r̄ of each choice; 0 for probabilities.
    size : array of float, ``[C]``
        What the rounding error of `cost` is in proportion to, at least its absolute value.
    costly : array of bool, ``[C]``
        Where something is paid; exactly nothing elsewhere.
    gaining, losing : array of bool, ``[C]``
        Where what is paid is at least 0, and at most 0, for sure, whatever was rounded.
    exact : array of bool, ``[C]``
        Where `cost` was computed without rounding.
    discount : float
        γ; 1 for all kinds but one.
    mirrored : bool
        Whether costs and direction are the opposite of the objective's, whose values are then the negative ones.
    """

    mdp: MDP
    index: Index
    probability: Floats  # [B]
    kind: Kind
    maximise: bool
    target: Bools  # [S]
    through: Bools  # [S]
    cost: Floats  # [C]
    size: Floats  # [C]
    costly: Bools  # [C]
    gaining: Bools  # [C]
    losing: Bools  # [C]
    exact: Bools  # [C]
    discount: float = 1.0
    mirrored: bool = False

    @property
    def counts_cost(self) -> bool:
        """Whether the value is a sum of what is paid, else it is a probability."""
        return self.kind is not Kind.PROBABILITY

    @property
    def signed(self) -> bool:
        """Whether values may have either sign."""
        return not bool(self.gaining.all())

    @property
    def unreached(self) -> float:
        """The value where the target is not reached with probability 1, of the kinds that count on it."""
        return -np.inf if self.kind is Kind.REWARD else np.inf

    @property
    def running(self) -> Bools:
        """Where the objective has not ended, ``[S]``."""
        return self.through & ~self.target

    @property
    def ends(self) -> tuple[Bools, Bools]:
        """Where it has ended well and badly, ``[S]`` each: the goal and the hazards of a Solution."""
        outside = ~self.through & ~self.target
        if self.counts_cost or self.maximise:
            return self.target, outside
        return outside, self.target


@dataclass(frozen=True, kw_only=True, eq=False)
class Task:
    """An optimum to compute, with all that the graph decides.

    Parameters
    ----------
    goal : Goal
    fixed : array of float, ``[S]``
        The exact value where the graph decides it: 0, 1 or ±∞; 0 where `open`.
    open : array of bool, ``[S]``
        Where the value is to be computed; where nothing paid is negative it is above 0 there.
    allowed : array of bool, ``[C]``
        The choices of open states among which the optimum is.
    component : array of int, ``[S]``
        The end component that a state is collapsed into, -1 for none.
    internal : array of bool, ``[C]``
        The choices that stay in such a component free of charge.
    arriving : array of bool, ``[S]``
        Where an optimal policy must not only take a best choice but also get on.
    attaining : array of bool, ``[C]``
        The best choices of the states that are arriving and not open.
    elsewhere : array of int, ``[S]``
        The policy's choice in the states that are neither arriving nor open.
    can_arrive : array of bool, ``[S]``
        As in Solution.
    nearest : tuple of array of int, optional
        Where the target is reached with probability 1: how many steps along choices that stay there it is away, ``[S]``, below 0
        elsewhere; and these states, the nearest first.
    """

    goal: Goal
    fixed: Floats  # [S]
    open: Bools  # [S]
    allowed: Bools  # [C]
    component: Choices  # [S]
    internal: Bools  # [C]
    arriving: Bools  # [S]
    attaining: Bools  # [C]
    elsewhere: Choices  # [S]
    can_arrive: Bools  # [S]
    nearest: tuple[Ints, Ints] | None = None


def mission_sets(problem: Problem, mission: Mission) -> tuple[Bools, Bools]:
    """Return where a mission is done, and where it has failed for good, on a product that was made for it, ``[S]`` each.

    Raises
    ------
    PropertyError
        If the problem is no such product.
    """
    unfolding = problem.unfolding
    if unfolding is None:
        raise PropertyError(f"The mission '{mission.text}' must be read on a product that was made for it, got none.")
    if unfolding.mission.formula == mission.formula:
        return unfolding.satisfied, unfolding.violated
    satisfied, violated = mission_sets(unfolding.origin, mission)
    return satisfied[unfolding.state], violated[unfolding.state]


def goal_of(problem: Problem, objective: Level, ended: Bools | None = None) -> Goal:
    """Return what `objective` wants on the problem's model.

    Parameters
    ----------
    problem : Problem
        For a mission, the product.
    objective : Level
    ended : array of bool, ``[S]``, optional
        Where the run ends besides: what is counted stops there, and what was not reached never will be.

    Raises
    ------
    PropertyError
        For formulas that do not fit the model, an unknown reward and a negative one where it must not be.
    """
    mdp, definitions = problem.mdp, problem.definitions
    everywhere, nowhere = np.ones(mdp.states, dtype=np.bool_), np.zeros(mdp.states, dtype=np.bool_)
    over = nowhere if ended is None else ended
    if isinstance(objective, ReachAvoid | Mission):
        if isinstance(objective, Mission):
            target, violated = mission_sets(problem, objective)
            through = ~violated
        else:
            target = states_where(mdp, objective.goal, definitions)
            through = everywhere
            if objective.through is not None:
                through = states_where(mdp, objective.through, definitions)
        return reaching(mdp, target, through & ~over, maximise=objective.maximise)
    if isinstance(objective, Discounted):
        _check_discount(objective.discount)
        return _paying(mdp, objective, target=nowhere, through=~over)
    target = states_where(mdp, objective.goal, definitions)
    return _paying(mdp, objective, target=target | over, through=everywhere)


def reaching(mdp: MDP, target: Bools, through: Bools, *, maximise: bool = True) -> Goal:
    """Return the goal of reaching `target` through states `through` with the largest (least) probability."""
    nothing = np.zeros(mdp.choices)
    return Goal(
        mdp=mdp,
        index=index_of(mdp),
        probability=mdp.branch_to_probability,
        kind=Kind.PROBABILITY,
        maximise=maximise,
        target=target,
        through=through,
        cost=nothing,
        size=nothing,
        costly=nothing > 0.0,
        gaining=nothing == 0.0,
        losing=nothing == 0.0,
        exact=nothing == 0.0,
    )


def _check_discount(discount: float) -> None:
    if not 0.0 < discount < 1.0:
        raise PropertyError(f"A discount must lie between 0 and 1, both excluded, got {discount:g}.", discount=discount)


def _paying(mdp: MDP, objective: ExpectedCost | ExpectedReward | Discounted, *, target: Bools, through: Bools) -> Goal:
    """Return the goal of an objective that adds up what is paid, mirrored where that leaves fewer kinds of tasks."""
    index = index_of(mdp)
    maximise, mirrored = objective.maximise, False
    if isinstance(objective, ExpectedCost):
        cost, costly = costs_of(mdp, index, objective.reward)
        size, gaining, losing, kind = cost, np.ones(mdp.choices, dtype=np.bool_), ~costly, Kind.COST
        exact = losing
    else:
        paid = paid_of(mdp, index, objective.reward)
        counts = (through & ~target)[index.choice_to_state]  # what is paid after the end does not count
        cost, size, costly = np.where(counts, paid.total, 0.0), np.where(counts, paid.size, 0.0), paid.pays & counts
        error = (np.diff(index.choice_to_branches) + 8) * ROUNDING * size
        above, below = counts & paid.signs[0] & (cost >= -error), counts & paid.signs[1] & (cost <= error)
        mirrored = bool(below.any()) and (not above.any() or not maximise)
        if mirrored:
            cost, maximise, above, below = 0.0 - cost, not maximise, below, above
        gaining, losing, exact = ~below, ~above, paid.exact | ~counts
        kind = Kind.DISCOUNTED
        if isinstance(objective, ExpectedReward):
            kind = Kind.REWARD if maximise else Kind.COST
        if not below.any():
            cost = np.where(costly, np.maximum(cost, SMALLEST), 0.0)
    return Goal(
        mdp=mdp,
        index=index,
        probability=mdp.branch_to_probability,
        kind=kind,
        maximise=maximise,
        target=target,
        through=through,
        cost=cost,
        size=size,
        costly=costly,
        gaining=gaining,
        losing=losing,
        exact=exact,
        discount=objective.discount if isinstance(objective, Discounted) else 1.0,
        mirrored=mirrored,
    )


def restricted(goal: Goal, permitted: Bools) -> tuple[Goal, Choices | None]:
    """Return a goal on the permitted choices alone, and which choices of the goal they are.

    Parameters
    ----------
    goal : Goal
    permitted : array of bool, ``[C]``
        At least one of every state.

    Returns
    -------
    Goal
    kept : array of int, ``[C']``, or None
        None where all are permitted.
    """
    index = goal.index
    if permitted.all():
        return goal, None
    kept = np.flatnonzero(permitted)
    branches, offsets = branches_of(index.choice_to_branches, kept)
    own = np.concatenate([[0], np.cumsum(np.bincount(index.choice_to_state[kept], minlength=index.states))])
    made = build_index(own, offsets, index.branch_to_target[branches])
    parts = {name: getattr(goal, name)[kept] for name in ("cost", "size", "costly", "gaining", "losing", "exact")}
    return replace(goal, index=made, probability=goal.probability[branches], **parts), kept
