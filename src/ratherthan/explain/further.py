"""Texts of further objectives and a plan enter; the objectives, and what the plan and its alternatives come to under each, leave.

Definition
----------
A plan π is made for one objective and judged under others. Taking b at s and then going on with π comes, under objective j, to

    q^π_j(s, b) = r̄_j(s, b) + γ_j · Σ δ(s, b, s') · ρ^π_j(s').

The plan is followed until its own objective has ended: there the run stays for ever and nothing is paid any more, whatever a
further objective would still ask for. Where objective j has ended at s, what is done there does not matter to it: every
choice has ρ^π_j(s).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ratherthan.errors import NotExplainableError, PropertyError, QuestionError
from ratherthan.explain.claims import fate_of
from ratherthan.explain.explanation import Measured
from ratherthan.factors import Interval, Responsibility, responsibility
from ratherthan.model.further import further_objective
from ratherthan.model.index import index_of
from ratherthan.model.mdp import MDP, Bools, Reward
from ratherthan.model.objective import Level, Lexicographic, Mission, Objective, Threshold
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve.levels import ended_at
from ratherthan.solve.solution import Solution
from ratherthan.solve.solver import evaluate

__all__ = ["View", "further_objectives", "stopped", "views_of"]


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """A plan seen under one objective.

    Parameters
    ----------
    solution : Solution
        Which has ρ^π of the objective in row `row`.
    row : int
    measures : Responsibility
        q^π of every choice.
    ended : array of bool, ``[S]``
        Where the objective has ended.
    """

    solution: Solution
    row: int
    measures: Responsibility
    ended: Bools  # [S]

    @property
    def objective(self) -> Level:
        """The objective."""
        return self.solution.objectives[self.row]

    def value(self, state: int) -> Interval:
        """Return ρ^π of a state."""
        solution, k = self.solution, self.row
        return Interval(
            value=float(solution.policy_values[k, state]),
            lower=float(solution.policy_lower[k, state]),
            upper=float(solution.policy_upper[k, state]),
        )

    def measured(self, state: int, choice: int) -> Measured:
        """Return what a choice and then the plan come to."""
        name = self.solution.problem.mdp.action_name(choice)
        if self.ended[state]:
            return Measured(choice=choice, action=name, number=self.value(state))
        number = self.measures.measured(choice)
        fate = fate_of(self.solution, choice, number, self.objective)
        return Measured(
            choice=choice, action=name, number=number, fate="may fail" if fate is not None and self.row > 0 else fate
        )


def views_of(solution: Solution, further: Iterable[Level]) -> tuple[View, ...]:
    """Return a plan under each level of its own objective, and under each further one.

    Parameters
    ----------
    solution : Solution
    further : iterable of objectives
        As `further_objectives` returns them.
    """
    own = [
        View(
            solution=solution,
            row=k,
            measures=responsibility(solution, objective=k, policy_values=True),
            ended=ended_at(solution, k),
        )
        for k in range(len(solution.objectives))
    ]
    wanted = tuple(further)
    problem, policy = stopped(solution) if wanted else (solution.problem, solution.policy)
    for objective in wanted:
        judged = evaluate(replace(problem, objective=objective), policy, objective)
        measures = responsibility(judged, policy_values=True)
        own.append(View(solution=judged, row=0, measures=measures, ended=judged.ended | solution.ended))
    return tuple(own)


def stopped(solution: Solution) -> tuple[Problem, Policy]:
    """Return the problem and the policy of a solution with a run that stays for nothing where its objective has ended."""
    mdp, policy, ended = solution.problem.mdp, solution.policy, solution.ended
    if not ended.any():
        return solution.problem, policy
    first = mdp.state_to_choices[:-1]
    choice = np.where(ended & (policy.choice < 0), first, policy.choice)
    chance = policy.chance
    if chance is not None:
        chance = np.where(ended[index_of(mdp).choice_to_state], 0.0, chance)
        chance[first[ended]] = 1.0
        choice = np.where(ended, -1, choice)
    return replace(solution.problem, mdp=_staying(mdp, ended)), Policy(choice=choice, chance=chance)


def _staying(mdp: MDP, ended: Bools) -> MDP:
    """Return a model in which every choice of the ended states stays for nothing."""
    index = index_of(mdp)
    over = ended[index.choice_to_state]
    kept = ~over[index.branch_to_choice]
    counts = np.where(over, 1, np.diff(mdp.choice_to_branches))
    choice_to_branches = np.concatenate([[0], np.cumsum(counts)])
    loops = choice_to_branches[:-1][over]
    total = int(choice_to_branches[-1])
    target, probability = np.zeros(total, dtype=np.int64), np.ones(total)
    moving = np.ones(total, dtype=np.bool_)
    moving[loops] = False
    target[moving], probability[moving] = mdp.branch_to_target[kept], mdp.branch_to_probability[kept]
    target[loops] = index.choice_to_state[over]

    def unpaid(reward: Reward) -> Reward:
        branch = None
        if reward.branch is not None:
            branch = np.zeros(total)
            branch[moving] = reward.branch[kept]
        return Reward(
            state=None if reward.state is None else np.where(ended, 0.0, reward.state),
            choice=None if reward.choice is None else np.where(over, 0.0, reward.choice),
            branch=branch,
        )

    return replace(
        mdp,
        choice_to_branches=choice_to_branches,
        branch_to_target=target,
        branch_to_probability=probability,
        rewards={name: unpaid(reward) for name, reward in mdp.rewards.items()},
    )


def further_objectives(solution: Solution, wishes: Iterable[str | Objective | Threshold]) -> tuple[Level, ...]:
    """Return the objectives under which a plan is to be judged besides its own.

    Parameters
    ----------
    solution : Solution
    wishes : iterable of str or objective
        Objectives, properties, the names of the source's own, or names of rewards: these mean the least of the reward until
        the goal of the plan's objective.

    Raises
    ------
    PropertyError
        If one cannot be read, asks yes or no, has levels, or stands twice.
    NotExplainableError
        For what takes memory to tell.
    QuestionError
        For anything else.
    """
    found: list[Level] = []
    for wish in wishes:
        objective = further_objective(solution.problem, wish, solution.objectives) if isinstance(wish, str) else wish
        if not isinstance(objective, Threshold | Objective):
            raise QuestionError(f"A further objective must be an objective or a property's text, got {wish!r}.")
        if isinstance(objective, Threshold | Lexicographic):
            raise PropertyError(
                f"A further objective must ask for one best value (=?), got '{objective.text}'.", text=objective.text
            )
        if isinstance(objective, Mission):
            raise NotExplainableError(
                f"A further objective must be told without memory, got '{objective.text}'. Ask for it as the plan's own, with "
                "--property.",
                text=objective.text,
            )
        if objective in (*solution.objectives, *found):
            raise PropertyError(
                f"A further objective must differ from the plan's own and from the others, got '{objective.text}' again.",
                text=objective.text,
            )
        found.append(objective)
    return tuple(found)
