"""Maps and wishes enter, the folder of a new study leaves: its file with notes that explain each part, its maps, and its stimuli.

Without maps it is the study of Chen, Boggess and Feng (2020, arXiv 2003.07425) on three road maps that come with the program.
"""

from __future__ import annotations

import re
import secrets
import shlex
import shutil
from collections.abc import Callable
from importlib import resources
from pathlib import Path

from ratherthan.apps.study.design.cursor import near
from ratherthan.apps.study.design.filling import New, fill, is_foreign, languages, left, material, section, shows
from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.design.orders import rounds
from ratherthan.apps.study.design.reading import FILE, LANGUAGE, LONGEST_TAG, read_design, read_draft
from ratherthan.apps.study.design.screens import screens
from ratherthan.apps.study.design.stimuli import build
from ratherthan.apps.study.design.timing import duration
from ratherthan.errors import QuestionError, SourceError
from ratherthan.model.world import World

__all__ = ["New", "languages", "new_study", "next_steps"]

MAPS = "maps"
ROADMAP = ".roadmap"
EXAMPLE = "example:"
OURS = ("ashbrook", "birchfield", "cedarton")
ROUNDS = 2
"""How many rounds of the plan the quota is where none is given: 84 people in the paper's design."""


def new_study(folder: Path, wanted: New, *, tell: Callable[[str], None] | None = None) -> Design:
    """Make the folder of a new study.

    Parameters
    ----------
    folder : Path
        Must not exist, or be empty.
    wanted : New
    tell : callable, optional
        Called with the title of each map before it is computed.

    Returns
    -------
    Design

    Raises
    ------
    InputError
        Where the folder is in use, a kind, language or map is none, or a map has nothing to explain. Then there is no folder.
    """
    _check(folder, wanted)
    whole = folder.resolve()
    made = whole.with_name(f".{whole.name[:80]}.{secrets.token_hex(6)}.part")
    try:
        (made / MAPS).mkdir(parents=True)
        sections, shown = _maps(made / MAPS, wanted)
        found = {"shows": shown, "quota": str(wanted.quota or 1), "minutes": "1", "translations": ""}
        fill(made, wanted, sections, found)
        build(made, tell=tell)
        draft, _ = read_draft(made)
        size = rounds(draft)
        design = read_design(made)
        minutes = -(-duration(screens(design, 0)).usual // 5) * 5
        found |= {
            "quota": str(wanted.quota or ROUNDS * size),
            "minutes": str(int(minutes)),
            "translations": left(design),
        }
        fill(made, wanted, sections, found)
        if whole.is_dir():  # it may be where the person is
            for entry in made.iterdir():
                entry.replace(whole / entry.name)
        else:
            made.replace(whole)
    except OSError as error:
        raise SourceError(
            f"The folder '{folder}' must be writable, but the system says: {error.strerror}.", path=str(folder)
        ) from error
    finally:
        shutil.rmtree(made, ignore_errors=True)
    return read_design(folder)


def next_steps(folder: str, wanted: New) -> tuple[str, ...]:
    """Return what is said when a study is made: where it is, and what to do with it."""
    own = (
        ("Give its maps titles that people understand, and make the instructions fit them: 'check' names the places.",)
        if wanted.maps
        else ()
    )
    foreign = (
        (
            f"Its texts are English, for you to translate into '{wanted.language}': also the words of buttons, at its end.",
        )
        if is_foreign(wanted.language)
        else ()
    )
    name = shlex.quote(folder)
    return (
        f"Made {folder}. Open {Path(folder) / FILE} with any editor: it says all of the study, with notes on each part.",
        *foreign,
        *own,
        f"  ratherthan study check {name}    what is still to be filled in, what is recorded, how long it takes",
        f"  ratherthan study build {name}    after maps or kinds were changed",
        f"  ratherthan study serve {name}    starts it",
    )


def _check(folder: Path, wanted: New) -> None:
    """Refuse what cannot become a study, before anything is computed."""
    from ratherthan.explain.question import KINDS

    if "\0" in str(folder):
        raise SourceError("The name of a folder must have no NUL character.", path=str(folder))
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise SourceError(
            f"A new study needs a folder of its own, but '{folder}' is there already. Give another name.",
            path=str(folder),
        )
    if not folder.absolute().parent.is_dir():
        raise SourceError(
            f"A new study needs a folder to stand in, but there is no '{folder.parent}'.", path=str(folder)
        )
    for kind in wanted.kinds:
        if kind not in KINDS:
            raise QuestionError(
                f"The kinds must be among {', '.join(KINDS)}; got '{kind}'.{near(kind, KINDS)}", kind=kind
            )
    if len(set(wanted.kinds)) < len(wanted.kinds):
        raise QuestionError("Each kind must be given once.")
    if not LANGUAGE.fullmatch(wanted.language) or len(wanted.language) > LONGEST_TAG:
        raise QuestionError(
            f"A language must be a tag such as en, de or pt-BR, got '{wanted.language[:40]}'. The texts of a study are there in "
            f"{', '.join(languages())}; for others they are English, for you to translate."
        )
    if wanted.at_most is not None and wanted.at_most < 1:
        raise QuestionError(f"There may be at most N sentences, N a whole number from 1 on; got {wanted.at_most}.")


def _maps(folder: Path, wanted: New) -> tuple[list[str], str]:
    """Bring the maps into the folder, and return their sections of the file, and what they show."""
    if not wanted.maps:
        for name in OURS:
            text = (material() / MAPS / f"{name}{ROADMAP}").read_bytes()
            (folder / f"{name}{ROADMAP}").write_bytes(text)
        rows = [section(number, name.title(), f"{MAPS}/{name}{ROADMAP}", wanted) for number, name in enumerate(OURS, 1)]
        return rows, "paper"
    taken: set[str] = set()
    found = [_brought(folder, number, source, taken, wanted) for number, source in enumerate(wanted.maps, 1)]
    return [row for row, _ in found], shows([world for _, world in found])


def _brought(folder: Path, number: int, source: str, taken: set[str], wanted: New) -> tuple[str, World | None]:
    """Bring one map into the folder: a road map as it is, everything else as an archive that needs no other files."""
    from ratherthan.io import read, write

    stem = _stem(source, taken)
    text = _roadmap_text(source)
    if text is not None:
        problem = read(source, **wanted.drive)
        (folder / f"{stem}{ROADMAP}").write_bytes(text)
        name = f"{stem}{ROADMAP}"
    else:
        given = () if wanted.property is None else (wanted.property,)
        problem = read(source, start=wanted.start, properties=given, **wanted.drive)
        name = f"{stem}.umb"
        write(problem, folder / name)
    world = problem.world
    title = (world.title if world is not None else "") or stem.replace("-", " ").capitalize()
    start = wanted.start if text is not None else None
    return section(number, title[:200], f"{MAPS}/{name}", wanted, start=start), world


def _stem(source: str, taken: set[str]) -> str:
    """Return a name for the file of a map, which no other map has."""
    bare = (
        source.split(":", 1)[1].split(",", maxsplit=1)[0]
        if source.startswith((EXAMPLE, "gym:"))
        else Path(source).name.split(".")[0]
    )
    name = re.sub(r"[^a-z0-9]+", "-", bare.casefold()).strip("-")[:40] or "map"
    stem, number = name, 1
    while stem in taken:
        number += 1
        stem = f"{name}-{number}"
    taken.add(stem)
    return stem


def _roadmap_text(source: str) -> bytes | None:
    """Return the bytes of a road map, None for all else."""
    if source.startswith(EXAMPLE):
        entry = resources.files("ratherthan.io") / "example_data" / f"{source.removeprefix(EXAMPLE)}{ROADMAP}"
        return entry.read_bytes() if entry.is_file() else None
    path = Path(source)
    return path.read_bytes() if path.suffix == ROADMAP and path.is_file() else None
