"""``ratherthan tradeoffs``: a model and several objectives enter, the plans between which there is a choice leave."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.options import Command, Wanted, option, output_options, source_options

EXAMPLES = (
    "ratherthan tradeoffs example:pedestrians -p shortest --also safest",
    "ratherthan tradeoffs example:pedestrians -p shortest --also safest --at-most risk=1",
    "ratherthan tradeoffs example:pedestrians --policies plans",
)
FORMS = ("text", "json", "csv")


@click.command(
    "tradeoffs",
    cls=Command,
    examples=EXAMPLES,
    short_help="List the plans between several objectives, and their prices.",
)
@source_options("properties", "discount", "constants", "start")
@option(
    "--also",
    section="Question",
    metavar="TEXT",
    multiple=True,
    show_default=False,
    help="What else is wanted, as for --property; can be repeated.  [default: the least of each other reward]",
)
@option(
    "--at-most",
    section="Question",
    metavar="NAME=NUMBER",
    help="Also the best plan with no more than this of one reward.",
)
@option(
    "--at-least",
    section="Question",
    metavar="NAME=NUMBER",
    help="The same for a reward that is gathered.",
)
@option(
    "--most",
    section="Question",
    type=click.IntRange(min=2),
    default=20,
    metavar="N",
    help="Find so many plans at most, between the first objective and each of the others.",
)
@option(
    "--policies",
    section="Output",
    metavar="FOLDER",
    help="Write each plan to a file there, which --policy of other commands reads.",
)
@output_options(*FORMS)
def command(wanted: Wanted, form: str | None, output: str | None, **given: Any) -> None:
    """List the plans of SOURCE between which there is a real choice: what each costs, and what the next one gains."""
    from ratherthan.apps.output import as_json, form_of, send, send_lines
    from ratherthan.apps.plans import plan_csv, plan_document, plan_lines, tradeoffs_of, write_plans

    found = tradeoffs_of(wanted, given)
    files = {} if given["policies"] is None else write_plans(found, given["policies"])
    wanted_form = form_of(form, output, FORMS)
    if wanted_form == "json":
        send([as_json(plan_document(found, files))], output)
    elif wanted_form == "csv":
        send([plan_csv(found)], output)
    else:
        send_lines(plan_lines(found), output)
