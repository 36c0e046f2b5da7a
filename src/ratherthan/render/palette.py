"""Colours enter pictures from here, and whether two of them can be told apart leaves.

The colours of lines and marks are those of Okabe and Ito (2008), which people with any kind of colour blindness tell apart; none is the
only carrier of a meaning: lines differ in dashes and width, marks in shape, grounds in lightness and pattern. Text is dark on light
or light on dark with a contrast of at least 4.5 to 1 (WCAG 2.2, 1.4.3).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["BLUES", "INK", "NEVER", "PAPER", "WITHOUT", "Look", "contrast", "ink_on", "looks_of", "rgb", "shade"]

INK, PAPER, BLACK = "#1b1b1b", "#ffffff", "#000000"
ROUTE, FOIL, START, GOAL, HAZARD = "#0072b2", "#a84300", "#004a34", "#b0357f", "#a84300"
MARK, OPENING = "#1b1b1b", "#b0357f"
QUIET = "#5c5c5c"
"""Text that stands back."""
ROAD = "#6e6e6e"
ZONE = "#5b3a8c"


@dataclass(frozen=True, kw_only=True)
class Look:
    """How a kind of ground looks: its colour, a pattern over it, and the colour of that."""

    fill: str
    pattern: str = ""
    ink: str = INK


GROUNDS = {
    "open ground": Look(fill="#ffffff"),
    "road": Look(fill="#ffffff"),
    "free": Look(fill="#ffffff"),
    "street": Look(fill="#ffffff"),
    "urban road": Look(fill="#ffffff"),
    "start": Look(fill="#ffffff"),
    "destination": Look(fill="#ffffff"),
    "goal": Look(fill="#ffffff"),
    "highway": Look(fill="#e3eefa", pattern="lane", ink="#7ba7cf"),
    "building": Look(fill="#4d4d4d", pattern="brick", ink="#6f6f6f"),
    "wall": Look(fill="#4d4d4d"),
    "too narrow": Look(fill="#d4d4d4", pattern="stripes", ink="#a9a9a9"),
    "forbidden": Look(fill="#f0c9c0", pattern="cross", ink="#a84300"),
    "unknown": Look(fill="#b9b9b9", pattern="dots", ink="#8a8a8a"),
    "dead end": Look(fill="#efe3d7", pattern="cross", ink="#8a5a2b"),
    "swamp": Look(fill="#d9dfc2", pattern="waves", ink="#8b9462"),
    "water": Look(fill="#c3dcec", pattern="waves", ink="#5f9cc2"),
    "trees": Look(fill="#56664d", pattern="dots", ink="#7d9070"),
    "hazard": Look(fill="#f4cfbd", pattern="stripes", ink="#a84300"),
}
"""Kinds of ground that are known by name."""
OTHERS = (
    Look(fill="#ece7f2", pattern="stripes", ink="#a29bb5"),
    Look(fill="#e5f0e3", pattern="dots", ink="#8fae8a"),
    Look(fill="#f6ead2", pattern="lane", ink="#c4a566"),
    Look(fill="#dedede", pattern="brick", ink="#b4b4b4"),
    Look(fill="#fad6e3", pattern="cross", ink="#cf9bb0"),
    Look(fill="#d3efef", pattern="waves", ink="#8fc4c4"),
    Look(fill="#f3f0c9", pattern="stripes", ink="#bdb566"),
    Look(fill="#cfd5ea", pattern="dots", ink="#7f8bbd"),
)
"""Looks of grounds that nobody has heard of, in turn."""
NEVER = Look(fill="#f3ded2", pattern="stripes", ink="#c98b66")
"""A number that is infinite."""
WITHOUT = Look(fill="#8c8c8c")
"""A cell in which no state lies."""
BLUES = ("#f4f8fc", "#d5e4f1", "#a9cbe4", "#6fa8d2", "#3a7fb8", "#155a94", "#0b3560")
"""From little to much, in even steps of lightness: a scale that reads in grey."""


def looks_of(kinds: Sequence[str]) -> list[Look]:
    """Return how kinds of ground look; those that are not known by name have looks of their own, in turn.

    Examples
    --------
    >>> [look.pattern for look in looks_of(["moss", "wall", "sand"])]
    ['stripes', '', 'dots']
    """
    others = itertools.cycle(OTHERS)
    return [GROUNDS.get(kind.lower()) or next(others) for kind in kinds]


def shade(share: float) -> str:
    """Return the colour of a share from 0 (little) to 1 (much) on the scale of blues.

    Examples
    --------
    >>> shade(0.0), shade(1.0), shade(0.25)
    ('#f4f8fc', '#0b3560', '#bfd8ea')
    """
    place = min(max(share, 0.0), 1.0) * (len(BLUES) - 1)
    below = min(int(place), len(BLUES) - 2)
    one, other = rgb(BLUES[below]), rgb(BLUES[below + 1])
    mixed = (round(a + (b - a) * (place - below)) for a, b in zip(one, other, strict=True))
    return "#" + "".join(f"{part:02x}" for part in mixed)


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours, from 1 to 21 (WCAG 2.2).

    Examples
    --------
    >>> contrast("#000000", "#ffffff"), contrast("#ffffff", "#ffffff")
    (21.0, 1.0)
    """
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def ink_on(ground: str) -> str:
    """Return the colour of text on a ground: black or white, of which one always contrasts at least 4.5 to 1."""
    return max((BLACK, PAPER), key=lambda ink: contrast(ink, ground))


def _luminance(colour: str) -> float:
    parts = [part / 255.0 for part in rgb(colour)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of a colour, each from 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
