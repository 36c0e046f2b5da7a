"""``ratherthan study password``: a study enters, a new password for its researchers leaves."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, argument, option

EXAMPLES = ("ratherthan study password my-study", "ratherthan study password my-study --ask")


@click.command("password", cls=Command, examples=EXAMPLES, short_help="Make a new password for the researchers' pages.")
@argument("study", tells="The folder of a study, or the database it was served with.")
@option("--ask", section="Other", is_flag=True, help="Ask for a password of your own, at least 12 characters.")
@option("--simulated", section="Other", is_flag=True, help="Of a folder: the study of robots, not of people.")
def command(study: str, ask: bool, simulated: bool) -> None:
    """Give the researchers of STUDY a new password, and print it; whoever is logged in is not any more."""
    from ratherthan.apps.study.extra import require_study

    require_study()
    from ratherthan.apps.output import send_lines
    from ratherthan.apps.study.server.front import change_password

    own = click.prompt("Password", hide_input=True, confirmation_prompt=True, err=True) if ask else None
    send_lines(change_password(study, own, simulated=simulated))
