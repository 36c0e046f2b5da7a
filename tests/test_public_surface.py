"""The shop window: what `import ratherthan` offers, and what it costs."""

from __future__ import annotations

import importlib.metadata
import inspect
import subprocess
import sys
import types
from pathlib import Path

import pytest

import ratherthan

SOURCE = Path(ratherthan.__file__).resolve().parent
ROOMS = sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))
HEAVY = ("click", "gymnasium", "numba", "pyarrow", "rich", "stormpy")


def python(code: str) -> str:
    """Run `code` in a fresh interpreter and return what it prints."""
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_all_is_sorted_and_names_nothing_twice():
    assert list(ratherthan.__all__) == sorted(set(ratherthan.__all__))


@pytest.mark.parametrize("name", ratherthan.__all__)
def test_every_name_in_the_window_can_be_had_and_says_what_it_is(name):
    thing = getattr(ratherthan, name)
    if isinstance(thing, type) or callable(thing):
        assert inspect.getdoc(thing), f"ratherthan.{name} has no docstring"


def test_nothing_public_lies_beside_the_window():
    stray = [
        name
        for name, thing in vars(ratherthan).items()
        if not name.startswith("_")
        and name not in ratherthan.__all__
        and not isinstance(thing, types.ModuleType)
        and name not in ("annotations", "TYPE_CHECKING")
    ]
    assert stray == []


def test_the_window_shows_no_module_in_place_of_a_verb():
    """Rooms and verbs share names (`explain`, `solve`): loading a room must not hide the verb."""
    code = f"""
import importlib, types, ratherthan
for room in {ROOMS!r}:
    importlib.import_module("ratherthan." + room)
print([name for name in ratherthan.__all__ if isinstance(getattr(ratherthan, name), types.ModuleType)])
"""
    assert python(code).strip() == "[]"


def test_importing_the_package_loads_none_of_the_heavy_libraries():
    code = f"import sys, ratherthan; print([name for name in {HEAVY!r} if name in sys.modules])"
    assert python(code).strip() == "[]"


def test_the_version_is_the_one_installed():
    if "__version__" not in vars(ratherthan) and not hasattr(ratherthan, "__version__"):
        pytest.skip("the package names no __version__")
    assert ratherthan.__version__ == importlib.metadata.version("ratherthan")


def test_the_package_ships_its_types():
    assert (SOURCE / "py.typed").exists()
