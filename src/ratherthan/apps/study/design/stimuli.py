"""A design's maps and kinds enter, their explanations and pictures leave: computed once by the core, and stored with the design.

All kinds of a map are shown with the same picture: the map with its route, drawn without the marks and numbers of decisions, which
would give away what only some of the explanations say. Where the pages are in another language than the core speaks, the picture has no
title, caption and legend: the instructions say what is to be seen.

The kinds that explain one step explain it at one state of the route, the same for all of them. Where the design names none, it is the
first state of the route whose step has the most to say: where the step is the best one and keeps the future the most flexible, if
there is such a state, so that what is said of it differs between these kinds.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ratherthan.apps.study.design.faults import DesignError, Fault
from ratherthan.apps.study.design.nouns import Design, Kind, StudyMap
from ratherthan.apps.study.design.reading import FILE, read_draft
from ratherthan.apps.study.design.storing import (
    FOLDER,
    FORMAT,
    INDEX,
    asked_of_kind,
    asked_of_map,
    few,
    load_index,
    same_language,
    sealed,
    size_of,
    source_hash,
    source_path,
)
from ratherthan.errors import InputError

if TYPE_CHECKING:
    from ratherthan.explain.explanation import Explanation, Step
    from ratherthan.render import Picture
    from ratherthan.solve.solution import Solution

__all__ = ["build"]

MOST_CHARACTERS = 20_000
"""A longer text is no explanation that a person reads."""
GOOD = ("best", "among the best")
FLEXIBLE = "most flexible"


def build(path: str | Path, *, tell: Callable[[str], None] | None = None) -> tuple[str, ...]:
    """Compute the stimuli of a design anew and store them beside it.

    Parameters
    ----------
    path : path
        The folder of the design, or its file.
    tell : callable, optional
        Called with the title of each map before it is computed.

    Returns
    -------
    tuple of str
        ``"m1/selective"`` for each text that is new or other than before, ``"m1"`` for each such picture.

    Raises
    ------
    DesignError
        With all faults of the design; nothing is written then.
    """
    from ratherthan.io._files import write_atomically

    design, _ = read_draft(path)
    before = load_index(design.folder)
    maps, pictures, faults = {}, {}, []
    for number, one in enumerate(design.maps, 1):
        if tell is not None:
            tell(one.title)
        try:
            maps[one.id], pictures[one.id] = _computed(design, one)
        except InputError as error:
            faults.append(Fault(place=f"{FILE}: maps[{number}]", sentence=f"'{one.source}': {error.message}"))
    if faults:
        raise DesignError(faults)
    folder = design.folder / FOLDER
    _make(folder)
    for name, svg in pictures.items():
        with write_atomically(folder / f"{name}.svg") as file:
            file.write(svg.encode("utf-8"))
    index = {"note": NOTE, "format": FORMAT, "made_by": _version(), "maps": maps}
    with write_atomically(folder / INDEX) as file:
        file.write((json.dumps(index, indent=1, ensure_ascii=False) + "\n").encode("utf-8"))
    return tuple(_changed(before, maps))


NOTE = "Written by 'ratherthan study build': do not change it by hand."


def _version() -> str:
    from ratherthan import __version__

    return f"ratherthan {__version__}"


def _make(folder: Path) -> None:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise DesignError(
            [Fault(place=str(folder), sentence=f"The folder cannot be made: {error.strerror}.")]
        ) from error


def _changed(before: Any, maps: Mapping[str, Any]) -> list[str]:
    """Return what is new or other than before."""
    old = before.get("maps", {}) if isinstance(before, dict) else {}
    found = []
    for name, entry in maps.items():
        was = old.get(name)
        was = was if isinstance(was, dict) else {}
        if was.get("picture", {}).get("sha256") != entry["picture"]["sha256"]:
            found.append(name)
        texts = was.get("texts", {})
        found += [
            f"{name}/{kind}" for kind, one in entry["texts"].items() if texts.get(kind, {}).get("text") != one["text"]
        ]
    return found


def _computed(design: Design, one: StudyMap) -> tuple[dict[str, Any], str]:
    """Return the entry of one map, and its picture."""
    from ratherthan.explain import explain
    from ratherthan.model.states import state_number
    from ratherthan.narrate import narrate
    from ratherthan.render import draw
    from ratherthan.render.wording import place_of

    solution = _solved(design, one)
    whole = explain(solution, kind="contrastive")
    if len(whole.route) < 2 or not whole.steps:
        raise InputError(
            f"A map of a study must have a route to show and explain, but on this one it is so: {narrate(whole)}"
        )
    state = _telling_state(whole) if one.state is None else state_number(solution.problem.mdp, one.state)
    plain = explain(solution, kind="naive-path")
    svg, width, height = _drawn(draw(plain), same=same_language(design.language, whole.lexicon.language))
    texts = {kind.id: _text(solution, one, kind, state) for kind in design.kinds}
    entry = {
        "asked": asked_of_map(one, design.language),
        "sha256": source_hash(design.folder, one.source),
        "language": whole.lexicon.language,
        "state": state,
        "route": _measures(whole),
        "picture": {
            "sha256": hashlib.sha256(svg.encode("utf-8")).hexdigest(),
            "places": [place_of(plain, state) for state in plain.route],
            "width": width,
            "height": height,
        },
        "texts": texts,
    }
    return sealed(entry), svg


def _drawn(picture: Picture, *, same: bool) -> tuple[str, float, float]:
    """Return a picture and its size: without the words around it where these are not in the language of the pages."""
    if same or picture.parts is None:
        return picture.svg, picture.width, picture.height
    return picture.parts.body, picture.parts.width, picture.parts.height


def _solved(design: Design, one: StudyMap) -> Solution:
    """Return the plan of a map for what the design wants."""
    from ratherthan.errors import PropertyError
    from ratherthan.io import read
    from ratherthan.model.objective import Threshold
    from ratherthan.model.property import wish_of
    from ratherthan.solve import solve

    path = source_path(design.folder, one.source)
    properties = () if one.property is None else (one.property,)
    problem = read(one.source if path is None else str(path), start=one.start, properties=properties)
    problem = replace(problem, source=one.title)
    wish = wish_of(problem, one.property)
    if isinstance(wish, Threshold):
        raise PropertyError(f"A property must ask for a best value (=?) to be explained, got '{wish.text}'.")
    world = problem.world if problem.world is None else replace(problem.world, title=one.title)
    return solve(replace(problem, objective=wish, world=world))


def _telling_state(whole: Explanation) -> int:
    """Return the state of the route whose step has the most to say."""

    def said(step: Step) -> int:
        claims = {claim.claim for claim in step.claims}
        return bool(step.critical) + 2 * bool(claims & set(GOOD)) + 4 * (FLEXIBLE in claims)

    return max(whole.steps, key=said).state


def _text(solution: Solution, one: StudyMap, kind: Kind, state: int) -> dict[str, Any]:
    """Return the entry of one explanation."""
    from ratherthan.explain import explain, question
    from ratherthan.explain.telling import told_groups
    from ratherthan.narrate import narrate

    asked = question(kind.kind) if kind.kind is not None else question(scope=kind.scope, factors=kind.factors)
    if asked.scope == "state":
        asked = replace(asked, state=state)
    asked = replace(asked, at_most=few(one, kind))
    explanation = explain(solution, asked=asked)
    text = narrate(explanation)
    if len(text) > MOST_CHARACTERS:
        raise InputError(
            f"An explanation of a study must have at most {MOST_CHARACTERS:,} characters, but the kind '{kind.id}' has {len(text):,}. "
            "Write at_most = 7 below the map in design.toml, or another number of sentences (--at-most 7 where the study is made), or take "
            "a shorter route."
        )
    words, sentences = size_of(text)
    steps = 0 if asked.scope == "none" else sum(len(group) for group in told_groups(explanation))
    entry = {"asked": asked_of_kind(one, kind), "text": text, "words": words, "sentences": sentences, "steps": steps}
    return sealed(entry)


def _measures(whole: Explanation) -> dict[str, Any]:
    """Return what maps are compared by: the length of the route, its decisions that matter, and what is said of them."""
    split: Counter[str] = Counter()
    for step in whole.steps:
        if step.critical is False:
            continue
        claims = {claim.claim for claim in step.claims}
        good, flexible = bool(claims & set(GOOD)), FLEXIBLE in claims
        split[
            "both" if good and flexible else "responsibility" if good else "constrictiveness" if flexible else "neither"
        ] += 1
    return {
        "moves": len(whole.route) - 1,
        "outcome": whole.route_outcome,
        "critical": sum(step.critical is not False for step in whole.steps),
        **{key: split[key] for key in ("both", "responsibility", "constrictiveness", "neither")},
    }
