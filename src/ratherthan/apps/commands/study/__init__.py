"""``ratherthan study``: the group of commands for studies with people, each loaded when it is asked for."""

from __future__ import annotations

import importlib
from pathlib import Path

import click

from ratherthan.apps.options import Command

__all__ = ["COMMANDS", "command"]

ORDER = ("new", "check", "build", "serve", "password", "export", "erase", "analyse", "power", "simulate")
"""As a study goes; the files beside this one are the commands."""
COMMANDS = tuple(name for name in ORDER if (Path(__file__).parent / f"{name}.py").is_file())


class Study(click.Group):
    """The commands of a study."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names of the commands, in the order in which help lists them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - click's
        """Return one command, None where there is none of that name."""
        if cmd_name not in COMMANDS:
            return None
        found: Command = importlib.import_module(f"ratherthan.apps.commands.study.{cmd_name}").command
        return found


@click.group(
    "study",
    cls=Study,
    invoke_without_command=True,
    short_help="Design, serve and analyse a study with people.",
    epilog="Begin with: ratherthan study new my-study",
)
@click.pass_context
def command(context: click.Context) -> None:
    """Ask people whether explanations help them: design a study, serve it to their browsers, analyse what they answered.

    A study is a folder that 'ratherthan study new' makes. Its file design.toml says what people read, what they are asked, and in which
    order; it is changed with any editor.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
