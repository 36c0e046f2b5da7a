"""``ratherthan study new``: maps enter, the folder of a new study leaves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from ratherthan.apps.driving import driving_options
from ratherthan.apps.options import Command, argument, option

EXAMPLES = (
    "ratherthan study new my-study",
    "ratherthan study new another --map example:city-1 --map example:city-2 --kinds none,naive-path,contrastive",
)
DRIVING = driving_options(option)


def _driving(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of maps of cells."""
    for add in reversed(list(DRIVING.values())):
        command = add(command)
    return command


@click.command("new", cls=Command, examples=EXAMPLES, short_help="Make a study: the paper's, or one of your own maps.")
@argument("folder", tells="The new folder.")
@option(
    "--map",
    "maps",
    section="Source",
    metavar="SOURCE",
    multiple=True,
    show_default=False,
    help="A map, or any model that 'ratherthan explain' takes; again for each further one.  [default: three maps that come along]",
)
@option(
    "-p",
    "--property",
    "text",
    section="Source",
    metavar="TEXT",
    help="What the routes are best at.  [default: the maps' own]",
)
@option("--start", section="Source", metavar="STATE", help="Where the routes begin.  [default: the maps' own]")
@option("--kinds", section="Question", metavar="A,B", help="Which kinds of explanation.  [default: all seven]")
@option(
    "--language",
    section="Output",
    metavar="TAG",
    default="en",
    help="Of the pages: en, de. In another language they are English, to be translated.",
)
@option(
    "--ages",
    section="Output",
    type=click.Choice(("adults", "paper")),
    default="adults",
    help="Which age bands are offered: from 18 on, or the paper's, which begin at 0.",
)
@option(
    "--quota",
    section="Output",
    type=click.IntRange(min=1),
    metavar="N",
    help="How many people.  [default: two rounds of the plan]",
)
@option(
    "--at-most",
    section="Question",
    type=click.IntRange(min=1, max=1000),
    metavar="N",
    help="At most N sentences about the moves of a route.  [default: one for each move that is told]",
)
@_driving
def command(folder: str, maps: tuple[str, ...], text: str | None, kinds: str | None, **given: Any) -> None:
    """Make FOLDER with a study: its file, its maps, and its explanations, computed once.

    Without maps it is the study of Chen, Boggess and Feng (2020): three road maps, seven kinds of explanation, two ratings after
    each, four choices for each map.
    """
    from pathlib import Path

    from ratherthan.apps.output import send_lines
    from ratherthan.apps.study.design.writing import New, new_study, next_steps
    from ratherthan.apps.waiting import waiting

    drive = {key: value for key in DRIVING if (value := given.pop(key)) is not None}
    chosen = tuple(name.strip() for name in (kinds or "").split(",") if name.strip())
    wanted = New(maps=maps, kinds=chosen, property=text, drive=drive, **given)
    with waiting("Computing the explanations") as tell:
        new_study(Path(folder), wanted, tell=tell)
    send_lines(next_steps(folder, wanted))
