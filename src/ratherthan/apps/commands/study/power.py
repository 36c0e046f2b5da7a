"""``ratherthan study power``: a model of responses enters, how many people each planned comparison needs leaves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ratherthan.apps.commands.study.numbers import FiniteRange
from ratherthan.apps.options import Command, option, output_options

EXAMPLES = (
    "ratherthan study power",
    "ratherthan study power --factor 0.5 --item trust",
    "ratherthan study power --model responses.toml --people 420 --format json",
)
FORMS = ("text", "json", "csv")


@click.command("power", cls=Command, examples=EXAMPLES, short_help="Say how many people are needed, by simulation.")
@option(
    "--item",
    "items",
    section="Question",
    multiple=True,
    show_default=False,
    metavar="NAME",
    help="understanding, trust, time or another item of the model; can be repeated.  [default: understanding, trust and time]",
)
@option(
    "--factor",
    section="Question",
    type=FiniteRange(0.0, 100.0),
    default=1.0,
    metavar="F",
    help="Multiply the model's differences between kinds; 0: none differ.",
)
@option(
    "--people",
    section="Question",
    type=click.IntRange(4, 5000),
    default=252,
    metavar="N",
    help="Look at studies of up to so many people.",
)
@option(
    "--power",
    "wanted",
    section="Question",
    type=FiniteRange(0.05, 0.999),
    default=0.8,
    metavar="P",
    help="How often a difference is to be found.",
)
@option(
    "--maps",
    section="Question",
    type=click.IntRange(1, 50),
    default=3,
    metavar="M",
    help="How many maps each person sees.",
)
@option("--kinds", section="Question", metavar="A,B,…", help="Kinds of explanations.  [default: all seven]")
@option(
    "--lost",
    section="Question",
    type=FiniteRange(0.0, 0.95),
    default=0.15,
    metavar="SHARE",
    help="The share of those who finish that will be left out, as they fail checks or are too fast.",
)
@option(
    "--model",
    section="Source",
    metavar="FILE.toml",
    help="How people answer.  [default: the model that comes with the package, which is made up]",
)
@option(
    "--samples",
    section="Limits",
    type=click.IntRange(100, 1_000_000),
    default=2000,
    metavar="R",
    help="How many studies are simulated.",
)
@option("--seed", section="Limits", type=click.IntRange(min=0), default=1, metavar="N", help="Of the random numbers.")
@output_options(*FORMS)
def command(items: tuple[str, ...], form: str | None, output: str | None, **given: Any) -> None:
    """Say how many people each planned comparison needs to be found, if people answer as a model says.

    Whole studies are drawn from the model and analysed as 'ratherthan study analyse' does: paired t tests with Holm's correction.
    """
    from ratherthan.apps.output import as_json, form_of, send, send_lines
    from ratherthan.apps.study.robots import telling
    from ratherthan.apps.study.robots.model import read_model
    from ratherthan.apps.study.robots.power import Setting, powers
    from ratherthan.apps.waiting import waiting

    lost = float(given["lost"])
    setting = Setting(
        kinds=telling.kinds_in(given["kinds"]),
        most=given["people"],
        **{name: given[name] for name in ("maps", "samples", "factor", "seed", "wanted")},
    )
    responses = read_model(None if given["model"] is None else Path(given["model"]))
    wanted_items = telling.items_in(items, responses)
    with waiting("Simulating studies") as tell:
        found = [powers(responses, item, setting, tell) for item in wanted_items]
    wanted_form = form_of(form, output, FORMS)
    if wanted_form == "json":
        send([as_json(telling.document(found, responses, lost))], output)
    elif wanted_form == "csv":
        send([telling.table(found, lost)], output)
    else:
        send_lines(telling.lines(found, responses, lost), output)
