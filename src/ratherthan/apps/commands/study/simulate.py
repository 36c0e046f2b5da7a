"""``ratherthan study simulate``: a design enters, robots take part in it through the server, an export marked as simulated leaves."""

from __future__ import annotations

from pathlib import Path

import click

from ratherthan.apps.commands.study.numbers import FiniteRange
from ratherthan.apps.options import Command, argument, option

EXAMPLES = (
    "ratherthan study simulate my-study --people 84 --output simulated",
    "ratherthan study simulate my-study --people 84 --output nothing --factor 0 --seed 7",
)


@click.command("simulate", cls=Command, examples=EXAMPLES, short_help="Let robots take part, to try a study out.")
@argument("design", tells="The folder of a study.")
@option(
    "-o",
    "--output",
    section="Output",
    metavar="FOLDER",
    required=True,
    show_default=False,
    help="Where the database and the export go.",
)
@option(
    "--people",
    section="Question",
    type=click.IntRange(1, 100_000),
    metavar="N",
    help="How many robots finish.  [default: the quota of the design]",
)
@option(
    "--factor",
    section="Question",
    type=FiniteRange(0.0, 100.0),
    default=1.0,
    metavar="F",
    help="Multiply the model's differences between kinds; 0: none differ.",
)
@option("--seed", section="Question", type=click.IntRange(min=0), default=1, metavar="N", help="Of the random numbers.")
@option(
    "--model",
    section="Source",
    metavar="FILE.toml",
    help="How robots answer.  [default: the model that comes with the package, which is made up]",
)
@option(
    "--at-once",
    section="Limits",
    type=click.IntRange(1, 500),
    default=20,
    metavar="N",
    help="So many robots answer at the same time.",
)
def command(design: str, output: str, people: int | None, **given: object) -> None:
    """Let robots take part in DESIGN through the server that people would use, and export their answers.

    All files are marked as simulated. The answers follow a model that is made up: they show that a study runs and what its analysis looks
    like, and say nothing on people.
    """
    from ratherthan.apps.study.extra import require_study

    require_study()
    from ratherthan.apps.output import send_lines
    from ratherthan.apps.study.analysis.words import listed, say
    from ratherthan.apps.study.design.reading import read_design
    from ratherthan.apps.study.robots.model import read_model
    from ratherthan.apps.study.robots.simulating import Run, simulated
    from ratherthan.apps.waiting import waiting

    read = read_design(design)
    model = read_model(None if given["model"] is None else Path(str(given["model"])))
    run = Run(
        people=read.quota if people is None else people,
        seed=int(str(given["seed"])),
        factor=float(str(given["factor"])),
        at_once=int(str(given["at_once"])),
    )
    with waiting("Simulating a study") as tell:
        found = simulated(read, model, run, Path(output), tell)
    ends = listed([f"{count} {state}" for state, count in sorted(found.ends.items())])
    send_lines([say("forms.simulated"), say("simulated.done", ends=ends, answers=found.answers, export=found.export)])
