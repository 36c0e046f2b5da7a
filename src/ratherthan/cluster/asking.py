"""A model solved in blocks and a state enter; why the plan does there what it does leaves, and the route that people see.

A question about one state needs the rows of that state and the bounds of the states that they lead to. These are fetched from the
blocks that own them, and become a small problem of their own, in which the states led to are at rest; what is said of it is said
by the same functions as of any other (`explain`). How many decisions a choice leaves open (constrictiveness) needs the whole graph and is
not told in blocks.

The route needs what the policy does everywhere: one row per state, which is fetched whole, a small part of the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ratherthan.cluster import working
from ratherthan.cluster.archive import Described
from ratherthan.cluster.block import States
from ratherthan.cluster.blocks import Blocks, always
from ratherthan.errors import QuestionError
from ratherthan.explain import Explanation, explain, question
from ratherthan.explain.route import Route, policy_graph, route_from
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.model.watch import room_for
from ratherthan.narrate import narrate
from ratherthan.solve.bellman import action_value_bounds
from ratherthan.solve.solution import Outcome, Solution

__all__ = ["Told", "ask", "check_question", "route_of"]

KINDS = ("naive-state", "responsibility")
MOST_NAMED = 20
FACTORS = ("selectiveness", "responsibility")


@dataclass(frozen=True, kw_only=True)
class Told:
    """What is said of one state, and the numbers behind it.

    Parameters
    ----------
    state : int
    text : str
    action : str
        What the plan does there; empty where nothing is to be done.
    choices : tuple of mappings
        For each choice its action, action_value, lower, upper, and whether it is taken.
    """

    state: int
    text: str
    action: str
    choices: tuple[Mapping[str, Any], ...]


def ask(
    solved: Blocks, state: int, kind: str | None = None, *, rather_than: str | None = None, alpha: float = 0.0
) -> Told:
    """Say why the plan does what it does at a state, or why not something else.

    Parameters
    ----------
    solved : Blocks
    state : int
    kind : str, optional
        "naive-state" or "responsibility" (the default).
    rather_than : str, optional
        The name of another action.
    alpha : float
        As in `Question`.

    Raises
    ------
    QuestionError
        For another kind, an unknown state or action, and where no plan is sure to arrive.
    """
    check_question(solved.about, kind, rather_than)
    if not 0 <= state < solved.about.header.states:
        raise QuestionError(
            f"A state must be a number from 0 to {solved.about.header.states - 1}, got {state}.", state=state
        )
    solution, states = _around(solved, state)
    local = int(np.searchsorted(states, state))
    if np.isinf(solution.values[0, local]):
        raise QuestionError(
            f"In blocks a plan is made where it is sure to arrive, but from state {state} none is. "
            "On one machine it is told where to head nevertheless: leave --cluster out.",
            state=state,
        )
    if rather_than is not None:
        asked = question(rather_than=rather_than, factors=("responsibility",), state=local, alpha=alpha)
    else:
        asked = question(kind or "responsibility", state=local, alpha=alpha)
    try:
        explanation = explain(solution, asked=asked)
    except QuestionError as error:
        raise QuestionError(error.message.replace(f"state {local}", f"state {state}"), state=state) from error
    return _told(solution, explanation, local, states)


def check_question(about: Described, kind: str | None, rather_than: str | None) -> None:
    """Raise QuestionError for what can be asked of no state of a model in blocks, before anything long begins."""
    if kind is not None and kind not in KINDS:
        raise QuestionError(
            f"In blocks the kind must be one of {', '.join(KINDS)}, or another action given by 'rather than'; got '{kind}'. "
            "The others count decisions on the whole graph: on one machine, leave --cluster out."
        )
    known = [name for name in about.actions if name]
    if rather_than is not None and rather_than not in known:
        raise QuestionError(
            f"'rather than' must name an action of the model, one of {', '.join(known[:MOST_NAMED])}"
            f"{', …' if len(known) > MOST_NAMED else ''}; got '{rather_than}'."
        )


def _around(solved: Blocks, state: int) -> tuple[Solution, States]:
    """Return a solution of a state's own rows and the states that they lead to, and which states these are."""
    owner = solved.owner(state)
    (rows,) = solved.every(working.rows_at, always(np.array([state])), which=[owner])
    states = np.unique(np.append(rows.target, state))
    values, choice = solved.at_states(states)
    lower, upper = solved.bounds(values)
    local, count = int(np.searchsorted(states, state)), len(states)
    own = int(rows.choices[0])
    choices = np.ones(count, dtype=np.int64)
    choices[local] = own
    offsets = np.concatenate([[0], np.cumsum(choices)])
    place = offsets[local] + np.arange(own)
    branches = np.ones(offsets[-1], dtype=np.int64)
    branches[place] = rows.branches
    begin = np.concatenate([[0], np.cumsum(branches)])
    target, probability = np.repeat(np.arange(count), choices), np.ones(begin[-1])
    target = np.repeat(target, branches)
    here = slice(int(begin[place[0]]), int(begin[place[-1] + 1]))
    target[here], probability[here] = np.searchsorted(states, rows.target), rows.probability
    cost = np.ones(offsets[-1])
    cost[place] = rows.cost
    actions, number = _actions(solved)
    action = np.full(offsets[-1], -1)
    action[place] = np.where(rows.action >= 0, number[rows.action], -1)
    goal = values == 0.0  # costs are positive
    name = solved.objective.reward
    label = "the goal"
    outline = solved.about.outline()
    mdp = MDP(
        state_to_choices=offsets,
        choice_to_branches=begin,
        branch_to_target=target,
        branch_to_probability=probability,
        choice_to_action=action,
        actions=actions,
        labels={label: goal},
        rewards={} if name is None else {name: Reward(choice=cost)},
        initial=np.array([local]),
    )
    taken = offsets[:-1].copy()
    taken[local] = offsets[local] + max(int(choice[local]) - int(rows.first[0]), 0)
    row = (values[None], lower[None], upper[None])
    solution = Solution(
        problem=Problem(mdp=mdp, objective=solved.objective, lexicon=outline.lexicon, source=solved.about.path),
        objectives=(solved.objective,),
        values=row[0],
        lower=row[1],
        upper=row[2],
        policy=Policy(choice=taken),
        given=False,
        policy_values=row[0],
        policy_lower=row[1],
        policy_upper=row[2],
        goal=goal,
        hazard=np.zeros(count, dtype=np.bool_),
        can_arrive=_can_arrive(solved, states),
        outcome=Outcome.CERTIFIED if solved.shares is not None else Outcome.UNCERTIFIED,
        engine="windowed sweeps in blocks",
        sweeps=solved.rounds[1],
        residual=0.0,
    )
    return solution, states


