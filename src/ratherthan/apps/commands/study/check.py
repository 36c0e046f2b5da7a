"""``ratherthan study check``: a design enters, all that is wrong or doubtful leaves, what is recorded, and how long it takes."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, argument, output_options

EXAMPLES = (
    "ratherthan study check my-study",
    "ratherthan study check my-study --format json",
)
FORMS = ("text", "json")


@click.command(
    "check", cls=Command, examples=EXAMPLES, short_help="Say what is wrong, what is recorded, and how long it takes."
)
@argument("design", tells="The folder of a study.")
@output_options(*FORMS)
@click.pass_context
def command(context: click.Context, design: str, form: str | None, output: str | None) -> None:
    """Say what is wrong or doubtful with DESIGN, what it records, and how long a participant needs.

    Faults keep it from being served, and end with exit code 2; warnings do not.
    """
    from ratherthan.apps.output import as_json, form_of, send, send_lines
    from ratherthan.apps.study.design.checking import check
    from ratherthan.apps.study.design.reporting import document, lines

    report = check(design)
    if form_of(form, output, FORMS) == "json":
        send([as_json(document(report))], output)
    else:
        send_lines(lines(report), output)
    if report.faults:
        context.exit(2)
