"""Shapes and words enter, one SVG picture leaves: the same shapes, the same bytes.

Numbers have at most two decimals; nothing depends on a clock, a locale or a random number. Words are laid out by the widths of
letters in a table, as a picture cannot ask which font will show it: lines break a little early rather than run out of the picture.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

from ratherthan.errors import MissingExtraError, SourceError
from ratherthan.render.palette import INK, PAPER

__all__ = ["Canvas", "Parts", "Picture", "cut", "element", "number", "text_width", "wrapped"]

FONT = "'DejaVu Sans', Verdana, 'Segoe UI', Helvetica, Arial, sans-serif"
NARROW, WIDE = frozenset("fijlrtI.,:;'|!()[]{} "), frozenset("mwMWGOQ%@—–→►")
MOST_PIXELS = 120_000_000
EDGE = 12.0
"""How much is seen around the body of a picture whose words are set elsewhere: marks may reach over its border."""


@dataclass(frozen=True, kw_only=True)
class Parts:
    """A picture taken apart, for a page that sets the words around it itself.

    Parameters
    ----------
    body : str
        What is drawn, as SVG, without the words around it.
    width, height : float
        Of that.
    title, description, caption : str
    legend : tuple of (str, str)
        For each line an example as SVG, and what it means.
    """

    body: str
    width: float
    height: float
    title: str
    description: str
    caption: str
    legend: tuple[tuple[str, str], ...]


@dataclass(frozen=True, kw_only=True)
class Body:
    """Where on a canvas a body is drawn, among which of its elements, and the words around it."""

    begin: int
    box: tuple[float, float, float, float]
    caption: str
    legend: tuple[tuple[str, str], ...]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture as SVG text.

    Parameters
    ----------
    svg : str
    width, height : float
        In its own units, of which 96 are an inch.
    parts : Parts, optional
        The same taken apart, where there are words around a body.
    """

    svg: str
    width: float
    height: float
    parts: Parts | None = None

    def save(self, path: str | os.PathLike[str], *, scale: float = 2.0) -> None:
        """Write the picture to a file, whole or not at all.

        Parameters
        ----------
        path : path
            ``.svg`` or ``.png``.
        scale : float
            Pixels of a PNG for each unit of the picture.

        Raises
        ------
        SourceError
            If the suffix is another, or the file cannot be written.
        MissingExtraError
            If PNG is wanted and the extra ``[png]`` is not installed.
        """
        from ratherthan.io._files import write_atomically

        suffix = Path(path).suffix.lower()
        if suffix not in (".svg", ".png"):
            raise SourceError(
                f"A picture is written as .svg or .png, got '{os.fspath(path)}'. Give the file one of these suffixes.",
                path=os.fspath(path),
            )
        data = self.svg.encode("utf-8") if suffix == ".svg" else self.png(scale=scale)
        with write_atomically(path) as file:
            file.write(data)

    def png(self, *, scale: float = 2.0) -> bytes:
        """Return the picture as PNG.

        Raises
        ------
        MissingExtraError
            If the extra ``[png]`` is not installed.
        """
        try:
            import resvg_py
        except ImportError as error:
            raise MissingExtraError(
                "A picture as PNG needs the extra [png]: pip install 'ratherthan[png]'. As SVG it can be had without."
            ) from error
        room = self.width * self.height
        scale = min(scale, (MOST_PIXELS / room) ** 0.5)
        return bytes(
            resvg_py.svg_to_bytes(svg_string=self.svg, width=max(1, round(self.width * scale)), background=PAPER)
        )

    def _repr_svg_(self) -> str:
        """Return what a notebook shows."""
        return self.svg


