"""``ratherthan study analyse``: a study's answers enter, a folder with a report on them leaves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ratherthan.apps.commands.study.numbers import FiniteRange
from ratherthan.apps.options import Command, argument, option

EXAMPLES = (
    "ratherthan study analyse export",
    "ratherthan study analyse export --output report --failed-checks 0",
    "ratherthan study analyse trust.csv --columns participant=seed,kind=condition --ratings trust=numTrustCorrect",
    "ratherthan study analyse wide.csv --columns participant=PID --ratings 'trust=trust_{kind}' --times 'time=seconds_{kind}'",
)


@click.command(
    "analyse",
    cls=Command,
    examples=EXAMPLES,
    short_help="Report on the answers: three layers of tests, figures, a paragraph for each hypothesis.",
)
@argument(
    "answers", tells="The folder that 'ratherthan study export' wrote, or a table of another study (CSV or Parquet)."
)
@option("-o", "--output", section="Output", metavar="FOLDER", default="report", help="Where the report goes.")
@option(
    "--contrasts",
    section="Question",
    metavar="A:B,C:D",
    help="The comparisons to look at, the first less the second.  [default: those planned for the paper's kinds, else all pairs]",
)
@option(
    "--failed-checks",
    section="Question",
    type=click.IntRange(min=0),
    default=1,
    metavar="N",
    help="So many attention checks may fail: who fails more is left out.",
)
@option(
    "--fastest",
    section="Question",
    type=FiniteRange(min=0.0),
    default=2.0,
    metavar="SECONDS",
    help="Who is faster than this at half of the trials is left out.",
)
@option("--unfinished", section="Question", is_flag=True, help="Count those, too, who did not finish.")
@option(
    "--columns",
    section="Source",
    metavar="ROLE=COLUMN,…",
    multiple=True,
    show_default=False,
    help="What the columns of another study's table are: participant, kind, map; item and value where a row holds one answer.",
)
@option(
    "--ratings",
    section="Source",
    metavar="NAME=COLUMN",
    multiple=True,
    show_default=False,
    help="A column of answers, or several by a pattern: 'trust=trust_{kind}', 'trust=t_{map}_{kind}'. Can be repeated.",
)
@option(
    "--times",
    section="Source",
    metavar="NAME=COLUMN",
    multiple=True,
    show_default=False,
    help="The same for times, in seconds.",
)
@option(
    "--choices",
    section="Source",
    metavar="A|B|neither=COLUMN",
    multiple=True,
    show_default=False,
    help="A column of choices, by what there was to choose from.",
)
@option(
    "--labels",
    section="Source",
    metavar="KIND=LABEL,…",
    multiple=True,
    show_default=False,
    help="What kinds are called, in the order in which they are shown.",
)
@option(
    "--scales",
    section="Source",
    metavar="NAME=1-5,…",
    multiple=True,
    show_default=False,
    help="The least and the most that a rating can be: then its answers are drawn, too.",
)
def command(answers: str, output: str, contrasts: str | None, **given: Any) -> None:
    """Write a report on ANSWERS.

    It says who answered, and holds the tests as the paper published them, those that respect that each person answered often, those that
    look at order only, choices, figures, and one paragraph for each hypothesis.
    """
    from ratherthan.apps.study.extra import require_study

    require_study()
    from ratherthan.apps.output import send_lines
    from ratherthan.apps.study.analysis.analyse import analysed, folder_for, read_answers, written
    from ratherthan.apps.study.analysis.excluding import Rules
    from ratherthan.apps.study.analysis.meaning import contrasts_in, meaning_of
    from ratherthan.apps.study.analysis.report import verdicts_of
    from ratherthan.apps.study.analysis.words import say
    from ratherthan.apps.waiting import waiting

    meaning = meaning_of(
        **{name: given[name] for name in ("columns", "ratings", "times", "choices", "labels", "scales")}
    )
    wanted = None if contrasts is None else contrasts_in(contrasts)
    rules = Rules(failed_checks=given["failed_checks"], fastest=given["fastest"], unfinished=given["unfinished"])
    with waiting("Analysing the answers") as tell:
        data = read_answers(Path(answers), meaning)
        folder_for(Path(output))
        found = analysed(data, rules=rules, contrasts=wanted, tell=tell)
        paths = written(found, Path(output))
    lines = [say("forms.simulated")] if found.data.simulated else []
    lines += [verdict.short or f"{verdict.name}: {verdict.text}" for verdict in verdicts_of(found)]
    lines.append(say("forms.written", report=paths[0], folder=output))
    send_lines(lines)
