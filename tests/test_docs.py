"""Docs cannot lie: every example in README.md, docs/ and the docstrings is run, and what it shows is what comes.

In Markdown, the blocks of a file run in order:

* ``python`` blocks share one namespace per file; a ``text`` block right after one is what it prints;
* ``console`` blocks: each line ``$ ratherthan …`` is run, and the lines up to the next ``$`` are what it prints.
  ``...`` stands for anything, on one line or over several. Nothing shown means nothing compared.
  Other commands are not run. A block opened with ``console fails`` shows an error: its commands must fail;
* a block opened with ``no-run`` after its language is only read by people.
"""

from __future__ import annotations

import contextlib
import doctest
import importlib
import io
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [path for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))] if path.exists()]
SOURCE = ROOT / "src"
MODULES = sorted(
    ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")
    for path in (SOURCE / "ratherthan").rglob("*.py")
    if path.name != "__main__.py" and "migrations" not in path.parts  # these run within Alembic alone
)
# What modules may import that the package alone does not bring.
OPTIONAL = {
    "argon2",
    "alembic",
    "gymnasium",
    "httpx",
    "itsdangerous",
    "pyarrow",
    "sqlalchemy",
    "starlette",
    "stormpy",
    "uvicorn",
}
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
# A fixed width and no colours: what is printed depends on nothing but the program.
SURROUNDINGS = {
    "COLUMNS": "100",
    "NO_COLOR": "1",
    "TERM": "dumb",
    "PYTHONIOENCODING": "utf-8",
    "PYTHONWARNINGS": "error",
}


class Block(NamedTuple):
    language: str
    flags: tuple[str, ...]
    line: int  # of the first line inside the fence, from 1
    text: str
    follows: bool  # only blank lines since the block before


class Command(NamedTuple):
    line: int
    command: str
    expected: str


def blocks(text: str) -> list[Block]:
    """Return the fenced blocks of a Markdown page, those in lists included."""
    found: list[Block] = []
    opening: re.Match[str] | None = None
    inside: list[str] = []
    start = since = 0
    for number, line in enumerate(text.splitlines(), 1):
        fence = re.match(r"^(\s*)(`{3,}|~{3,})\s*([^`]*)$", line)
        if opening is None:
            if fence:
                opening, inside, start = fence, [], number + 1
            elif line.strip():
                since += 1
        elif fence and fence[2].startswith(opening[2]) and not fence[3].strip():
            language, *flags = opening[3].split() or [""]
            indent = len(opening[1])
            body = "".join(
                row[indent:] + "\n" if row[:indent].isspace() or not indent else row + "\n" for row in inside
            )
            found.append(Block(language, tuple(flags), start, body, since == 0 and bool(found)))
            opening, since = None, 0
        else:
            inside.append(line)
    assert opening is None, f"the block that begins at line {start - 1} is never closed"
    return found


def commands(block: Block) -> list[Command]:
    """Return the ``$`` lines of a console block, each with the lines that follow it; ``\\`` continues a line."""
    found: list[Command] = []
    rows = block.text.splitlines()
    i = 0
    while i < len(rows):
        line, row = block.line + i, rows[i]
        i += 1
        if not row.startswith("$ "):
            continue
        command = row[2:]
        while command.endswith("\\") and i < len(rows):
            command = command[:-1] + rows[i]
            i += 1
        expected = []
        while i < len(rows) and not rows[i].startswith("$ "):
            expected.append(rows[i])
            i += 1
        found.append(Command(line, command, "\n".join(expected).strip("\n")))
    return found


def matches(expected: str, got: str) -> bool:
    """Tell whether `got` is `expected`, where ``...`` stands for anything; blanks at line ends do not count."""
    want, have = ("\n".join(row.rstrip() for row in text.strip().splitlines()) for text in (expected, got))
    pattern = ".*?".join(re.escape(part) for part in want.split("..."))
    return re.fullmatch(pattern, have, flags=re.DOTALL) is not None


