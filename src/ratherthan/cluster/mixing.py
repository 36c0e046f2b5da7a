"""What blocks assumed of each other and what they answered enters, what to assume next leaves: better than the answer alone.

Let x be the values at the rims and g(x) what the blocks find with them. Where many ways cross from block to block, x ← g(x) converges
slowly. As long as no block changes its plan, g is affine, and a few rounds span what is left of the error: Anderson mixing takes the
combination of the last answers whose residuals g(x) - x cancel best in the sense of least squares. It is a guess like any other:
the certificate decides.

References
----------
D. G. Anderson, Iterative Procedures for Nonlinear Integral Equations, J. ACM 12(4), 1965.
H. F. Walker, P. Ni, Anderson Acceleration for Fixed-Point Iterations, SIAM J. Numer. Anal. 49(4), 2011.
"""

from __future__ import annotations

import numpy as np

from ratherthan.model.mdp import Floats

__all__ = ["Mixing"]

DEPTH = 10
SLOW = 0.8
"""Mixing begins where a round leaves more than this share of the change of the round before."""
WORSE = 3.0
"""What was learned is forgotten where the change grows by more than this: the plan has changed."""


class Mixing:
    """The last rounds, and what they tell of the next.

    Parameters
    ----------
    settled : float
        Only changes up to this are mixed: beyond it, plans still change, and what comes next is not like what was.
    """

    def __init__(self, settled: float) -> None:
        self.settled = settled
        self.assumed: list[Floats] = []
        self.answered: list[Floats] = []
        self.change = np.inf

    def next(self, assumed: Floats, answered: Floats, change: float) -> Floats:
        """Return what to assume in the next round.

        Parameters
        ----------
        assumed, answered : array of float
            x and g(x).
        change : float
            The largest difference between the two.
        """
        slow = SLOW * self.change < change < np.inf
        if change > min(WORSE * self.change, self.settled) or not slow:
            self.assumed, self.answered = [], []
        self.change = change
        if not change <= self.settled:
            return answered
        self.assumed, self.answered = [*self.assumed[-DEPTH:], assumed], [*self.answered[-DEPTH:], answered]
        if len(self.assumed) < 3:
            return answered
        given, got = np.array(self.assumed), np.array(self.answered)
        residual = got - given
        steps, moves = np.diff(residual, axis=0), np.diff(got, axis=0)
        weight = np.linalg.lstsq(steps.T, residual[-1], rcond=1e-10)[0]
        mixed: Floats = answered - weight @ moves
        return mixed if np.isfinite(mixed).all() and (mixed >= 0.0).all() else answered
