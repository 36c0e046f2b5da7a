"""Stimuli enter a folder and come back as they were: the explanations, pictures and measures that `stimuli` computed once.

``stimuli/stimuli.json`` holds, for each map, what it was computed from (the bytes of the map's file, what was asked of it), the route's
measures, and for each kind the text with its size. Each text and each map bears a seal, a hash of what it says: whatever was changed
by hand is found, and so is a stimulus whose map or kind has changed since. Nobody is shown a text that the core did not say, unless the
design's own section ``[translations]`` says it.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ratherthan.apps.study.design.faults import Faults
from ratherthan.apps.study.design.nouns import Design, Kind, Picture, Stimulus, StudyMap

__all__ = [
    "FOLDER",
    "INDEX",
    "Translations",
    "asked_of_kind",
    "asked_of_map",
    "few",
    "load_index",
    "same_language",
    "scope_of",
    "sealed",
    "size_of",
    "source_hash",
    "source_path",
    "stored",
]

Translations = Mapping[tuple[str, str], str]
FOLDER = "stimuli"
INDEX = "stimuli.json"
FORMAT = 1
MOST_PLACES = 60
"""Of a longer route, what is said in place of the picture names the first places and the last."""
PREFIXES = ("example:", "gym:")
SENTENCE = re.compile(r"[.!?…。！？]+(?=\s|$)")
BUILD = "'ratherthan study build' computes them."


def source_path(folder: Path, source: str) -> Path | None:
    """Return the file of a source, None where it is none: an example, an environment."""
    return None if source.startswith(PREFIXES) else folder / source


def source_hash(folder: Path, source: str) -> str | None:
    """Return the hash of a source's bytes, None where it is no file or cannot be read."""
    path = source_path(folder, source)
    if path is None or not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def size_of(text: str) -> tuple[int, int]:
    """Return how many words and sentences a text has.

    Examples
    --------
    >>> size_of("We move east at grid 10. All other decisions result in equivalent routes.")
    (13, 2)
    """
    words = text.split()
    return len(words), max(len(SENTENCE.findall(text)), 1 if words else 0)


def same_language(one: str, other: str) -> bool:
    """Return whether two tags are of one language, whatever the country."""
    return one.split("-", maxsplit=1)[0].casefold() == other.split("-", maxsplit=1)[0].casefold()


def asked_of_map(one: StudyMap, language: str) -> dict[str, Any]:
    """Return what is asked of a map, beside its source; `language` is that of the pages. The picture bears the title."""
    asked = {"source": one.source, "property": one.property, "start": one.start, "language": language}
    return asked | {"title": one.title}


def asked_of_kind(one: StudyMap, kind: Kind) -> dict[str, Any]:
    """Return what is asked of a kind on a map."""
    asked = {"kind": kind.kind, "scope": kind.scope, "factors": list(kind.factors)}
    sentences = few(one, kind)
    return asked | {"state": one.state} | ({} if sentences is None else {"at_most": sentences})


def few(one: StudyMap, kind: Kind) -> int | None:
    """Return how many sentences about moves a kind may have on a map, None where that is not bounded: the kind's own number goes first."""
    scope = kind.scope if kind.kind is None else scope_of(kind.kind)
    if scope != "route":
        return None
    return one.at_most if kind.at_most is None else kind.at_most


def scope_of(kind: str) -> str:
    """Return what one of the core's kinds explains: "state", "route" or "none"."""
    from ratherthan.explain.question import KINDS

    return KINDS[kind][0]


