"""``ratherthan study build``: a design enters, its explanations and pictures are computed anew and stored with it."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, argument

EXAMPLES = ("ratherthan study build my-study",)


@click.command("build", cls=Command, examples=EXAMPLES, short_help="Compute explanations and pictures anew.")
@argument("design", tells="The folder of a study.")
def command(design: str) -> None:
    """Compute the explanations and pictures of DESIGN anew, and say which of them are other than before."""
    from ratherthan.apps.output import send_lines
    from ratherthan.apps.study.design.stimuli import build
    from ratherthan.apps.waiting import waiting

    with waiting("Computing the explanations") as tell:
        changed = build(design, tell=tell)
    send_lines([f"Changed: {', '.join(changed)}." if changed else "Nothing has changed."])
