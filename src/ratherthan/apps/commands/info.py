"""``ratherthan info``: a model enters, what is in it leaves."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, Wanted, output_options, source_options

EXAMPLES = ("ratherthan info example:paper-5x5", "ratherthan info example:delivery --format json")
FORMS = ("text", "json")


@click.command(
    "info", cls=Command, examples=EXAMPLES, short_help="List what is in a model: sizes, labels, rewards, properties."
)
@source_options("constants", "start")
@output_options(*FORMS)
def command(wanted: Wanted, form: str | None, output: str | None) -> None:
    """List what is in SOURCE: sizes, labels, rewards, properties, actions, and what was repaired on reading."""
    from ratherthan.apps.answers import info_document, info_lines
    from ratherthan.apps.asked import problem_of
    from ratherthan.apps.output import as_json, form_of, send, send_lines

    document = info_document(problem_of(wanted))
    if form_of(form, output, FORMS) == "json":
        send([as_json(document)], output)
    else:
        send_lines(info_lines(document), output)
