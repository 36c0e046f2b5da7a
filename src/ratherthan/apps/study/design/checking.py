"""A design enters, all that is wrong or doubtful with it leaves, each with its place; and what it measures and takes.

A *fault* keeps a study from being served. A *warning* does not: it names what a careful researcher would want to know before
people come. Which of the two something is follows one rule: data that nobody could use, or a page that cannot be shown, is a fault.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from ratherthan.apps.study.design.codebook import Entry, codebook
from ratherthan.apps.study.design.faults import DesignError, Fault, Faults
from ratherthan.apps.study.design.interface import english_texts, left_in_english
from ratherthan.apps.study.design.lines import lines_of
from ratherthan.apps.study.design.nouns import Design, Record
from ratherthan.apps.study.design.orders import rounds, rows_of, unbalanced
from ratherthan.apps.study.design.reading import design_file, read_design
from ratherthan.apps.study.design.screens import screens
from ratherthan.apps.study.design.storing import load_index, same_language, source_path
from ratherthan.apps.study.design.texts import texts_of
from ratherthan.apps.study.design.timing import Duration, duration
from ratherthan.apps.study.pages.wording import FALLBACK

__all__ = ["MEASURES", "Report", "check", "measures"]

MEASURES = ("moves", "critical", "both", "responsibility", "constrictiveness", "neither")
"""What maps are compared by: moves, decisions that matter, and of how many of these which factors are said."""
LIKE = 1.25
"""Sizes are alike up to this ratio."""
SHORT_STUDY = 5.0
"""Minutes: a study that takes as long or longer may reject for two failed checks only (Prolific's rule)."""
GAP = re.compile(r"\[[^\[\]]{3,}\]")
YEARS = re.compile(r"\d+")
ADULT = 18
MOST_PICTURE = 2_000_000
READABLE = 250
"""Words: about a minute."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """What was found.

    Parameters
    ----------
    faults, warnings : tuple of Fault
    design : Design, optional
        None where there are faults.
    codebook : tuple of Entry
    duration : Duration, optional
    measures : dict
        By map, its `MEASURES`.
    """

    faults: tuple[Fault, ...] = ()
    warnings: tuple[Fault, ...] = ()
    design: Design | None = None
    codebook: tuple[Entry, ...] = ()
    duration: Duration | None = None
    measures: dict[str, dict[str, int]] = field(default_factory=dict)


def check(path: str | os.PathLike[str]) -> Report:
    """Return what is wrong or doubtful with a design, and what it measures.

    Parameters
    ----------
    path : path
        The folder of a design, or the file in it.
    """
    try:
        design = read_design(path)
    except DesignError as error:
        return Report(faults=error.faults)
    file = design_file(path)
    shown = screens(design, 0)
    taken = duration(shown)
    noted = Faults(file.name, lines_of(file.read_text(encoding="utf-8-sig")))
    _doubts(design, taken, noted)
    return Report(
        warnings=tuple(noted.found),
        design=design,
        codebook=codebook(design),
        duration=taken,
        measures=measures(design),
    )


def measures(design: Design) -> dict[str, dict[str, int]]:
    """Return the stored measures of each map."""
    index = load_index(design.folder)
    return {one.id: {key: int(index["maps"][one.id]["route"][key]) for key in MEASURES} for one in design.maps}


def _doubts(design: Design, taken: Duration, noted: Faults) -> None:
    """Note everything doubtful."""
    _about_people(design, noted)
    _about_orders(design, noted)
    _about_checks(design, taken, noted)
    _about_texts(design, noted)
    _about_maps(design, noted)
    _about_kinds(design, noted)
    _about_language(design, noted)


def _about_people(design: Design, noted: Faults) -> None:
    if not design.contact:
        noted.add(("contact",), "There is no address for questions: people must be able to reach who runs the study.")
    for number, record in enumerate(design.about_records, 1):
        if _asks_minors(record):
            noted.add(
                ("about", "questions", number),
                f"This lets people under {ADULT} take part. They need the consent of their parents, and most platforms forbid it: ask "
                "your ethics board, and see that the consent does not speak of adults only.",
            )
    codes = {name: code for name, code in vars(design.codes).items() if code}
    for name, code in codes.items():
        same = next((other for other in codes if codes[other] == code and other != name), None)
        if same is not None and name < same:
            noted.add(
                ("codes", name),
                f"'{name}' and '{same}' have the same code: a platform cannot tell these endings apart.",
            )
    if not design.codes.done:
        noted.add(("codes",), "There is no code 'done': a platform cannot tell who has finished.")


def _asks_minors(record: Record) -> bool:
    """Return whether a question about age has an answer under 18."""
    if record.name != "age" and record.unit != "years":
        return False
    if record.type == "number":
        return record.least is None or record.least < ADULT
    years = [int(found[0]) for option in record.options if (found := YEARS.search(str(option.value)))]
    return any(year < ADULT for year in years)


def _about_orders(design: Design, noted: Faults) -> None:
    for key, order, ids in (
        ("kinds", design.kind_order, [kind.id for kind in design.kinds]),
        ("maps", design.map_order, [one.id for one in design.maps]),
    ):
        placed, beside = unbalanced(rows_of(order, ids))
        if placed is not None:
            noted.add(
                ("order", key),
                f"This order is not balanced: '{placed}' does not stand in every place equally often. \"williams\" is.",
            )
        elif beside is not None:
            noted.add(
                ("order", key),
                f"This order is balanced over places, but '{beside}' does not follow each other one equally often. \"williams\" is.",
            )
    size = rounds(design)
    if design.quota % size:
        below, above = design.quota // size * size, (design.quota // size + 1) * size
        near = f"{below} or {above}" if below else f"{above}"
        noted.add(
            ("participants", "quota"),
            f"Kinds and maps are balanced over every {size} people who finish, and {design.quota} is no multiple of it: take {near}.",
        )


def _about_checks(design: Design, taken: Duration, noted: Faults) -> None:
    for number, one in enumerate(design.attention, 1):
        label = next((option.label for option in one.record.options if option.value == one.record.correct), "")
        said = " ".join((one.record.label, *one.page.paragraphs))
        if label and label.casefold() not in said.casefold():
            noted.add(
                ("attention", number, "text"),
                f"The item must say itself what to answer, but '{label}' does not occur in it.",
            )
    if design.attention and design.failed_checks_allowed == 0 and taken.usual >= SHORT_STUDY:
        noted.add(
            ("participants", "failed_checks_allowed"),
            f"Of a study of {SHORT_STUDY:g} minutes or more Prolific lets nobody be rejected for one failed check: allow 1.",
        )
    if design.failed_checks_allowed >= len(design.attention) > 0:
        noted.add(
            ("participants", "failed_checks_allowed"),
            "Nobody can fail more checks than that: the checks have no effect while people take part.",
        )


def _about_texts(design: Design, noted: Faults) -> None:
    """Note gaps that were to be filled in."""
    for place, texts in texts_of(design):
        for text in texts:
            found = GAP.search(text)
            if found:
                noted.add(place, f"Fill in what stands in square brackets, or take it out: {found[0]}.")


def _about_maps(design: Design, noted: Faults) -> None:
    found = measures(design)
    index = load_index(design.folder)["maps"]
    for number, one in enumerate(design.maps, 1):
        path = source_path(Path(), one.source)
        if path is not None and (path.is_absolute() or ".." in PurePath(one.source).parts):
            noted.add(
                ("maps", number, "source"),
                "The map lies outside of the folder of the design: copy it in, so that the study stays whole.",
            )
        outcome = index[one.id]["route"].get("outcome")
        if outcome != "arrives":
            noted.add(("maps", number), f"The route of this map does not arrive anywhere (it is told as: {outcome}).")
        size = design.pictures[one.id].file.stat().st_size
        if size > MOST_PICTURE:
            noted.add(("maps", number), f"The picture of this map has {size / 1e6:.1f} MB: people will wait for it.")
    for key in MEASURES:
        counts = {one.id: found[one.id][key] for one in design.maps}
        low, high = min(counts.values()), max(counts.values())
        if high > low * LIKE and high - low > 1:
            told = ", ".join(f"{name} {count}" for name, count in counts.items())
            noted.add(
                ("maps",),
                f"The maps are not comparable in {_called(key)}: {told}. What differs between maps may be taken for what differs between people.",
            )


def _called(key: str) -> str:
    return {
        "moves": "the moves of the route",
        "critical": "the decisions that matter",
        "both": "the decisions with both reasons",
        "responsibility": "the decisions with the reason of responsibility alone",
        "constrictiveness": "the decisions with the reason of constrictiveness alone",
        "neither": "the decisions without a reason",
    }[key]


def _about_kinds(design: Design, noted: Faults) -> None:
    if all(design.stimuli[one.id, kind.id].text for one in design.maps for kind in design.kinds):
        noted.add(
            ("kinds",),
            "No kind says nothing. In some situations an explanation was worse than none: without that arm you cannot tell.",
        )
    for number, kind in enumerate(design.kinds, 1):
        words = {one.id: design.stimuli[one.id, kind.id].words for one in design.maps}
        low, high = min(words.values()), max(words.values())
        if high > low * LIKE and high - low > 5:
            told = ", ".join(f"{name} {count}" for name, count in words.items())
            noted.add(
                ("kinds", number),
                f"The explanations of this kind are not alike in length on all maps, in words: {told}.",
            )
    for number, one in enumerate(design.maps, 1):
        said: dict[str, str] = {}
        for kind in design.kinds:
            text = design.stimuli[one.id, kind.id].text
            if text in said and text:
                noted.add(
                    ("maps", number),
                    f"On this map '{kind.id}' says the same as '{said[text]}': whoever compares them compares nothing. Take another state or map.",
                )
            said.setdefault(text, kind.id)
    for number, one in enumerate(design.maps, 1):
        long = [kind.id for kind in design.kinds if design.stimuli[one.id, kind.id].words > READABLE]
        if long:
            noted.add(
                ("maps", number),
                f"More than {READABLE} words are read by few people; so long are {', '.join(long)}. Write at_most = 7, or another number of "
                "sentences, at this map, and build.",
            )


def _about_language(design: Design, noted: Faults) -> None:
    """Note what is in another language than the pages: explanations, texts of the design, words of the interface."""
    index = load_index(design.folder)["maps"]
    for number, one in enumerate(design.maps, 1):
        spoken = index[one.id].get("language", "en")
        if same_language(spoken, design.language):
            continue
        left = [kind.id for kind in design.kinds if (s := design.stimuli[one.id, kind.id]).text and not s.by_hand]
        if left:
            noted.add(
                ("maps", number),
                f"The explanations are in '{spoken}', the pages in '{design.language}'. Translate {', '.join(left)} in [translations.{one.id}].",
            )
    if not same_language(design.language, FALLBACK):
        ours = english_texts()
        found = [noted.place(keys).rpartition(": ")[2] for keys, texts in texts_of(design) if ours.intersection(texts)]
        places = dict.fromkeys(found)
        if places:
            noted.add(
                ("language",),
                f"The language is '{design.language}', but there are texts in English at: {', '.join(places)}.",
            )
    words = left_in_english(design.language, design.words)
    if words:
        noted.add(
            ("words",) if design.words else ("language",),
            f"The interface has no words in '{design.language}'. Put yours below [words]; these {len(words)} are in English: {', '.join(words)}.",
        )
