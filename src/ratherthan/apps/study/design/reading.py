"""A design's file enters, a Design leaves; or all its faults at once, each with its place.

A design is a folder with ``design.toml``, its maps, and its stimuli: the explanations and pictures that `build` computed. Everything
is checked here, before a server starts; what is only doubtful is for `ratherthan.apps.study.design.checking`.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from ratherthan.apps.study.design import parts
from ratherthan.apps.study.design.cursor import LONG, Cursor
from ratherthan.apps.study.design.faults import DesignError, Fault, Faults
from ratherthan.apps.study.design.interface import own_words
from ratherthan.apps.study.design.lines import lines_of
from ratherthan.apps.study.design.nouns import Comprehension, Design, Page, Record
from ratherthan.apps.study.design.screens import CONSENT, PREFERRED
from ratherthan.apps.study.design.storing import Translations, source_path, stored

__all__ = ["FILE", "FORMAT", "LANGUAGE", "LONGEST_TAG", "design_file", "read_design", "read_draft"]

FILE = "design.toml"
FORMAT = 1
MOST_BYTES = 2_000_000
RESERVED = (CONSENT, PREFERRED, "time", "hidden_time")
LONGEST_TAG = 35
LANGUAGE = re.compile(r"[A-Za-z]{2,3}(-[A-Za-z0-9]{2,8})*", re.ASCII)


def design_file(path: str | os.PathLike[str]) -> Path:
    """Return the file of a design: of a folder the ``design.toml`` in it."""
    given = Path(path)
    return given / FILE if given.is_dir() else given


def read_design(path: str | os.PathLike[str]) -> Design:
    """Read a design with its stimuli, ready to be served.

    Parameters
    ----------
    path : path
        Its folder, or the file in it.

    Returns
    -------
    Design

    Raises
    ------
    DesignError
        With all faults: of the file, and of stimuli that are missing, were changed by hand, or belong to an older map.
    """
    draft, translations, faults = _read(design_file(path))
    faults.check()
    design = stored(draft, translations, faults)
    faults.check()
    return replace(design, fingerprint=fingerprint(design))


def read_draft(path: str | os.PathLike[str]) -> tuple[Design, Translations]:
    """Read a design without its stimuli, which are about to be computed; and the explanations written by hand.

    Parameters
    ----------
    path : path

    Raises
    ------
    DesignError
        With all faults of the file.
    """
    draft, translations, faults = _read(design_file(path))
    faults.check()
    return draft, translations


def fingerprint(design: Design) -> str:
    """Return what changes with everything that a participant can see or that is recorded, and with nothing else."""
    plain = asdict(replace(design, folder=Path(), fingerprint="", stimuli={}, pictures={}))
    for key in ("folder", "fingerprint", "quota", "longest_gap", "codes", "stimuli", "pictures"):
        del plain[key]
    texts = [asdict(design.stimuli[key]) for key in sorted(design.stimuli)]
    pictures = [[name, picture.sha256, picture.text] for name, picture in sorted(design.pictures.items())]
    whole = json.dumps([FORMAT, plain, texts, pictures], sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(whole.encode()).hexdigest()[:16]


def _read(path: Path) -> tuple[Design, Translations, Faults]:
    """Read the file; faults of its text are raised, those of what it says are noted."""
    text = _text(path)
    try:
        table = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError) as error:
        raise _refused(path, f"The file must be TOML, but: {_toml_words(str(error))}") from error
    except RecursionError as error:
        raise _refused(path, "The file must be TOML with few levels, got lists nested too deeply.") from error
    faults = Faults(path.name, lines_of(text))
    at = Cursor(table=table, keys=(), faults=faults)
    version = at.get("format")
    if version != FORMAT:
        newer = isinstance(version, int) and version > FORMAT
        hint = "It was made by a newer version of this program: install that." if newer else "Write format = 1."
        raise _refused(path, f"The format of a design must be {FORMAT}, got {version!r:.40}. {hint}")
    design = _design(at, path.parent)
    translations = _translations(at, design)
    at.done()
    _check_names(design, faults)
    _check_places(design, faults)
    return design, translations, faults


def _toml_words(message: str) -> str:
    """Return the parser's complaint with its place in front."""
    found = re.search(r"\s*\(at line (\d+), column (\d+)\)$", message)
    if found is None:
        return f"{message[:200]}."
    return f"{message[: found.start()][:200]}, in line {found[1]}, column {found[2]}. Is a quotation mark or bracket missing there or before?"


def _refused(path: Path, sentence: str) -> DesignError:
    return DesignError([Fault(place=path.name, sentence=sentence)])


def _text(path: Path) -> str:
    """Return the text of the file."""
    if not path.exists():
        raise _refused(
            path, f"There must be a design here, but '{path}' does not exist. 'ratherthan study new FOLDER' makes one."
        )
    try:
        data = path.read_bytes()
    except OSError as error:
        raise _refused(path, f"The file '{path}' must be readable, but the system says: {error.strerror}.") from error
    if len(data) > MOST_BYTES:
        raise _refused(path, f"A design must have at most {MOST_BYTES:,} bytes, got {len(data):,}.")
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise _refused(path, f"A design must be UTF-8 text, but line {line} is not. Save it as UTF-8.") from error


