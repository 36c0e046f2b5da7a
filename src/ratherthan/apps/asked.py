"""A `Wanted` and the options of a question enter; problems, solutions, explanations and tables leave.

What every command does first, in an order in which a slip of the person is told before anything long begins.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ratherthan.apps.options import Wanted
from ratherthan.apps.waiting import waiting

if TYPE_CHECKING:
    from ratherthan.apps.columns import Column
    from ratherthan.explain import Explanation, Question
    from ratherthan.factors import Counts
    from ratherthan.model.objective import Objective, Threshold
    from ratherthan.model.problem import Problem
    from ratherthan.solve import Solution

__all__ = ["answer_of", "explanation_of", "factor_table_of", "problem_of", "solution_of"]

MILLION = 1_000_000
FEW, MANY = 7, 12
"""How many sentences about steps pages and pictures have where there would be more than so many."""


def problem_of(wanted: Wanted) -> Problem:
    """Read the model, from the state and with the words that are wanted; its objective is still the source's own."""
    from ratherthan.io import read

    with waiting(f"Reading {wanted.source}"):
        problem = read(
            wanted.source,
            constants=wanted.constants,
            start=wanted.start,
            properties=wanted.properties,
            **wanted.drive,
        )
    if wanted.lexicon is None:
        return problem
    from ratherthan.apps.door import say
    from ratherthan.apps.words import read_lexicon, strangers
    from ratherthan.model.lexicon import Lexicon

    lexicon = read_lexicon(wanted.lexicon, problem.lexicon)
    note = strangers(read_lexicon(wanted.lexicon, Lexicon()), problem.mdp)
    if note:
        say(note)
    return replace(problem, lexicon=lexicon)


def answer_of(
    wanted: Wanted, late: Callable[[dict[str, Any], str], None], *, policy: str | None, minimise_q: bool
) -> tuple[dict[str, Any], str]:
    """Return the document of the value that is wanted, and the text of the property; Storm's where it is not ours to give.

    Where a limit is reached in the middle of what cannot be interrupted, `late` takes both, from another thread.
    """
    from ratherthan.apps.answers import value_document
    from ratherthan.apps.elsewhere import asked_of_storm, storm_document
    from ratherthan.apps.limits import speaking
    from ratherthan.errors import NotExplainableError, PropertyError, StoppedError
    from ratherthan.model.discounts import discount_taken
    from ratherthan.model.objective import Lexicographic, Threshold
    from ratherthan.model.states import start_of

    problem = problem_of(wanted)
    text = wanted.properties[0] if len(wanted.properties) == 1 and wanted.discount is None else None
    reason: PropertyError
    try:
        wish = _wish(wanted, problem)
        discount_taken([wish], wanted.discount)
    except PropertyError as error:
        reason = error
    else:
        start_of(problem.mdp)
        objective = wish.objective if isinstance(wish, Threshold) else wish
        try:
            with speaking(lambda error: late(value_document(error.solution, wish, error), wish.text)):
                solution = _solved(replace(problem, objective=objective), policy, minimise_q=minimise_q)
            return value_document(solution, wish), wish.text
        except StoppedError as error:
            return value_document(error.solution, wish, error), wish.text
        except NotExplainableError as error:
            reason, text = error, None if isinstance(wish, Lexicographic) else wish.text
    answer = asked_of_storm(problem, text, reason, policy)
    return storm_document(answer, problem), answer.text


def explanation_of(wanted: Wanted, given: Mapping[str, Any], *, usable: bool = False) -> Explanation:
    """Return the explanation that the options of ``ratherthan explain`` ask for; in few sentences where it is to be `usable`."""
    from ratherthan.apps.limits import with_value
    from ratherthan.explain import explain
    from ratherthan.explain.telling import matters
    from ratherthan.model.states import start_of, state_number

    if usable and given.get("ranking") is not None and given.get("at_most") is None:
        given = {**given, "at_most": FEW}
    problem, also = _explainable(wanted, given["also"])
    state = given["state"]
    if state is None:
        start_of(problem.mdp)
    asked = _question(given, None if state is None else state_number(problem.mdp, state))
    solution = _solved(problem, given["policy"], minimise_q=given["minimise_q"])
    with waiting("Explaining"), with_value(solution):
        if usable and asked.at_most is None and asked.scope == "route":
            few = explain(solution, asked=replace(asked, at_most=FEW), also=also)
            if sum(matters(step, asked) for step in few.steps) > MANY:
                return few
        return explain(solution, asked=asked, also=also)


def solution_of(wanted: Wanted, policy: str | None, *, minimise_q: bool) -> Solution:
    """Return the plan that is wanted, the best one or the one of a file, with its values."""
    from ratherthan.model.states import start_of

    problem, _ = _explainable(wanted)
    start_of(problem.mdp)
    return _solved(problem, policy, minimise_q=minimise_q)


def factor_table_of(wanted: Wanted, given: Mapping[str, Any]) -> dict[str, Column]:
    """Return the table that the options of ``ratherthan factors`` ask for."""
    from ratherthan.apps.columns import counted_at, factor_columns, route_states
    from ratherthan.apps.door import say
    from ratherthan.apps.limits import with_value
    from ratherthan.explain import Factors
    from ratherthan.factors import Effort
    from ratherthan.model.states import start_of, state_number

    problem, _ = _explainable(wanted)
    asked, start = _question(given, None), start_of(problem.mdp)
    states = {state_number(problem.mdp, state) for state in given["states"]}
    solution = _solved(problem, given["policy"], minimise_q=given["minimise_q"])
    factors = Factors(solution=solution, asked=asked)
    effort = Effort(visits=given["work"] * MILLION, estimate=given["estimate"])
    with waiting("Counting the decisions left open"), with_value(solution):
        where = None if given["constrictiveness"] == "all" else states | route_states(factors, start)
        counts = counted_at(factors, where, effort)
        columns = factor_columns(factors, where, counts, estimates=effort.estimate)
    if not counts.counted.all():
        say(_spent(counts, given["work"], estimate=effort.estimate))
    return columns


