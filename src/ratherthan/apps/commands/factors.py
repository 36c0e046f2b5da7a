"""``ratherthan factors``: a model enters, the table of its factors leaves, a row per choice."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.options import Command, Wanted, measure_options, option, output_options, source_options

EXAMPLES = (
    "ratherthan factors example:paper-5x5",
    "ratherthan factors example:paper-5x5 --constrictiveness all --format json",
    "ratherthan factors example:paper-5x5 --output factors.csv",
)
FORMS = ("table", "json", "csv", "parquet")


@click.command(
    "factors", cls=Command, examples=EXAMPLES, short_help="Print the numbers behind the words, a row per choice."
)
@source_options("properties", "discount", "constants", "start")
@option(
    "--constrictiveness",
    section="Question",
    type=click.Choice(("route", "all")),
    default="route",
    help="Where the decisions left open are counted: on the route and at --state, or everywhere.",
)
@option(
    "--state", "states", section="Question", metavar="STATE", multiple=True, help="Count there too; can be repeated."
)
@option(
    "--work",
    section="Limits",
    type=click.IntRange(min=0),
    metavar="N",
    default=3000,
    help="Count with at most N million visits of a state; what is not counted by then is left out of the table, and said.",
)
@option(
    "--estimate",
    section="Limits",
    is_flag=True,
    help="Add columns with guesses at what was not counted, and their standard error, where it is known.",
)
@measure_options
@output_options(*FORMS)
def command(wanted: Wanted, form: str | None, output: str | None, **given: Any) -> None:
    """Print the three factors of every choice of SOURCE."""
    from ratherthan.apps.asked import factor_table_of
    from ratherthan.apps.output import check_binary, form_of, send
    from ratherthan.apps.tables import need_parquet, parts_of

    wanted_form = form_of(form, output, FORMS)
    if wanted_form == "parquet":
        check_binary(output)
        need_parquet()
    columns = factor_table_of(wanted, given)
    send(parts_of(wanted_form, columns), output)
