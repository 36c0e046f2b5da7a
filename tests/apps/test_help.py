"""Help teaches by example: the examples run, in their order, and the lists in it are those of the program."""

from __future__ import annotations

import importlib
import shlex

import click
import pytest

from ratherthan.apps.cli import COMMANDS, main
from ratherthan.apps.options import SECTIONS
from ratherthan.model.compiling import is_compiled


def commands():
    return {name: importlib.import_module(f"ratherthan.apps.commands.{name}") for name in COMMANDS}


def test_every_command_file_is_a_command():
    folder = importlib.import_module("ratherthan.apps.commands").__path__[0]
    from pathlib import Path

    files = {path.stem for path in Path(folder).glob("*.py")} - {"__init__"}
    assert files == set(COMMANDS)
    assert {name: module.command.name for name, module in commands().items()} == {name: name for name in COMMANDS}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_examples_of_a_command_work(ask, name):
    if name == "warmup" and not is_compiled(10**9):
        pytest.skip("compiling is switched off")
    examples = commands()[name].EXAMPLES
    assert 2 <= len(examples) <= 4
    for example in examples:
        program, *words = shlex.split(example)
        assert program == "ratherthan"
        result = ask(*words)
        assert (result.exit_code, result.stderr) == (0, ""), result.output


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_ends_with_its_examples(said, name):
    examples = commands()[name].EXAMPLES
    text = said(name, "--help")
    assert text.endswith("Examples:\n" + "".join(f"  $ {example}\n" for example in examples))


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_a_help_and_a_section(name):
    for parameter in commands()[name].command.params:
        assert getattr(parameter, "section", None) in SECTIONS
        record = parameter.get_help_record(click.Context(commands()[name].command))
        assert record is not None
        assert record[1]


def test_the_kinds_are_those_of_the_questions():
    from ratherthan.apps.asking import KIND_NAMES
    from ratherthan.explain import KINDS

    assert tuple(KINDS) == KIND_NAMES


def test_no_page_is_wider_than_a_terminal(ask, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    for name in COMMANDS:
        examples = commands()[name].EXAMPLES
        for line in ask(name, "--help").output.splitlines():
            assert len(line) <= 80 or line.removeprefix("  $ ") in examples


def test_the_group_lists_every_command(said):
    text = said("--help")
    assert [line.split()[0] for line in text.split("Commands:\n")[1].splitlines() if line.startswith("  ")][
        : len(COMMANDS)
    ] == list(COMMANDS)
    assert main.name == "ratherthan"
