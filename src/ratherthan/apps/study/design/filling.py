"""What a new study shall be enters, the text of its file leaves: a template with notes, filled in.

The template is data: ``material/design.LANGUAGE.toml``. Its lines ``#: …`` say when what follows them is taken in, ``@…@`` is filled
in. For a language that there is no template of, the English one is taken, with the words of the interface to be translated, too.
"""

from __future__ import annotations

import json
import math
import re
import secrets
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.design.orders import williams
from ratherthan.apps.study.design.reading import FILE
from ratherthan.apps.study.design.storing import same_language
from ratherthan.apps.study.pages.wording import FALLBACK, for_participants, words
from ratherthan.model.world import World

__all__ = ["AGES", "New", "fill", "is_foreign", "languages", "left", "material", "section", "shows"]

SHOWN = {"roads": "urban road", "ground": "open ground"}
"""A kind of place that only such maps have."""
AGES = ("adults", "paper")
ALPHABET = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
DIRECTION = "direction"
FROM_RIGHT = ("ar", "ckb", "dv", "fa", "he", "ps", "sd", "ug", "ur", "yi")
"""Languages that are written from right to left."""


@dataclass(frozen=True, kw_only=True)
class New:
    """What a new study shall be.

    Parameters
    ----------
    maps : tuple of str
        Sources as `ratherthan.read` takes them; none: the three maps that come with the program.
    kinds : tuple of str
        Some of the seven; none: all.
    language : str
        Of the pages; in one that the texts are not there in they are English, to be translated.
    ages : str
        "adults", or "paper" for the paper's bands, which begin at 0.
    quota : int, optional
        Two rounds of the plan where none is given.
    property, start : str, optional
        For all maps.
    drive : mapping
        What was asked of a robot on maps of cells.
    at_most : int, optional
        How many sentences about moves the kinds about a whole route may have, on all maps.
    """

    maps: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    language: str = "en"
    ages: str = "adults"
    quota: int | None = None
    property: str | None = None
    start: str | None = None
    drive: Mapping[str, Any] = field(default_factory=dict)
    at_most: int | None = None


def languages() -> tuple[str, ...]:
    """Return the languages that the texts of a study are there in."""
    names = sorted(entry.name for entry in material().iterdir())
    return tuple(name.split(".")[1] for name in names if name.startswith("design.") and name.endswith(".toml"))


def texts_in(language: str) -> str:
    """Return which of the languages of the texts a study in some language begins with."""
    return next((one for one in languages() if same_language(one, language)), FALLBACK)


def is_foreign(language: str) -> bool:
    """Return whether the texts are to be translated."""
    return not same_language(texts_in(language), language)


def material() -> Traversable:
    """Return the folder of what comes with the program: templates and maps."""
    return resources.files("ratherthan.apps.study.design") / "material"


def section(number: int, title: str, source: str, wanted: New, *, start: str | None = None) -> str:
    """Return the section of a map."""
    rows = ["[[maps]]", f'id = "m{number}"', f"title = {quoted(title)}", f"source = {quoted(source)}"]
    if wanted.property is not None:
        rows.append(f"property = {quoted(wanted.property)}")
    if start is not None:
        rows.append(f"start = {quoted(start)}")
    if wanted.at_most is not None:
        rows.append(f"at_most = {wanted.at_most}")
    return "\n".join(rows) + "\n"


def quoted(text: str) -> str:
    """Return a text as TOML writes it."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


def left(design: Design) -> str:
    """Return the explanations that are not in the language of the pages, as notes to be made into translations."""
    rows = []
    for one in design.maps:
        said = {kind.id: design.stimuli[one.id, kind.id] for kind in design.kinds}
        rows += [f"# [translations.{one.id}]"]
        rows += [f"# {kind} = {quoted(stimulus.text)}" for kind, stimulus in said.items() if stimulus.language]
        rows += [""]
    return "\n".join(rows[:-1])


def _words(language: str) -> str:
    """Return the words of the interface for participants, as they are there."""
    found = {**words(language), DIRECTION: "rtl" if language.casefold().split("-")[0] in FROM_RIGHT else "ltr"}
    return "\n".join(f"{key} = {quoted(found[key])}" for key in (DIRECTION, *for_participants()))


def shows(worlds: Sequence[World | None]) -> str:
    """Return what all of some maps show: "roads" as road maps do, "ground" as maps of cells do, else "other"."""
    kinds = [frozenset() if world is None else frozenset(world.kinds) for world in worlds]
    return next((name for name, kind in SHOWN.items() if all(kind in one for one in kinds)), "other")


def fill(folder: Path, wanted: New, sections: Sequence[str], found: Mapping[str, str]) -> None:
    """Write the file of a study, with what was found out about it."""
    from ratherthan.explain.question import KINDS

    kinds = wanted.kinds or tuple(KINDS)
    trials = len(sections) * len(kinds)
    template = (material() / f"design.{texts_in(wanted.language)}.toml").read_text(encoding="utf-8")
    facts = {
        "kinds": kinds,
        "ages": wanted.ages,
        "trials": trials,
        "shows": found["shows"],
        "foreign": is_foreign(wanted.language),
        "translate": bool(found["translations"]) and not same_language(wanted.language, FALLBACK),
    }
    values = {
        **found,
        "language": quoted(wanted.language),
        "words": _words(wanted.language),
        "round": str(math.lcm(len(williams(len(kinds))), len(williams(len(sections))))),
        "maps": "\n".join(sections),
        "after_1": str(max(1, round(0.3 * trials))),
        "after_2": str(max(2, round(0.75 * trials))),
        **{f"code_{key}": code for key, code in _codes().items()},
    }
    text = "".join(_kept(template.splitlines(keepends=True), facts))
    text = re.sub(r"@([a-z_0-9]+)@", lambda found: values[found[1]], text)
    (folder / FILE).write_text(text, encoding="utf-8")


def _codes() -> dict[str, str]:
    """Return codes drawn by lot, all different."""
    found: dict[str, str] = {}
    for key in ("done", "screened_out", "no_consent", "failed_checks"):
        code = ""
        while not code or code in found.values():
            code = "".join(secrets.choice(ALPHABET) for _ in range(8))
        found[key] = code
    return found


def _kept(lines: Iterable[str], facts: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a template whose condition holds; a condition stands on a line ``#: …`` and holds until the next one."""
    holds = True
    for line in lines:
        if line.startswith("#: "):
            holds = _holds(line[3:].split(), facts)
        elif holds:
            yield line


def _holds(condition: Sequence[str], facts: Mapping[str, Any]) -> bool:
    """Return whether a condition holds.

    always; kind and kinds: those are asked for; ages; checks N: there are so many trials; foreign: the texts are to be translated;
    translate: explanations are; shows: the maps show one of these.
    """
    key, words = condition[0], condition[1:]
    if key in ("kind", "kinds"):
        return set(words) <= set(facts["kinds"])
    if key == "shows":
        return facts[key] in words
    if key in ("foreign", "translate"):
        return bool(facts[key])
    if key == "ages":
        return words == [facts["ages"]]
    return key == "always" or (key == "checks" and facts["trials"] > int(words[0]))
