"""``ratherthan explain``: a model enters, the explanation of its plan leaves."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.clustered import cluster_options, explain_in_blocks
from ratherthan.apps.options import Command, Wanted, measure_options, option, output_options, source_options

EXAMPLES = (
    "ratherthan explain example:paper-5x5",
    "ratherthan explain example:paper-5x5 --state 10 --rather-than south",
    "ratherthan explain example:delivery -p safest --also time",
    "ratherthan explain example:paper-5x5 --output route.json",
)
KIND_NAMES = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")
FORMS = ("text", "json")


@click.command("explain", cls=Command, examples=EXAMPLES, short_help="Say what the plan does, and why.")
@source_options("properties", "discount", "constants", "start", "lexicon")
@cluster_options(explain_in_blocks)
@option(
    "--kind",
    section="Question",
    type=click.Choice(KIND_NAMES),
    metavar="KIND",
    help=f"Which explanation: {', '.join(KIND_NAMES)}.  [default: contrastive]",
)
@option(
    "--scope",
    section="Question",
    type=click.Choice(("state", "route")),
    help="In place of a kind: one step, or all of them.",
)
@option(
    "--factors",
    section="Question",
    metavar="A,B",
    help="In place of a kind: of selectiveness, responsibility and constrictiveness, those that are told.",
)
@option(
    "--state",
    section="Question",
    metavar="STATE",
    help="Where: a number from 0, or an exact name.  [default: the initial state]",
)
@option("--rather-than", section="Question", metavar="ACTION", help="Why not this action, at the one state?")
@option(
    "--also",
    section="Question",
    metavar="TEXT",
    multiple=True,
    show_default=False,
    help="Judge the plan and its alternatives by this, too: a property, its name in the source, or a reward that counts until the goal; can be repeated.",
)
@option("--detail", section="Question", is_flag=True, help="Say also what the other actions would lead to.")
@measure_options
@output_options(*FORMS)
def command(wanted: Wanted, form: str | None, output: str | None, **given: Any) -> None:
    """Say what the plan of SOURCE does, and why this rather than that."""
    from ratherthan.apps.asked import explanation_of
    from ratherthan.apps.output import form_of, send, send_line
    from ratherthan.narrate import narrate, to_json

    explanation = explanation_of(wanted, given)
    if form_of(form, output, FORMS) == "json":
        send([to_json(explanation)], output)
    else:
        send_line(narrate(explanation), output)
