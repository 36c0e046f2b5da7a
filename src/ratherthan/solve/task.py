"""A Goal enters; a Task leaves: what the graph alone decides, and what is left to compute.

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

* *Least probability, where the run must end.* Of several objectives the first may demand that the run comes to an end; then to stay
  for ever is no way to avoid G. 0 where the other ends can be reached with probability 1 without G, 1 where they cannot be reached
  at all. In the rest end components are collapsed, as for costs: every policy that counts leaves them.

* *Sums of rewards of either sign, and discounted sums*: see `gathering`.

Objectives whose rewards are all of the sign against their direction are mirrored (`goal`): the most reward, where every
reward is at most 0, is the least cost of the opposite rewards, to the letter.

References
----------
D. P. Bertsekas, J. N. Tsitsiklis, An Analysis of Stochastic Shortest Path Problems, Math. Oper. Res. 16(3), 1991.
S. Haddad, B. Monmege, Interval iteration algorithm for MDPs and IMDPs, Theor. Comput. Sci. 735, 2018.
"""

from __future__ import annotations

import numpy as np

from ratherthan.model import graph
from ratherthan.model.mdp import Bools
from ratherthan.solve.gathering import discounted, most_reward
from ratherthan.solve.goal import Goal, Kind, Task, goal_of

__all__ = ["Goal", "Task", "goal_of", "task_of"]


def task_of(goal: Goal, must_end: Bools | None = None) -> Task:
    """Return the task that a goal sets: what the graph decides, and what is left.

    Parameters
    ----------
    goal : Goal
    must_end : array of bool, ``[S]``, optional
        For a least probability: where only policies count with which the run ends for sure. No choice leads out of it but to an
        end, and there is such a policy.
    """
    if must_end is not None and goal.kind is Kind.PROBABILITY and not goal.maximise:
        return _least_likely_ending(goal, must_end)
    if goal.kind is Kind.DISCOUNTED:
        return discounted(goal)
    if goal.kind is Kind.REWARD:
        return most_reward(goal)
    if goal.kind is Kind.COST:
        return _most_cost(goal) if goal.maximise else _least_cost(goal)
    return _most_likely(goal) if goal.maximise else _least_likely(goal)


def _least_cost(goal: Goal) -> Task:
    index, target, everywhere = goal.index, goal.target, goal.through
    sure = graph.surely_reaching(index, target, everywhere)
    finite, free, attaining = sure.states, target, np.zeros(index.choices, dtype=np.bool_)
    component, internal = np.full(index.states, -1, dtype=np.int64), attaining
    open_, allowed = finite & ~target, sure.usable
    if not goal.costly.all():
        free = graph.surely_reach(index, target, finite, ~goal.costly)
        attaining = (free & ~target)[index.choice_to_state] & ~goal.costly & graph.all_branches_in(index, free)
        open_ = finite & ~free
        allowed = allowed & open_[index.choice_to_state]
        component, internal = graph.end_components(index, open_, allowed & ~goal.costly)
    trying = graph.way_back(index, finite, everywhere)
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
        can_arrive=sure.possible,
        nearest=(sure.level, sure.order),
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
    found = graph.surely_reaching(index, target, through)
    possible, sure = found.possible, found.states
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
        attaining=found.usable,
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


def _least_likely_ending(goal: Goal, must_end: Bools) -> Task:
    index, target, running = goal.index, goal.target, goal.running
    safe = ~target & ~running
    must = must_end & running
    free = must & graph.surely_reach(index, safe, must)
    avoiding = graph.can_avoid(index, target | must & ~free, running & ~free)
    sure = ~graph.can_reach(index, avoiding, running)
    open_ = ~avoiding & ~sure
    component, internal = graph.end_components(index, open_, open_[index.choice_to_state])
    staying = graph.first_listed(index, graph.all_branches_in(index, avoiding))
    saving = free[index.choice_to_state] & graph.all_branches_in(index, free | safe)
    return Task(
        goal=goal,
        fixed=np.where(sure, 1.0, 0.0),
        open=open_,
        allowed=open_[index.choice_to_state],
        component=component,
        internal=internal,
        arriving=must,
        attaining=saving | (sure & must)[index.choice_to_state],
        elsewhere=np.where(avoiding & running, staying, index.state_to_choices[:-1]),
        can_arrive=np.ones(index.states, dtype=np.bool_),
    )
