"""``ratherthan report``: a model or a stored explanation enters, a page leaves."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.asking import question_options
from ratherthan.apps.options import Command, Wanted, file_option, measure_options, source_options

EXAMPLES = (
    "ratherthan report example:paper-5x5 --output town.html",
    "ratherthan explain example:office --output office.json",
    "ratherthan report office.json --output office.html",
)
SUFFIXES = (".html", ".htm")


@click.command("report", cls=Command, examples=EXAMPLES, short_help="Write a page: text, map and numbers.")
@source_options("properties", "discount", "constants", "start", "lexicon")
@question_options
@measure_options
@file_option(".html")
def command(wanted: Wanted, output: str | None, **given: Any) -> None:
    """Write one page about the plan of SOURCE: what it does and why, the map, the numbers, and how they were computed.

    SOURCE may also be an explanation that was stored by `ratherthan explain --output route.json`.

    The page is one file of HTML that needs no network. Where there would be more than 12 sentences about steps, there are at
    most 7; --at-most says otherwise.
    """
    from ratherthan.apps.asked import explanation_of
    from ratherthan.apps.output import check_binary, check_suffix, send
    from ratherthan.apps.stored import stored_explanation
    from ratherthan.apps.waiting import waiting
    from ratherthan.report import report

    check_suffix(output, SUFFIXES)
    check_binary(output, "A page")
    explanation = stored_explanation(wanted) or explanation_of(wanted, given, usable=True)
    with waiting("Writing the page"):
        page = report(explanation)
    send([page.html], output)
