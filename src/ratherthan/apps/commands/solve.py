"""``ratherthan solve``: a model enters, its optimal value leaves with proved bounds."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.clustered import cluster_options, solve_in_blocks
from ratherthan.apps.options import Command, Wanted, option, output_options, source_options

EXAMPLES = (
    "ratherthan solve example:paper-5x5",
    "ratherthan solve example:paper-5x5 --start 10 --format json",
    "ratherthan solve example:delivery -p 'Pmax>=0.9 [F \"delivered\"]'",
)
FORMS = ("text", "json")


@click.command("solve", cls=Command, examples=EXAMPLES, short_help="Print the best value, with bounds that are proved.")
@source_options("properties", "discount", "constants", "start")
@cluster_options(solve_in_blocks, files=True)
@option(
    "--policy",
    section="Policy",
    metavar="FILE",
    help="The value of this policy (JSON, CSV, .npy, or an export of Storm or PRISM).",
)
@option("--minimise-q", section="Policy", is_flag=True, help="In a Q table the smallest number is taken.")
@output_options(*FORMS)
def command(wanted: Wanted, form: str | None, output: str | None, **given: Any) -> None:
    """Print the best value of SOURCE from its start, with bounds that are proved.

    A property that cannot be explained is handed to Storm, where it is installed; its answer has no bounds.
    """
    from ratherthan.apps.answers import value_lines
    from ratherthan.apps.asked import answer_of
    from ratherthan.apps.output import as_json, form_of, send, send_lines

    def told(document: dict[str, Any], text: str) -> None:
        if form_of(form, output, FORMS) == "json":
            send([as_json(document)], output)
        else:
            send_lines(value_lines(document, text), output)

    document, text = answer_of(wanted, told, **given)
    told(document, text)
    click.get_current_context().exit(1 if "limit" in document else 0)
