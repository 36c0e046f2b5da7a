"""Exports of a study in the tidy form, made from the response model without a server: for tests of the analysis."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np

from ratherthan.apps.study.robots.drawing import drawn_ratings, drawn_times
from ratherthan.apps.study.robots.model import read_model

KINDS = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")
GROUPINGS = {
    "g1": ("naive-state", "responsibility", "neither"),
    "g2": ("naive-state", "constrictive", "neither"),
    "g3": ("naive-path", "selective", "neither"),
    "g4": ("responsibility", "constrictive", "selective", "contrastive"),
}
COLUMNS = (
    *(
        "study",
        "design",
        "simulated",
        "participant",
        "state",
        "slot",
        "screen",
        "phase",
        "number",
        "map",
        "map_place",
        "kind",
    ),
    *(
        "kind_place",
        "grouping",
        "item",
        "type",
        "value",
        "label",
        "correct",
        "unit",
        "attempts",
        "words",
        "sentences",
        "options",
    ),
)
LABELS = {1: "not at all", 2: "little", 3: "partly", 4: "mostly", 5: "fully"}
Rows = list[dict[str, str]]


def observations(
    people: int = 30, *, seed: int = 1, maps: int = 3, factor: float = 1.0, simulated: bool = True, kinds=KINDS
) -> Rows:
    """Return the observations of a whole study."""
    random = np.random.default_rng(seed)
    model = read_model()
    shape = (1, people, maps)
    ratings = {
        name: drawn_ratings(model.item(name), kinds, shape, random, factor=factor)[0]
        for name in ("understanding", "trust")
    }
    times = drawn_times(model, kinds, shape, random)[0]
    rows: Rows = []
    for p in range(people):
        base = dict.fromkeys(COLUMNS, "") | {
            "study": "Explanations of routes",
            "design": "f" * 16,
            "simulated": str(simulated).lower(),
            "participant": f"P{p + 1:04d}",
            "state": "finished",
            "slot": str(p % 42),
        }

        def add(base=base, **cells: object) -> None:
            rows.append(base | {name: str(cell) for name, cell in cells.items()})

        for m in range(maps):
            for k, kind in enumerate(kinds):
                at = {"screen": f"trial-m{m + 1}-{kind}", "phase": "trial", "map": f"m{m + 1}", "kind": kind}
                for name, table in ratings.items():
                    value = int(table[p, k, m])
                    add(**at, item=name, type="choice", value=value, label=LABELS[value], unit="points")
                add(
                    **at,
                    item="time",
                    type="number",
                    value=round(float(times[p, k, m]), 3),
                    unit="s",
                    words=int(model.time.words[kind]),
                )
            for name, options in GROUPINGS.items():
                worth = np.array([model.worth[option] for option in options])
                choice = options[int(random.choice(len(options), p=worth / worth.sum()))]
                at = {"screen": f"grouping-m{m + 1}-{name}", "phase": "grouping", "map": f"m{m + 1}", "grouping": name}
                add(**at, item="preferred", type="choice", value=choice, options="|".join(options))
        for i in (1, 2):
            add(
                screen=f"attention-{i}",
                phase="attention",
                item=f"attention-{i}",
                type="choice",
                value=2,
                correct="true",
            )
        add(screen="about-you", phase="about", item="age", type="choice", value="25-34", label="25–34")
    return rows


def write(rows: Rows, folder: Path, *, study: dict[str, object] | None = None, columns=COLUMNS) -> Path:
    """Write an export to a folder, and return it."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "observations.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    if study is not None:
        (folder / "study.json").write_text(json.dumps(study), encoding="utf-8")
    return folder
