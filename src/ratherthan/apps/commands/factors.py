"""``ratherthan factors``: a model enters, the table of its factors leaves, a row per choice."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.options import Command, Wanted, option, output_options, source_options

EXAMPLES = (
    "ratherthan factors example:paper-5x5",
    "ratherthan factors example:paper-5x5 --constrictiveness all --format json",
    "ratherthan factors example:paper-5x5 --output factors.csv",
)
FORMS = ("table", "json", "csv", "parquet")


@click.command(
    "factors", cls=Command, examples=EXAMPLES, short_help="Print the numbers behind the words, a row per choice."
)
@source_options("properties", "constants", "start")
@option(
    "--constrictiveness",
    section="Question",
    type=click.Choice(("route", "all")),
    default="route",
    help="Where the decisions left open are counted: on the route and at --state, or everywhere (slow on large models).",
)
@option(
    "--state", "states", section="Question", metavar="STATE", multiple=True, help="Count there too; can be repeated."
)
@option(
    "--alpha",
    section="Question",
    type=float,
    default=0.0,
    help="Decisions that change no more than this do not matter.",
)
@option(
    "--impact",
    section="Question",
    type=click.Choice(("action-value", "omega")),
    default="action-value",
    help="What makes a state critical: the cost of a step and all that follows, or what follows alone (the paper's).",
)
@option(
    "--values",
    section="Question",
    type=click.Choice(("optimum", "policy")),
    default="optimum",
    help="What follows a step: the best plan, or the one of --policy.",
)
@option(
    "--horizon",
    section="Question",
    type=click.IntRange(min=0),
    metavar="H",
    help="Look so many steps ahead for choices.",
)
@option(
    "--toward",
    section="Question",
    type=click.Choice(("goal",)),
    help="Look for choices only on the way to better states.",
)
@option(
    "--policy",
    section="Policy",
    metavar="FILE",
    help="Judge this policy (JSON, CSV, .npy, or an export of Storm or PRISM), not the best one.",
)
@option("--minimise-q", section="Policy", is_flag=True, help="In a Q table the smallest number is taken.")
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
