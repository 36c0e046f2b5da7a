"""A design enters, the screens of its slots leave, and each as the browser gets it: without the right answers."""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable, Mapping
from threading import Lock
from typing import Any

from ratherthan.apps.study.design.nouns import Design, Record, Screen
from ratherthan.apps.study.design.screens import rounds, screens

__all__ = ["THANKS", "Course", "Way", "shown"]

THANKS = "thanks"
KEPT = 1024
"""Slots whose screens are kept ready: more than there are people who answer at the same time."""


class Way:
    """The screens of one slot, in order.

    Parameters
    ----------
    screens : tuple of Screen
    written : callable
        Returns a screen as JSON for the browser.

    Attributes
    ----------
    places : mapping of str to int
        The id of a screen to its index.
    """

    def __init__(self, screens: tuple[Screen, ...], written: Callable[[Screen], str]) -> None:
        self.screens = screens
        self.places: Mapping[str, int] = {one.id: index for index, one in enumerate(screens)}
        self._written = written
        self._texts: dict[int, str] = {}

    def text(self, index: int) -> str:
        """Return a screen as JSON for the browser, made when it is first asked for."""
        found = self._texts.get(index)
        if found is None:
            found = self._texts[index] = self._written(self.screens[index])
        return found


class Course:
    """The ways through a design, made when they are first asked for.

    Parameters
    ----------
    design : Design
    """

    def __init__(self, design: Design) -> None:
        self.design = design
        self.round = rounds(design)
        self.media = {
            name: f"/media/{name}.svg?v={picture.sha256[:12]}" for name, picture in sorted(design.pictures.items())
        }
        self._ways: OrderedDict[int, Way] = OrderedDict()
        self._lock = Lock()

    def way(self, slot: int | None) -> Way:
        """Return the screens of a slot; of the first one where a participant has none yet, as all begin alike."""
        slot = slot or 0
        with self._lock:
            found = self._ways.get(slot)
            if found is not None:
                self._ways.move_to_end(slot)
                return found
        found = Way(screens(self.design, slot), self._written)
        with self._lock:
            self._ways[slot] = found
            if len(self._ways) > KEPT:
                self._ways.popitem(last=False)
        return found

    def prepare(self, count: int) -> None:
        """Make the ways of the first slots now, so that nobody waits for them."""
        for slot in range(min(count, KEPT // 2)):
            self.way(slot)

    def _written(self, screen: Screen) -> str:
        return json.dumps(self._shown(screen), ensure_ascii=False)

    def _shown(self, screen: Screen) -> dict[str, Any]:
        """Return a screen with the address of its picture."""
        picture = self.design.pictures.get(screen.map) if screen.map is not None else None
        about = (
            None
            if picture is None
            else {
                "address": self.media[picture.map],
                "text": picture.text,
                "width": picture.width,
                "height": picture.height,
            }
        )
        return {**shown(screen), "picture": about}


def shown(screen: Screen) -> dict[str, Any]:
    """Return what a browser may know of a screen.

    Parameters
    ----------
    screen : Screen

    Returns
    -------
    dict
        Its fields, the records without `correct`.
    """
    return {
        "id": screen.id,
        "phase": screen.phase,
        "title": screen.title,
        "paragraphs": list(screen.paragraphs),
        "map": screen.map,
        "kind": screen.kind,
        "explanation": screen.explanation,
        "language": screen.language,
        "cards": [{"value": card.value, "text": card.text, "language": card.language} for card in screen.cards],
        "records": [_asked(record) for record in screen.records],
        "map_place": screen.map_place,
        "kind_place": screen.kind_place,
        "grouping": screen.grouping,
    }


def _asked(record: Record) -> dict[str, Any]:
    return {
        "name": record.name,
        "type": record.type,
        "label": record.label,
        "unit": record.unit,
        "options": [{"value": option.value, "label": option.label} for option in record.options],
        "least": record.least,
        "most": record.most,
        "longest": record.longest,
        "required": record.required,
    }
