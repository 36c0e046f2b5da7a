"""A `Wanted`, what is to be drawn and the options of a question enter, a picture leaves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ratherthan.apps.options import Wanted
from ratherthan.apps.stored import MODEL, given_options, stored_explanation
from ratherthan.apps.waiting import waiting
from ratherthan.errors import QuestionError

if TYPE_CHECKING:
    from ratherthan.render import Picture

__all__ = ["picture_of"]

READING = frozenset({"properties", "discount", "constants", "start", "precision"})
PLAN = READING | {"policy", "minimise_q"}
STATE = PLAN | {"state"}
ROUTES = ("route", "graph")
USED = {
    "value": PLAN,
    "spread": PLAN,
    "policy": PLAN,
    "trees": STATE | {"rather_than"},
    "factors": STATE,
    "model": READING,
}
"""The options that a view has a use for, besides those for maps; the others are refused."""


def picture_of(wanted: Wanted, what: str, given: Mapping[str, Any]) -> Picture:
    """Return the picture that the options of ``ratherthan draw`` ask for.

    Raises
    ------
    QuestionError
        Where an option has nothing to do with what is to be drawn, or a stored explanation does not hold it.
    """
    from ratherthan.render import draw

    explanation = stored_explanation(wanted)
    if what in ROUTES:
        from ratherthan.apps.asked import explanation_of

        explanation = explanation or explanation_of(wanted, given, usable=True)
        with waiting("Drawing"):
            return draw(explanation, what)
    if explanation is not None:
        raise QuestionError(
            f"A stored explanation holds its route, not what '{what}' needs. Give the model, or leave --what out."
        )
    _refuse_useless(wanted, what)
    if what == "model":
        from ratherthan.apps.asked import problem_of

        problem = problem_of(wanted)
        with waiting("Drawing"):
            return draw(problem)
    from ratherthan.apps.asked import solution_of
    from ratherthan.model.states import start_of, state_number

    solution = solution_of(wanted, given["policy"], minimise_q=given["minimise_q"])
    mdp, state = solution.problem.mdp, None
    if "state" in USED[what]:
        state = start_of(mdp) if given["state"] is None else state_number(mdp, given["state"])
    with waiting("Drawing"):
        return draw(solution, what, state=state, rather_than=given["rather_than"])


def _refuse_useless(wanted: Wanted, what: str) -> None:
    """Raise QuestionError where an option was given that changes nothing in the picture."""
    useless = given_options(USED[what] | MODEL | set(wanted.drive))
    if useless:
        raise QuestionError(f"A picture of '{what}' has no use for {', '.join(useless)}. Leave it out.")
