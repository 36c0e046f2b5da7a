"""The equations of the open states of a frame enter; proved bounds leave: Bellman sweeps decide, and trust no candidate.

What is proved
--------------
Let D(c) = r(c) + Σ δ(c, s') · (x(s') - x(s)) be what a sweep of x changes along choice c of state s. With e(c), a bound of
the rounding error of D(c), two checks are possible of a vector x that has the known values outside the open states:

* x *never falls* along some choices: D(c) - e(c) ≥ 0, so x ≤ r + P x along them;
* x *never rises*: D(c) + e(c) ≤ 0, so x ≥ r + P x.

Summed up over k steps of a policy that uses these choices, x(s) ≤ (≥) E[costs of k steps] + E[x after k steps]. If the policy
leaves the open states with probability 1 (which `Frame.reach` decides), the last term tends to the known value where it
ended, and x is a bound of the policy's value. So, of an optimum:

* least expected cost: x never falls along all choices → x ≤ the cost of every policy that arrives. x never rises along one
  policy that arrives → x ≥ its cost ≥ the optimum.
* largest expected cost, least probability: every policy leaves the open states; the checks along all choices, and along
  one policy, bound the optimum from either side.
* largest probability: x ≥ 0 never rises along all choices → x ≥ P[arrived within k steps] for every policy and k.
* rewards of any sign until a target that must be reached: only policies that arrive count, so both checks of x, of any sign,
  along all choices and along one policy that arrives, are bounds. The same with a discount, where every step is the last one
  with the chance 1 - γ: D(c) = r(c) + γ Σ δ(c, s') · (x(s') - x(s)) - (1 - γ) x(s).

Differences x(s') - x(s) vanish exactly on equal values, so staying in place, and end components on which x is constant,
cost no precision. x is kept in two parts, a large and a small one, so that the error of D is relative to the differences.

How candidates are found
------------------------
End components in which moving is free are collapsed into one node. Large systems are swept through windows (`settling`); the rest,
and what sweeps do not bring to an end, is solved by policy iteration with linear solves (dense for small systems, else sparse LU).
Then the equations are solved once more with a cost that is shifted a little in favour of the check, choice by choice, by a
multiple of the rounding error.

References
----------
A. Hartmanns, B. L. Kaminski, Optimistic Value Iteration, CAV 2020. S. Haddad, B. Monmege, Interval Iteration Algorithm for
MDPs and IMDPs, Theor. Comput. Sci. 735, 2018.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ratherthan.model.mdp import Floats
from ratherthan.verify.candidates import Budget, search
from ratherthan.verify.equations import Core, Open, Pair, core_of, rows_of
from ratherthan.verify.frame import Array
from ratherthan.verify.growth import circling, gathering, paying_inside

__all__ = ["prove"]

ENOUGH = 1e-8
FAINT = 1e-3
"""Where signs may differ, a value need not be known better than one of this share of the largest."""


def prove(problem: Open, budget: Budget) -> tuple[Floats, Floats]:
    """Return proved bounds of the values of all open states, ``[S]`` each; -∞ and ∞ where none could be proved.

    Parameters
    ----------
    problem : Open
    budget : Budget
    """
    lower, upper = np.full(problem.frame.mdp.states, -np.inf), np.full(problem.frame.mdp.states, np.inf)
    for _ in range(budget.rounds):
        core = core_of(problem, rows_of(problem, np.flatnonzero(problem.rows)))
        demanding = problem.frame.demanding and problem.weight is None
        growing = np.zeros_like(problem.open)
        if demanding:
            growing = paying_inside(core) | circling(problem, budget.sweeps)
        if not growing.any():
            never = _searched(core, budget, (lower, upper))
            if never is None or not demanding:
                break
            growing = gathering(core, never)
            if not growing.any():
                break
        endless = problem.frame.reach(growing, problem.open, problem.rows)
        lower[endless] = upper[endless] = np.inf if problem.frame.maximise else -np.inf
        problem = replace(problem, open=problem.open & ~endless, rows=problem.rows & ~endless[problem.frame.row_state])
        if not problem.open.any():
            break
    return lower, upper


def _searched(core: Core, budget: Budget, ends: tuple[Floats, Floats]) -> Array | None:
    """Narrow bounds as far as candidates prove them; return what `search` returns."""
    problem, every = core.problem, core.every

    def judge(values: Pair, rows: Array | None) -> tuple[bool, bool]:
        x, rest = core.spread_pair(values)
        taken, proved = None if rows is None else core.policy(rows), False
        if rows is None or taken is not None:
            drift, error = (every if taken is None else every.some(taken)).drift(x, rest)
            x = x + rest
            below = problem.frame.maximise == (rows is not None)  # on which side it may be a bound
            proved = _is_bound(x[problem.open], drift, error, below=below, signed=problem.frame.signed)
        if proved and below:
            ends[0][problem.open] = np.maximum(ends[0], np.nextafter(x, -np.inf))[problem.open]
        elif proved:
            ends[1][problem.open] = np.minimum(ends[1], np.nextafter(x, np.inf))[problem.open]
        low, high = ends[0][problem.open], ends[1][problem.open]
        return proved, _close(low, high, np.abs(x[problem.open]).max() if problem.frame.signed else 0.0)

    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is no bound: nothing follows from it
        return search(core, budget, judge)


def _is_bound(x: Floats, drift: Floats, error: Floats, *, below: bool, signed: bool) -> bool:
    """Return whether x never falls along the rows (a bound from below), or never rises."""
    if not np.isfinite(x).all():
        return False
    if below:
        return bool((drift - error >= 0.0).all())
    return bool((signed or (x >= 0.0).all()) and (drift + error <= 0.0).all())


def _close(lower: Floats, upper: Floats, size: float) -> bool:
    """Return whether bounds are so near to each other that it is not worth while to try further candidates."""
    finite = bool((np.isfinite(lower) & np.isfinite(upper)).all())
    return finite and bool((upper - lower <= ENOUGH * np.maximum(np.abs(upper), FAINT * size)).all())
