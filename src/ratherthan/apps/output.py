"""Answers enter as text or bytes; they leave through standard output, or as a whole file."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable
from pathlib import Path

import click

from ratherthan.apps.door import one_line, silence
from ratherthan.errors import QuestionError, SourceError

__all__ = ["as_json", "check_binary", "check_suffix", "form_of", "on_terminal", "send", "send_line", "send_lines"]


def form_of(form: str | None, output: str | None, forms: tuple[str, ...]) -> str:
    """Return the format of an answer: what was asked for, else what the suffix of the file says, else the first."""
    if form is not None:
        return form
    suffix = Path(output or "").suffix.removeprefix(".").lower()
    return suffix if suffix in forms else forms[0]


def check_binary(output: str | None, what: str = "Parquet") -> None:
    """Raise QuestionError where what nobody reads as it is would be written to a terminal."""
    if output in (None, "-") and on_terminal():
        raise QuestionError(f"{what} must go to a file or a pipe, not to a terminal. Give --output FILE.")


def check_suffix(output: str | None, suffixes: tuple[str, ...]) -> None:
    """Raise SourceError where a file is to be written whose suffix says that it is something else."""
    if output not in (None, "-") and Path(str(output)).suffix.lower() not in suffixes and not _is_device(str(output)):
        raise SourceError(
            f"The file to be written must end in {' or '.join(suffixes)}, got '{output}'. Give it that suffix.",
            path=output,
        )


def _is_device(output: str) -> bool:
    """Whether something is there that is neither a file nor a folder: /dev/null, a pipe."""
    path = Path(output)
    return path.exists() and not path.is_file() and not path.is_dir()


def on_terminal() -> bool:
    """Whether standard output is a terminal."""
    return sys.stdout is not None and sys.stdout.isatty()


def _shows_colour(output: str | None) -> bool:
    """Whether colour would be seen, and nobody asked for none."""
    wanted = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    return wanted and output in (None, "-") and on_terminal()


def as_json(document: object) -> str:
    """Return a document as indented JSON with a line end."""
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def send_line(text: str, output: str | None = None) -> None:
    """Send one line of text, wrapped at words where it goes to a terminal; nothing at all where it is empty."""
    line = one_line(text)
    if not line:
        send([], output)
        return
    if output in (None, "-") and on_terminal():
        import shutil
        import textwrap

        width = max(20, shutil.get_terminal_size().columns)
        line = "\n".join(textwrap.wrap(line, width, break_long_words=False, break_on_hyphens=False))
    send([line + "\n"], output)


def send_lines(lines: Iterable[str], output: str | None = None) -> None:
    """Send lines as they are, their colours where they are seen."""
    colour = _shows_colour(output)
    send(((line if colour else click.unstyle(line)) + "\n" for line in lines), output)


def send(parts: Iterable[str | bytes | bytearray], output: str | None = None) -> None:
    """Send the parts of an answer, text as UTF-8, to standard output or into a file.

    Parameters
    ----------
    parts : iterable of str, bytes or bytearray
        May be made on the way: a long table is never held whole.
    output : str, optional
        A file, written whole or not at all; ``-`` is standard output.

    Raises
    ------
    SourceError
        Where they cannot be written.
    """
    # A lone surrogate, which JSON may smuggle into a name, has no bytes in UTF-8: it stays an escape, as in JSON.
    chunks = (part.encode("utf-8", "backslashreplace") if isinstance(part, str) else part for part in parts)
    if output is None or output == "-":
        _to_standard_output(chunks)
    elif _is_device(output):
        _to_device(output, chunks)
    else:
        from ratherthan.io._files import write_atomically

        with write_atomically(Path(output).resolve()) as file:
            file.writelines(chunks)


def _to_device(output: str, chunks: Iterable[bytes | bytearray]) -> None:
    """Write to a device or a pipe, which a file cannot replace."""
    try:
        with Path(output).open("wb") as device:
            device.writelines(chunks)
    except OSError as error:
        reason = error.strerror or str(error)
        raise SourceError(f"The output must be writable, but '{output}' is not: {reason}.", path=output) from error


def _to_standard_output(chunks: Iterable[bytes | bytearray]) -> None:
    """Write to standard output; a reader who left is no error."""
    if sys.stdout is None:  # closed by whoever started us
        return
    stream = getattr(sys.stdout, "buffer", None)
    try:
        sys.stdout.flush()
        for chunk in chunks:
            if stream is None:
                sys.stdout.write(chunk.decode("utf-8"))
            else:
                stream.write(chunk)
        (stream or sys.stdout).flush()
    except BrokenPipeError:
        silence(sys.stdout, sys.stderr)
        raise click.exceptions.Exit(0) from None
    except OSError as error:
        silence(sys.stdout)
        reason = error.strerror or str(error)
        raise SourceError(
            f"Standard output must be writable, but it is not: {reason}. The answer is not whole."
        ) from error