def show(page: str, line: int, expected: str, got: str) -> str:
    return f"{page}:{line} shows\n\n{expected}\n\nbut this came:\n\n{got}"


def run_python(page: str, block: Block, namespace: dict[str, Any]) -> str:
    code = compile("\n" * (block.line - 1) + block.text, page, "exec")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(code, namespace)
    return printed.getvalue()


def run_console(page: str, block: Block) -> None:
    fails = "fails" in block.flags
    here = Path(sys.executable).parent
    env = os.environ | SURROUNDINGS | {"PATH": f"{here}{os.pathsep}{os.environ.get('PATH', '')}"}
    for line, command, expected in commands(block):
        if command.split()[0] != "ratherthan":
            continue
        done = subprocess.run(
            command, shell=True, env=env, text=True, encoding="utf-8", check=False, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        word = "succeeded" if fails else f"failed with exit code {done.returncode}"
        assert (done.returncode != 0) == fails, f"{page}:{line} `{command}` {word}:\n{done.stdout}"
        if expected:
            assert matches(expected, done.stdout), show(page, line, expected, done.stdout)


def run_page(page: str, text: str) -> None:
    """Run all blocks of the page `text`, called `page` in messages, in the current folder."""
    namespace: dict[str, Any] = {"__name__": "__docs__"}
    printed = None
    for block in blocks(text):
        if block.language == "text" and block.follows and printed is not None:
            assert matches(block.text, printed), show(page, block.line, block.text, printed)
        printed = None
        if "no-run" in block.flags:
            continue
        if block.language == "python":
            printed = run_python(page, block, namespace)
        elif block.language == "console":
            run_console(page, block)


def needed(text: str) -> list[str]:
    """Return the optional libraries a page says it needs, in a comment such as ``<!-- needs: stormpy -->``."""
    return re.findall(r"<!--\s*needs:\s*(\w+)\s*-->", text)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_the_page_shows_what_comes(path, tmp_path, monkeypatch):
    text = path.read_text(encoding="utf-8")
    for library in needed(text):
        pytest.importorskip(library, reason=f"{path.name} needs {library}, which is not installed")
    monkeypatch.chdir(tmp_path)
    run_page(path.relative_to(ROOT).as_posix(), text)


@pytest.mark.parametrize("name", MODULES)
def test_the_docstrings_show_what_comes(name, tmp_path, monkeypatch):
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in OPTIONAL:
            raise
        pytest.skip(f"{name} needs {error.name}, which is not installed")
    monkeypatch.chdir(tmp_path)
    report = io.StringIO()
    runner = doctest.DocTestRunner(optionflags=OPTIONS)
    for example in doctest.DocTestFinder(exclude_empty=True).find(module, name):
        runner.run(example, out=report.write)
    assert runner.failures == 0, report.getvalue()


def page(*rows: str) -> str:
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        page("```python", "x = 1", "```", "words", "```python", "assert x == 2", "```"),
        page("```python", "print('north')", "```", "", "```text", "south", "```"),
        page("```console", "$ ratherthan no-such-command", "```"),
        page("```console fails", "$ ratherthan --help", "```"),
        page("```console", "$ ratherthan --help", "Usage: otherthan ...", "```"),
        page("```python", "never closed"),
    ],
)
def test_a_page_that_lies_is_found(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AssertionError):
        run_page("page.md", text)


@pytest.mark.parametrize(
    "text",
    [
        page("```python", "x = 1", "```", "words", "```python", "assert x == 1", "```"),
        page("```python", "print('north', 12)", "```", "", "```text", "north ...", "```"),
        page("```python no-run", "raise SystemExit", "```"),
        page("1. a list", "", "    ```python", "    if True:", "        x = 1", "    ```"),
        page("```console", "$ make run", "anything", "$ ratherthan --help", "Usage: ratherthan ...", "```"),
        page("```console fails", "$ ratherthan no-such-command", "```"),
    ],
)
def test_a_page_that_holds_is_let_be(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_page("page.md", text)