def _design(at: Cursor, folder: Path) -> Design:
    """Return the design of a table, without stimuli."""
    language = at.text("language", "en", most=LONGEST_TAG)
    if language and not LANGUAGE.fullmatch(language):
        at.fail("language", f"A language must be a tag such as en, de or pt-BR, got '{language}'.")
    title, contact, version = at.text("title"), at.text("contact", ""), at.text("version", "1", most=40)
    people = at.below("participants")
    kinds = tuple(parts.kind(row) for row in at.rows("kinds"))
    maps = tuple(parts.study_map(row) for row in at.rows("maps"))
    items = tuple(parts.record(row) for row in at.rows("items"))
    kind_ids, map_ids = tuple(one.id for one in kinds), tuple(one.id for one in maps)
    groupings = at.rows("groupings", least=0)
    common = at.below("grouping") if groupings else None
    at.get("grouping")
    order, about = at.below("order"), at.below("about")
    quota = people.whole("quota", None, least=1)
    gap = people.number("longest_gap", 24.0)
    if gap is not None and not 0 < gap <= 8760:
        people.fail("longest_gap", f"The longest gap must be above 0 and at most 8760 hours, got {gap:g}.")
    found = Design(
        folder=folder,
        fingerprint="",
        title=title,
        language=language,
        contact=contact,
        version=version,
        kinds=kinds,
        maps=maps,
        items=items,
        groupings=() if common is None else tuple(parts.grouping(row, common, kind_ids) for row in groupings),
        consent=parts.consent(at.below("consent")),
        instructions=tuple(_whole_page(row) for row in at.rows("instructions", least=0)),
        comprehension=_comprehension(at),
        attention=tuple(parts.attention(row) for row in at.rows("attention", least=0)),
        trial=parts.trial(at.below("trial")),
        about=parts.page(about, needed=False),
        about_records=tuple(parts.record(row) for row in about.rows("questions", least=0)),
        thanks=_whole_page(at.below("thanks")),
        kind_order=parts.order(order, "kinds", kind_ids),
        map_order=parts.order(order, "maps", map_ids),
        seed=order.whole("seed", 1),
        quota=quota,
        longest_gap=gap or 24.0,
        failed_checks_allowed=people.whole("failed_checks_allowed", 1, most=100),
        codes=parts.codes(at.below("codes") if "codes" in at else Cursor(table={}, keys=("codes",), faults=at.faults)),
        words=own_words(at),
    )
    at.get("codes")
    for section in (people, order, about, common):
        if section is not None:
            section.done()
    return found


def _comprehension(at: Cursor) -> Comprehension:
    if "comprehension" in at:
        return parts.comprehension(at.below("comprehension"))
    at.get("comprehension")
    return Comprehension(page=Page(title="", paragraphs=()), questions=(), attempts=1)


def _whole_page(at: Cursor) -> Page:
    found = parts.page(at)
    at.done()
    return found


def _translations(at: Cursor, design: Design) -> Translations:
    """Return the explanations written by hand: ``[translations.MAP] KIND = "…"``."""
    if "translations" not in at:
        at.get("translations")
        return {}
    table, found = at.below("translations"), {}
    for one in design.maps:
        if one.id not in table:
            table.get(one.id)
            continue
        texts = table.below(one.id)
        for kind in design.kinds:
            text = texts.optional(kind.id, most=LONG * 4)
            if text is not None:
                found[one.id, kind.id] = text
        texts.done()
    table.done()
    return found


def _twice(names: Iterable[str]) -> set[str]:
    return {name for name, count in Counter(names).items() if count > 1 and name}


def _check_names(design: Design, faults: Faults) -> None:
    """Note ids that are there twice."""
    for section, ids in (
        ("kinds", [one.id for one in design.kinds]),
        ("maps", [one.id for one in design.maps]),
        ("groupings", [one.id for one in design.groupings]),
    ):
        for number, name in enumerate(ids, 1):
            if name and name in ids[: number - 1]:
                faults.add((section, number, "id"), f"Ids must differ, but '{name}' is also the id of an entry before.")
    seen: dict[str, str] = dict.fromkeys(RESERVED, "a column of the program's own")
    for keys, one in _records(design):
        if one.name in seen:
            faults.add(
                (*keys, "id"),
                f"Whatever is recorded needs an id of its own, but '{one.name}' is already {seen[one.name]}.",
            )
        elif one.name:
            seen[one.name] = (
                f"the id of {''.join(f'[{key}]' if isinstance(key, int) else f'.{key}' for key in keys)[1:]}"
            )
    screens = [f"{one.id}-{kind.id}" for one in design.maps for kind in design.kinds]
    for name in sorted(
        _twice(screens) - {f"{one}-{kind}" for one in _twice(m.id for m in design.maps) for kind in _ids(design)}
    ):
        if not _twice(_ids(design)):
            faults.add(
                ("maps",),
                f"The ids of maps and kinds together must differ, but '{name}' can be read in two ways: rename one.",
            )


def _ids(design: Design) -> list[str]:
    return [kind.id for kind in design.kinds]


def _records(design: Design) -> list[tuple[tuple[str | int, ...], Record]]:
    """Return everything that is recorded, by where it stands in the file."""
    found: list[tuple[tuple[str | int, ...], Record]] = []

    def add(where: tuple[str, ...], records: Sequence[Record]) -> None:
        found.extend(((*where, number), one) for number, one in enumerate(records, 1))

    add(("items",), design.items)
    add(("comprehension", "questions"), design.comprehension.questions)
    add(("attention",), [check.record for check in design.attention])
    add(("about", "questions"), design.about_records)
    return found


def _check_places(design: Design, faults: Faults) -> None:
    """Note maps that are not there, and checks that stand behind the last trial."""
    trials = len(design.maps) * len(design.kinds)
    for number, check in enumerate(design.attention, 1):
        if check.after > trials > 0:
            faults.add(
                ("attention", number, "after"),
                f"A check stands behind a trial, of which there are {trials}; got {check.after}.",
            )
    for number, one in enumerate(design.maps, 1):
        path = source_path(design.folder, one.source)
        if path is not None and one.source and not path.is_file():
            faults.add(
                ("maps", number, "source"),
                f"There must be a file '{one.source}', seen from the folder of the design; there is none.",
            )
