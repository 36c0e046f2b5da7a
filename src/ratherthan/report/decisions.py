"""An Explanation enters, a table of its told decisions leaves: for each what is done, what else could be done, and what they come to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ratherthan.explain.explanation import Measured, Step, Tally
from ratherthan.factors import Interval
from ratherthan.narrate.numbers import percent
from ratherthan.narrate.words import Vocabulary
from ratherthan.report.numbers import Number, counted, lost, measured

__all__ = ["Decision", "Option", "Row", "columns_of", "decision_of", "row_of", "shown"]

Tables = Mapping[str, Mapping[str, str]]
MOST_OPTIONS = 4
"""How many actions of a decision have rows of their own."""


@dataclass(frozen=True, kw_only=True)
class Option:
    """An action in a table: its words, whether it is what is done, and a number for each column, None where there is none."""

    action: str
    taken: bool
    numbers: tuple[Number | None, ...]


@dataclass(frozen=True, kw_only=True)
class Decision:
    """A decision in a table.

    Parameters
    ----------
    number : int
        That of its sentence.
    place : str
    options : tuple of Option
        The one that is taken first.
    more : tuple of Option
        Where there are many, those that have no row of their own.
    """

    number: int
    place: str
    options: tuple[Option, ...]
    more: tuple[Option, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Row:
    """A step in the list of all steps."""

    number: int
    place: str
    action: str
    critical: str
    sentence: int | None


@dataclass
class _Known:
    """What an explanation knows of the actions of a step: numbers by objective and action, and counts."""

    numbers: dict[int, dict[str, Measured]] = field(default_factory=dict)
    counts: dict[str, Tally] = field(default_factory=dict)

    def take(self, level: int, row: Measured | Tally) -> None:
        if isinstance(row, Tally):
            self.counts.setdefault(row.action, row)
        else:
            self.numbers.setdefault(level, {}).setdefault(row.action, row)


def columns_of(words: Vocabulary, tables: Tables) -> list[str]:
    """Return the heads of the columns with numbers.

    Parameters
    ----------
    words : Vocabulary
    tables : mapping
        The words of the page.
    """
    asked, said = words.explanation.question, tables["table"]
    key = "value_omega" if asked.omega else "value_step" if asked.policy_values else "value"
    levels = len(words.explanation.levels)
    heads = [
        _capital(
            (said[key] if place < levels and not wanted.record.chance else "{noun}").format(noun=wanted.words["noun"])
        )
        for place, wanted in enumerate(words.objectives)
    ]
    units = [wanted.words["unit"].strip() for wanted in words.objectives]
    heads = [
        said["in_unit"].format(head=head, unit=unit) if unit else head for head, unit in zip(heads, units, strict=True)
    ]
    twice = {head for head in heads if heads.count(head) > 1}
    heads = [f"{head} {place}" if head in twice else head for place, head in enumerate(heads, 1)]
    return [*heads, said["responsibility"], said["flexibility"]]


def decision_of(words: Vocabulary, tables: Tables, number: int, told: Sequence[int]) -> Decision:
    """Return a decision with all that the explanation knows of its actions.

    Parameters
    ----------
    words : Vocabulary
    tables : mapping
    number : int
        Of its sentence.
    told : sequence of int
        The steps that the sentence tells; the numbers are those of the first.
    """
    step = words.explanation.steps[told[0]]
    known = _known(step, len(words.explanation.levels))
    numbers = _numbers(words, tables, step, known)
    empty = [None] * (len(words.objectives) + 2)
    options = [
        Option(
            action=_done(words, tables, step, action),
            taken=action == step.action,
            numbers=tuple(numbers.get(action, empty)),
        )
        for action in _ordered(words, step, known)
    ]
    few = len(options) <= MOST_OPTIONS + 1
    return Decision(
        number=number,
        place=_where(words, tables, told),
        options=tuple(options if few else options[:MOST_OPTIONS]),
        more=() if few else tuple(options[MOST_OPTIONS:]),
    )


def _ordered(words: Vocabulary, step: Step, known: _Known) -> list[str]:
    """Return the actions of a step: the one taken, the foil, then the others, the better ones first."""
    others = [other.action for other in step.alternatives]
    others += [action for rows in known.numbers.values() for action in rows]
    others += known.counts
    sign = -1.0 if words.objectives[0].record.maximise else 1.0
    first = known.numbers.get(0, {})
    rated = sorted(dict.fromkeys(others), key=lambda a: sign * first[a].number.value if a in first else math.inf)
    return list(dict.fromkeys([step.action, *([] if step.foil is None else [step.foil]), *rated]))


def row_of(words: Vocabulary, tables: Tables, place: int, sentence: int | None) -> Row:
    """Return a step as it stands in the list of all steps."""
    step, said = words.explanation.steps[place], tables["steps"]
    asked = words.explanation.question
    unasked = step.spread is None and step.critical is False and "selectiveness" not in asked.factors
    key = "not_asked" if unasked else {True: "yes", False: "no", None: "open"}[step.critical]
    return Row(
        number=place + 1,
        place=words.place(step.state),
        action=_done(words, tables, step, step.action),
        critical=said[key],
        sentence=sentence,
    )


def _where(words: Vocabulary, tables: Tables, told: Sequence[int]) -> str:
    """Return where a decision is made; of a run the first place."""
    first = words.place(words.explanation.steps[told[0]].state)
    return first if len(told) == 1 else tables["table"]["run"].format(place=first, count=len(told))


def _done(words: Vocabulary, tables: Tables, step: Step, action: str) -> str:
    """Return an action in words, with its share where the plan is not sure of it."""
    said = words.act(action)
    if action != step.action or step.share == 1.0:
        return said
    return f"{said} ({tables['table']['share'].format(percent=percent(step.share))})"


def _known(step: Step, levels: int) -> _Known:
    """Gather what the claims of a step rest on; where details were asked for, numbers of all its actions."""
    known = _Known()
    for level, rows in enumerate(step.numbers):
        for row in rows:
            known.take(level, row)
    for claim in step.claims:
        for found in (claim.evidence.taken, *claim.evidence.others):
            known.take(claim.level, found)
    for trade in step.trades:
        for judged in trade.judged:
            if judged.objective >= levels:  # of the plan's own levels the numbers are those of the claims
                known.take(judged.objective, judged.taken)
                known.take(judged.objective, judged.other)
    return known


def _numbers(words: Vocabulary, tables: Tables, step: Step, known: _Known) -> dict[str, list[Number | None]]:
    """Return the numbers of each action, a column for each objective, its share in the outcome, and what it leaves open."""
    said, columns = tables["numbers"], len(words.objectives)
    spelled = [measured(list(known.numbers.get(place, {}).values()), said) for place in range(columns)]
    decided = {a: row.number for a, row in known.numbers.get(0, {}).items() if _decided(row.number)}
    shares = lost(decided, step.spread[1], said) if step.spread is not None and _decided(step.spread[1]) else {}
    actions = dict.fromkeys([*(action for column in spelled for action in column), *known.counts])
    found: dict[str, list[Number | None]] = {}
    for action in actions:
        tally = known.counts.get(action)
        found[action] = [
            *(column.get(action) for column in spelled),
            (shares[action], "") if action in shares else None,
            None if tally is None else (counted(tally, said), ""),
        ]
    return found


def _decided(number: Interval) -> bool:
    return number.finite or number.infinite


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def shown(decisions: Sequence[Decision]) -> tuple[list[int], bool]:
    """Return which columns of numbers tell something, and whether all actions leave the same choices open everywhere."""
    width = len(decisions[0].options[0].numbers) if decisions else 0
    full = [
        column for column in range(width) if any(o.numbers[column] is not None for d in decisions for o in d.options)
    ]
    last = width - 1
    same = last in full and all(
        len({option.numbers[last] for option in (*decision.options, *decision.more)}) == 1 for decision in decisions
    )
    return ([column for column in full if column != last] if same else full), same
