"""A problem and objectives that are totals of rewards enter; for each weighting of them the best policy leaves.

All objectives become costs, to be kept small: a reward to gather counts negative. They must be totals until one and the same
goal, or discounted alike, so that a weighted sum of them is a total again, and a policy's total is linear in how often it takes
each choice.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ratherthan.errors import NotExplainableError, PropertyError, QuestionError
from ratherthan.model.formula import states_where
from ratherthan.model.index import index_of
from ratherthan.model.mdp import Bools, Floats, Reward
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, Level, Objective
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.model.states import start_of
from ratherthan.solve.plan import Plan, certified
from ratherthan.solve.rewards import costs_of, expected_reward
from ratherthan.solve.solver import solve

__all__ = ["Found", "Weighing", "called", "weighing_of"]

Total = ExpectedCost | ExpectedReward | Discounted
Numbers = npt.NDArray[np.float64]
STEPS = "steps"
UNNAMED = "reward"
SUM = "weighted sum"


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """The best policy for some weights.

    Parameters
    ----------
    plan : Plan
        The policy with its proved values.
    costs : array of float, ``[K]``
        What it pays, objective by objective.
    doubt : array of float, ``[K]``
        How far apart the bounds of these are.
    least : float
        A proved lower bound of the weighted sum, over all policies.
    """

    plan: Plan
    costs: Floats  # [K]
    doubt: Floats  # [K]
    least: float = -np.inf


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighing:
    """Several totals of one problem, as costs.

    Parameters
    ----------
    problem : Problem
    objectives : tuple of objectives, ``[K]``
    start : int
    ended : array of bool, ``[S]``
    discount : float
        1 where nothing is discounted.
    costs : array of float, ``[K, C]``
        What each choice costs: rewards to gather are negative here.
    progress : callable, optional
    """

    problem: Problem
    objectives: tuple[Total, ...]
    start: int
    ended: Bools  # [S]
    discount: float
    costs: Floats  # [K, C]
    progress: Callable[[str], None] | None = None

    @property
    def signs(self) -> Floats:
        """1 where an objective is kept small, -1 where it is gathered, ``[K]``."""
        return np.array([-1.0 if objective.maximise else 1.0 for objective in self.objectives])

    def best(self, weights: Floats) -> Found | None:
        """Return the best policy for weights from 0 on; None where no policy is sure to arrive.

        Raises
        ------
        PropertyError
            Where the sum has no best value, as more and more can be gathered before the goal.
        """
        cost = weights @ self.costs
        mdp = replace(self.problem.mdp, rewards={SUM: Reward(choice=cost)})
        solution = solve(replace(self.problem, mdp=mdp, unfolding=None), self._sum(cost), progress=self.progress)
        value = float(solution.values[0, self.start])
        if value == np.inf:
            return None
        if value == -np.inf:
            raise PropertyError(
                "Each objective must have a best value, but more and more can be gathered before the goal is reached. "
                "Ask for a discounted reward, or for a reward that is limited."
            )
        found = self.followed(solution.policy)
        if found is None:
            raise PropertyError(
                "A plan's totals must be finite numbers, but of the best plan for a weighted sum of "
                f"{', '.join(map(called, self.objectives))} they cannot be told in doubles."
            )
        return replace(found, least=float(solution.lower[0, self.start]))

    def followed(self, policy: Policy) -> Found | None:
        """Return what a policy pays; None where it is not sure to arrive, or pays more than doubles can tell."""
        plan = certified(self.problem, self.objectives, self.start, policy)
        if not np.isfinite([plan.values, plan.lower, plan.upper]).all():
            return None
        return Found(plan=plan, costs=self.signs * plan.values, doubt=plan.upper - plan.lower)

    def _sum(self, cost: Floats) -> Total:
        """Return the objective of a weighted sum."""
        if self.discount != 1.0:
            return Discounted(reward=SUM, discount=self.discount, maximise=False)
        goal = next(objective.goal for objective in self.objectives if not isinstance(objective, Discounted))
        if (cost >= 0.0).all():
            return ExpectedCost(goal=goal, reward=SUM)
        return ExpectedReward(goal=goal, reward=SUM, maximise=False)


def called(objective: Level) -> str:
    """Return what an objective is about, in a word: its reward, or steps."""
    reward = getattr(objective, "reward", None)
    return STEPS if reward is None else str(reward) or UNNAMED


def weighing_of(
    problem: Problem, objectives: Sequence[Objective], progress: Callable[[str], None] | None = None
) -> Weighing:
    """Return what is weighed, checked.

    Raises
    ------
    QuestionError
        For less than two objectives, two about the same reward, and several initial states.
    NotExplainableError
        For objectives that are no totals, or not until the same goal.
    PropertyError
        For rewards and formulas that do not fit the model.
    """
    totals = tuple(_total(objective) for objective in objectives)
    if len(totals) < 2:
        raise QuestionError(f"A trade-off must be between two or more objectives, got {len(totals)}. Add another one.")
    names = [called(objective) for objective in totals]
    for name in names:
        if names.count(name) > 1:
            raise QuestionError(f"A trade-off must be between different rewards, got '{name}' twice.", reward=name)
    ended = _ended(problem, totals)
    costs = np.array([_costs(problem, objective) for objective in totals])
    discounts = {objective.discount for objective in totals if isinstance(objective, Discounted)}
    return Weighing(
        problem=problem,
        objectives=totals,
        start=start_of(problem.mdp),
        ended=ended,
        discount=discounts.pop() if discounts else 1.0,
        costs=costs,
        progress=progress,
    )


def _total(objective: Objective) -> Total:
    if isinstance(objective, ExpectedCost) and objective.maximise:
        instead = _sure(objective)
        raise NotExplainableError(
            f"A trade-off must be between plans that arrive, but '{objective.text}' is without bound where the goal can be "
            f"dodged. Ask for '{instead.text}'.",
            text=objective.text,
        )
    if not isinstance(objective, ExpectedCost | ExpectedReward | Discounted):
        raise NotExplainableError(
            f'A trade-off must be between expected totals of rewards, such as R{{"distance"}}min=? [F "goal"], '
            f"got '{objective.text}'.",
            text=objective.text,
        )
    return objective


def _sure(objective: ExpectedCost) -> ExpectedReward:
    """Return the same total over policies that are sure to arrive."""
    return ExpectedReward(goal=objective.goal, reward=objective.reward, maximise=objective.maximise)


def _ended(problem: Problem, totals: Sequence[Total]) -> Bools:
    """Return where all objectives end, which must be the same states."""
    first = totals[0]
    ends = []
    for objective in totals:
        if isinstance(objective, Discounted):
            ends.append(np.zeros(problem.mdp.states, dtype=np.bool_))
        else:
            ends.append(states_where(problem.mdp, objective.goal, problem.definitions))
        alike = getattr(objective, "discount", 1.0) == getattr(first, "discount", 1.0)
        if not alike or not np.array_equal(ends[0], ends[-1]):
            raise NotExplainableError(
                f"The objectives of a trade-off must end alike, at the same goal or with the same discount, got "
                f"'{first.text}' and '{objective.text}'.",
                text=objective.text,
            )
    return ends[0]


def _costs(problem: Problem, objective: Total) -> Floats:
    """Return what each choice costs, ``[C]``."""
    if isinstance(objective, ExpectedCost):
        return costs_of(problem.mdp, index_of(problem.mdp), objective.reward)[0]
    reward = expected_reward(problem.mdp, objective.reward)
    return -reward if objective.maximise else reward
