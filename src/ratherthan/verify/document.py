"""A stored explanation enters; what it says leaves, or an ExplanationError that names what was tampered with."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

from ratherthan.errors import ExplanationError, InputError
from ratherthan.explain.explanation import Explanation, Measured, Step, Tally, Unfolded
from ratherthan.explain.question import Question
from ratherthan.explain.record import digest, frame_of, from_document
from ratherthan.model.mdp import MDP
from ratherthan.model.problem import Problem
from ratherthan.narrate import narrate
from ratherthan.verify.wanted import refuse

__all__ = ["OUTCOMES", "load", "refuse_foreign", "refuse_retold"]

OUTCOMES = (
    "The values are proved: one check by Bellman's operator confirmed the bounds.",
    "Only the lower bounds are proved.",
    "Only the upper bounds are proved.",
    "The lower bounds are proved; from above only what plans of a limited number of steps attain, and beyond that nothing.",
    "The solver stopped before it converged; the bounds that were proved so far are given.",
    "The values are not certified: no bounds are known, and no claim rests on them.",
)
"""How a solver may say it ended; the first is full success."""

LOOSEST = 1e-4
"""A larger tolerance would call numbers equal that are printed as different."""

_KINDS = {
    "none": ("none", frozenset[str]()),
    "naive-state": ("state", frozenset[str]()),
    "responsibility": ("state", frozenset({"responsibility"})),
    "constrictive": ("state", frozenset({"constrictiveness"})),
    "naive-path": ("route", frozenset[str]()),
    "selective": ("route", frozenset({"selectiveness"})),
    "contrastive": ("route", frozenset({"selectiveness", "constrictiveness", "responsibility"})),
}


def load(source: Mapping[str, Any] | str | Path) -> tuple[Explanation, str]:
    """Return the explanation and the text of a document, once its form and its digest are found in order.

    Parameters
    ----------
    source : mapping, str or Path
        The document, or the path of a JSON file.

    Raises
    ------
    ExplanationError
    """
    document = source if isinstance(source, Mapping) else _read(Path(source))
    if not isinstance(document, Mapping):
        raise ExplanationError(f"An explanation must be a JSON object, got {type(document).__name__}.")
    try:
        explanation, text = from_document(document)
        claimed, own = document["digest"], digest(document)
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise ExplanationError(f"An explanation must be a JSON document of numbers and text; {error}.") from None
    if claimed != own:
        refuse(f"The digest of an explanation must be that of its content, {own}", claimed)
    for where, number in _integers(explanation):
        if type(number) is not int:
            refuse(f"A state, choice or count must be a whole number at {where}", repr(number))
    missing = {state for _, state in _states(explanation)} - set(explanation.states)
    if missing:
        refuse("Every state that is mentioned must have a record", f"none of state {min(missing)}")
    bare = dict(document) | {"policy": {**document["policy"], "choices": []}}
    _refuse_difference(bare, frame_of(explanation, text) | {"digest": own}, "")
    _refuse_contradictions(explanation)
    return explanation, text


def _refuse_difference(got: Any, wanted: Any, where: str) -> None:
    """Raise where a document differs from what its own data would be written as, naming the first place."""
    if isinstance(got, Mapping) and isinstance(wanted, Mapping) and got.keys() == wanted.keys():
        for key in wanted:
            _refuse_difference(got[key], wanted[key], f"{where}.{key}" if where else str(key))
    elif isinstance(got, list | tuple) and isinstance(wanted, list) and len(got) == len(wanted):
        for i, (one, other) in enumerate(zip(got, wanted, strict=True)):
            _refuse_difference(one, other, f"{where}[{i}]")
    elif got != wanted:
        refuse(f"The document must agree with itself: {where} must be {wanted!r}", repr(got), where=where)


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_constant, object_pairs_hook=_once)
    except OSError as error:
        raise ExplanationError(f"An explanation must be a file that can be read: {path}: {error.strerror}.") from None
    except (ValueError, RecursionError) as error:
        raise ExplanationError(f"An explanation must be a JSON document, {path} is none: {error}.") from None


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no JSON number")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key {key!r} stands there twice")
        found[key] = value
    return found


def _integers(told: Explanation) -> Iterator[tuple[str, object]]:
    """Yield every number that must be whole, with its place."""
    yield "start", told.start
    if told.question.state is not None:
        yield "state", told.question.state
    if told.question.search.horizon is not None:
        yield "search.horizon", told.question.search.horizon
    for name in ("route", "circle", "in_the_way", "size"):
        yield from ((name, number) for number in getattr(told, name))
    yield "circle_size", told.circle_size
    if told.unfolded is not None:
        yield "unfolded.states", told.unfolded.states
        yield "unfolded.memories", told.unfolded.memories
    yield "closing.off_route", told.closing.off_route
    yield "closing.off_route_open", told.closing.off_route_open
    for record in told.states.values():
        yield from (("states", number) for number in record.place or ())
    for step in told.steps:
        yield from (("steps", number) for number in (step.state, step.choice, step.choice_index))
        yield from (("alternatives", other.towards) for other in step.alternatives)
        for claim in step.claims:
            yield "claims", claim.level
            for row in (claim.evidence.taken, *claim.evidence.others):
                yield "claims", row.choice
                if isinstance(row, Tally):
                    yield from (("claims", number) for number in (row.lower, row.upper))
            yield from (("claims", state) for state, _, _ in claim.evidence.follows)
        for judged in (judged for trade in step.trades for judged in trade.judged):
            yield from (("trades", n) for n in (judged.objective, judged.taken.choice, judged.other.choice))


def _refuse_contradictions(told: Explanation) -> None:
    """Raise where parts of a document contradict each other, whatever the model."""
    asked = told.question
    wanted = _kind_of(asked)
    if asked.kind != wanted:
        refuse(f"The kind of this scope and these factors must be '{wanted}'", f"'{asked.kind}'")
    if not 0.0 < asked.tolerance <= LOOSEST:
        refuse(f"The tolerance of comparisons must be above 0 and at most {LOOSEST}", asked.tolerance)
    if asked.rather_than is not None and asked.scope != "state":
        refuse("'rather than' must ask about one state", f"scope '{asked.scope}'")
    if told.outcome not in OUTCOMES:
        refuse("The outcome must be one of the solver's sentences", f"'{told.outcome}'")
    if asked.state is not None and told.start != asked.state:
        refuse(f"The start must be the state asked about, {asked.state}", told.start)
    if asked.scope != "route" and (told.route or told.route_probability is not None or told.arrival is not None):
        refuse("A route must be given only where one was asked for", f"scope '{asked.scope}'")
    for step in told.steps:
        for claim in step.claims:
            names = tuple(row.action for row in claim.evidence.others)
            if claim.against != names:
                refuse(f"'{claim.claim}' must be claimed against the actions of its evidence, {names}", claim.against)
        for trade in step.trades:
            names = (trade.judged[0].other.action,)
            if trade.against != names:
                refuse(f"'{trade.claim}' must be claimed against the action of its evidence, {names}", trade.against)
    _refuse_few(told)


def _refuse_few(told: Explanation) -> None:
    """Raise where what is told in few sentences, or said in detail, does not fit the question and its levels."""
    asked, levels, left = told.question, len(told.levels), told.closing.left_out
    if asked.at_most is not None and asked.scope != "route":
        refuse("A number of sentences must be for a route", f"scope '{asked.scope}'")
    if left is not None and len(left.largest) != levels:
        refuse(f"The largest difference that is left out must be given for {levels} levels", len(left.largest))
    for step in told.steps:
        if step.rank is not None and step.rank.level >= levels:
            refuse(f"A rank must be of one of {levels} levels", step.rank.level, state=step.state)
        if len(step.numbers) > levels or len({len(rows) for rows in step.numbers}) > 1:
            refuse(f"Numbers must be of at most {levels} levels, of the same choices each", len(step.numbers))


def _kind_of(asked: Question) -> str:
    """Return what a combination of scope and factors is called."""
    if asked.rather_than is not None:
        return "rather-than"
    for name, combination in _KINDS.items():
        if combination == (asked.scope, asked.factors):
            return name
    listed = [name for name in ("selectiveness", "constrictiveness", "responsibility") if name in asked.factors]
    return f"{asked.scope}: {', '.join(listed) or 'no factors'}"


def refuse_foreign(told: Explanation, problem: Problem) -> None:
    """Raise where an explanation names states, choices or actions that the model has not, or calls otherwise."""
    mdp, unfolding = problem.mdp, problem.unfolding
    unfolded = None
    if unfolding is not None:
        unfolded = Unfolded(states=unfolding.origin.mdp.states, memories=len(unfolding.left))
    if told.unfolded != unfolded:
        refuse(f"What the model was unfolded from must be {unfolded}", told.unfolded)
    for where, state in _states(told):
        if not 0 <= state < mdp.states:
            refuse(f"A state must be a number from 0 to {mdp.states - 1} at {where}", state, state=state)
    listed = told.policy.rows.state
    foreign = listed[(listed < 0) | (listed >= mdp.states)]
    if len(foreign):
        state = int(foreign[0])
        refuse(f"A state must be a number from 0 to {mdp.states - 1} at policy", state, state=state)
    for state, record in told.states.items():
        place = None if problem.world is None else problem.world.place(state)
        name, named = mdp.names[state], mdp.names.named
        if (record.name, record.named, record.place) != (name, named, place):
            refuse(
                f"State {state} must be called '{name}' at {place}", f"'{record.name}' at {record.place}", state=state
            )
    for step in told.steps:
        _refuse_foreign_step(step, mdp, told.question.rather_than)


def _refuse_foreign_step(step: Step, mdp: MDP, asked: str | None) -> None:
    """Raise where a step names choices or actions that its state has not, or calls otherwise."""
    own = mdp.choices_of(step.state)
    rows: list[Measured | Tally] = []
    for claim in step.claims:
        rows += [claim.evidence.taken, *claim.evidence.others]
    for judged in (judged for trade in step.trades for judged in trade.judged):
        rows += [judged.taken, judged.other]
    for choice, action in [(step.choice, step.action), *((row.choice, row.action) for row in rows)]:
        if choice not in own:
            refuse(f"State {step.state} has the choices {own.start} to {own.stop - 1}", choice, state=step.state)
        if action != mdp.action_name(choice):
            refuse(f"Choice {choice} must be called '{mdp.action_name(choice)}'", f"'{action}'", state=step.state)
    if step.choice_index != step.choice - own.start:
        refuse(f"Choice {step.choice} must be number {step.choice - own.start} of its state", step.choice_index)
    foils = [mdp.action_name(choice) for choice in own if choice != step.choice]
    if step.foil is not None and step.foil not in foils:
        refuse(f"The foil must be another action of state {step.state}, one of {foils}", f"'{step.foil}'")
    if step.foil != asked:
        refuse(f"The foil must be what was asked about, {asked!r}", repr(step.foil))


def _states(told: Explanation) -> Iterator[tuple[str, int]]:
    """Yield every state that is mentioned, with its place in the document."""
    yield "start", told.start
    for name in ("route", "circle", "in_the_way", "states"):
        yield from ((name, state) for state in getattr(told, name))
    for step in told.steps:
        yield "steps", step.state
        yield from (("alternatives", other.towards) for other in step.alternatives)
        for claim in step.claims:
            yield from (("claims", state) for state, _, _ in claim.evidence.follows)


def refuse_retold(told: Explanation, text: str) -> None:
    """Raise where the text is not what the explanation's data say."""
    try:
        own = narrate(told)
    except (InputError, KeyError, ValueError, TypeError, IndexError, AttributeError) as error:
        raise ExplanationError(f"An explanation must be one that can be told: {error}.") from None
    if own != text:
        refuse(f"The text must be what the data say, '{own}'", f"'{text}'")
