"""The sections of a design's file enter, the parts of a Design leave: each reads its own keys and notes its own faults."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from ratherthan.apps.study.design.cursor import LONG, LONGEST_ID, MOST_ROWS, SHORT, Cursor, shown, strange
from ratherthan.apps.study.design.nouns import (
    NEITHER,
    Attention,
    Codes,
    Comprehension,
    Consent,
    Grouping,
    Kind,
    Option,
    Order,
    Page,
    Record,
    StudyMap,
    Trial,
)
from ratherthan.apps.study.design.orders import ORDERS
from ratherthan.apps.study.design.storing import scope_of

__all__ = [
    "attention",
    "codes",
    "comprehension",
    "consent",
    "grouping",
    "kind",
    "order",
    "page",
    "record",
    "study_map",
    "trial",
]

TYPES = ("scale", "choice", "number", "text", "flag")
FACTORS = ("selectiveness", "responsibility", "constrictiveness")
MOST_TEXT = 10_000
MOST_SENTENCES = 1000


def page(at: Cursor, *, needed: bool = True) -> Page:
    """Return a title and paragraphs; the cursor may hold more."""
    return Page(title=at.text("title"), paragraphs=at.paragraphs(needed=needed))


def consent(at: Cursor) -> Consent:
    """Return ``[consent]``."""
    found = Consent(page=page(at), question=at.text("question"), agree=at.text("agree"), decline=at.text("decline"))
    at.done()
    return found


def comprehension(at: Cursor) -> Comprehension:
    """Return ``[comprehension]``."""
    questions = tuple(record(row, correct="needed") for row in at.rows("questions", least=0))
    found = Comprehension(page=page(at), questions=questions, attempts=at.whole("attempts", 2, least=1, most=20))
    at.done()
    return found


def attention(at: Cursor) -> Attention:
    """Return one ``[[attention]]``."""
    heading = Page(title=at.text("title"), paragraphs=at.paragraphs(needed=False))
    after = at.whole("after", None, least=1, most=MOST_ROWS * MOST_ROWS)
    return Attention(page=heading, after=after, record=record(at, correct="needed"))


def trial(at: Cursor) -> Trial:
    """Return ``[trial]``."""
    found = Trial(
        title=at.text("title"),
        paragraphs=at.paragraphs(),
        without=at.paragraphs("without"),
        picture=at.text("picture", most=LONG),
    )
    at.done()
    return found


def codes(at: Cursor) -> Codes:
    """Return ``[codes]``."""
    found = {}
    for key in ("done", "screened_out", "no_consent", "failed_checks"):
        code = at.optional(key, most=64)
        if code is not None and not all(c.isascii() and (c.isalnum() or c in "-_") for c in code):
            at.fail(key, f"A code must have only letters, digits, '-' and '_', got {shown(code)}.")
        found[key] = code
    at.done()
    return Codes(**found)


def kind(at: Cursor) -> Kind:
    """Return one ``[[kinds]]``."""
    from ratherthan.explain.question import KINDS

    name, label = at.name(), at.text("label")
    if name == NEITHER:
        at.fail("id", f"The id '{NEITHER}' stands for none of the explanations: take another one.")
    scope, factors, core = None, (), None
    if "scope" in at or "factors" in at:
        if "kind" in at:
            at.fail("kind", "A kind is given either by 'kind' or by 'scope' and 'factors': leave one of them out.")
        at.get("kind")
        scope = at.one_of("scope", ("state", "route"))
        given = at.get("factors") or []
        factors = tuple(given) if isinstance(given, list) and all(isinstance(one, str) for one in given) else ()
        if (given and not factors) or len(set(factors)) < len(factors) or not set(factors) <= set(FACTORS):
            at.fail("factors", f"This must be a list of some of {', '.join(FACTORS)}, each once; got {_listed(given)}.")
            factors = ()
    else:
        core = at.one_of("kind", tuple(KINDS))
        at.get("scope"), at.get("factors")
    at_most = _few(at)
    if at_most is not None and (scope or (core and scope_of(core))) not in ("route", "", None):
        at.fail(
            "at_most", "A number of sentences must be for a kind about a whole route; this one is not: leave it out."
        )
    at.done()
    return Kind(id=name, label=label, kind=core, scope=scope, factors=factors, at_most=at_most)


def _few(at: Cursor) -> int | None:
    """Return how many sentences there may be, None where that is not said."""
    if "at_most" not in at:
        at.get("at_most")
        return None
    return at.whole("at_most", None, least=1, most=MOST_SENTENCES)


def _listed(value: Any) -> str:
    return ", ".join(shown(one) for one in value[:5]) if isinstance(value, list) else shown(value)


def study_map(at: Cursor) -> StudyMap:
    """Return one ``[[maps]]``."""
    found = StudyMap(
        id=at.name(),
        title=at.text("title"),
        source=at.text("source", most=1000),
        property=at.optional("property", most=1000),
        start=_place(at, "start"),
        state=_place(at, "state"),
        picture_text=at.optional("picture_text", most=LONG),
        at_most=_few(at),
    )
    at.done()
    return found


def _place(at: Cursor, key: str) -> str | None:
    """Return a state: a number or a name."""
    value = at.table.get(key)
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 10**12:
        at.get(key)
        return str(value)
    return at.optional(key)


def grouping(at: Cursor, common: Cursor, kinds: Collection[str]) -> Grouping:
    """Return one ``[[groupings]]``; words that it does not have itself are those of ``[grouping]``."""
    name, members = at.name(), at.texts("kinds")
    for number, one in enumerate(members, 1):
        if one and kinds and one not in kinds:
            at.fail(
                f"kinds[{number}]", f"A grouping must name kinds of this study ({', '.join(kinds)}), got {shown(one)}."
            )
    if len(set(members)) < len(members):
        at.fail("kinds", "A grouping must name each kind once.")
    allowed = at.flag("neither", default=True)
    words = {key: at.optional(key, most=SHORT) for key in ("title", "question", "neither_label")}
    paragraphs = at.paragraphs() if "paragraphs" in at else common.paragraphs()
    at.get("paragraphs")
    neither = (words["neither_label"] or common.text("neither")) if allowed else None
    if len(members) + allowed < 2:
        at.fail("kinds", "There must be something to choose from: two kinds, or one and neither = true.")
    at.done()
    return Grouping(
        id=name,
        kinds=members,
        neither=neither,
        page=Page(title=words["title"] or common.text("title"), paragraphs=paragraphs),
        question=words["question"] or common.text("question"),
    )


def order(at: Cursor, key: str, ids: tuple[str, ...]) -> Order:
    """Return an order of ``[order]``: one of its names, or rows of ids."""
    value = at.get(key)
    if not isinstance(value, list):
        return Order(how=at.one_of(key, ORDERS[:-1], "williams"))
    rows = []
    for number, row in enumerate(value, 1):
        if not isinstance(row, list) or sorted(map(str, row)) != sorted(ids):
            at.fail(f"{key}[{number}]", f"A row must list each of {', '.join(ids)} once, got {_listed(row)}.")
        else:
            rows.append(tuple(row))
    if not rows or len(value) > MOST_ROWS**2:
        at.fail(key, f"This must be one of {', '.join(ORDERS[:-1])}, or 1 to {MOST_ROWS**2} rows of ids.")
        return Order(how="fixed")
    return Order(how="rows", rows=tuple(rows))


def record(at: Cursor, *, correct: str = "refused") -> Record:
    """Return one thing to be answered: an item, a question or a check.

    Parameters
    ----------
    at : Cursor
    correct : str
        "needed" or "refused": whether it has a right answer.
    """
    name, label, form = at.name(), at.text("text", most=LONG), at.one_of("type", TYPES, "choice")
    options = _options(at, form)
    least, most = (at.number("least"), at.number("most")) if form == "number" else (None, None)
    if least is not None and most is not None and least > most:
        at.fail("least", f"'least' must not be above 'most', got {least:g} and {most:g}.")
    right = _correct(at, options, needed=correct == "needed")
    found = Record(
        name=name,
        type="choice" if form == "scale" else form,
        label=label,
        unit=at.optional("unit", most=LONGEST_ID) or ("points" if form == "scale" else None),
        options=options,
        least=least,
        most=most,
        longest=at.whole("longest", 2000, least=1, most=MOST_TEXT) if form == "text" else None,
        required=at.flag("required", default=form != "text"),
        correct=right,
    )
    at.done()
    return found


def _correct(at: Cursor, options: tuple[Option, ...], *, needed: bool) -> int | str | None:
    """Return the right answer, one of the options."""
    if not needed:
        return None
    right = at.get("correct")
    values = [option.value for option in options]
    if isinstance(right, bool) or right not in values:
        came = "nothing" if right is None else shown(right)
        at.fail(
            "correct", f"The right answer must be one of {', '.join(map(str, values)) or 'the options'}; got {came}."
        )
        return None
    chosen: int | str = right
    return chosen


def _options(at: Cursor, form: str) -> tuple[Option, ...]:
    """Return the allowed values of a scale or a choice."""
    if form == "scale":
        labels = at.texts("labels")
        points = at.whole("points", max(len(labels), 1), least=1, most=MOST_ROWS)
        if labels and len(labels) != points:
            at.fail("labels", f"A scale must have a label for each of its {points} points, got {len(labels)} labels.")
        if len(set(labels)) < len(labels):
            at.fail("labels", "The labels of a scale must differ: a person could not tell two of its points apart.")
        if points < 2:
            at.fail("points", f"A scale must have at least 2 points, got {points}.")
        return tuple(Option(value=value, label=label) for value, label in enumerate(labels, 1))
    if form != "choice":
        return ()
    found = [_option(at, number, row) for number, row in enumerate(_entries(at), 1)]
    values = [str(option.value) for option in found]
    twice = next((value for place, value in enumerate(values) if value in values[:place]), None)
    if twice is not None:
        at.fail("options", f"The values of options must differ, got '{twice}' twice.")
    return tuple(found)


def _entries(at: Cursor) -> list[Any]:
    value = at.get("options")
    if not isinstance(value, list) or not 1 < len(value) <= MOST_ROWS:
        came = "nothing" if value is None else shown(value)
        at.fail(
            "options", f'A choice must have 2 to {MOST_ROWS} options, {{ value = "…", label = "…" }} each; got {came}.'
        )
        return []
    return value


def _option(at: Cursor, number: int, row: Any) -> Option:
    """Return one option: a table with value and label, or a text that is both."""
    place = Cursor(table={}, keys=at.keys, faults=at.faults)
    if isinstance(row, str):
        row = {"value": row, "label": row}
    if not isinstance(row, dict):
        place.fail(f"options[{number}]", f'An option must be {{ value = "…", label = "…" }}, got {shown(row)}.')
        return Option(value=number, label="")
    inner = Cursor(table=row, keys=(*at.keys, f"options[{number}]"), faults=at.faults)
    value, label = inner.get("value"), inner.text("label")
    whole = isinstance(value, int) and not isinstance(value, bool) and abs(value) < 10**9
    text = isinstance(value, str) and 0 < len(value) <= 100 and not strange(value)
    if not (whole or text):
        inner.fail("value", f"The value of an option must be a short text or a whole number, got {shown(value)}.")
        value = number
    inner.done()
    return Option(value=value.strip() if isinstance(value, str) else value, label=label)
