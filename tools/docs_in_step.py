"""The code enters, docs/cli.md, docs/schema/ and the README's picture leave: what is generated, and the check that it is in step.

Without arguments: compare, print what differs and exit with 1 if anything does. With ``--write``: write them anew.
"""

from __future__ import annotations

import argparse
import difflib
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import click

ROOT = Path(__file__).resolve().parent.parent
WIDTH = 100


def command_pages(command: click.Command, name: str, parent: click.Context | None = None) -> Iterator[tuple[str, str]]:
    """Yield (full name, help text) of `command` and all commands below it, in the order its help lists them."""
    settings = {**command.context_settings, "terminal_width": WIDTH, "max_content_width": WIDTH}
    context = click.Context(command, info_name=name, parent=parent, **settings)
    yield context.command_path, command.get_help(context)
    if isinstance(command, click.Group):
        for below in command.list_commands(context):
            child = command.get_command(context, below)
            if child is not None and not child.hidden:
                yield from command_pages(child, below, context)


def cli_page() -> str:
    from ratherthan.apps.cli import main

    parts = [
        "# The command line\n",
        "<!-- Written by `make docs` from the program itself: change the help texts there. -->\n",
    ]
    for name, text in command_pages(main, "ratherthan"):
        body = "\n".join(row.rstrip() for row in text.splitlines()).strip()
        parts.append(f"## {name}\n\n```text\n{body}\n```\n")
    return "\n".join(parts)


def schema_page() -> str:
    from ratherthan.explain.schema import schema

    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


def town_picture() -> str:
    import ratherthan as rt

    return rt.draw(rt.explain(rt.solve(rt.read("example:paper-5x5")))).svg


PAGES = {
    "docs/cli.md": cli_page,
    "docs/schema/explanation.schema.json": schema_page,
    "docs/town.svg": town_picture,
}


def main() -> int:
    parser = argparse.ArgumentParser(description="Check, or write, the pages that are generated from the code.")
    parser.add_argument("--write", action="store_true", help="write the pages anew")
    write = parser.parse_args().write
    behind = []
    for name, generate in PAGES.items():
        path, text = ROOT / name, generate()
        old = path.read_text(encoding="utf-8") if path.exists() else ""
        if text == old:
            continue
        behind.append(name)
        if write:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            print(f"{name}: written")
        else:
            rows = difflib.unified_diff(old.splitlines(), text.splitlines(), name, f"{name}, as generated", lineterm="")
            print("\n".join(rows))
    if behind and not write:
        print(f"Not in step with the code: {', '.join(behind)}. `make docs` writes them anew.", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
