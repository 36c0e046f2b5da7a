"""A design and a slot enter, the screens of one participant leave, in their order: the same ones every time.

The order: consent, instructions, comprehension; then map by map its trials, one per kind, and after them its groupings, with the
attention checks between the trials; at last the questions about the person, and thanks. Two things are drawn by lot, from the seed of
the design and the slot alone: which card of a grouping stands where (balanced over a round as far as it can be), and nothing else.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import random
from collections.abc import Iterator

from ratherthan.apps.study.design.nouns import (
    NEITHER,
    Attention,
    Card,
    Design,
    Grouping,
    Option,
    Page,
    Record,
    Screen,
    StudyMap,
)
from ratherthan.apps.study.design.orders import plan, rounds

__all__ = ["CONSENT", "PREFERRED", "rounds", "screens"]

CONSENT = "consent"
PREFERRED = "preferred"


def screens(design: Design, slot: int) -> tuple[Screen, ...]:
    """Return the screens of the participant in a slot.

    Parameters
    ----------
    design : Design
        With its stimuli.
    slot : int
        From 0: a row of the balanced plan; `rounds` slots are a full round.

    Returns
    -------
    tuple of Screen
        Their ids are unique. The same design and slot always give the same screens.
    """
    if slot < 0:
        raise ValueError(f"Slots are counted from 0, got {slot}.")
    return (*_before(design), *_trials(design, slot), *_after(design))


def _before(design: Design) -> Iterator[Screen]:
    """Yield what comes before the first map."""
    consent = design.consent
    answers = (Option(value="yes", label=consent.agree), Option(value="no", label=consent.decline))
    asked = Record(name=CONSENT, type="choice", label=consent.question, options=answers)
    yield _screen("consent", CONSENT, consent.page, asked)
    for number, page in enumerate(design.instructions, 1):
        yield _screen("instructions", f"instructions-{number}", page)
    if design.comprehension.questions:
        yield _screen("comprehension", "comprehension", design.comprehension.page, *design.comprehension.questions)


def _trials(design: Design, slot: int) -> Iterator[Screen]:
    """Yield the trials and groupings of all maps, the attention checks between them."""
    maps = {one.id: one for one in design.maps}
    checks = {id(check): number for number, check in enumerate(design.attention, 1)}
    done = 0
    for map_place, (chosen, kinds) in enumerate(plan(design, slot), 1):
        for kind_place, kind in enumerate(kinds, 1):
            yield _trial(design, maps[chosen], kind, (map_place, kind_place))
            done += 1
            for check in design.attention:
                if check.after == done:
                    yield _check(check, checks[id(check)])
        for grouping in design.groupings:
            yield _grouping(design, maps[chosen], grouping, (slot, map_place))


def _trial(design: Design, shown: StudyMap, kind: str, places: tuple[int, int]) -> Screen:
    """Return one explanation and the items rated after it."""
    said = design.stimuli[shown.id, kind]
    text = said.text
    return Screen(
        id=f"trial-{shown.id}-{kind}",
        phase="trial",
        title=_said(design.trial.title, shown),
        paragraphs=tuple(_said(one, shown) for one in (design.trial.paragraphs if text else design.trial.without)),
        map=shown.id,
        kind=kind,
        explanation=text,
        records=design.items,
        map_place=places[0],
        kind_place=places[1],
        language=said.language,
    )


def _check(check: Attention, number: int) -> Screen:
    return _screen("attention", f"attention-{number}", check.page, check.record)


def _grouping(design: Design, shown: StudyMap, grouping: Grouping, at: tuple[int, int]) -> Screen:
    """Return the explanations of a map of which one is preferred."""
    slot, map_place = at
    cards = [
        Card(value=kind, text=said.text or " ".join(design.trial.without), language=said.language)
        for kind in _dealt(design, shown.id, grouping, slot)
        for said in (design.stimuli[shown.id, kind],)
    ]
    if grouping.neither is not None:
        cards.append(Card(value=NEITHER, text=grouping.neither))
    asked = Record(
        name=PREFERRED,
        type="choice",
        label=grouping.question,
        options=tuple(Option(value=card.value, label=card.text) for card in cards),
    )
    return Screen(
        id=f"grouping-{shown.id}-{grouping.id}",
        phase="grouping",
        title=_said(grouping.page.title, shown),
        paragraphs=tuple(_said(one, shown) for one in grouping.page.paragraphs),
        map=shown.id,
        cards=tuple(cards),
        records=(asked,),
        map_place=map_place,
        grouping=grouping.id,
    )


def _dealt(design: Design, shown: str, grouping: Grouping, slot: int) -> tuple[str, ...]:
    """Return the kinds of a grouping in the order of their cards.

    The slots of a round are shuffled and take the possible orders in turn, a Latin square of them after the other: so each card
    stands in each place equally often in a round, but for one.
    """
    size, kinds = rounds(design), grouping.kinds
    turn, place = divmod(slot, size)
    slots = list(range(size))
    name = f"{design.seed} {shown} {grouping.id} {turn}"
    random.Random(int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big")).shuffle(slots)
    square, row = divmod(slots[place], len(kinds))
    heads = math.factorial(len(kinds) - 1) if len(kinds) < 6 else 1
    tail = next(itertools.islice(itertools.permutations(kinds[1:]), square % heads, None))
    order = (kinds[0], *tail)
    return order[row:] + order[:row]


def _after(design: Design) -> Iterator[Screen]:
    """Yield what comes after the last map."""
    if design.about_records:
        yield _screen("about", "about-you", design.about, *design.about_records)
    yield _screen("thanks", "thanks", design.thanks)


def _screen(phase: str, name: str, page: Page, *records: Record) -> Screen:
    return Screen(id=name, phase=phase, title=page.title, paragraphs=page.paragraphs, records=records)


def _said(text: str, shown: StudyMap) -> str:
    return text.replace("{map}", shown.title)