def sealed(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table with the seal of what it says (but of the texts below it, which have their own)."""
    plain = {key: value for key, value in table.items() if key not in ("seal", "texts")}
    text = json.dumps(plain, sort_keys=True, ensure_ascii=False)
    return {**table, "seal": hashlib.sha256(text.encode()).hexdigest()[:16]}


def load_index(folder: Path) -> Any:
    """Return what ``stimuli.json`` holds, None where there is none or it is no JSON."""
    try:
        return json.loads((folder / FOLDER / INDEX).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None


def stored(draft: Design, translations: Translations, faults: Faults) -> Design:
    """Return a design with its stored stimuli; what is missing, changed by hand or out of date is noted as faults.

    Parameters
    ----------
    draft : Design
    translations : mapping
        Texts written by hand, which are shown in place of the stored ones.
    faults : Faults
    """
    index = load_index(draft.folder)
    reading = _Reading(draft, translations, Faults(f"{FOLDER}/{INDEX}"))
    if not (draft.folder / FOLDER / INDEX).is_file():
        reading.faults.add((), f"The explanations and pictures are not there yet. {BUILD}")
    elif not isinstance(index, dict) or index.get("format") != FORMAT or not isinstance(index.get("maps"), dict):
        reading.faults.add((), f"This must be a table of stimuli of format {FORMAT}, and it is not. {BUILD}")
    else:
        for one in draft.maps:
            reading.map(one, index["maps"].get(one.id))
    faults.found += reading.faults.found
    return replace(draft, stimuli=reading.stimuli, pictures=reading.pictures)


class _Reading:
    """What was read so far."""

    def __init__(self, draft: Design, translations: Translations, faults: Faults) -> None:
        self.draft, self.translations, self.faults = draft, translations, faults
        self.stimuli: dict[tuple[str, str], Stimulus] = {}
        self.pictures: dict[str, Picture] = {}

    def map(self, one: StudyMap, entry: Any) -> None:
        """Read the stimuli of one map."""
        if not isinstance(entry, dict) or not isinstance(entry.get("texts"), dict):
            self.faults.add(("maps", one.id), f"The explanations of this map are not there yet. {BUILD}")
            return
        if sealed(entry)["seal"] != entry.get("seal"):
            self.faults.add(("maps", one.id), f"This was changed by hand; stimuli are served as computed. {BUILD}")
            return
        now = source_hash(self.draft.folder, one.source)
        if entry.get("asked") != asked_of_map(one, self.draft.language) or (
            now is not None and entry.get("sha256") != now
        ):
            self.faults.add(("maps", one.id), f"The map, or what is asked of it, has changed since. {BUILD}")
        self._picture(one, entry["picture"])
        for kind in self.draft.kinds:
            self._text(one, kind, entry["texts"].get(kind.id), str(entry.get("language", "en")))

    def _picture(self, one: StudyMap, entry: Mapping[str, Any]) -> None:
        file = self.draft.folder / FOLDER / f"{one.id}.svg"
        found = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else None
        if found is None or found != entry["sha256"]:
            what = "was changed by hand; pictures are served as computed" if found else "is missing"
            self.faults.add(("maps", one.id), f"Its picture '{FOLDER}/{file.name}' {what}. {BUILD}")
            return
        self.pictures[one.id] = Picture(
            map=one.id,
            file=file,
            sha256=found,
            text=_spoken(one.picture_text or self.draft.trial.picture, one, entry["places"]),
            width=float(entry["width"]),
            height=float(entry["height"]),
        )

    def _text(self, one: StudyMap, kind: Kind, entry: Any, spoken: str) -> None:
        place = ("maps", one.id, "texts", kind.id)
        if not isinstance(entry, dict):
            self.faults.add(place, f"This explanation is not there yet. {BUILD}")
            return
        if sealed(entry)["seal"] != entry.get("seal"):
            hint = f"Write your own words into [translations.{one.id}] of the design."
            self.faults.add(place, f"This text was changed by hand; explanations are served as computed. {hint}")
            return
        if entry["asked"] != asked_of_kind(one, kind):
            self.faults.add(place, f"The kind, or the state it explains, has changed since. {BUILD}")
        by_hand = (one.id, kind.id) in self.translations
        text = self.translations.get((one.id, kind.id), entry["text"])
        words, sentences = size_of(text)
        self.stimuli[one.id, kind.id] = Stimulus(
            map=one.id,
            kind=kind.id,
            text=text,
            words=words,
            sentences=sentences,
            steps=int(entry["steps"]),
            by_hand=by_hand,
            language=None if by_hand or not text or same_language(spoken, self.draft.language) else spoken,
        )


def _spoken(template: str, one: StudyMap, places: Sequence[str]) -> str:
    """Return what is said in place of a picture."""
    moves = str(max(len(places) - 1, 0))
    told = [*places[: MOST_PLACES - 1], "…", places[-1]] if len(places) > MOST_PLACES else places
    return template.replace("{map}", one.title).replace("{moves}", moves).replace("{places}", ", ".join(told))
