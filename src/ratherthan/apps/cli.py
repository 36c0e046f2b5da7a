"""The words of a command line enter, the command that they ask for is run."""

from __future__ import annotations

import importlib
import sys
from contextlib import suppress

import click

from ratherthan.apps.door import Door, say, silence
from ratherthan.apps.guard import stand_guard
from ratherthan.model.compiling import tally

__all__ = ["COMMANDS", "GROUPS", "Ratherthan", "main", "run"]

COMMANDS = (
    "explain",
    "report",
    "draw",
    "factors",
    "solve",
    "tradeoffs",
    "verify",
    "info",
    "convert",
    "examples",
    "batch",
    "warmup",
    "completion",
)
GROUPS = ("study",)
"""Commands that have commands of their own."""


class Ratherthan(Door):
    """The group of all commands, each loaded when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names of the commands, in the order in which help lists them."""
        return [*COMMANDS, *GROUPS]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - click's
        """Return one command, None where there is none of that name."""
        if cmd_name not in (*COMMANDS, *GROUPS):
            return None
        command: click.Command = importlib.import_module(f"ratherthan.apps.commands.{cmd_name}").command
        return command


@click.group(
    name="ratherthan",
    cls=Ratherthan,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Each command has examples of its own: ratherthan explain --help",
)
@click.version_option(package_name="ratherthan", message="%(prog)s %(version)s")
@click.pass_context
def main(context: click.Context) -> None:
    """Explain plans of Markov decision processes: why this action rather than that one.

    A SOURCE is a bundled example (example:paper-5x5), a road map (.roadmap), a robot's map (MovingAI's .map, or the .yaml of the ROS
    map server), a PRISM or JANI model, a UMB archive
    (.umb), a NumPy archive (.npz), Storm's explicit text (.drn), or a Gymnasium environment (gym:FrozenLake-v1, with arguments after commas:
    gym:FrozenLake-v1,map_name=8x8,is_slippery=false) or its table (.json.gz).
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


def run() -> None:
    """Run the command line of this process, which signals end within a second."""
    standing = stand_guard(say)
    tally.announce = say
    try:
        standing.working = True
        main(prog_name="ratherthan")
    except KeyboardInterrupt:
        silence(sys.stdout, sys.stderr)
        standing.end(standing.code)
    except SystemExit as leaving:
        if (
            leaving.code == 1 and standing.limit_reached
        ):  # all is told: nobody waits for workers to be closed in good order
            with suppress(OSError, ValueError):
                sys.stdout.flush()
            standing.end(1)
        raise
    finally:
        standing.working = False
        if standing.signal:  # nothing is waited for, not even that a large model is forgotten
            standing.end(standing.code)
