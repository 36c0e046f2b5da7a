"""``ratherthan examples``: the names of the bundled examples leave, a line each."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, output_options

EXAMPLES = ("ratherthan examples", "ratherthan explain example:office")
FORMS = ("text", "json")


@click.command("examples", cls=Command, examples=EXAMPLES, short_help="List the bundled examples.")
@output_options(*FORMS)
def command(form: str | None, output: str | None) -> None:
    """List the models that come with the program; each is a SOURCE."""
    from ratherthan.apps.answers import example_documents, example_lines
    from ratherthan.apps.output import as_json, form_of, send, send_lines

    documents = example_documents()
    if form_of(form, output, FORMS) == "json":
        send([as_json({"examples": documents})], output)
    else:
        send_lines(example_lines(documents), output)
