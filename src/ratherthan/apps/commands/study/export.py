"""``ratherthan study export``: a study's database enters, tidy tables and their codebook leave."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, argument, option

EXAMPLES = (
    "ratherthan study export my-study --output export",
    "ratherthan study export postgresql://researcher@localhost/study --output export",
)


@click.command("export", cls=Command, examples=EXAMPLES, short_help="Write the answers as tidy tables.")
@argument("study", tells="The folder of a study, or the database it was served with.")
@option("-o", "--output", section="Output", required=True, metavar="FOLDER", help="Where the tables go.")
@option("--simulated", section="Other", is_flag=True, help="Of a folder: the answers of robots, not of people.")
def command(study: str, output: str, simulated: bool) -> None:
    """Write the answers of STUDY as CSV and Parquet, a row per observation, with a codebook.

    It may be done while the study is served. What a platform calls a person is never exported.
    """
    from ratherthan.apps.study.extra import require_study

    require_study()
    from ratherthan.apps.output import send_lines
    from ratherthan.apps.study.server.front import export_study

    send_lines(export_study(study, output, simulated=simulated))