def _actions(solved: Blocks) -> tuple[tuple[str, ...], States]:
    """Return the names of the actions, and the number among them of each of the archive's, -1 where it has no name."""
    given = solved.about.actions
    named = np.array([bool(name) for name in given], dtype=np.bool_)
    return tuple(name for name in given if name), np.append(np.where(named, np.cumsum(named) - 1, -1), -1)


def _can_arrive(solved: Blocks, states: States) -> Any:
    """Return from which states the goal can be reached at all."""
    found = np.zeros(len(states), dtype=np.bool_)
    for number, state in enumerate(map(int, states)):
        extent = solved.extents[solved.owner(state)]
        bit = state - extent.begin
        found[number] = bool(solved.can[extent.number][bit >> 3] >> (7 - (bit & 7)) & 1)
    return found


def _told(solution: Solution, explanation: Explanation, local: int, states: States) -> Told:
    """Return what is said, in the numbers of the archive."""
    state, mdp = int(states[local]), solution.problem.mdp
    renamed = replace(
        explanation,
        start=state,
        states={int(states[s]): replace(record, name=str(states[s])) for s, record in explanation.states.items()},
        steps=tuple(replace(step, state=int(states[step.state])) for step in explanation.steps),
        question=replace(explanation.question, state=state),
    )
    value, lower, upper = action_value_bounds(solution)
    ended = bool(solution.goal[local])
    taken = int(solution.policy.choice[local])
    rows = [
        {
            "action": mdp.action_name(choice),
            "action_value": float(value[choice]),
            "lower": float(lower[choice]),
            "upper": float(upper[choice]),
            "taken": choice == taken and not ended,
        }
        for choice in mdp.choices_of(local)
    ]
    action = "" if ended else mdp.action_name(taken)
    return Told(state=state, text=narrate(renamed), action=action, choices=tuple(rows))


def route_of(solved: Blocks, start: int) -> tuple[Route, list[str]]:
    """Return the most probable way from a state to the goal under the plan, and the action at each step.

    What the plan does everywhere must fit into this process: about 40 bytes per branch of the rows taken.
    """
    header = solved.about.header
    room_for(
        40.0 * header.branches * header.states / max(header.choices, 1) + 60.0 * header.states, "The plan of all states"
    )
    found = solved.every(working.policy_rows, solved.final)
    branches = np.concatenate([part[0] for part in found])
    values = np.concatenate([part[4] for part in found])
    goal = values == 0.0
    mdp = MDP(
        state_to_choices=np.arange(header.states + 1),
        choice_to_branches=np.concatenate([[0], np.cumsum(branches)]),
        branch_to_target=np.concatenate([part[1] for part in found]),
        branch_to_probability=np.concatenate([part[2] for part in found]),
        labels={"goal": goal},
        initial=np.array([start]),
    )
    nothing = np.zeros((1, header.states))
    solution = Solution(
        problem=Problem(mdp=mdp, objective=solved.objective, source=solved.about.path),
        objectives=(solved.objective,),
        values=nothing,
        lower=nothing,
        upper=nothing,
        policy=Policy(choice=np.arange(header.states)),
        given=False,
        policy_values=nothing,
        policy_lower=nothing,
        policy_upper=nothing,
        goal=goal,
        hazard=np.zeros(header.states, dtype=np.bool_),
        can_arrive=np.isfinite(values),
        outcome=Outcome.UNCERTIFIED,
        engine="",
        sweeps=0,
        residual=0.0,
    )
    route = route_from(solution, policy_graph(solution), start)
    action = np.concatenate([part[3] for part in found])
    given = (*solved.about.actions, "")
    names = [given[action[state]] or f"choice {action[state]}" for state in route.states[:-1]]
    return route, names
