"""A number of maps enters, a small design in code leaves: for tests that need no files."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ratherthan.apps.study.design.nouns import (
    Attention,
    Codes,
    Comprehension,
    Consent,
    Design,
    Grouping,
    Kind,
    Option,
    Order,
    Page,
    Picture,
    Record,
    Stimulus,
    StudyMap,
    Trial,
)

KINDS = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")
TEXTS = {
    "none": "",
    "naive-state": "We move east at grid {0}.",
    "responsibility": "We move east at grid {0} because it leads to the shortest route.",
    "constrictive": "We move east at grid {0} because it leads to the most flexible future route.",
    "naive-path": "First, we move south at grid 5. Next, we move east at grid {0}. Finally, we move east at grid 3.",
    "selective": "First, we move east at critical grid {0}. All other decisions result in equivalent routes.",
    "contrastive": "First, we move east at critical grid {0} because it leads to the shortest and most flexible future route. "
    "All other decisions result in equivalent routes.",
}
SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="100" height="100" viewBox="0 0 100 100">'
    '<rect width="100" height="100" fill="#eee"/><path d="M10 10H90V90" fill="none" stroke="#06c" stroke-width="4"/></svg>\n'
)


def _scale(name: str, text: str) -> Record:
    labels = ("Strongly disagree", "Disagree", "Neither agree nor disagree", "Agree", "Strongly agree")
    options = tuple(Option(value=value, label=label) for value, label in enumerate(labels, 1))
    return Record(name=name, type="choice", label=text, unit="points", options=options)


def _choice(name: str, text: str, labels: dict[str, str], correct: str | None = None) -> Record:
    options = tuple(Option(value=value, label=label) for value, label in labels.items())
    return Record(name=name, type="choice", label=text, options=options, correct=correct)


def small_design(folder: Path, *, maps: int = 3, kinds: tuple[str, ...] = KINDS, quota: int = 84) -> Design:
    """Return a design whose pictures are written into `folder`; the paper's shape by default."""
    names = tuple(f"m{number}" for number in range(1, maps + 1))
    pictures = {}
    for name in names:
        file = folder / f"{name}.svg"
        file.write_text(SVG, encoding="utf-8")
        pictures[name] = Picture(
            map=name,
            file=file,
            sha256=hashlib.sha256(SVG.encode()).hexdigest(),
            text="A map with a route of 3 moves.",
            width=100.0,
            height=100.0,
        )
    stimuli = {}
    for number, name in enumerate(names):
        for kind in kinds:
            text = TEXTS[kind].format(10 + number)
            stimuli[name, kind] = Stimulus(
                map=name,
                kind=kind,
                text=text,
                words=len(text.split()),
                sentences=text.count("."),
                steps=text.count("we "),
            )
    pairs = {
        "g1": ("naive-state", "responsibility"),
        "g2": ("naive-state", "constrictive"),
        "g3": ("naive-path", "selective"),
        "g4": ("responsibility", "constrictive", "selective", "contrastive"),
    }
    trust = _scale("trust", "I trust that this explanation is correct.")
    both = {"disagree": "Disagree", "agree": "Agree"}
    checks = (
        _choice("check-1", "Please choose “Agree” here.", both, "agree"),
        _choice("check-2", "Please choose “Disagree” here.", both, "disagree"),
    )
    return Design(
        folder=folder,
        fingerprint="f" * 16,
        title="A small study",
        language="en",
        contact="researcher@example.org",
        version="1",
        kinds=tuple(Kind(id=kind, label=kind.replace("-", " "), kind=kind) for kind in kinds),
        maps=tuple(StudyMap(id=name, title=f"Town {n}", source=f"{name}.roadmap") for n, name in enumerate(names, 1)),
        items=(_scale("understanding", "I understand what this explanation says."), trust),
        groupings=tuple(
            Grouping(
                id=name,
                kinds=group,
                neither="Neither of them" if len(group) == 2 else None,
                page=Page(title="Which do you prefer?", paragraphs=("All of them are about {map}.",)),
                question="The explanation that I prefer",
            )
            for name, group in pairs.items()
            if set(group) <= set(kinds)
        ),
        consent=Consent(
            page=Page(title="Before you begin", paragraphs=("This is a study about explanations.",)),
            question="Do you agree to take part?",
            agree="I am 18 or older and I agree",
            decline="I do not agree",
        ),
        instructions=(
            Page(title="What you will see", paragraphs=("A map with a route.",)),
            Page(title="What you will do", paragraphs=("Rate explanations.", "There are no wrong answers.")),
        ),
        comprehension=Comprehension(
            page=Page(title="Two questions", paragraphs=("Please answer from what you have just read.",)),
            questions=(
                _choice("who-moves", "Who moves on the map?", {"robot": "A robot", "bird": "A bird"}, "robot"),
                _choice("what-line", "What is the line?", {"route": "The route", "river": "A river"}, "route"),
            ),
            attempts=2,
        ),
        attention=tuple(
            Attention(record=check, page=Page(title="A quick check", paragraphs=()), after=(place + 1) * len(kinds) - 2)
            for place, check in enumerate(checks[:maps])
        ),
        trial=Trial(
            title="{map}",
            paragraphs=("The robot says:",),
            without=("For this route the robot gives no explanation.",),
            picture="The route goes through {places}.",
        ),
        about=Page(title="About you", paragraphs=()),
        about_records=(
            _choice("age", "How old are you?", {"18-24": "18 to 24", "25-34": "25 to 34", "35-": "35 or more"}),
            Record(name="comment", type="text", label="Anything else?", longest=2000, required=False),
        ),
        thanks=Page(title="Thank you", paragraphs=("Your answers are stored.",)),
        kind_order=Order(how="williams"),
        map_order=Order(how="williams"),
        seed=1,
        quota=quota,
        longest_gap=24.0,
        failed_checks_allowed=1,
        codes=Codes(done="DONE1234", screened_out="SCREEN12", no_consent="NOCONS12", failed_checks="FAILED12"),
        stimuli=stimuli,
        pictures=pictures,
    )
