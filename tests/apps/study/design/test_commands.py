"""The commands of a study's design, as a person types them."""

from __future__ import annotations

import importlib
import json
import re
import shlex
import subprocess
import sys

import click
import pytest

from ratherthan.apps.cli import GROUPS, main
from ratherthan.apps.commands.study import COMMANDS
from ratherthan.apps.options import SECTIONS

OURS = ("new", "check", "build")


def module(name):
    return importlib.import_module(f"ratherthan.apps.commands.study.{name}")


def test_the_examples_work_in_their_order(ask):
    for name in OURS:
        for example in module(name).EXAMPLES:
            program, *words = shlex.split(example)
            assert program == "ratherthan"
            result = ask(*words)
            assert (result.exit_code, result.stderr) == (0, ""), result.output


@pytest.mark.parametrize("name", OURS)
def test_every_option_has_a_help_and_a_section(name):
    for parameter in module(name).command.params:
        assert getattr(parameter, "section", None) in SECTIONS
        assert parameter.get_help_record(click.Context(module(name).command))[1]


@pytest.mark.parametrize("name", OURS)
def test_no_page_is_wider_than_a_terminal(ask, monkeypatch, name):
    monkeypatch.setenv("COLUMNS", "80")
    for line in ask("study", name, "--help").output.splitlines():
        assert len(line) <= 80 or line.removeprefix("  $ ") in module(name).EXAMPLES


def test_the_group_is_listed_and_lists_its_commands(said):
    assert "study" in GROUPS
    assert "  study " in said("--help")
    listed = said("study", "--help").split("Commands:\n")[1]
    assert set(OURS) <= set(COMMANDS)
    assert re.findall(r"^  (\w+) ", listed.split("\n\n")[0], re.MULTILINE) == list(COMMANDS)
    assert main.name == "ratherthan"


def test_an_unknown_command_of_the_group_is_refused(refused):
    assert "No such command 'sell'" in refused("study", "sell")


def test_check_tells_faults_a_line_each_and_ends_with_two(ask, study):
    text = (study / "design.toml").read_text(encoding="utf-8")
    text = text.replace("quota = 84", "quota = 0").replace('id = "trust"', 'id = "understanding"')
    (study / "design.toml").write_text(text, encoding="utf-8")
    result = ask("study", "check", study)
    assert result.exit_code == 2
    assert result.stderr == ""
    lines = result.stdout.splitlines()
    assert lines[0] == "Faults: 2"
    assert [line.split(": ")[1] for line in lines[1:]] == ["participants.quota", "items[2].id"]


def test_check_says_what_is_recorded_and_how_long_it_takes(said, made):
    text = said("study", "check", made)
    assert "A participant needs about 24 minutes (21 to 29)" in text
    assert "understanding  21     choice  points  1 = Strongly disagree" in text
    assert "m1   Ashbrook    14     6" in text
    assert "84 participants; the plan is balanced over every 42: 2 full rounds" in text


def test_check_as_json_is_json(document, made):
    found = document("study", "check", made)
    assert (found["faults"], found["round"], found["quota"]) == ([], 42, 84)
    assert len(found["codebook"]) == 12
    assert json.dumps(found, allow_nan=False)


def test_build_says_what_has_changed(said, study):
    assert said("study", "build", study) == "Nothing has changed.\n"
    path = study / "maps" / "ashbrook.roadmap"
    path.write_text(path.read_text(encoding="utf-8").replace("grid {number}", "field {number}"), encoding="utf-8")
    changed = said("study", "build", study)
    assert changed.startswith("Changed: m1")
    assert "m2" not in changed


def test_new_says_what_comes_next(said, tmp_path):
    text = said("study", "new", "my study", "--kinds", "none, naive-path")
    assert "ratherthan study check 'my study'" in text
    assert (tmp_path / "my study" / "design.toml").is_file()


def test_a_study_can_be_made_where_one_is(said, tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    said("study", "new", ".", "--kinds", "none,naive-path")
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == ["design.toml", "maps", "stimuli"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["here"]


@pytest.mark.parametrize(
    "words",
    [
        ("new",),
        ("new", "a", "--kinds", "magic"),
        ("new", "a", "--map", "gone.roadmap"),
        ("new", "a", "--quota", "0"),
        ("new", "a", "--language", "plain English"),
        ("new", "a", "--at-most", "0"),
        ("new", "a", "--map", "example:city-1", "--goal", "3,4"),
        ("build", "gone"),
        ("build", "\0"),
        ("new", "\0"),
        ("new", "/"),
        ("new", "x" * 5000),
    ],
)
def test_bad_input_is_refused_in_one_line(refused, words):
    refused("study", *words)


@pytest.mark.parametrize("path", ["gone", "/dev/null", "\0", "x" * 5000])
def test_checking_what_is_no_design_is_no_fault_of_the_program(ask, path):
    result = ask("study", "check", path)
    assert result.exit_code == 2
    assert "fault of the program" not in result.output


def test_help_needs_none_of_the_libraries_of_a_server():
    code = (
        "import sys\nfrom ratherthan.apps.cli import main\n"
        "main(['study', '--help'], standalone_mode=False)\n"
        "heavy = {'fastapi', 'uvicorn', 'sqlalchemy', 'jinja2', 'statsmodels', 'matplotlib', 'numpy', 'scipy', 'numba'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines()[-1] == "[]"


def test_a_design_is_made_and_checked_without_the_libraries_of_a_server(tmp_path):
    code = (
        "import sys\nfrom ratherthan.apps.cli import main\n"
        "for name in ('fastapi', 'uvicorn', 'sqlalchemy', 'jinja2', 'statsmodels', 'matplotlib', 'pyarrow', 'numba'):\n"
        "    sys.modules[name] = None\n"
        "main(['study', 'new', 'a'], standalone_mode=False)\n"
        "print(main(['study', 'check', 'a'], standalone_mode=False))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.endswith("None\n")
