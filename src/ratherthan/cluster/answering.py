"""Missions about one model enter, a row of results for each leaves. Runs on a worker; what it read and solved stays there.

The rows of a model that was just asked about find it solved. At most `KEPT` models are kept, the last ones asked about.
"""

from __future__ import annotations

import os
import time
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ratherthan.cluster.missions import Mission, driven, model_of, questioned, read_from
from ratherthan.errors import LimitError, PropertyError, RatherthanError
from ratherthan.model.watch import Limits, watching

if TYPE_CHECKING:
    from ratherthan.explain import Explanation
    from ratherthan.model.objective import Objective
    from ratherthan.model.problem import Problem
    from ratherthan.solve import Solution

__all__ = ["answer_some", "answers"]

KEPT = 1
"""How many solved models a worker keeps: they may be large."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Opened:
    """A model with its solution, or the error that came of it."""

    solution: Solution | None
    error: Exception | None


_opened: OrderedDict[tuple[Any, ...], _Opened] = OrderedDict()


def answer_some(missions: Sequence[Mission], folder: str, *, documents: bool, limits: Limits) -> list[dict[str, Any]]:
    """Return a row of results for each of some missions, as `answers` yields them; relative paths begin in `folder`."""
    with suppress(OSError):
        if os.getcwd() != folder:  # noqa: PTH109 - compared as text
            os.chdir(folder)
    return list(answers(missions, documents=documents, limits=limits))


def answers(missions: Sequence[Mission], *, documents: bool, limits: Limits) -> Iterator[dict[str, Any]]:
    """Yield a row of results for each of some missions; what is wrong with one is a result, too.

    Parameters
    ----------
    missions : sequence of Mission
    documents : bool
        Whether each explanation is wanted as a document, too.
    limits : Limits
        How much each of them may take.
    """
    from ratherthan.solve.precise import aiming

    for mission in missions:
        begun = time.perf_counter()
        row: dict[str, Any] = dict.fromkeys(
            ("property", "state", "value", "lower", "upper", "outcome", "text", "document")
        )
        row |= {"row": mission.number, "status": "answered", "error": None, "fault": False}
        try:
            with watching(limits), aiming(mission.precision):
                row |= _answered(mission, documents=documents)
        except (MemoryError, OSError, RatherthanError) as error:
            row |= {"status": "failed", "error": _sentence(error), "fault": isinstance(error, LimitError)}
        except Exception as error:  # noqa: BLE001 - one row's fault is told in that row, and the others go on
            sentence = (
                f"This is a fault of the program ({type(error).__name__}: {error}). Please report it with its input."
            )
            row |= {"status": "failed", "error": sentence, "fault": True}
        yield row | {"seconds": round(time.perf_counter() - begun, 3)}


def _sentence(error: Exception) -> str:
    if isinstance(error, RatherthanError):
        return error.message
    if isinstance(error, MemoryError):
        return "The memory of the worker must hold the model, but it does not suffice. Take a smaller model."
    assert isinstance(error, OSError)
    named = f"'{error.filename}': " if isinstance(error.filename, str) else ""
    return f"Files must be readable, but the system says: {named}{error.strerror or error}."


def _answered(mission: Mission, *, documents: bool) -> dict[str, Any]:
    """Return what is filled into the row of a mission."""
    from ratherthan.explain import explain, question
    from ratherthan.model.states import start_of, state_number
    from ratherthan.narrate import narrate, to_json

    question(**questioned(mission, None))  # a slip in the question is told before anything long begins
    solution = _solution_of(mission)
    problem = solution.problem
    state = None
    for given in (mission.state, None if driven(mission) else mission.start):
        if given is not None and state is None:
            state = state_number(problem.mdp, given)
    place = start_of(problem.mdp) if state is None else state
    also = _further(mission, problem)
    parts = questioned(mission, state)
    if mission.state is None and mission.scope is None and (mission.factors is not None):
        parts["scope"] = "route"  # a start alone asks about the route from there
    explanation: Explanation = explain(solution, asked=question(**parts), also=also)
    given_values = ("policy_values", "policy_lower", "policy_upper") if solution.given else ("values", "lower", "upper")
    value, lower, upper = (float(getattr(solution, name)[0, place]) for name in given_values)
    return {
        "property": explanation.property,
        "state": place,
        "value": value,
        "lower": lower if lower > -float("inf") or upper == lower else None,
        "upper": upper if upper < float("inf") or upper == lower else None,
        "outcome": solution.outcome.name.lower().replace("_", " "),
        "text": narrate(explanation),
        "document": to_json(explanation) if documents else None,
    }


def _solution_of(mission: Mission) -> Solution:
    """Return the solved model of a mission; read and solved now, or before for another."""
    key = model_of(mission)
    if key not in _opened:
        while len(_opened) >= KEPT:
            _opened.popitem(last=False)
        try:
            _opened[key] = _Opened(solution=_solved(mission), error=None)
        except LimitError:
            raise
        except (MemoryError, OSError, RatherthanError) as error:
            _opened[key] = _Opened(solution=None, error=error)
    _opened.move_to_end(key)
    found = _opened[key]
    if found.error is not None:
        raise found.error
    assert found.solution is not None
    return found.solution


def _solved(mission: Mission) -> Solution:
    """Read and solve the model of a mission."""
    from ratherthan.io import read
    from ratherthan.io.policies import read_policy
    from ratherthan.model.discounts import discount_taken
    from ratherthan.model.objective import Threshold
    from ratherthan.model.property import lexicographic, wish_of
    from ratherthan.solve import evaluate, solve

    problem = read(
        mission.source,
        constants=mission.constants,
        start=read_from(mission),
        properties=mission.property,
        **driven(mission),
    )
    wishes = [wish_of(problem, text, discount=mission.discount) for text in mission.property or (None,)]
    wish = wishes[0] if len(wishes) == 1 else lexicographic(wishes)
    if isinstance(wish, Threshold):
        raise PropertyError(
            f"A property must ask for a best value (=?) to be explained, got the yes-or-no question '{wish.text}'. "
            f"Ask for '{wish.objective.text}'.",
            text=wish.text,
        )
    if not mission.also:
        discount_taken(wishes, mission.discount)
    problem = _unfolded(replace(problem, objective=wish), wish)
    if mission.policy is None:
        return solve(problem)
    origin = problem if problem.unfolding is None else problem.unfolding.origin
    policy = read_policy(mission.policy, origin.mdp, minimise_q=mission.minimise_q)
    if problem.unfolding is not None:
        from ratherthan.model.product import lifted

        policy = lifted(policy, problem)
    return evaluate(problem, policy)


def _unfolded(problem: Problem, wish: Objective) -> Problem:
    from ratherthan.model.objective import Mission as Remembering
    from ratherthan.model.objective import levels_of

    if not any(isinstance(level, Remembering) for level in levels_of(wish)):
        return problem
    from ratherthan.solve.solver import unfolded_for

    return replace(unfolded_for(problem, wish), objective=wish)


def _further(mission: Mission, problem: Problem) -> list[Objective]:
    """Return by what else the plan is judged."""
    from ratherthan.model.discounts import discount_taken
    from ratherthan.model.further import further_objective
    from ratherthan.model.objective import Threshold, levels_of

    if not mission.also:
        return []
    assert problem.objective is not None
    levels, wishes = levels_of(problem.objective), []
    for text in mission.also:
        further = further_objective(problem, text, levels, discount=mission.discount)
        if isinstance(further, Threshold):
            raise PropertyError(
                f"A further objective must ask for one best value (=?), got '{further.text}'.", text=further.text
            )
        wishes.append(further)
    discount_taken([problem.objective, *wishes], mission.discount)
    return wishes
