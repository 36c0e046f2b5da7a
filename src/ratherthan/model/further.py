"""The text of a further objective and those of the plan enter; the objective leaves: a property, its name, or a reward's name.

The name of a reward alone means the least of it until the goal of the plan's own objective.
"""

from __future__ import annotations

from collections.abc import Sequence

from ratherthan.errors import PropertyError
from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Level,
    Objective,
    ReachAvoid,
    Threshold,
)
from ratherthan.model.problem import Problem
from ratherthan.model.property import wish_of
from ratherthan.model.weights import canonical_reward

__all__ = ["further_objective", "least_of"]


def further_objective(
    problem: Problem, text: str, levels: Sequence[Level], *, discount: float | None = None
) -> Objective | Threshold:
    """Return what a property, its name in the source or the name of a reward means beside a plan.

    Parameters
    ----------
    problem : Problem
    text : str
    levels : sequence of objectives
        The plan's own.
    discount : float, optional
        For a sum without end that has none of its own.

    Raises
    ------
    PropertyError
        If the text cannot be read, or a reward alone is named and the plan has no goal.
    """
    bracketed = set(text) & set("[]") and text not in problem.mdp.rewards
    reward = None if bracketed else canonical_reward(text, problem.mdp.rewards)
    if reward is None:
        return wish_of(problem, text, discount=discount)
    for level in levels:
        found = least_of(reward, level)
        if found is not None:
            return found
    labels = [label for label, where in problem.mdp.labels.items() if where.any() and label not in ("init", "deadlock")]
    goal = next((label for label in ("goal", "target", "destination") if label in labels), next(iter(labels), "goal"))
    example = f'R{{"{reward}"}}min=? [F "{goal}"]'
    raise PropertyError(
        f"A reward alone is enough where the plan has a goal, but '{levels[0].text}' has none. Say until when "
        f"'{reward}' counts, for example {example}.",
        reward=reward,
    )


def least_of(reward: str, level: Level) -> Level | None:
    """Return the least of a reward as long as an objective runs, None where that has no end to name."""
    if isinstance(level, Discounted):
        return Discounted(reward=reward, discount=level.discount, maximise=False)
    if isinstance(level, ExpectedCost | ExpectedReward) or (isinstance(level, ReachAvoid) and level.maximise):
        return ExpectedCost(goal=level.goal, reward=reward)
    return None
