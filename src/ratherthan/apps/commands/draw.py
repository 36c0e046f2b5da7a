"""``ratherthan draw``: a model or a stored explanation enters, a picture leaves."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.asking import question_options
from ratherthan.apps.options import Command, Wanted, measure_options, option, output_options, source_options

EXAMPLES = (
    "ratherthan draw example:paper-5x5 --output town.svg",
    "ratherthan draw example:paper-5x5 --what trees --state 10 --rather-than south --output trees.svg",
    "ratherthan draw example:office --what spread --output office.svg",
)
FORMS = ("svg", "png")
VIEWS = ("route", "graph", "value", "spread", "policy", "trees", "factors", "model")


@click.command("draw", cls=Command, examples=EXAMPLES, short_help="Draw the route, the values, or a decision.")
@source_options("properties", "discount", "constants", "start", "lexicon")
@option(
    "--what",
    section="Question",
    type=click.Choice(VIEWS),
    default="route",
    help="The route with its decisions, on the map or as a graph; on a map the value of each cell, how much its decision changes, "
    "or where the policy leads; of one state the search trees of two actions, or the factors of each; or the model alone.",
)
@question_options
@measure_options
@output_options(*FORMS)
def command(wanted: Wanted, what: str, form: str | None, output: str | None, **given: Any) -> None:
    """Draw the plan of SOURCE as SVG or PNG.

    SOURCE may also be an explanation that was stored by `ratherthan explain --output route.json`. Where more than 12 decisions would
    be told, at most 7 are; --at-most says otherwise.
    """
    from ratherthan.apps.output import check_binary, check_suffix, form_of, send
    from ratherthan.apps.pictures import picture_of
    from ratherthan.apps.waiting import waiting

    if form is None:
        check_suffix(output, tuple(f".{one}" for one in FORMS))
    wanted_form = form_of(form, output, FORMS)
    if wanted_form == "png":
        check_binary(output, "A PNG")
    picture = picture_of(wanted, what, given)
    with waiting("Drawing"):
        send([picture.svg if wanted_form == "svg" else picture.png()], output)
