"""Values with sound bounds, a policy and an outcome enter one noun, the Solution, and are passed on whole."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.objective import Level
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem

__all__ = ["Outcome", "Solution"]


class Outcome(Enum):
    """How a solver ended; each value is a sentence."""

    CERTIFIED = "The values are proved: one check by Bellman's operator confirmed the bounds."
    LOWER_ONLY = "Only the lower bounds are proved."
    UPPER_ONLY = "Only the upper bounds are proved."
    HORIZON = "The lower bounds are proved; from above only what plans of a limited number of steps attain, and beyond that nothing."
    STOPPED = "The solver stopped before it converged; the bounds that were proved so far are given."
    UNCERTIFIED = "The values are not certified: no bounds are known, and no claim rests on them."


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """Values of every state, with sound bounds, and the policy that is explained.

    K is the number of objectives; values have a row per objective, also when K = 1.

    Parameters
    ----------
    problem : Problem
    objectives : tuple of objectives, ``[K]``
        The levels, first things first; one where the objective is not lexicographic.
    values, lower, upper : array of float, ``[K, S]``
        The optimum ρ of each objective, and bounds with lower ≤ ρ ≤ upper; ±∞ is a value like any other. Where nothing is
        proved the bounds are -∞ and ∞ (never NaN), which decides no comparison.
    policy : Policy
        The optimal policy, or the one that was given. Of several levels it attains the first ones first; what it attains of
        each stands in `policy_values`.
    given : bool
        Whether the policy was given, rather than computed.
    policy_values, policy_lower, policy_upper : array of float, ``[K, S]``
        The value ρ^π of following the policy, likewise.
    goal, hazard : array of bool, ``[S]``
        Where the objective (of several, the first) ends well, and badly. For a minimised probability the target is the hazard and goal is empty.
    can_arrive : array of bool, ``[S]``
        Whether the largest probability to reach the goal (through states that are no hazard) is above 0; all true where
        the objective has no goal.
    outcome : Outcome
    engine : str
        Which method gave the values, in a few words.
    sweeps : int
        Bellman sweeps (or linear solves) done.
    residual : float
        The largest |Tv - v| over finite values.
    horizon : int, optional
        Where a largest probability could not be bounded from above: the number of steps that `within` holds for.
    within : array of float, ``[S]``, optional
        What no plan of at most `horizon` steps exceeds, of the first objective. It is no bound of the value, and no claim rests on it.
    precision : float
        The relative width of bounds that was wanted.
    """

    problem: Problem
    objectives: tuple[Level, ...]
    values: Floats  # [K, S]
    lower: Floats  # [K, S]
    upper: Floats  # [K, S]
    policy: Policy
    given: bool
    policy_values: Floats  # [K, S]
    policy_lower: Floats  # [K, S]
    policy_upper: Floats  # [K, S]
    goal: Bools  # [S]
    hazard: Bools  # [S]
    can_arrive: Bools  # [S]
    outcome: Outcome
    engine: str
    sweeps: int
    residual: float
    horizon: int | None = None
    within: Floats | None = None  # [S]
    precision: float = 1e-6

    @property
    def ended(self) -> Bools:
        """Where the objective has ended, ``[S]``: no claims, never critical, leaves of every search."""
        return self.goal | self.hazard
