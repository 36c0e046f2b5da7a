"""What may be an explanation that was stored as a document enters; the explanation leaves, or None where it is a model."""

from __future__ import annotations

import os
import re
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from ratherthan.errors import ExplanationError, QuestionError
from ratherthan.model.lexicon import Lexicon

if TYPE_CHECKING:
    from ratherthan.apps.options import Wanted
    from ratherthan.explain import Explanation

__all__ = ["MODEL", "given_options", "stored_explanation"]

MODEL = frozenset({"source", "lexicon", "form", "output", "time_limit", "memory_limit", "what"})
"""The parameters that a stored explanation can do with, too."""
HEAD = 1 << 16
KEYS = re.compile(rb'"(alpha|closing|digest|factors|route_outcome|text|version)"\s*:')
OTHERS = re.compile(rb'"(jani-version|nS|P)"\s*:')


def stored_explanation(wanted: Wanted) -> Explanation | None:
    """Return the explanation that is in the source, None where that is no such document.

    Raises
    ------
    ExplanationError
        Where the document is damaged, or of another version.
    QuestionError
        Where something is asked that only a model can answer.
    """
    if not _is_document(wanted.source):
        return None
    given = given_options(MODEL)
    if given:
        raise QuestionError(
            f"A stored explanation was asked its question already, so {', '.join(given)} must be left out. "
            "Give the model to ask another.",
        )
    from ratherthan.io._files import open_source
    from ratherthan.narrate import from_json

    with open_source(wanted.source, "an explanation") as file:
        data = file.read()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ExplanationError(
            f"An explanation must be text in UTF-8, but '{wanted.source}' is not, at byte {error.start}."
        ) from error
    explanation = from_json(text)
    if wanted.lexicon is None:
        return explanation
    from ratherthan.apps.words import read_lexicon

    return replace(explanation, lexicon=read_lexicon(wanted.lexicon, explanation.lexicon or Lexicon()))


def given_options(but: Collection[str]) -> list[str]:
    """Return the options on the command line, without some of them, as they are typed."""
    context = click.get_current_context()
    return [
        parameter.opts[-1]
        for parameter in context.command.params
        if parameter.name not in but
        and parameter.name is not None
        and context.get_parameter_source(parameter.name) is ParameterSource.COMMANDLINE
    ]


def _is_document(source: str) -> bool:
    """Return whether a source is a file that looks like the document of an explanation, and like no model in JSON."""
    if not source.lower().endswith(".json") or "\0" in source or not os.path.isfile(source):  # noqa: PTH113 - may be no path
        return False
    with Path(source).open("rb") as file:
        head = file.read(HEAD)
    bare = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    return bare.startswith(b"{") and KEYS.search(head) is not None and OTHERS.search(head) is None
