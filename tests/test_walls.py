"""Which room may know which library, read from the source itself: a second belt beside the import contracts.

The contracts in pyproject.toml know modules; this walk also sees imports inside functions under any name.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parent.parent / "src" / "ratherthan"
MODULES = sorted(path.relative_to(SOURCE).as_posix() for path in SOURCE.rglob("*.py"))

# library: (where it may be imported, as a test on the path within the package; the same in words)
HOMES = {
    "stormpy": (lambda path: path == "io/_storm.py", "io/_storm.py"),
    "gymnasium": (lambda path: path == "io/gymnasium.py", "io/gymnasium.py"),
    "numba": (lambda path: path.rpartition("/")[2] == "_kernels.py", "files named _kernels.py"),
    "llvmlite": (lambda path: path == "model/compiling/_kernels.py", "model/compiling/_kernels.py"),
    "lark": (lambda path: path.startswith("model/"), "model"),
    "distributed": (lambda path: path == "cluster/engine.py", "cluster/engine.py"),
    "dask": (lambda path: path == "cluster/engine.py", "cluster/engine.py"),
    "jinja2": (
        lambda path: path == "report/page.py" or path.startswith("apps/study/"),
        "report/page.py and apps/study",
    ),
    "click": (lambda path: path.startswith("apps/"), "apps"),
    "rich": (lambda path: path.startswith("apps/"), "apps"),
}


def imports(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield every module imported anywhere in `tree`, with its line; also by ``importlib.import_module("name")``."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module, node.lineno
            yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in ("import_module", "__import__") and isinstance(node.args[0].value, str):
                yield node.args[0].value, node.lineno


def strangers(path: str, text: str) -> list[str]:
    """Return a sentence for each import in the module at `path` that its room may not make."""
    found = []
    for module, line in imports(ast.parse(text)):
        library = module.partition(".")[0]
        allowed, home = HOMES.get(library, (None, ""))
        if allowed is not None and not allowed(path):
            found.append(f"{path}:{line} imports {library}, which belongs in {home}")
        inside = path.startswith("apps/") or path == "__main__.py"
        if (module == "ratherthan.apps" or module.startswith("ratherthan.apps.")) and not inside:
            found.append(f"{path}:{line} imports {module}: nothing inside the house imports a door")
    return found


@pytest.mark.parametrize("path", MODULES)
def test_a_library_is_imported_only_in_its_room(path):
    assert strangers(path, (SOURCE / path).read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("solve/sweeps.py", "import numba"),
        ("solve/kernels.py", "def f():\n    from numba import njit"),
        ("io/prism.py", "import stormpy.core as core"),
        ("io/prism.py", "import importlib\nimportlib.import_module('stormpy')"),
        ("io/prism.py", "def f():\n    from lark import Lark"),
        ("io/_gym_explore.py", "from gymnasium import spaces"),
        ("render/svg.py", "from rich.text import Text"),
        ("report/figure.py", "from jinja2 import Template"),
        ("cluster/batch.py", "def f():\n    from distributed import Client"),
        ("explain/route.py", "from ratherthan.apps import cli"),
        ("explain/route.py", "from ratherthan import apps"),
    ],
)
def test_a_library_in_the_wrong_room_is_found(path, text):
    assert len(strangers(path, text)) > 0


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("solve/_kernels.py", "from numba import njit"),
        ("io/_storm.py", "import stormpy"),
        ("io/gymnasium.py", "def f():\n    import gymnasium"),
        ("model/reading.py", "from lark import Lark"),
        ("report/page.py", "def f():\n    from jinja2 import Environment"),
        ("apps/cli.py", "import click\nfrom ratherthan.apps import text"),
        ("__main__.py", "from ratherthan.apps.cli import run"),
    ],
)
def test_a_library_in_its_room_is_let_be(path, text):
    assert strangers(path, text) == []
