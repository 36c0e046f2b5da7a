"""``ratherthan study serve``: a design enters, people and researchers are answered until the server is stopped."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.options import Command, argument, option

EXAMPLES = (
    "ratherthan study serve my-study",
    "ratherthan study serve my-study --host 0.0.0.0 --port 443 --certificate cert.pem --private-key key.pem",
    "ratherthan study serve my-study --database postgresql://researcher@localhost/study --url https://study.example.org",
)


@click.command("serve", cls=Command, examples=EXAMPLES, short_help="Let people take part.")
@argument("design", tells="The folder of a study.")
@option(
    "--database",
    section="Other",
    metavar="URL",
    help="postgresql://…, or the file of an SQLite database.  [default: a file in the study's folder]",
)
@option(
    "--host",
    section="Other",
    default="127.0.0.1",
    help="The address to listen at; 0.0.0.0 is every one of this machine.",
)
@option(
    "--port",
    section="Other",
    type=click.IntRange(0, 65535),
    default=8000,
    help="The port to listen at; 0 is any that is free.",
)
@option("--url", section="Output", metavar="URL", help="The address that people see, for the links that are printed.")
@option("--certificate", section="Other", type=click.Path(), metavar="FILE", help="A certificate, for https.")
@option("--private-key", section="Other", type=click.Path(), metavar="FILE", help="Its private key.")
@option(
    "--proxy",
    section="Other",
    metavar="IP",
    help="A reverse proxy on another machine: its word is taken on who asks, and whether by https.",
)
@option("--simulated", section="Other", is_flag=True, help="The participants are robots, in a database of their own.")
@option(
    "--log", section="Output", is_flag=True, help="Tell of every request: what was asked and answered, never who asked."
)
def command(design: str, **given: Any) -> None:
    """Serve DESIGN to people's browsers, and print the links for participants and for researchers.

    Every answer is on the disk before it is acknowledged. Stop the server with Ctrl-C and start it again as you like: participants go
    on where they were. The researchers' password is printed when the database is new; 'ratherthan study password' makes another.
    """
    from ratherthan.apps.study.extra import require_study

    require_study()
    from ratherthan.apps.study.server.front import Wanted, serve_design

    serve_design(design, Wanted(**given))
