"""A design enters, all that people read in it leaves (but for explanations), by where it stands in its file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ratherthan.apps.study.design.nouns import Design, Page, Record

__all__ = ["texts_of"]


def texts_of(design: Design) -> Iterator[tuple[tuple[str | int, ...], tuple[str, ...]]]:
    """Yield what people read, by where it stands."""
    consent = design.consent
    yield ("title",), (design.title,)
    yield ("consent",), (*_said(consent.page), consent.question, consent.agree, consent.decline)
    for number, page in enumerate(design.instructions, 1):
        yield ("instructions", number), _said(page)
    yield ("comprehension",), _said(design.comprehension.page)
    yield from _asked(("comprehension", "questions"), design.comprehension.questions)
    yield ("trial",), (design.trial.title, *design.trial.paragraphs, *design.trial.without, design.trial.picture)
    yield from _asked(("items",), design.items)
    for number, check in enumerate(design.attention, 1):
        yield ("attention", number), _said(check.page)
    yield from _asked(("attention",), [check.record for check in design.attention])
    for number, group in enumerate(design.groupings, 1):
        yield ("groupings", number), (*_said(group.page), group.question, *([group.neither] if group.neither else []))
    yield ("about",), _said(design.about)
    yield from _asked(("about", "questions"), design.about_records)
    yield ("thanks",), _said(design.thanks)


def _said(page: Page) -> tuple[str, ...]:
    return (page.title, *page.paragraphs)


def _asked(
    place: tuple[str, ...], records: Sequence[Record]
) -> Iterator[tuple[tuple[str | int, ...], tuple[str, ...]]]:
    """Yield what is asked, with what can be answered."""
    for number, record in enumerate(records, 1):
        yield (*place, number), (record.label, *(option.label for option in record.options))
