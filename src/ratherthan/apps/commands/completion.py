"""``ratherthan completion``: the name of a shell enters, the script that completes the command in it leaves."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, argument

EXAMPLES = ("ratherthan completion bash", "ratherthan completion fish")


@click.command(
    "completion", cls=Command, examples=EXAMPLES, short_help="Print the script that completes the command in a shell."
)
@argument("shell", type=click.Choice(("bash", "zsh", "fish")), tells="The shell that you use.")
@click.pass_context
def command(context: click.Context, shell: str) -> None:
    """Print the script that completes ratherthan in SHELL.

    Load it at the start of a shell: in ~/.bashrc and ~/.zshrc as eval "$(ratherthan completion bash)" (or zsh), in
    ~/.config/fish/config.fish as ratherthan completion fish | source.
    """
    from click.shell_completion import get_completion_class

    from ratherthan.apps.output import send

    script = get_completion_class(shell)
    if script is None:
        raise click.UsageError(f"There is no completion for {shell}.")
    send([script(context.find_root().command, {}, "ratherthan", "_RATHERTHAN_COMPLETE").source() + "\n"])
