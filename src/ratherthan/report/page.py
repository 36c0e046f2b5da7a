"""An Explanation enters, a page leaves: one file of HTML with the text, the picture, the numbers and what they rest on.

The page asks nothing of a network: its policy (Content-Security-Policy) allows the one script and the one style sheet that are in it,
told by their digests, and images that are in it. Everything else is text. Without the script all is still there, and the numbers of
sentences and marks lead to each other as links.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata, resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ratherthan.errors import InputError, SourceError
from ratherthan.explain.explanation import Explanation

if TYPE_CHECKING:
    from jinja2 import Template

__all__ = ["Report", "report"]

MOST_DECISIONS = 200
"""How many decisions stand in the table at most."""
MOST_STEPS = 500
"""How many steps are listed at most."""
_UNFIT = re.compile(r"[^\t\n\x20-\x7e\xa0-\u2029\u202f-\u2065\u206a-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What HTML cannot hold, and what would turn the direction of all that follows: names come from files of strangers."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """A page.

    Parameters
    ----------
    html : str
    title : str
    """

    html: str
    title: str

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page to a file, whole or not at all.

        Parameters
        ----------
        path : path
            ``.html`` or ``.htm``.

        Raises
        ------
        SourceError
            If the suffix is another, or the file cannot be written.
        """
        from ratherthan.io._files import write_atomically

        if Path(path).suffix.lower() not in (".html", ".htm"):
            raise SourceError(
                f"A page is written as .html, got '{os.fspath(path)}'. Give the file this suffix.", path=os.fspath(path)
            )
        with write_atomically(path) as file:
            file.write(self.html.encode("utf-8"))


def report(explanation: Explanation) -> Report:
    """Return the page of an explanation.

    Parameters
    ----------
    explanation : Explanation

    Returns
    -------
    Report
        With ``html`` and ``save("x.html")``; the same explanation gives the same bytes.

    Raises
    ------
    InputError
        If there are no words in the language of its lexicon.

    Examples
    --------
    >>> import ratherthan as rt
    >>> page = rt.report(rt.explain(rt.solve(rt.read("example:paper-5x5"))))
    >>> page.title, page.html.startswith("<!doctype html>")
    ('A town of 5 × 5 grids (reconstruction)', True)
    """
    tables = _words(explanation.lexicon.language)
    parts = _parts(explanation, tables)
    html = _template().render(parts, words=tables, language=explanation.lexicon.language, **_inside())
    return Report(html=_clean(html), title=parts["figure"].title)


def _parts(explanation: Explanation, tables: Mapping[str, Mapping[str, str]]) -> dict[str, Any]:
    """Return all that differs from page to page."""
    from ratherthan.narrate.words import vocabulary
    from ratherthan.report.decisions import columns_of, decision_of, row_of, shown
    from ratherthan.report.facts import facts_of
    from ratherthan.report.figure import figure_of
    from ratherthan.report.told import told_of

    words, told, steps = vocabulary(explanation), told_of(explanation), explanation.steps
    label = tables["page"]["mark"]
    figure = figure_of(
        explanation, {number: label.format(number=number, words=text) for number, text, _ in told.numbered}
    )
    telling = {step: number for number, _, indices in told.numbered for step in indices}
    alone = explanation.question.scope == "state"
    decided = [(n, told) for n, _, told in told.numbered if alone or steps[told[0]].critical is not False]
    decisions = [decision_of(words, tables, number, indices) for number, indices in decided[:MOST_DECISIONS]]
    version = metadata.version("ratherthan")
    columns, same = shown(decisions)
    return {
        "figure": figure,
        "on_map": explanation.world is not None,
        "told": told,
        "decisions": decisions,
        "more_decisions": len(decided) - len(decisions),
        "columns": columns_of(words, tables),
        "shown": columns,
        "same_choices": same,
        "rows": [row_of(words, tables, place, telling.get(place)) for place in range(min(len(steps), MOST_STEPS))],
        "more_rows": max(0, len(steps) - MOST_STEPS),
        "facts": facts_of(words, tables, version),
        "version": version,
        "route": explanation.question.scope == "route",
    }


@cache
def _words(language: str) -> Mapping[str, Mapping[str, str]]:
    """Return the tables of words of a language."""
    if language != "en":
        raise InputError(f"The language must be one of: en; got '{language}'.", language=language)
    return tomllib.loads(_file("words/en.toml"))


@cache
def _template() -> Template:
    from jinja2 import DictLoader, Environment, StrictUndefined

    made = Environment(
        loader=DictLoader({"page.html": _file("templates/page.html")}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return made.get_template("page.html")


@cache
def _inside() -> Mapping[str, str]:
    """Return the script and the style sheet of every page, and the policy that allows them and nothing else."""
    script, style = _file("templates/page.js").strip(), _file("templates/page.css").strip()
    policy = (
        f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    return {"script": script, "style": style, "policy": policy}


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _file(name: str) -> str:
    return resources.files("ratherthan.report").joinpath(*name.split("/")).read_text(encoding="utf-8")


def _clean(text: str) -> str:
    """Return text without what is unfit for a page."""
    return _UNFIT.sub("\ufffd", text)
