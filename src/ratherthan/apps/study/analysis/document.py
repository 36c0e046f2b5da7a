"""What a report consists of, whatever it is written as: headings, paragraphs, tables and figures, in order."""

from __future__ import annotations

from dataclasses import dataclass

from ratherthan.render.canvas import Picture

__all__ = ["Block", "Document", "Figure", "Heading", "Paragraph", "Table"]


@dataclass(frozen=True, kw_only=True)
class Heading:
    """A heading of level 2 or 3."""

    level: int
    text: str


@dataclass(frozen=True, kw_only=True)
class Paragraph:
    """A paragraph; `warning` sets it apart."""

    text: str
    warning: bool = False


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table; `words` says how many columns on the left hold words; `folded` closes it until it is asked for."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    folded: bool = False


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure; `name` is the name of its file without suffix, `text` says in words what is to be seen."""

    name: str
    picture: Picture
    caption: str
    text: str


Block = Heading | Paragraph | Table | Figure


@dataclass(frozen=True, kw_only=True)
class Document:
    """A report."""

    title: str
    banner: str  # stands on top of every page of it; "" for none
    blocks: tuple[Block, ...]
