"""``ratherthan convert``: a model enters, a file of another format leaves."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, Wanted, argument, source_options

EXAMPLES = (
    "ratherthan convert example:paper-5x5 town.umb",
    "ratherthan explain town.umb --kind selective",
)


@click.command(
    "convert", cls=Command, examples=EXAMPLES, short_help="Write a model to a .umb, .npz, .drn or .roadmap file."
)
@source_options("constants", "start")
@argument("target", tells="The new file: its suffix tells the format.")
def command(wanted: Wanted, target: str) -> None:
    """Write SOURCE to TARGET.

    A UMB archive (.umb) or a NumPy archive (.npz) holds its map, objective and words too, a road map (.roadmap) what can be
    drawn, Storm's explicit text (.drn) the model alone.
    """
    from ratherthan.apps.asked import problem_of
    from ratherthan.apps.waiting import waiting
    from ratherthan.io import write

    problem = problem_of(wanted)
    with waiting(f"Writing {target}"):
        write(problem, target)
