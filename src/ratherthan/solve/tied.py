"""The best choices of every state enter, one of them for every state leaves: the first listed with which the plan gets on.

To take a best choice everywhere is not enough: where waiting costs nothing, or where a run can go round without losing
probability, a policy may take best choices for ever and never arrive. Let the *tied* choices be those that cannot be told
from the best. Their maximal end components are where a run could stay for ever.

* A state outside all of them takes its first listed tied choice.
* Inside, a state with a tied choice that leaves the component (an *exit*) takes the first listed exit. The others are put in
  layers by their distance from such states along tied choices, and take the first listed tied choice with a branch to a lower
  layer. Likely branches go first (those at least half as likely as the likeliest that moves), so that nobody drives east in
  order to slip south; the other branches serve where these lead to no exit.

This arrives with probability 1. For let R be a set of states that the policy does not leave, each reached from each: R with
the choices taken is an end component of tied choices, hence inside a maximal one, M. The choices taken lead down the layers
of M with positive probability, within R, until an exit, which leaves M, hence R: a contradiction. And a policy that takes
tied choices and is absorbed attains the optimum: the values are then the expected sum of what its steps pay.

Two choices are taken as tied up to a tolerance far below that with which values are compared. As small losses may add up along
a route, the policy is evaluated, and the tolerance made finer until nothing is lost (`solver`).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model import graph
from ratherthan.model.index import branches_of, build_index
from ratherthan.model.mdp import Bools, Floats
from ratherthan.solve.goal import Goal, Kind, Task
from ratherthan.solve.system import System

__all__ = ["first_tied", "fixed_best", "tied_choices"]

LIKELY = 0.5
"""A branch is likely if it is at least so many times as likely as the likeliest branch of its choice that moves."""

Nodes = npt.NDArray[np.int64]


def tied_choices(task: Task, core: System, gap: Floats, least: Floats, rows: Nodes) -> Bools:
    """Return the choices that cannot be told from the best, ``[C]``.

    Parameters
    ----------
    task : Task
    core : System
        The task's equations.
    gap, least : array of float, ``[m]``
        How much worse each row is than the value of its node, and up to which gap it is tied.
    rows : array of int, ``[n]``
        Best rows of the solver; they are tied in any case.
    """
    tied = task.internal | task.attaining
    tied[core.source[gap <= least]] = True
    tied[core.source[rows]] = True
    return tied


def fixed_best(task: Task) -> Bools:
    """Return the best choices of the states whose value the graph decides, ``[C]``: those that have it as well.

    A value of 0 or 1 is had by choices that pay nothing and lead to that value only. Where no policy is sure to arrive all
    choices are the same; where there is no end to what can be gathered, those are best that may lead to such a state.
    """
    goal, open_ = task.goal, task.open
    index, running = goal.index, goal.running
    best = index.by_choice(~running)
    decided = np.flatnonzero(running & ~open_)
    choices, begin = branches_of(index.state_to_choices, decided)
    if not len(choices):
        return best
    branches, offsets = branches_of(index.choice_to_branches, choices)
    value, after = np.repeat(task.fixed[decided], np.diff(begin)), index.branch_to_target[branches]
    same = task.fixed[after] == np.repeat(value, np.diff(offsets))
    leads = np.logical_and.reduceat(same & ~open_[after], offsets[:-1])
    infinite = np.logical_or.reduceat(same, offsets[:-1])
    if goal.kind is Kind.REWARD:
        infinite &= ~np.logical_or.reduceat(task.fixed[after] == -np.inf, offsets[:-1])
    worst = goal.unreached if goal.kind is Kind.REWARD or not goal.maximise else np.nan
    best[choices] = np.where(np.isinf(value), (value == worst) | infinite, leads & ~goal.costly[choices])
    return best


def first_tied(task: Task, tied: Bools) -> Nodes:
    """Return for every state the first listed of its tied choices with which the policy arrives, ``[S]``.

    Parameters
    ----------
    task : Task
    tied : array of bool, ``[C]``
    """
    index = task.goal.index
    first = graph.first_listed(index, tied)
    choice = np.where(task.open | task.arriving, first, task.elsewhere)
    if not task.arriving.any():
        return choice
    component, internal = graph.end_components(index, task.arriving, tied)
    inside = component >= 0
    if not inside.any():
        return choice
    leaving = tied & inside[index.choice_to_state] & ~internal
    onward = _onward(task.goal, component, leaving, internal)
    exits = np.where(onward >= 0, -1, graph.first_listed(index, leaving))
    level = graph.levels_to(index, (onward >= 0) | (exits >= 0), inside, internal)
    down = graph.first_downhill(index, level, internal)
    return np.where(inside, np.where(onward >= 0, onward, np.where(exits >= 0, exits, down)), choice)


def _onward(goal: Goal, component: Nodes, leaving: Bools, internal: Bools) -> Nodes:
    """Return the same for the likely branches alone: -1 where they lead to no exit."""
    index = goal.index
    moves = index.branch_to_target != index.choice_to_state[index.branch_to_choice]
    chance = np.where(moves, goal.probability, 0.0)
    likeliest = np.maximum.reduceat(chance, index.choice_to_branches[:-1])
    likely = chance >= LIKELY * np.maximum(likeliest, 1e-300)[index.branch_to_choice]
    rows = np.concatenate([[0], np.cumsum(np.add.reduceat(likely.astype(np.int64), index.choice_to_branches[:-1]))])
    plain = build_index(index.state_to_choices, rows, index.branch_to_target[likely])
    outward = component[plain.branch_to_target] != component[plain.choice_to_state[plain.branch_to_choice]]
    heading = leaving & graph.any_branch_in_rows(plain, outward)
    exits = graph.first_listed(plain, heading)
    level = graph.levels_to(plain, exits >= 0, component >= 0, internal)
    return np.where(exits >= 0, exits, graph.first_downhill(plain, level, internal))
