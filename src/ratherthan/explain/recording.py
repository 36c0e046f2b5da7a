"""A Solution and what was found out about it enter; an Explanation leaves, with records of all that it mentions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ratherthan.explain.explanation import (
    Explanation,
    Further,
    PolicyRecord,
    PolicyRows,
    StateRecord,
    Step,
    Unfolded,
)
from ratherthan.explain.objectives import objective_record
from ratherthan.explain.places import world_of
from ratherthan.explain.question import Question
from ratherthan.explain.route import reachable_at_all
from ratherthan.explain.shared import graph_of, reached_from
from ratherthan.model.index import index_of
from ratherthan.model.objective import Level, Lexicographic
from ratherthan.model.problem import Problem
from ratherthan.solve.solution import Solution

__all__ = ["recorded"]


def recorded(solution: Solution, asked: Question, also: Sequence[Level], start: int, **parts: Any) -> Explanation:
    """Return an Explanation out of its parts.

    Parameters
    ----------
    solution : Solution
    asked : Question
    also : sequence of objectives
    start : int
    **parts
        The route, the steps and so on, as `Explanation` has them.
    """
    problem, levels = solution.problem, solution.objectives
    steps: tuple[Step, ...] = parts.get("steps", ())
    mentioned = {start, *parts.get("route", ()), *parts.get("circle", ()), *parts.get("in_the_way", ())}
    for step in steps:
        mentioned |= {step.state} | {state for claim in step.claims for state, _, _ in claim.evidence.follows}
    shown = mentioned | {other.towards for step in steps for other in step.alternatives}
    records = tuple(map(objective_record, levels))
    return Explanation(
        source=problem.source,
        property=(levels[0] if len(levels) == 1 else Lexicographic(levels=levels)).text,
        objective=records[0],
        levels=records,
        also=tuple(Further(property=level.text, objective=objective_record(level)) for level in also),
        question=asked,
        start=start,
        states={state: _state_record(problem, state) for state in sorted(shown)},
        size=(problem.mdp.states, problem.mdp.choices, problem.mdp.branches),
        policy=_policy_record(solution, asked, start, mentioned, _compared(steps)),
        lexicon=problem.lexicon,
        outcome=solution.outcome.value,
        unfolded=_unfolded(problem),
        world=world_of(problem, solution.goal, solution.hazard),
        **parts,
    )


def _unfolded(problem: Problem) -> Unfolded | None:
    unfolding = problem.unfolding
    if unfolding is None:
        return None
    return Unfolded(states=unfolding.origin.mdp.states, memories=len(unfolding.left))


def _state_record(problem: Problem, state: int) -> StateRecord:
    place = None if problem.world is None else problem.world.place(state)
    return StateRecord(name=problem.mdp.names[state], named=problem.mdp.names.named, place=place)


def _compared(steps: Sequence[Step]) -> set[int]:
    """Return the choices that are compared under further objectives."""
    judged = [one for step in steps for trade in step.trades for one in trade.judged[:1]]
    return {choice for one in judged for choice in (one.taken.choice, one.other.choice)}


def _policy_record(
    solution: Solution, asked: Question, start: int, mentioned: set[int], compared: set[int]
) -> PolicyRecord:
    """Return the policy where the explanation can lead; after an alternative it goes on, too."""
    mdp, policy = solution.problem.mdp, solution.policy
    roots = set(mentioned)
    for choice in compared:
        roots |= set(map(int, mdp.branch_to_target[mdp.branches_of(choice)]))
    judged = asked.policy_values and solution.given  # by ρ^π: an alternative rests on what the policy does after it
    seen = reachable_at_all(solution, start) if judged else reached_from(solution, start)
    for root in sorted(roots - {start}):
        if not seen[root]:
            seen = seen | reachable_at_all(solution, root) if judged else graph_of(solution).reachable(root, seen)
    within = seen & ~solution.ended
    if policy.chance is None:
        state = np.flatnonzero(within & (policy.choice >= 0))
        kept, share = policy.choice[state].astype(np.int64), np.ones(len(state))
    else:
        state_of_choice = index_of(mdp).choice_to_state
        kept = np.flatnonzero((policy.chance > 0) & within[state_of_choice])
        state, share = state_of_choice[kept].astype(np.int64), policy.chance[kept]
    return PolicyRecord(given=solution.given, choices=PolicyRows(state=state, choice=kept, share=share))
