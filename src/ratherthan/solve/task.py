"""A model and an objective enter; a Task leaves: what the graph alone decides, and what is left to compute.

Which states have the value 0, 1 or ∞ exactly, and where the optimum has a unique fixed point, depends on the graph and
on which costs are positive, never on a computed number. With G the goal:

* *Least expected cost.* X, where G can be reached with probability 1, is the region of finite values; inside it only
  choices with all branches in X can belong to a policy that arrives for sure. Where such a policy exists that uses costless
  choices only, the value is 0. End components of costless choices are collapsed: within them the run moves free of
  charge, and Bellman's equation has spurious solutions below the optimum (going round for ever costs nothing). After
  that, every policy that does not arrive pays without end, and the fixed point is unique (Bertsekas and Tsitsiklis 1991).
* *Largest expected cost.* Finite where every policy arrives with probability 1, ∞ elsewhere (PRISM's meaning). No end
  component is left.
* *Largest probability.* 0 where G cannot be reached, 1 where it can be reached with probability 1. In the rest end
  components are collapsed: a run may stay there for ever, so that any constant solves Bellman's equation on them.
* *Least probability.* 0 where G can be avoided, 1 where it cannot be missed. In the rest no end component is left: where a
  run can stay for ever, G is avoided.

References
----------
D. P. Bertsekas, J. N. Tsitsiklis, An Analysis of Stochastic Shortest Path Problems, Math. Oper. Res. 16(3), 1991.
S. Haddad, B. Monmege, Interval iteration algorithm for MDPs and IMDPs, Theor. Comput. Sci. 735, 2018.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.errors import PropertyError
from ratherthan.model import graph
from ratherthan.model.formula import states_where
from ratherthan.model.index import Index, index_of
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.objective import ExpectedCost, Objective, ReachAvoid
from ratherthan.model.problem import Problem
from ratherthan.model.property import choose_objective
from ratherthan.solve.rewards import costs_of

__all__ = ["Goal", "Task", "goal_of", "objective_of", "task_of"]

Choices = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Goal:
    """What an objective wants, resolved on a model.

    Parameters
    ----------
    mdp : MDP
    index : Index
    maximise : bool
    counts_cost : bool
        Whether the value is an expected cost, else it is a probability.
    target, through : array of bool, ``[S]``
        Where to, and through which states a run may pass before; a run ends at targets and where neither holds.
    cost : array of float, ``[C]``
        r̄ of each choice; 0 for probabilities.
    costly : array of bool, ``[C]``
        Where the cost is positive.
    """

    mdp: MDP
    index: Index
    maximise: bool
    counts_cost: bool
    target: Bools  # [S]
    through: Bools  # [S]
    cost: Floats  # [C]
    costly: Bools  # [C]

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
        The exact value where the graph decides it: 0, 1 or ∞; 0 where `open`.
    open : array of bool, ``[S]``
        Where the value is to be computed; it is finite and above 0 there.
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


def objective_of(problem: Problem, objective: Objective | None) -> Objective:
    """Return `objective`, or the one that the problem makes plain; PropertyError if there is neither."""
    wanted = choose_objective(problem) if objective is None else objective
    if not isinstance(wanted, ExpectedCost | ReachAvoid):
        raise PropertyError(f"The objective must ask for a value, such as Pmax=? or Rmin=?, got '{wanted.text}'.")
    return wanted


def goal_of(problem: Problem, objective: Objective) -> Goal:
    """Return what `objective` wants on the problem's model.

    Raises
    ------
    PropertyError
        For formulas that do not fit the model, an unknown reward and a negative one.
    """
    mdp, definitions = problem.mdp, problem.definitions
    index = index_of(mdp)
    target = states_where(mdp, objective.goal, definitions)
    if isinstance(objective, ExpectedCost):
        cost, costly = costs_of(mdp, index, objective.reward)
        through = np.ones(mdp.states, dtype=np.bool_)
    else:
        cost, costly = np.zeros(mdp.choices), np.zeros(mdp.choices, dtype=np.bool_)
        through = np.ones(mdp.states, dtype=np.bool_)
        if objective.through is not None:
            through = states_where(mdp, objective.through, definitions)
    return Goal(
        mdp=mdp,
        index=index,
        maximise=objective.maximise,
        counts_cost=isinstance(objective, ExpectedCost),
        target=target,
        through=through,
        cost=cost,
        costly=costly,
    )


def task_of(goal: Goal) -> Task:
    """Return the task that a goal sets: what the graph decides, and what is left."""
    if goal.counts_cost:
        return _most_cost(goal) if goal.maximise else _least_cost(goal)
    return _most_likely(goal) if goal.maximise else _least_likely(goal)


def _least_cost(goal: Goal) -> Task:
    index, target, everywhere = goal.index, goal.target, goal.through
    finite = graph.surely_reach(index, target, everywhere)
    free = graph.surely_reach(index, target, finite, ~goal.costly)
    open_ = finite & ~free
    allowed = open_[index.choice_to_state] & graph.all_branches_in(index, finite)
    component, internal = graph.end_components(index, open_, allowed & ~goal.costly)
    attaining = (free & ~target)[index.choice_to_state] & ~goal.costly & graph.all_branches_in(index, free)
    every = np.ones(index.choices, dtype=np.bool_)
    level = graph.levels_to(index, finite, everywhere)
    trying = graph.first_downhill(index, level, every)
    return Task(
        goal=goal,
        fixed=np.where(finite, 0.0, np.inf),
        open=open_,
        allowed=allowed,
        component=component,
        internal=internal,
        arriving=finite & ~target,
        attaining=attaining,
        elsewhere=np.where(trying >= 0, trying, index.state_to_choices[:-1]),
        can_arrive=graph.can_reach(index, target, everywhere),
    )


def _most_cost(goal: Goal) -> Task:
    index, target, everywhere = goal.index, goal.target, goal.through
    finite = graph.cannot_miss(index, target, everywhere)
    running = finite & ~target
    pays = running & (graph.first_listed(index, goal.costly) >= 0)
    open_ = running & graph.can_reach(index, pays, running)
    avoiding = graph.can_avoid(index, target, everywhere)
    staying = graph.first_listed(index, graph.all_branches_in(index, avoiding))
    every = np.ones(index.choices, dtype=np.bool_)
    heading = graph.first_downhill(index, graph.levels_to(index, avoiding, ~target), every)
    elsewhere = np.where(avoiding, staying, np.where(heading >= 0, heading, index.state_to_choices[:-1]))
    return Task(
        goal=goal,
        fixed=np.where(finite, 0.0, np.inf),
        open=open_,
        allowed=open_[index.choice_to_state],
        elsewhere=elsewhere,
        can_arrive=graph.can_reach(index, target, everywhere),
        component=np.full(index.states, -1, dtype=np.int64),
        internal=np.zeros(index.choices, dtype=np.bool_),
        arriving=np.zeros(index.states, dtype=np.bool_),
        attaining=np.zeros(index.choices, dtype=np.bool_),
    )


def _most_likely(goal: Goal) -> Task:
    index, target, through = goal.index, goal.target, goal.through
    possible = graph.can_reach(index, target, through)
    sure = graph.surely_reach(index, target, through)
    open_ = possible & ~sure
    allowed = open_[index.choice_to_state]
    component, internal = graph.end_components(index, open_, allowed)
    return Task(
        goal=goal,
        fixed=np.where(sure, 1.0, 0.0),
        open=open_,
        allowed=allowed,
        component=component,
        internal=internal,
        arriving=possible & ~target,
        attaining=(sure & ~target)[index.choice_to_state] & graph.all_branches_in(index, sure),
        elsewhere=index.state_to_choices[:-1].astype(np.int64),
        can_arrive=possible,
    )


def _least_likely(goal: Goal) -> Task:
    index, target, through = goal.index, goal.target, goal.through
    avoiding = graph.can_avoid(index, target, through)
    sure = graph.cannot_miss(index, target, through)
    open_ = ~avoiding & ~sure
    staying = graph.first_listed(index, graph.all_branches_in(index, avoiding))
    return Task(
        goal=goal,
        fixed=np.where(sure, 1.0, 0.0),
        open=open_,
        allowed=open_[index.choice_to_state],
        elsewhere=np.where(avoiding & goal.running, staying, index.state_to_choices[:-1]),
        can_arrive=np.ones(index.states, dtype=np.bool_),
        component=np.full(index.states, -1, dtype=np.int64),
        internal=np.zeros(index.choices, dtype=np.bool_),
        arriving=np.zeros(index.states, dtype=np.bool_),
        attaining=np.zeros(index.choices, dtype=np.bool_),
    )
