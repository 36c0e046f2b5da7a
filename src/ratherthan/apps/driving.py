"""Options for maps of cells: where a robot is to go, and how it drives; those that were given leave by the names `read` takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import click

__all__ = ["driving_options"]

F = TypeVar("F", bound=Callable[..., Any])
SECTION = "Maps (.map, .yaml)"


def driving_options(option: Callable[..., Callable[[F], F]]) -> Mapping[str, Callable[[F], F]]:
    """Return the decorators by the names of what they ask for; `option` makes one, as `ratherthan.apps.options.option` does."""
    return {
        name: option(f"--{name}", section=SECTION, metavar=metavar, show_default=False, help=text, **more)
        for name, metavar, text, more in _OPTIONS
    }


_OPTIONS: tuple[tuple[str, str | None, str, Mapping[str, Any]], ...] = (
    (
        "goal",
        "PLACE",
        "Where to go: column,row from the upper left as 3,14, or metres in the map's frame as 1.2m,3.4m. So may --start be.",
        {},
    ),
    ("scen", "FILE", "Start and goal from a MovingAI scenario file.", {}),
    ("row", "N", "Which of its rows, from 0.  [default: 0]", {"type": click.IntRange(min=0)}),
    (
        "slip",
        "P",
        "The chance to go astray, half of it to the next direction on either side; into a wall the robot stays.  [default: 0.1]",
        {"type": float},
    ),
    ("stay", "P", "The chance that an attempt leaves the robot where it is.  [default: 0]", {"type": float}),
    (
        "directions",
        None,
        "In how many directions it drives; a diagonal is √2 long and cuts no corner.  [default: 8]",
        {"type": click.Choice(("4", "8"))},
    ),
    (
        "radius",
        "LENGTH",
        (
            "Of the robot, which keeps so far from obstacles: in metres, on a map without metres in cells.  "
            "[default: 0.2 m, or 0 cells]"
        ),
        {"type": float},
    ),
    (
        "cell",
        "LENGTH",
        (
            "The side of a cell of the model, a multiple of the map's; it is free where the robot fits all over it.  "
            "[default: the map's]"
        ),
        {"type": float},
    ),
    (
        "speed",
        "SPEED",
        "In metres (or cells) a second, also for kinds of ground: 0.8,swamp=0.2.  [default: 0.5 m, or 1 cell, a second]",
        {},
    ),
    (
        "safe",
        "LENGTH",
        (
            "From how far on an obstacle is no risk; nearer, a metre costs the more risk the nearer it is, 1 at the wall.  "
            "[default: 0.5 m, or 1 cell]"
        ),
        {"type": float},
    ),
    (
        "zones",
        "FILE",
        "Parts of the map that a person marked: named, risky, slow or forbidden.  [default: MAP.zones.toml beside the map]",
        {},
    ),
    (
        "unknown",
        None,
        "Whether unknown ground is free; then it may be occupied with a chance of one half, a risk.  [default: closed]",
        {"type": click.Choice(("free", "closed"))},
    ),
)
