"""``ratherthan warmup``: compiled code is made for all that any command may need; where it lies leaves."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, option

EXAMPLES = ("ratherthan warmup", "ratherthan warmup --check", "ratherthan warmup --clear")


@click.command("warmup", cls=Command, examples=EXAMPLES, short_help="Compile ahead of time what large models need.")
@option("--check", section="Other", is_flag=True, help="Only say what is there.")
@option("--clear", section="Other", is_flag=True, help="Remove what is there, and make nothing.")
def command(check: bool, clear: bool) -> None:
    """Compile ahead of time what large models need, so that the first of them is answered as fast as the next.

    Small models need nothing of it. Compiled code is kept in the folder that NUMBA_CACHE_DIR names, else among the user's cached files, else in
    a folder for temporary files; it is for this processor and this version of the program. Nothing breaks when it is removed.
    """
    from ratherthan.apps.output import send_lines
    from ratherthan.apps.warming import cleared, made, standing

    if check and clear:
        raise click.UsageError("Either --check or --clear must be given, got both.")
    send_lines([cleared()] if clear else [standing()] if check else made())