def _spent(counts: Counts, work: int, *, estimate: bool) -> str:
    """Return what is said where the work did not suffice."""
    done, asked, guessed = int(counts.counted.sum()), len(counts.choices), int(counts.estimated.sum())
    said = (
        f"The decisions left open were counted for {done:,} of {asked:,} choices; then the work was spent (--work {work}). "
        "The others have no constrictiveness in the table. Grant more work to count them."
    )
    if not estimate:
        return said
    return f"{said} For {guessed:,} of them constrictiveness_estimate holds a guess, which proves nothing."


def _wish(wanted: Wanted, problem: Problem) -> Objective | Threshold:
    """Return what is wanted: the property that was given, else the one that the source makes plain."""
    from ratherthan.model.property import lexicographic, wish_of

    wishes = [wish_of(problem, text, discount=wanted.discount) for text in wanted.properties or (None,)]
    return wishes[0] if len(wishes) == 1 else lexicographic(wishes)


def _further(wanted: Wanted, problem: Problem, wish: Objective | Threshold, also: Sequence[str]) -> list[Objective]:
    """Return what else is wanted; the discount is for this, too."""
    from ratherthan.errors import PropertyError
    from ratherthan.model.discounts import discount_taken
    from ratherthan.model.further import further_objective
    from ratherthan.model.objective import Threshold, levels_of

    levels = levels_of(wish.objective if isinstance(wish, Threshold) else wish)
    wishes: list[Objective] = []
    for text in also:
        further = further_objective(problem, text, levels, discount=wanted.discount)
        if isinstance(further, Threshold):
            raise PropertyError(
                f"A further objective must ask for one best value (=?), got '{further.text}'.", text=further.text
            )
        wishes.append(further)
    discount_taken([wish, *wishes], wanted.discount)
    return wishes


def _explainable(wanted: Wanted, also: Sequence[str] = ()) -> tuple[Problem, list[Objective]]:
    """Return the problem with an objective that has a best value, unfolded with what must be remembered, and what else is wanted."""
    from ratherthan.errors import NotExplainableError

    problem = problem_of(wanted)
    try:
        wish = _wish(wanted, problem)
        wishes = _further(wanted, problem, wish, also)
        return _with_objective(problem, wish), wishes
    except NotExplainableError as error:
        if len(wanted.properties) != 1 or also:
            raise
        raise NotExplainableError(
            f"{error.message} ratherthan solve can ask Storm for its value.", **error.place
        ) from error


def _with_objective(problem: Problem, wish: Objective | Threshold) -> Problem:
    from ratherthan.errors import PropertyError
    from ratherthan.model.objective import Mission, Threshold, levels_of

    if isinstance(wish, Threshold):
        raise PropertyError(
            f"A property must ask for a best value (=?) to be explained, got the yes-or-no question '{wish.text}'. "
            f"Ask for '{wish.objective.text}'; the question itself is answered by: ratherthan solve.",
            text=wish.text,
        )
    problem = replace(problem, objective=wish)
    if not any(isinstance(level, Mission) for level in levels_of(wish)):
        return problem
    from ratherthan.solve.solver import unfolded_for

    with waiting("Unfolding the mission"):
        return replace(unfolded_for(problem, wish), objective=wish)


def _question(given: Mapping[str, Any], state: int | None) -> Question:
    from ratherthan.explain import question
    from ratherthan.factors import Search

    factors = given.get("factors")
    return question(
        given.get("kind"),
        scope=given.get("scope"),
        factors=None if factors is None else [name.strip() for name in factors.split(",") if name.strip()],
        state=state,
        rather_than=given.get("rather_than"),
        alpha=given["alpha"],
        omega=given["impact"] == "omega",
        policy_values=given["values"] == "policy",
        search=Search(horizon=given["horizon"], toward_goal=given["toward"] == "goal"),
        detail=given.get("detail", False),
        at_most=given.get("at_most"),
        ranking=given.get("ranking"),
    )


def _solved(problem: Problem, policy: str | None, *, minimise_q: bool) -> Solution:
    """Return the optimum, or where a file with a policy is given that policy beside it."""
    from ratherthan.errors import QuestionError

    if policy is None and minimise_q:
        raise QuestionError("--minimise-q must come with a table of action values to read: give --policy FILE, too.")
    from ratherthan.solve import evaluate, solve

    with waiting("Solving") as tell:
        if policy is None:
            return solve(problem, progress=tell)
        from ratherthan.io.policies import read_policy

        unfolding = problem.unfolding  # a policy is given for the model as it is, whatever must be remembered
        mdp = problem.mdp if unfolding is None else unfolding.origin.mdp
        chosen = read_policy(policy, mdp, minimise_q=minimise_q)
        if unfolding is not None:
            from ratherthan.model.product import lifted

            chosen = lifted(chosen, problem)
        return evaluate(problem, chosen, progress=tell)
