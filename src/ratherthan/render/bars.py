"""A Solution and a state enter, bars of the three factors for each of its actions leave: value, share in the outcome, decisions left open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ratherthan.errors import QuestionError
from ratherthan.explain.measures import Factors
from ratherthan.explain.question import question
from ratherthan.render.canvas import Canvas, Picture, cut, text_width
from ratherthan.render.ground import pattern_of
from ratherthan.render.legend import Entry, swatch
from ratherthan.render.palette import INK, NEVER, QUIET, ROUTE, Look
from ratherthan.render.sheet import Sheet, sheet
from ratherthan.render.wording import amount, state_words, words
from ratherthan.solve.solution import Solution

__all__ = ["draw_factors"]

ROW, HEAD, BAR, GAP = 30.0, 30.0, 130.0, 84.0
SIZE = 13.0
WIDEST = 240.0
MOST_ROWS = 30
TAKEN, OTHER = Look(fill=ROUTE), Look(fill="#c9d6e2", pattern="stripes", ink="#8da2b5")


@dataclass(frozen=True, kw_only=True)
class _Row:
    """An action with its numbers; None where one is not decided."""

    action: str
    taken: bool
    numbers: tuple[float, float, float | None]


def draw_factors(solution: Solution, state: int) -> Picture:
    """Return the picture of the factors of each action of a state.

    Parameters
    ----------
    solution : Solution
    state : int

    Raises
    ------
    QuestionError
        If the model has no such state.
    """
    mdp, lexicon = solution.problem.mdp, solution.problem.lexicon
    if not 0 <= state < mdp.states:
        raise QuestionError(f"A state must be a number from 0 to {mdp.states - 1}, got {state}.", state=state)
    table = words(lexicon.language)["chart"]
    rows = _rows(solution, state)
    shown = rows[:MOST_ROWS]
    label = min(WIDEST, max(text_width(row.action, SIZE) for row in shown)) + 24.0
    place = state_words(lexicon, state, mdp.names[state], named=mdp.names.named)
    spoken = "; ".join(
        table["row"].format(
            action=row.action,
            value=_said(row.numbers[0], table),
            share=_said(row.numbers[1], table),
            count=_said(row.numbers[2], table),
        )
        for row in shown
    )
    entries = [Entry(words=table["taken"], sample=swatch(TAKEN, pattern_of))]
    if len(rows) > 1:
        entries.append(Entry(words=table["other"], sample=swatch(OTHER, pattern_of)))
    if any(number is not None and math.isinf(number) for row in shown for number in row.numbers):
        entries.append(Entry(words=table["infinite"], sample=swatch(NEVER, pattern_of)))
    caption = table["more"].format(count=len(rows) - MOST_ROWS) if len(rows) > MOST_ROWS else ""
    text = Sheet(
        title=table["title"].format(place=place),
        description=table["description"].format(count=len(rows), rows=spoken),
        caption=caption,
        entries=entries,
    )
    body = sheet(text, label + 3 * BAR + 2 * GAP + 60.0, HEAD + ROW * len(shown) + 4.0)
    _draw(body.canvas, (body.x, body.y), label, shown, [table[key] for key in ("value", "share", "count")])
    return body.canvas.picture()


def _rows(solution: Solution, state: int) -> list[_Row]:
    """Return the actions of a state with their numbers."""
    mdp = solution.problem.mdp
    factors = Factors(solution=solution, asked=question("contrastive"))
    measures, own = factors.levels[0], mdp.choices_of(state)
    counts = factors.counts(own)
    weights = solution.policy.chance
    found = []
    for choice in own:
        taken = int(solution.policy.choice[state]) == choice if weights is None else bool(weights[choice] > 0)
        numbers = (float(measures.action_value[choice]), float(measures.responsibility[choice]), counts[choice].count)
        found.append(_Row(action=mdp.action_name(choice), taken=taken, numbers=numbers))
    return found


def _said(number: float | None, table: dict[str, str] | object) -> str:
    if number is None:
        assert isinstance(table, dict)
        return str(table["unknown"])
    return amount(number)


def _draw(
    canvas: Canvas, corner: tuple[float, float], label: float, rows: Sequence[_Row], heads: Sequence[str]
) -> None:
    """Draw three columns of bars with their numbers."""
    left, top = corner
    for row, one in enumerate(rows):
        y = top + HEAD + (row + 0.5) * ROW
        weight = "bold" if one.taken else None
        canvas.text(left, y + 0.36 * SIZE, cut(one.action, label - 16.0, SIZE), size=SIZE, font_weight=weight)
    for column, head in enumerate(heads):
        x = left + label + column * (BAR + GAP)
        canvas.text(x, top + 0.8 * SIZE, cut(head, BAR + GAP - 10.0, SIZE), size=SIZE, fill=QUIET)
        numbers = [row.numbers[column] for row in rows]
        finite = [number for number in numbers if number is not None and math.isfinite(number)]
        low, high = min([0.0, *finite]), max([0.0, *finite])
        unit = BAR / (high - low) if high > low else 0.0
        zero = x - low * unit
        for row, number in enumerate(numbers):
            y = top + HEAD + (row + 0.5) * ROW
            look = TAKEN if rows[row].taken else OTHER
            end = zero
            if number is not None and math.isinf(number):
                _bar(canvas, x, y, BAR, NEVER)
                end = x + BAR
            elif number is not None:
                _bar(canvas, min(zero, zero + number * unit), y, abs(number) * unit, look)
                end = max(zero, zero + number * unit)
            said = "?" if number is None else amount(number)
            canvas.text(end + 6.0, y + 0.36 * SIZE, said, size=SIZE)
        canvas.path([(zero, top + HEAD), (zero, top + HEAD + ROW * len(rows))], stroke=INK, stroke_width=1.0)


def _bar(canvas: Canvas, x: float, y: float, length: float, look: Look) -> None:
    for fill in (look.fill, None if (name := pattern_of(canvas, look)) is None else f"url(#{name})"):
        if fill is not None and length > 0.0:
            canvas.rect(x, y - 8.0, length, 16.0, fill=fill, stroke=QUIET, stroke_width=0.5)
