"""A Solution enters; impact, action values, their extremes per state and the responsibility of every choice leave.

Definition
----------
For a choice (s, a), with s' over its branches and ρ the value of a state (Chen, Boggess, Feng 2020, section III):

* impact           ω(s,a) = Σ δ(s,a,s') · ρ(s')
* action value     q(s,a) = r̄(s,a) + γ · ω(s,a), with the expected immediate reward r̄ that the paper leaves out:
  with unequal action costs ω alone would call an expensive action good
* extremes         λmax_s, λmin_s = the largest and the smallest of q (on request of ω) over the choices of s
* responsibility   ζ(s,a) = q(s,a) - λmin_s, where ∞ - ∞ = 0 (and -∞ + ∞ likewise): the action's share in the outcome. For costs small is good,
  for probabilities and rewards large is good.

Where all actions of a state cost the same and γ = 1, the differences of ω and of q agree. This responsibility is not the
Shapley value of states used in verification (Baier et al.).

References
----------
S. Chen, K. Boggess, L. Feng. Towards Transparent Robotic Planning via Contrastive Explanations. 2020. arXiv:2003.07425.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ratherthan.factors.compare import Interval
from ratherthan.model.mdp import Floats
from ratherthan.solve.bellman import choice_bounds
from ratherthan.solve.levels import ended_at
from ratherthan.solve.solution import Solution

__all__ = ["Responsibility", "responsibility"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Responsibility:
    """Impact, action value and responsibility per choice, and the extremes per state.

    Parameters
    ----------
    impact, impact_lower, impact_upper : array of float, ``[C]``
        ω with sound bounds.
    action_value, lower, upper : array of float, ``[C]``
        q with sound bounds.
    lambda_min, lambda_max : array of float, ``[S]``
        The extremes of q.
    responsibility : array of float, ``[C]``
        ζ from q; 0 where the objective (of several, that one) has ended.
    """

    impact: Floats  # [C]
    impact_lower: Floats  # [C]
    impact_upper: Floats  # [C]
    action_value: Floats  # [C]
    lower: Floats  # [C]
    upper: Floats  # [C]
    lambda_min: Floats  # [S]
    lambda_max: Floats  # [S]
    responsibility: Floats  # [C]

    def measured(self, choice: int, *, omega: bool = False) -> Interval:
        """Return q (or ω) of one choice with its bounds."""
        value, lower, upper = (
            (self.impact, self.impact_lower, self.impact_upper)
            if omega
            else (self.action_value, self.lower, self.upper)
        )
        return Interval(value=float(value[choice]), lower=float(lower[choice]), upper=float(upper[choice]))


def responsibility(solution: Solution, *, objective: int = 0, policy_values: bool = False) -> Responsibility:
    """Compute impact, action values and responsibility for every choice of the model.

    Parameters
    ----------
    solution : Solution
    objective : int
        Which of the K objectives.
    policy_values : bool
        Judge single steps against the value of following the policy, ρ^π, instead of the optimum ρ.

    Returns
    -------
    Responsibility
    """
    mdp = solution.problem.mdp
    impacts, action_values = choice_bounds(solution, objective, of_policy=policy_values)
    impact, impact_lower, impact_upper = impacts
    action_value, action_lower, action_upper = action_values
    starts = mdp.state_to_choices[:-1]
    lambda_min = np.minimum.reduceat(action_value, starts)
    lambda_max = np.maximum.reduceat(action_value, starts)
    low = np.repeat(lambda_min, np.diff(mdp.state_to_choices))
    with np.errstate(invalid="ignore"):
        share = np.where(action_value == low, 0.0, action_value - low)
    share[np.repeat(ended_at(solution, objective), np.diff(mdp.state_to_choices))] = 0.0
    return Responsibility(
        impact=impact,
        impact_lower=impact_lower,
        impact_upper=impact_upper,
        action_value=action_value,
        lower=action_lower,
        upper=action_upper,
        lambda_min=lambda_min,
        lambda_max=lambda_max,
        responsibility=share,
    )
