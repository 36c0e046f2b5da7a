"""``ratherthan study erase``: a participant enters; nothing of them is left but the day on which they were erased."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, argument, option

EXAMPLES = ("ratherthan study erase my-study P0042", "ratherthan study erase my-study k7qm-2xwd-9prt --yes")


@click.command("erase", cls=Command, examples=EXAMPLES, short_help="Erase one participant.")
@argument("study", tells="The folder of a study, or the database it was served with.")
@argument("participant", tells="The number in exports, the withdrawal code, or what the platform calls them.")
@option("--yes", section="Other", is_flag=True, help="Do not ask.")
@option("--simulated", section="Other", is_flag=True, help="Of a folder: the answers of robots, not of people.")
def command(study: str, participant: str, yes: bool, simulated: bool) -> None:
    """Erase PARTICIPANT from STUDY: all answers, times and ids. Another one will take their place.

    Tables that were exported before still have them: export anew. So have copies that were made of the database.
    """
    from ratherthan.apps.study.extra import require_study

    require_study()
    from ratherthan.apps.output import send_lines
    from ratherthan.apps.study.server.front import erase_participant, found_participant

    number = found_participant(study, participant, simulated=simulated)
    if not yes:
        click.confirm(f"Erase {number}, with all answers?", abort=True, err=True)
    send_lines(erase_participant(study, number, simulated=simulated))