@dataclass(kw_only=True)
class Canvas:
    """A picture that is being made; elements are drawn in the order in which they are added.

    Parameters
    ----------
    width, height : float
    title, description : str
        What a screen reader says: a short name, and what is to be seen.
    """

    width: float
    height: float
    title: str
    description: str
    parts: list[str] = field(default_factory=list)
    definitions: dict[str, str] = field(default_factory=dict)
    body: Body | None = None

    def picture(self) -> Picture:
        """Return the picture."""
        whole = self._svg((0.0, 0.0, self.width, self.height), self.parts)
        return Picture(svg=whole, width=self.width, height=self.height, parts=self._apart())

    def _apart(self) -> Parts | None:
        """Return the picture taken apart, None where it has no body of its own."""
        if self.body is None:
            return None
        x, y, width, height = self.body.box
        box = (x - EDGE, y - EDGE, width + 2 * EDGE, height + 2 * EDGE)
        return Parts(
            body=self._svg(box, self.parts[self.body.begin :]),
            width=box[2],
            height=box[3],
            title=self.title,
            description=self.description,
            caption=self.body.caption,
            legend=self.body.legend,
        )

    def _svg(self, box: tuple[float, float, float, float], parts: Sequence[str]) -> str:
        """Return what is within a box as SVG."""
        x, y, width, height = map(number, box)
        defined = "".join(f"\n{self.definitions[name]}" for name in sorted(self.definitions))
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="{x} {y} {width} {height}" '
            f'role="img" aria-labelledby="title description" font-family={quoteattr(FONT)}>\n'
            f'<title id="title">{escape(_clean(self.title))}</title>\n'
            f'<desc id="description">{escape(_clean(self.description))}</desc>\n'
        )
        defs = f"<defs>{defined}\n</defs>\n" if defined else ""
        corner = "" if (x, y) == ("0", "0") else f'x="{x}" y="{y}" '
        paper = f'<rect {corner}width="{width}" height="{height}" fill="{PAPER}"/>\n'
        return head + defs + paper + "\n".join(parts) + "\n</svg>\n"

    def define(self, name: str, element: str) -> str:
        """Keep an element under a name among the definitions, and return the name."""
        self.definitions[name] = element
        return name

    def add(self, name: str, content: str | None = None, /, **attributes: object) -> None:
        """Add an element; attributes whose value is None are left out, underscores become hyphens."""
        self.parts.append(element(name, content, **attributes))

    def open(self, **attributes: object) -> None:
        """Begin a group."""
        self.parts.append(f"<g{_attributes(attributes)}>")

    def close(self) -> None:
        """End a group."""
        self.parts.append("</g>")

    def rect(self, x: float, y: float, width: float, height: float, **attributes: object) -> None:
        """Add a rectangle."""
        self.add("rect", x=x, y=y, width=width, height=height, **attributes)

    def path(self, points: Sequence[tuple[float, float]], *, closed: bool = False, **attributes: object) -> None:
        """Add a line through points, straight from each to the next."""
        line = "M" + "L".join(f"{number(x)} {number(y)}" for x, y in points) + ("Z" if closed else "")
        self.add("path", d=line, **({"fill": "none"} | attributes))

    def text(self, x: float, y: float, words: str, *, size: float = 13.0, **attributes: object) -> None:
        """Add one line of text; (x, y) is its anchor on the base line."""
        given = {"fill": INK} | attributes
        self.add("text", _clean(words), x=x, y=y, font_size=size, **given)

    def lines(self, x: float, y: float, lines: Iterable[str], *, size: float = 13.0, **attributes: object) -> float:
        """Add lines of text one below the other, and return the base line after the last."""
        for line in lines:
            self.text(x, y, line, size=size, **attributes)
            y += 1.45 * size
        return y


def element(name: str, content: str | None = None, /, **attributes: object) -> str:
    """Return an element as text; `content` is escaped."""
    inside = "/" if content is None else f">{escape(content)}</{name}"
    return f"<{name}{_attributes(attributes)}{inside}>"


def _attributes(attributes: dict[str, object]) -> str:
    said = {name.rstrip("_").replace("_", "-"): value for name, value in attributes.items() if value is not None}
    return "".join(
        f" {name}={quoteattr(number(value) if isinstance(value, float) else str(value))}"
        for name, value in said.items()
    )


def number(value: float) -> str:
    """Return a number as pictures have it.

    Examples
    --------
    >>> number(2.0), number(1 / 3), number(-0.001)
    ('2', '0.33', '0')
    """
    said = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if said in ("-0", "") else said


def text_width(words: str, size: float) -> float:
    """Return about how wide a line of text is, rather too much than too little."""
    units = sum(0.38 if c in NARROW else 0.95 if c in WIDE else 1.05 if c > "\u2e80" else 0.66 for c in words)
    return units * size


def cut(words: str, width: float, size: float) -> str:
    """Return a text that is no wider than `width`; what is longer ends in an ellipsis.

    Examples
    --------
    >>> cut("a crossing", 200.0, 12.0), cut("a crossing", 40.0, 12.0)
    ('a crossing', 'a cr…')
    """
    if text_width(words, size) <= width:
        return words
    kept = words
    while kept and text_width(kept + "…", size) > width:
        kept = kept[:-1]
    return kept.rstrip() + "…"


def wrapped(words: str, width: float, size: float) -> list[str]:
    """Return a text in lines that are no wider than `width`; a single word that is wider is broken."""
    lines: list[str] = []
    line = ""
    for word in words.split():
        tried = f"{line} {word}" if line else word
        if text_width(tried, size) <= width:
            line = tried
            continue
        if line:
            lines.append(line)
        while text_width(word, size) > width and len(word) > 1:
            cut = max(1, sum(text_width(word[: i + 1], size) <= width for i in range(len(word))))
            lines.append(word[:cut])
            word = word[cut:]
        line = word
    return [*lines, line] if line else lines


def _clean(words: str) -> str:
    """Return text without what XML cannot hold."""
    return "".join(
        c if c in "\t\n" or (c >= " " and not "\ud800" <= c <= "\udfff" and c not in "\ufffe\uffff") else "\ufffd"
        for c in words
    )
