"""How fast one more question is answered on a model that is open already: ten states of the route, in one session."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.harness import Case
from benchmarks.models import slippery_map
from ratherthan.explain import explain, question
from ratherthan.explain.explanation import Explanation
from ratherthan.narrate import narrate
from ratherthan.solve import Solution, solve

SIDES = (300, 1000)
QUESTIONS = 10


def foils(solution: Solution, route: Explanation) -> list[tuple[int, str]]:
    """Return states along a route, each with an action that is not taken there."""
    mdp, found = solution.problem.mdp, []
    for k in range(QUESTIONS):
        step = route.steps[len(route.steps) * k // QUESTIONS]
        other = next(choice for choice in mdp.choices_of(step.state) if choice != step.choice)
        found.append((step.state, mdp.action_name(other)))
    return found


def asked(solution: Solution, state: int, action: str) -> str:
    """Return the answer to one question, in words."""
    return narrate(explain(solution, asked=question(state=state, rather_than=action)))


def session(side: int) -> tuple[Callable[[], object], Callable[[], object]]:
    """Return what asks for the whole route, and what asks one more question; the model is solved once, the first time."""
    open_: list[Solution] = []
    waiting: list[tuple[int, str]] = []

    def opened() -> Solution:
        if not open_:
            open_.append(solve(slippery_map(side)))
        return open_[0]

    def route() -> object:
        return narrate(explain(opened()))

    def one() -> object:
        if not waiting:
            waiting.extend(foils(opened(), explain(opened())))
        state, action = waiting[0]
        waiting.append(waiting.pop(0))
        return asked(opened(), state, action)

    return route, one


def cases() -> list[Case]:
    found = []
    for side in SIDES:
        route, one = session(side)
        found.append(Case(name=f"the whole route once more, {side} × {side} cells", run=route))
        found.append(Case(name=f"why not another action at a state of it, {side} × {side} cells", run=one))
    return found
