"""A screen and a model of responses enter, what one simulated participant answers leaves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.robots.drawing import rounded
from ratherthan.apps.study.robots.model import Ratings, ResponseModel

__all__ = ["Answered", "Robot"]

READING = 0.25
"""Seconds for each word of a page that is no trial."""
ADULT = 18.0, 70.0
Record = Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Answered:
    """The values of a screen, and how long it took."""

    values: dict[str, Any]
    milliseconds: int


@dataclass(kw_only=True)
class Robot:
    """One simulated participant, who answers the same way to the same screens.

    Parameters
    ----------
    number : int
        From 0.
    seed : int
    design : Design
        It knows the right answers of checks, which the server never tells.
    model : ResponseModel
    factor : float
        By which the model's differences between kinds are multiplied.
    """

    number: int
    seed: int
    design: Design
    model: ResponseModel
    factor: float = 1.0
    levels: dict[str, float] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self.random = np.random.default_rng([self.seed, self.number])
        self.cores = {kind.id: kind.kind or kind.id for kind in self.design.kinds}
        checks = (*self.design.comprehension.questions, *(check.record for check in self.design.attention))
        self.right = {record.name: record.correct for record in checks}

    def leaves(self, screen: Mapping[str, Any]) -> bool:
        """Whether this participant goes away at a screen."""
        return screen["phase"] == "trial" and self._happens(self.model.conduct.leaves)

    def answer(self, screen: Mapping[str, Any]) -> Answered:
        """Return what this participant answers."""
        records = {record["name"]: record for record in screen["records"]}
        phase = screen["phase"]
        if phase == "consent":
            declines = self._happens(self.model.conduct.declines)
            values = {name: record["options"][-1 if declines else 0]["value"] for name, record in records.items()}
        elif phase == "comprehension":
            values = self._checked(records, self.model.conduct.misunderstands)
        elif phase == "attention":
            values = self._checked(records, self.model.conduct.inattentive)
        elif phase == "trial":
            values = {name: self._rated(screen, record) for name, record in records.items() if record["type"] != "text"}
        elif phase == "grouping":
            values = {name: self._chosen(record) for name, record in records.items()}
        else:
            values = {name: self._told(record) for name, record in records.items()}
        seconds = self._seconds(screen)
        return Answered(values={n: v for n, v in values.items() if v is not None}, milliseconds=round(1000 * seconds))

    def _happens(self, probability: float) -> bool:
        return bool(self.random.random() < probability)

    def _level(self, name: str, spread: float) -> float:
        """Return what is particular to this participant, drawn once."""
        if name not in self.levels:
            self.levels[name] = float(self.random.normal(0.0, spread))
        return self.levels[name]

    def _checked(self, records: Mapping[str, Record], wrong: float) -> dict[str, Any]:
        """Return right answers, or with a probability one wrong one."""
        values = {name: self.right.get(name, self._told(record)) for name, record in records.items()}
        if values and self._happens(wrong):
            name = str(self.random.choice(sorted(values)))
            others = [option["value"] for option in records[name]["options"] if option["value"] != values[name]]
            if others:
                values[name] = others[int(self.random.integers(len(others)))]
        return values

    def _rated(self, screen: Mapping[str, Any], record: Record) -> Any:
        """Return a rating of an explanation."""
        item = self.model.item(record["name"])
        kind = self.cores.get(screen["kind"], screen["kind"])
        latent = self._centre(item, kind)
        latent += self._level(f"{record['name']} person", item.person)
        latent += self._level(f"{record['name']} kind {kind}", item.kind)
        latent += float(self.random.normal(0.0, item.rest))
        options = record["options"]
        if options:
            return options[int(rounded(np.array(latent), len(options))) - 1]["value"]
        if record["type"] == "flag":
            return latent >= 3.0
        least, most = _bounds(record, 1.0, 5.0)
        return round(least + (min(max(latent, 1.0), 5.0) - 1.0) / 4.0 * (most - least))

    def _centre(self, item: Ratings, kind: str) -> float:
        kinds = [self.cores[one.id] for one in self.design.kinds]
        return float(item.centres(kinds, self.factor)[kinds.index(kind)]) if kind in kinds else item.other

    def _chosen(self, record: Record) -> Any:
        """Return which card is preferred."""
        values = [option["value"] for option in record["options"]]
        worths = []
        for value in values:
            worth = self.model.worth.get(self.cores.get(value, value), self.model.other_worth)
            worths.append(worth * math.exp(self._level(f"worth {value}", self.model.worth_person)))
        shares = np.array(worths) / sum(worths)
        return values[int(self.random.choice(len(values), p=shares))]

    def _told(self, record: Record) -> Any:
        """Return something that a question on oneself allows; None for texts that need not be written."""
        if record["options"]:
            return record["options"][int(self.random.integers(len(record["options"])))]["value"]
        if record["type"] == "flag":
            return True
        if record["type"] == "number":
            least, most = _bounds(record, *ADULT)
            return int(self.random.integers(math.ceil(least), max(math.ceil(least), math.floor(most)) + 1))
        return "simulated" if record["required"] else None

    def _seconds(self, screen: Mapping[str, Any]) -> float:
        """Return how long a screen takes."""
        time = self.model.time
        chance = self._level("time person", time.person) + float(self.random.normal(0.0, time.rest))
        if screen["phase"] == "trial":
            kind = self.cores.get(screen["kind"], screen["kind"])
            words = len((screen.get("explanation") or "").split())
            return time.centre(words) * math.exp(chance + self._level(f"time kind {kind}", time.kind))
        words = len(" ".join([*screen["paragraphs"], *(card["text"] for card in screen.get("cards") or ())]).split())
        return (5.0 + READING * words) * math.exp(chance)


def _bounds(record: Record, least: float, most: float) -> tuple[float, float]:
    """Return the bounds of a number, where the record has none those given, as far as they fit together."""
    low = least if record.get("least") is None else float(record["least"])
    high = most if record.get("most") is None else float(record["most"])
    return (low, high) if low <= high else (low, low) if record.get("most") is None else (high, high)
