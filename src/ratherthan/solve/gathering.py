"""A Goal that gathers rewards enters; a Task leaves: what the graph decides, and what is left to compute.

**The largest expected sum until a goal that must be reached, rewards of either sign.** The value is the supremum over the
policies that reach the goal in a finite expected number of steps. Where one reaches it with probability 1 at all there is such
a policy. X is the region where the goal G can be reached with probability 1; elsewhere the value is -∞. Inside X only
choices with all branches in X are allowed.

* *+∞.* Let an end component of allowed choices before G have a positive mean reward under some policy. Staying there for n
  steps and going to G then gathers without limit: the value is ∞ in every state that can reach it by allowed choices. Where
  the choices of an end component pay nothing below 0, and one of them more, the graph tells. Where they pay both, policy
  iteration finds it (`endless`), with proof. The other states cannot reach such a component, and are a task of their own.
* *0.* Exactly, where by allowed choices nothing that pays can be reached; and where no gain can be reached, but the goal can
  with probability 1 by choices that pay nothing.
* *Elsewhere* no end component has a positive mean reward, and the value is finite. Let x be bounded and x ≥ r̄ + P x along
  all allowed choices. With T the time of arrival, x(s) ≥ E[what is paid before k ∧ T] + E[x(X(k ∧ T))]. With E[T] finite the
  first sum is bounded by a multiple of T, and the probability of T > k vanishes: x ≥ ρ, whatever the signs of x and r̄. And
  ρ ≥ ρ^π for a policy that arrives.
* End components of choices that pay exactly nothing are collapsed, as for costs.

Policies that arrive with probability 1 but after an infinite expected time do not count: where rewards of both signs come by
chance and have the mean 0, a gambler who goes on until he is lucky gathers whatever he likes, with probability 1.

*End components of mean 0 that pay both ways* (+1 there, -1 back) are neither collapsed nor forbidden. Bellman's equation has
many solutions on them. Policy iteration starts from a policy that arrives and changes a choice only for a gain. So it never
enters one: on a set of states that the new policy never leaves, the gains have the mean reward as their mean; if that is 0
all of them are 0, no choice there was changed, and the old policy did not arrive either. For the proof such components are
taken out where that is possible without rounding (`levelling`); elsewhere the bound from above is left unproved.

**The discounted sum.** A run goes on with probability γ, so to speak, and is absorbed under every policy. There is no goal. The
value is 0 exactly where nothing that pays can be reached; where a cost that is nowhere negative is to be kept small, also where
it can be avoided for ever.

References
----------
D. P. Bertsekas, J. N. Tsitsiklis, An Analysis of Stochastic Shortest Path Problems, Math. Oper. Res. 16(3), 1991.
C. Baier, N. Bertrand, C. Dubslaff, D. Gburek, O. Sankur, Stochastic Shortest Paths and Weight-Bounded Properties in Markov
Decision Processes, LICS 2018.
"""

from __future__ import annotations

import numpy as np

from ratherthan.model import graph
from ratherthan.model.mdp import Bools
from ratherthan.solve.goal import Goal, Kind, Task
from ratherthan.solve.system import ROUNDING

__all__ = ["discounted", "loops_in_doubt", "most_reward"]


def most_reward(goal: Goal, endless: Bools | None = None) -> Task:
    """Return the task of gathering the most until a goal that must be reached.

    Parameters
    ----------
    goal : Goal
    endless : array of bool, ``[S]``, optional
        Where more and more can be gathered, as was found out besides.
    """
    index, target, everywhere = goal.index, goal.target, goal.through
    sure = graph.surely_reach(index, target, everywhere)
    running = sure & ~target
    allowed = running[index.choice_to_state] & graph.all_branches_in(index, sure)
    rising = _rising(goal, running, allowed)
    unlimited = graph.can_reach(index, rising if endless is None else rising | endless & running, running, allowed)
    unlimited &= running
    rest = running & ~unlimited
    free = _free(goal, rest, allowed)
    open_ = rest & ~free
    component, internal = graph.end_components(index, open_, allowed & ~goal.costly)
    saving = allowed & free[index.choice_to_state] & ~goal.costly & graph.all_branches_in(index, free | target)
    every = np.ones(index.choices, dtype=np.bool_)
    trying = graph.first_downhill(index, graph.levels_to(index, sure, everywhere), every)
    return Task(
        goal=goal,
        fixed=np.where(unlimited, np.inf, np.where(sure, 0.0, -np.inf)),
        open=open_,
        allowed=allowed & open_[index.choice_to_state],
        component=component,
        internal=internal,
        arriving=running,
        attaining=allowed & unlimited[index.choice_to_state] | saving,
        elsewhere=np.where(trying >= 0, trying, index.state_to_choices[:-1]),
        can_arrive=graph.can_reach(index, target, everywhere),
    )


def _free(goal: Goal, rest: Bools, allowed: Bools) -> Bools:
    """Return where the value is exactly 0, ``[S]``, of the states where it is finite."""
    index = goal.index
    gains = np.zeros(index.states, dtype=np.bool_)
    gains[index.choice_to_state[allowed & goal.costly & ~goal.losing]] = True
    none = rest & ~graph.can_reach(index, gains & rest, rest, allowed)
    return none & graph.surely_reach(index, goal.target, none, allowed & ~goal.costly)


def _rising(goal: Goal, running: Bools, allowed: Bools) -> Bools:
    """Return the states of end components of choices that pay nothing below 0, and one of them more, ``[S]``."""
    index = goal.index
    component, internal = graph.end_components(index, running, allowed & goal.gaining)
    found = np.zeros(int(component.max(initial=-1)) + 1, dtype=np.bool_)
    found[component[index.choice_to_state[internal & goal.costly]]] = True
    return np.append(found, False)[component]


def loops_in_doubt(task: Task) -> bool:
    """Return whether staying in place pays, and rounding leaves its sign open: then nothing is proved of the task."""
    goal = task.goal
    if not goal.signed or goal.kind is not Kind.REWARD:
        return False
    index = goal.index
    error = (np.diff(index.choice_to_branches) + 8) * ROUNDING * goal.size
    doubtful = task.allowed & ~task.internal & goal.costly & (goal.cost + error > 0.0)
    moves = index.branch_to_target != index.choice_to_state[index.branch_to_choice]
    return bool((doubtful & ~graph.any_branch_in_rows(index, moves)).any())


def discounted(goal: Goal) -> Task:
    """Return the task of a discounted sum."""
    index, running = goal.index, goal.running
    nothing = np.zeros(index.choices, dtype=np.bool_)
    first = index.state_to_choices[:-1].astype(np.int64)
    if goal.maximise or goal.signed:
        paying = np.zeros(index.states, dtype=np.bool_)
        paying[index.choice_to_state[goal.costly]] = True
        open_ = running & graph.can_reach(index, paying & running, running)
        elsewhere = first
    else:
        component, _ = graph.end_components(index, running, ~goal.costly)
        free = graph.surely_reach(index, ~running | (component >= 0), running, ~goal.costly)
        open_ = running & ~free
        saving = graph.first_listed(index, ~goal.costly & graph.all_branches_in(index, free))
        elsewhere = np.where(saving >= 0, saving, first)
    return Task(
        goal=goal,
        fixed=np.zeros(index.states),
        open=open_,
        allowed=open_[index.choice_to_state],
        component=np.full(index.states, -1, dtype=np.int64),
        internal=nothing,
        arriving=np.zeros(index.states, dtype=np.bool_),
        attaining=nothing,
        elsewhere=elsewhere,
        can_arrive=np.ones(index.states, dtype=np.bool_),
    )
