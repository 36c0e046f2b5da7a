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

Differences x(s') - x(s) vanish exactly on equal values, so staying in place, and end components on which x is constant,
cost no precision. x is kept in two parts, a large and a small one, so that the error of D is relative to the differences.

How candidates are found
------------------------
End components in which moving is free are collapsed into one node. Value iteration is tried first; where it is slow, policy
iteration with linear solves (dense for small systems, else sparse LU). Then the equations are solved once more with a cost
that is shifted a little in favour of the check, choice by choice, by a multiple of the rounding error.

References
----------
A. Hartmanns, B. L. Kaminski, Optimistic Value Iteration, CAV 2020. S. Haddad, B. Monmege, Interval Iteration Algorithm for
MDPs and IMDPs, Theor. Comput. Sci. 735, 2018.
"""

from __future__ import annotations

import numpy as np

from ratherthan.model.mdp import Floats
from ratherthan.verify.candidates import Budget, search
from ratherthan.verify.equations import Open, Pair, core_of, rows_of
from ratherthan.verify.frame import Array

__all__ = ["prove"]

ENOUGH = 1e-8


def prove(problem: Open, budget: Budget) -> tuple[Floats, Floats]:
    """Return proved bounds of the values of all open states, ``[S]`` each; -∞ and ∞ where none could be proved.

    Parameters
    ----------
    problem : Open
    budget : Budget
    """
    ends = np.full(problem.frame.mdp.states, -np.inf), np.full(problem.frame.mdp.states, np.inf)
    every = rows_of(problem, np.flatnonzero(problem.rows))
    core = core_of(problem, every)

    def judge(values: Pair, rows: Array | None) -> tuple[bool, bool]:
        x, rest = core.spread_pair(values)
        drift, error = every.drift(x, rest)
        x, proved = x + rest, False
        taken = None if rows is None else core.policy(rows)
        if taken is not None:
            drift, error = drift[taken], error[taken]
        if rows is None or taken is not None:
            below = problem.frame.maximise == (rows is not None)  # on which side it may be a bound
            proved = _is_bound(x, drift, error, below=below)
        if proved and below:
            ends[0][problem.open] = np.maximum(ends[0], np.nextafter(x, -np.inf))[problem.open]
        elif proved:
            ends[1][problem.open] = np.minimum(ends[1], np.nextafter(x, np.inf))[problem.open]
        return proved, _close(ends[0][problem.open], ends[1][problem.open])

    search(core, budget, judge)
    return ends


def _is_bound(x: Floats, drift: Floats, error: Floats, *, below: bool) -> bool:
    """Return whether x never falls along the rows (a bound from below), or never rises."""
    if below:
        return bool((drift - error >= 0.0).all())
    return bool((x >= 0.0).all() and (drift + error <= 0.0).all())


def _close(lower: Floats, upper: Floats) -> bool:
    """Return whether bounds are so near to each other that it is not worth while to try further candidates."""
    return bool((np.isfinite(lower) & np.isfinite(upper)).all() and (upper - lower <= ENOUGH * upper).all())
