"""``ratherthan batch``: a table of missions enters, a table of explanations leaves."""

from __future__ import annotations

import click

from ratherthan.apps.limits import Amount, Duration
from ratherthan.apps.options import Command, argument, option

EXAMPLES = (
    "ratherthan batch example:missions --output results.csv",
    "ratherthan batch example:missions --output results.jsonl --documents explanations --workers 1",
)
MOST_TOLD = 20


@click.command("batch", cls=Command, examples=EXAMPLES, short_help="Explain many missions, from a table into a table.")
@argument(
    "missions",
    tells="A table .csv, .jsonl or .parquet (or example:missions): a row per question, a column per option of explain.",
)
@option(
    "-o",
    "--output",
    section="Output",
    metavar="FILE",
    required=True,
    help="The table of results, .csv, .jsonl or .parquet; written whole when all rows are done.",
)
@option("--documents", section="Output", metavar="FOLDER", help="Write each explanation as a document there, too.")
@option("--resume", section="Output", is_flag=True, help="Go on with what an interrupted run left beside the output.")
@option(
    "--workers",
    section="Other",
    type=click.IntRange(min=1),
    metavar="N",
    help="How many processes.  [default: as many as there are processors]",
)
@option(
    "--cluster",
    section="Other",
    metavar="ADDRESS",
    help="A Dask scheduler, tcp://host:8786, whose workers do it instead.",
)
@option("--time-limit", section="Limits", type=Duration(), metavar="TIME", help="For each row, such as 10s or 2m.")
@option("--memory-limit", section="Limits", type=Amount(), metavar="SIZE", help="For each process, such as 4GB.")
def command(
    *,
    missions: str,
    output: str,
    documents: str | None,
    resume: bool,
    workers: int | None,
    cluster: str | None,
    time_limit: float | None,
    memory_limit: int | None,
) -> int:
    """Explain every row of the table MISSIONS.

    Columns have the names of explain's options: source, property, start, goal, state, rather_than, kind, also, policy and so on;
    id and those that begin with tag are carried along. Rows of one model share its solving. A row that fails is told and the
    others are done; then the exit code is not 0.
    """
    from ratherthan.apps.door import say
    from ratherthan.apps.waiting import waiting
    from ratherthan.cluster import explain_many
    from ratherthan.model.watch import Limits

    with waiting("Explaining") as tell:
        found = explain_many(
            missions,
            output,
            workers=workers,
            cluster=cluster,
            resume=resume,
            documents=documents,
            limits=Limits(seconds=time_limit, memory=memory_limit),
            tell=tell,
            note=say,
        )
    for row in found.failed[:MOST_TOLD]:
        say(f"row {row['row']} ({row['id']}): {row['error']}")
    if len(found.failed) > MOST_TOLD:
        say(f"{len(found.failed) - MOST_TOLD} more rows failed; the column 'error' says why.")
    return 0 if not found.failed else 1 if found.faults else 2
