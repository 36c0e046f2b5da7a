"""A command and its words enter; its exit code leaves, and where it fails one line on standard error.

==== ===================================================================
code
==== ===================================================================
0    an answer, also "there is no way"; a reader who left early
2    bad input: a file, model, property, question or option; a model that the memory does not hold
1    a fault of the program, or a time limit that was reached before there was an answer
130  interrupted; 143 ended by another process
==== ===================================================================
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TextIO

import click

from ratherthan.apps import guard

if TYPE_CHECKING:
    from ratherthan.errors import RatherthanError

__all__ = ["Door", "code_of", "one_line", "say", "silence"]

MOST_SAID = 2000
"""No message is longer: what came may have been a whole file."""


class Door(click.Group):
    """A group of commands that translates every error into one line and an exit code."""

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        **extra: Any,
    ) -> Any:
        """Run the group; see `click.Command.main`."""
        if not standalone_mode:
            return super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
        try:
            result = super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
            code = result if isinstance(result, int) else 0
        except SystemExit as leaving:
            if not isinstance(leaving.__context__, BrokenPipeError):
                raise
            silence(sys.stdout, sys.stderr)
            code = 0
        except (click.Abort, KeyboardInterrupt) as interrupt:
            code = _interrupted(interrupt)
        except Exception as error:  # noqa: BLE001 - here every error becomes a line for the person who typed
            cause = error if guard.guard is None else guard.guard.cause(error)
            code = _refused(cause) if isinstance(cause, Exception) else _interrupted(cause)
        sys.exit(code)


def _interrupted(interrupt: BaseException) -> int:
    """Say nothing more and return the exit code."""
    silence(sys.stdout, sys.stderr)
    return (
        130
        if guard.guard is None or (isinstance(interrupt, click.Abort) and interrupt.__cause__ is None)
        else guard.guard.code
    )


def _refused(error: Exception) -> int:
    """Say what went wrong and return the exit code."""
    from ratherthan.errors import RatherthanError

    debugging = os.environ.get("RATHERTHAN_DEBUG", "0") not in ("", "0")
    if debugging and not isinstance(error, click.ClickException):
        import traceback

        traceback.print_exception(error)
    if isinstance(error, click.ClickException):
        say(_usage(error))
        return 2
    if isinstance(error, RatherthanError):
        say(error.message)
        return code_of(error)
    if isinstance(error, MemoryError):
        say("The memory of this machine must hold the model, but it does not suffice. Take a smaller model.")
        return 2
    if isinstance(error, OSError):
        named = f"'{error.filename}': " if isinstance(error.filename, str) else ""
        say(f"Files must be readable and writable, but the system says: {named}{error.strerror or error}.")
        return 2
    hint = "" if debugging else " Set RATHERTHAN_DEBUG=1 to see where it happened."
    say(
        f"This is a fault of the program ({type(error).__name__}: {error}). Please report it with the command and its input."
        + hint
    )
    return 1


def code_of(error: RatherthanError) -> int:
    """Return the exit code of an error: 2 for what is given, and for a model that the memory does not hold; else 1."""
    from ratherthan.errors import InputError, LimitError

    too_large = isinstance(error, LimitError) and error.place.get("limit") == "memory"
    return 2 if too_large or isinstance(error, InputError) else 1


def _usage(error: click.ClickException) -> str:
    """Return click's own message as a sentence, with the way to help."""
    sentence = error.format_message().strip()
    context = getattr(error, "ctx", None)
    if not sentence.endswith((".", "?", "!")):
        sentence += "."
    return sentence if context is None else f"{sentence} See '{context.command_path} --help'."


def say(message: str) -> None:
    """Write one line to standard error, whatever becomes of it."""
    line = one_line(message)
    if len(line) > MOST_SAID:
        line = line[:MOST_SAID] + " …"
    with suppress(OSError, ValueError):
        click.echo(f"ratherthan: {line}".encode("utf-8", "backslashreplace"), err=True)


def one_line(text: str) -> str:
    r"""Return text that stays on one line and cannot steer a terminal: names come from files of strangers.

    Examples
    --------
    >>> one_line("two\nlines"), one_line("red \x1b[31m")
    ('two lines', 'red �[31m')
    """
    if text.isprintable():
        return text
    plain = (" " if c in "\t\n\v\f\r\x85\u2028\u2029" else "�" if _steers(c) else c for c in text)
    return "".join(plain)


def _steers(character: str) -> bool:
    """Whether a character controls a terminal or the direction of writing."""
    return (
        character < " "
        or "\x7f" <= character < "\xa0"
        or character in "\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
    )


def silence(*streams: TextIO | None) -> None:
    """Let what is still to be written to `streams` go nowhere, so that the end of the process is silent."""
    for stream in streams:
        if stream is None:
            continue
        with suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
