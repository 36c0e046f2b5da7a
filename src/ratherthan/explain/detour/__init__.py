"""A Solution and a route enter; what each step's best alternative comes to *without turning back* leaves.

Definition
----------
On a map whose streets run both ways nothing is ever lost: whoever goes wrong turns round, so λmax - λmin is at most twice the cost of a
step, everywhere. What tells a decision that matters from one that does not is what the best alternative comes to if one may not
turn back. At step i of a route s_0, s_1, … let the states s_0 … s_i be *closed*: a branch into a closed state leaves the run where
it is, as at a wall, and costs what it costs; where it would be worse to go there than to stay, it counts as going there, so that
closing never makes anything better. With ρ for the values of the open model, W is the best value under

    W(x) = min over a of r̄(x,a) + γ Σ δ(x,a,t) · W(t),   for closed t: max(W(x), ρ(t)) in place of W(t)

(max over a, and min, where much is wanted), and the detour of step i is the best W of the alternatives at s_i, taken there until
they lead away, minus the action value of the choice taken. It is ∞ where no alternative is sure to arrive that way.
With several levels, a further one takes only the choices that are equal to the best at the levels before.

Method
------
A state from which the optimal plan never meets s_0 … s_i keeps its value: W = ρ there, as W ≥ ρ. Let m(x) be the least index of a route
state that the plan may come to from x: one search backwards along the plan gives it for all x. Then only states with m(x) ≤ i must
be looked at, and of these only those that the best choices come to: what was not looked at has its ρ as a bound, what the best
choices lead to is looked at next (LAO*). Each step may look at so many branches; those that are not done are looked at once more
with more of them, in the order of the route, until all is spent. What is then not settled has a lower bound (of what is lost),
and says so. The work granted never depends on a clock: what comes out is the same everywhere.

References
----------
E. A. Hansen, S. Zilberstein, LAO*: A heuristic search algorithm that finds solutions with loops, Artif. Intell. 129, 2001.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.explain.detour._kernels import Effort, Rows, Way, Wish, detours, first_touched
from ratherthan.explain.shared import graph_of
from ratherthan.factors import Compared, Responsibility
from ratherthan.model._kernels import sorted_by
from ratherthan.model.compiling import LEAST_WORK, compiled, is_compiled
from ratherthan.model.index import branches_of, index_of
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward
from ratherthan.model.watch import look
from ratherthan.solve.bellman import action_value_bounds
from ratherthan.solve.rewards import expected_reward
from ratherthan.solve.solution import Solution

__all__ = ["Detour", "detours_of"]

Numbers = npt.NDArray[np.int64]

COMPILED, PLAIN = Effort(20_000, 4_000_000, 24_000_000), Effort(4_000, 40_000, 200_000)
"""How many branches are looked at: for each step, for each once more, and in all; compiled, and not."""
TIED = 1e-6
"""Choices whose numbers differ by less than that may be those of an optimal plan."""


@dataclass(frozen=True, kw_only=True)
class Detour:
    """By how much the best alternative is worse, negative where it is better; `settled` where it is not only a lower bound."""

    loss: float
    settled: bool


def detours_of(
    solution: Solution,
    level: int,
    numbers: Responsibility,
    route: tuple[Sequence[int], Sequence[int]],
    wanted: Sequence[int],
    *,
    compared: Compared | None = None,
) -> dict[int, Detour]:
    """Return what the best alternatives of some steps come to without turning back, against the choices taken.

    Parameters
    ----------
    solution : Solution
    level : int
        Of the objective.
    numbers : Responsibility
        Of this level: what the choices taken come to.
    route : pair of sequences of int
        The states where something is decided, in their order, and the choices taken there.
    wanted : sequence of int
        The steps that are asked about.
    compared : Compared, optional
        The choices that the level compares; all without it.
    """
    if not wanted:
        return {}
    look("looking for the longest detours")
    mdp, objective = solution.problem.mdp, solution.objectives[level]
    sign = -1.0 if objective.maximise else 1.0
    states, choices = (np.asarray(part, dtype=np.int64) for part in route)
    asked = np.zeros(len(states), dtype=np.bool_)
    asked[list(wanted)] = True
    stands = np.full(mdp.states, mdp.states, dtype=np.int64)
    stands[states[::-1]] = np.arange(len(states))[::-1]
    rows = Rows(mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target, mdp.branch_to_probability)
    wish = _wish(solution, level, sign, np.zeros(0, dtype=np.bool_) if compared is None else compared.possible)
    way = Way(states, choices, asked, stands, _touched(solution, level, states))
    if isinstance(objective, ExpectedCost) and objective.maximise:
        # how long a run can be kept from arriving is no matter of best values alone
        found, settled = detours(rows, wish, way, Effort(0, 0, 0))
    else:
        found, settled = _searched(rows, wish, way)
    own = sign * numbers.action_value[choices]
    with np.errstate(invalid="ignore"):
        loss = np.where(found == own, 0.0, found - own)
    return {at: Detour(loss=float(loss[at]), settled=bool(settled[at])) for at in wanted}


def _searched(rows: Rows, wish: Wish, way: Way) -> tuple[Floats, Bools]:
    """Return what the search finds; a small model is searched as it stands, and only what that leaves open by compiled code."""
    branches = len(rows.target)
    if is_compiled(branches):
        return compiled(detours, branches)(rows, wish, way, COMPILED)
    if not is_compiled(LEAST_WORK):
        return detours(rows, wish, way, PLAIN)
    found, settled = detours(rows, wish, way, PLAIN._replace(again=0))
    if not settled[way.wanted].all():
        left = way._replace(wanted=way.wanted & ~settled)
        more, done = compiled(detours, LEAST_WORK)(rows, wish, left, COMPILED)
        found, settled = np.where(left.wanted, more, found), settled | done
    return found, settled


def _wish(solution: Solution, level: int, sign: float, open_: Bools) -> Wish:
    """Return a level as a cost to be kept small."""
    mdp, objective = solution.problem.mdp, solution.objectives[level]
    paid, summed = np.zeros(0), False
    if isinstance(objective, ExpectedCost | ExpectedReward | Discounted):
        paid, summed = sign * expected_reward(mdp, objective.reward), True
    return Wish(
        paid=paid,
        best=np.ascontiguousarray(sign * solution.values[level]),
        open=open_,
        discount=objective.discount if isinstance(objective, Discounted) else 1.0,
        never=np.inf if isinstance(objective, ExpectedCost | ExpectedReward) else 0.0,
        waits=not summed and not objective.maximise,
        counts_up=not summed and objective.maximise,
    )


def _touched(solution: Solution, level: int, states: Numbers) -> Numbers:
    """Return the first place of the route that an optimal plan may come to from each state, ``[S]``; S where to none."""
    count = solution.problem.mdp.states
    if solution.given or solution.policy.chance is not None:
        origin, target = _tied(solution, level)
    else:
        graph = graph_of(solution)
        origin, target = graph.origin, graph.target
    if is_compiled(len(target)):
        first, edge = compiled(sorted_by, len(target))(target, np.arange(len(target)), count)
    else:
        edge = np.argsort(target, kind="stable")
        first = np.concatenate([[0], np.cumsum(np.bincount(target, minlength=count))])
    return compiled(first_touched, len(target))(first.astype(np.int64), origin[edge].astype(np.int64), states)


def _tied(solution: Solution, level: int) -> tuple[Numbers, Numbers]:
    """Return where all choices lead that may be those of an optimal plan: the given one is another."""
    mdp, index = solution.problem.mdp, index_of(solution.problem.mdp)
    best = solution.values[level][index.choice_to_state]
    q = action_value_bounds(solution, level)[0]
    with np.errstate(invalid="ignore"):
        near = (q == best) | (np.abs(q - best) <= TIED * np.maximum(np.abs(q), np.abs(best)))
    chosen = np.flatnonzero(near & ~solution.ended[index.choice_to_state])
    branch, offsets = branches_of(mdp.choice_to_branches, chosen)
    origin = np.repeat(index.choice_to_state[chosen].astype(np.int64), np.diff(offsets))
    target = mdp.branch_to_target[branch].astype(np.int64)
    moves = origin != target
    return origin[moves], target[moves]
