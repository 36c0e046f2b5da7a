"""An Explanation enters, its picture leaves as it stands in a page: two sizes of the same, with marks that are links, and a legend.

What a picture says in words around itself, a page says in its own type. Names of definitions get a prefix, as several pictures share
one page; styles become attributes, as the page's policy allows no inline ones.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

from ratherthan.explain.explanation import Explanation
from ratherthan.render import draw

__all__ = ["Figure", "figure_of"]

WIDE, NARROW = (620.0, 620.0), (270.0, 420.0)
"""How much room the map has on a screen, and on a telephone: about as much as there it is shown, so that its words can be read."""

_TAG = re.compile(r"<[^>]*>")
_NAME = re.compile(r'(\sid="|="url\(#)')
_STEP = re.compile(r'<g class="step" data-sentence="(\d+)">(.*?)</g>', re.DOTALL)
_HEAD = re.compile(r"<svg [^>]*>\s*<title[^>]*>.*?</title>\s*<desc[^>]*>.*?</desc>", re.DOTALL)
_SENTENCE = re.compile(r'data-sentence="(\d+)"')


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture in a page.

    Parameters
    ----------
    wide, narrow : str
        SVG.
    title : str
    descriptions, captions : pair of str
        Of the wide one and of the narrow one, which may have room for fewer numbers.
    legend : tuple of (str, str)
    marked : frozenset of int
        The sentences that have something in the picture.
    """

    wide: str
    narrow: str
    title: str
    descriptions: tuple[str, str]
    captions: tuple[str, str]
    legend: tuple[tuple[str, str], ...]
    marked: frozenset[int]


def figure_of(explanation: Explanation, labels: Mapping[int, str]) -> Figure:
    """Return the picture of an explanation for a page.

    Parameters
    ----------
    explanation : Explanation
    labels : mapping of int to str
        For each sentence what a screen reader says at its mark.
    """
    wide, narrow = draw(explanation, room=WIDE).parts, draw(explanation, room=NARROW).parts
    assert wide is not None
    assert narrow is not None
    return Figure(
        wide=_embedded(wide.body, "w", (wide.width, wide.height), labels),
        narrow=_embedded(narrow.body, "n", (narrow.width, narrow.height), labels),
        title=wide.title,
        descriptions=(wide.description, narrow.description),
        captions=(wide.caption, narrow.caption),
        legend=tuple((_prefixed(sample, f"l{place}"), words) for place, (sample, words) in enumerate(wide.legend)),
        marked=frozenset(map(int, _SENTENCE.findall(wide.body))),
    )


def _embedded(svg: str, prefix: str, size: tuple[float, float], labels: Mapping[int, str]) -> str:
    """Return a picture for a page: a group of links, whose name and description stand in the page."""
    width, height = size
    box = re.search(r'viewBox="[^"]*"', svg)
    font = re.search(r'font-family="[^"]*"', svg)
    assert box is not None
    assert font is not None
    head = (
        f'<svg class="{"wide" if prefix == "w" else "narrow"}" width="{width:.0f}" height="{height:.0f}" {box[0]} {font[0]} '
        f'role="group" aria-labelledby="picture-title" aria-describedby="{prefix}-description">'
    )
    body = _HEAD.sub(lambda _: head, _prefixed(svg, prefix), count=1)
    return _STEP.sub(lambda found: _link(found[1], found[2], prefix, labels), body)


def _link(number: str, drawn: str, prefix: str, labels: Mapping[int, str]) -> str:
    """Return a mark as a link to its sentence."""
    label = escape(labels.get(int(number), number))
    return (
        f'<a class="step" data-sentence="{number}" id="{prefix}-mark-{number}" href="#sentence-{number}" '
        f'aria-label="{label}">{drawn}</a>'
    )


def _prefixed(svg: str, prefix: str) -> str:
    """Return a picture whose names of definitions begin with a prefix, without styles."""

    def renamed(tag: re.Match[str]) -> str:
        inside = tag[0].replace(' style="image-rendering:pixelated"', ' class="pixels"')
        return _NAME.sub(lambda found: f"{found[1]}{prefix}-", inside)

    return _TAG.sub(renamed, svg)
