"""A Field enters; its values leave as those of a policy that no row improves on: equations solved and sweeps in turn.

Where a run lingers, in pockets that cost nothing or hold it for long, sweeps come nearer by as little as a run leaves there at each
step. Equations do not mind: the graph of one policy has small strong components, which are eliminated by themselves (`eliminating`),
and from one policy to the next only those in which a row changed. So:

1. The equations of the rows taken are solved, and the solution refined once.
2. Some sweeps in place start from it. It lies above the least values, so every sweep goes the right way, every row that changes is
   better, and policies go on to arrive. A row changes where it gains more than a share of the value; that share shrinks from
   round to round, so that only what was to gain something is eliminated anew.

This is Howard's policy iteration with sweeps in between (Puterman and Shin 1978). It ends when no row gains anything that doubles can
tell, and gives up where factors would fill, a policy does not arrive, or after so many rounds.

References
----------
R. A. Howard, Dynamic Programming and Markov Processes, MIT Press, 1960.
M. L. Puterman, M. C. Shin, Modified Policy Iteration Algorithms for Discounted Markov Decision Problems, Management Science
24(11), 1978.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import Floats
from ratherthan.model.watch import look
from ratherthan.solve.contracting._kernels import improve_rows
from ratherthan.solve.contracting.field import SLICE, Field
from ratherthan.solve.eliminating import Factored
from ratherthan.solve.policy_iteration import least_rows
from ratherthan.solve.system import drift

__all__ = ["begin_exactly", "collected", "improved"]

Nodes = npt.NDArray[np.int64]

COARSE, FINE = 1e-3, 1e-13
"""The share of a value that a row must gain to change, in the first round and at last."""
FINER = 0.003
"""By what that is multiplied from round to round."""
SWEEPS = 12
MOST_ROUNDS = 60
MOST_MARGINS = 30


def begin_exactly(field: Field, equations: Factored, rows: Nodes) -> bool:
    """Take the values of a policy that arrives; return whether its equations could be solved.

    Parameters
    ----------
    field : Field
        Its values and rows are set.
    equations : Factored
        Of the field's system.
    rows : array of int, ``[n]``
        Of the system, one per node.
    """
    values = _solved(equations, rows)
    if values is None:
        return False
    field.set_to(values)
    field.take(rows)
    return True


def improved(field: Field, equations: Factored, rows: Nodes, *, unit: float) -> bool:
    """Bring the values of a field to where no row gains anything that doubles can tell; return whether they are.

    Parameters
    ----------
    field : Field
        Its values are improved.
    equations : Factored
        Of the field's system.
    rows : array of int, ``[n]``
        To begin with; they arrive.
    unit : float
        What a step costs, about: no gain is looked for that is small beside it and the value.
    """
    share = COARSE
    for number in range(1, MOST_ROUNDS + 1):
        look(f"policy iteration by components, round {number}")
        values = _solved(equations, rows)
        if values is None:
            return False
        field.set_to(values)
        field.take(rows)
        share = max(FINER * share, FINE)
        before = field.taken.copy()
        _swept(field, share, unit)
        if share == FINE and np.array_equal(before, field.taken):
            return True
        rows = field.rows_taken()
    return False


def collected(equations: Factored, pay: Floats, needed: Floats, rows: Nodes) -> Floats | None:
    """Return m with m ≥ needed + P m along every row, about the largest expected sum of `pay`, ``[n]``; None where none is found.

    Parameters
    ----------
    equations : Factored
    pay, needed : array of float, ``[m]``
        What is collected, and what has to be; the first is larger.
    rows : array of int, ``[n]``
        To begin with; they arrive.
    """
    system = equations.system
    for _ in range(MOST_MARGINS):
        look()
        if not equations.follow(rows):
            return None
        margin = np.maximum(equations.solve(pay[rows]), 0.0)
        if not np.isfinite(margin).all():
            return None
        short, wrong = drift(system, margin, cost=needed, one=0.0)
        best = least_rows(system, -(short + wrong))
        better = np.where((short + wrong)[best] > 0.0, best, rows)
        if np.array_equal(better, rows):
            return margin
        rows = better
    return None


def _solved(equations: Factored, rows: Nodes) -> Floats | None:
    """Return the values of a policy in doubles, refined once; None where its equations cannot be solved."""
    if not equations.follow(rows):
        return None
    chain = equations.chain
    assert chain is not None
    values = equations.solve(drift(chain, np.zeros(chain.nodes))[0])
    values += equations.solve(drift(chain, values)[0])
    return values if np.isfinite(values).all() else None


def _swept(field: Field, share: float, unit: float) -> None:
    """Sweep some times, each node taking the value of its best row."""
    kernel = compiled(improve_rows, field.work)
    at_once, made = max(1, min(SWEEPS, SLICE // field.work)), 0
    while made < SWEEPS:
        look()
        if kernel(field.rows, field.values, field.taken, (share, unit), at_once) == 0:
            break
        made += at_once
