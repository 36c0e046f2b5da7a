"""A report enters, it leaves as one page of HTML that asks for nothing from elsewhere, and as Markdown with its figures beside it."""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path
from typing import Any

from ratherthan.apps.study.analysis.document import Block, Document, Figure, Heading, Paragraph
from ratherthan.apps.study.analysis.words import say
from ratherthan.errors import MissingExtraError

__all__ = ["as_html", "as_markdown"]

FOLDER = Path(__file__).parent / "templates"


def as_html(document: Document) -> str:
    """Return the report as HTML.

    Raises
    ------
    MissingExtraError
        If jinja2 is not installed.
    """
    try:
        from jinja2 import Environment, StrictUndefined
    except ImportError as error:
        raise MissingExtraError("A report needs the extra [study]: pip install 'ratherthan[study]'.") from error
    from markupsafe import Markup

    style = (FOLDER / "report.css").read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(style.encode("utf-8")).digest()).decode("ascii")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    template = environment.from_string((FOLDER / "report.html.jinja").read_text(encoding="utf-8"))
    blocks = [_for_template(block) for block in document.blocks]
    page = template.render(
        document={"title": document.title, "banner": document.banner, "blocks": blocks},
        short_banner=say("forms.simulated_short"),
        style=Markup(style),
        style_hash=f"sha256-{digest}",
    )
    page = re.sub(r"(?<=[\d)]) %", "\N{NO-BREAK SPACE}%", page)  # numbers stay with their signs
    page = re.sub(r" (=|&lt;|&gt;) (?=[\d.−])", "\N{NO-BREAK SPACE}\\1\N{NO-BREAK SPACE}", page)
    page = re.sub(r"(&lt;|&gt;) (?=\.\d)", "\\1\N{NO-BREAK SPACE}", page)
    return re.sub(r"\n{2,}", "\n", page)


def _for_template(block: Block) -> dict[str, Any]:
    """Return a block as the template takes it."""
    if isinstance(block, Heading):
        return {"kind": "heading", "level": block.level, "text": block.text}
    if isinstance(block, Paragraph):
        return {"kind": "paragraph", "text": block.text, "warning": block.warning}
    if isinstance(block, Figure):
        return {
            "kind": "figure",
            "data": base64.b64encode(block.picture.svg.encode("utf-8")).decode("ascii"),
            "width": round(block.picture.width),
            "height": round(block.picture.height),
            "text": block.text,
            "short": block.caption.split(".")[0],
            "caption": block.caption,
        }
    return {
        "kind": "table",
        "caption": block.caption,
        "head": block.head,
        "rows": block.rows,
        "words": block.words,
        "folded": block.folded,
    }


def as_markdown(document: Document) -> str:
    """Return the report as Markdown; figures are looked for in ``figures/``."""
    parts = [f"# {_plain(document.title)}"]
    if document.banner:
        parts.append(f"> **{_plain(document.banner)}**")
    for block in document.blocks:
        if isinstance(block, Heading):
            parts.append(f"{'#' * block.level} {_plain(block.text)}")
        elif isinstance(block, Paragraph):
            parts.append(("> " if block.warning else "") + _plain(block.text))
        elif isinstance(block, Figure):
            parts.append(f"![{_plain(block.text)}](figures/{block.name}.svg)\n\n*{_plain(block.caption)}*")
        else:
            rule = ["---" if i < block.words else "---:" for i in range(len(block.head))]
            lines = [block.head, tuple(rule), *block.rows]
            rows = [_line(line, plain=i != 1) for i, line in enumerate(lines)]
            parts.append(f"*{_plain(block.caption)}*\n\n" + "\n".join(rows))
    if document.banner:
        parts.append(f"> **{_plain(document.banner)}**")
    return "\n\n".join(parts) + "\n"


def _line(cells: tuple[str, ...], *, plain: bool) -> str:
    return "| " + " | ".join(_plain(cell) if plain else cell for cell in cells) + " |"


def _plain(text: str) -> str:
    """Return text that Markdown shows as it is: names come from files of strangers."""
    text = " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    text = re.sub(r"([\\`*_\[\]|~!#])", r"\\\1", text)
    return re.sub(r"^([-+]|\d+\.)(?=\s)", r"\\\1", text)
