"""Every error becomes one line and an exit code, whatever it says."""

from __future__ import annotations

import click
import pytest
from click.testing import CliRunner

import ratherthan as rt
from ratherthan.apps.door import MOST_SAID, Door, one_line

ERRORS = [
    (rt.InputError("This must be that."), 2, "This must be that."),
    (rt.SourceError("A\nB"), 2, "A B"),
    (rt.MissingExtraError("It needs a library."), 2, "It needs a library."),
    (rt.UnsolvedError("The solver stopped."), 1, "The solver stopped."),
    (MemoryError(), 2, "memory"),
    (PermissionError(13, "Permission denied", "secret.umb"), 2, "'secret.umb': Permission denied"),
    (OSError("something"), 2, "something"),
    (ZeroDivisionError("oh"), 1, "fault of the program (ZeroDivisionError: oh)"),
    (RecursionError(), 1, "fault of the program"),
    (click.UsageError("What is this"), 2, "What is this."),
    (click.Abort(), 130, ""),
    (KeyboardInterrupt(), 130, ""),
]


def door(error: BaseException) -> Door:
    @click.command()
    def fail() -> None:
        raise error

    group = Door("ratherthan")
    group.add_command(fail)
    return group


@pytest.mark.parametrize(("error", "code", "part"), ERRORS, ids=lambda value: type(value).__name__)
def test_an_error_is_one_line_and_an_exit_code(error, code, part, monkeypatch):
    monkeypatch.delenv("RATHERTHAN_DEBUG", raising=False)
    result = CliRunner().invoke(door(error), ["fail"])
    assert result.exit_code == code
    assert result.stdout == ""
    assert part in result.stderr
    assert "Traceback" not in result.stderr
    if code != 130:
        assert result.stderr.startswith("ratherthan: ")
        assert result.stderr.count("\n") == 1


def test_no_line_is_endless():
    result = CliRunner().invoke(door(rt.InputError("x" * 100_000)), ["fail"])
    assert len(result.stderr) < MOST_SAID + 100


def test_other_programs_can_have_the_error_itself():
    with pytest.raises(ZeroDivisionError):
        door(ZeroDivisionError()).main(["fail"], standalone_mode=False)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("plain ρ ≤ 3", "plain ρ ≤ 3"),
        ("two\nlines\tand\r\nmore", "two lines and  more"),
        ("\x1b[31mred\x07", "�[31mred�"),
        ("left\u202eright", "left�right"),
        ("family 👨\u200d👩", "family 👨\u200d👩"),
        ("", ""),
    ],
)
def test_a_line_stays_a_line_and_steers_no_terminal(text, line):
    assert one_line(text) == line
