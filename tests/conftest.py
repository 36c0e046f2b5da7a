"""Fixtures of all tests: data of others, golden files, and how many examples hypothesis tries."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from browsing import Seen, opened, visiting
from hypothesis import HealthCheck, settings

ROOT = Path(__file__).resolve().parent.parent
GOLDEN = ROOT / "tests" / "golden"

# No deadline: the first example may compile a kernel. In CI the examples are the same ones every time.
settings.register_profile(
    "standard", deadline=None, derandomize="CI" in os.environ, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("quick", settings.get_profile("standard"), max_examples=10)
settings.register_profile("thorough", settings.get_profile("standard"), max_examples=2000)
settings.load_profile("standard")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write the golden files anew instead of comparing")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if "golden" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.golden)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder with models and maps that others published: ../shared/data, or RATHERTHAN_SHARED_DATA."""
    folder = Path(os.environ.get("RATHERTHAN_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"needs the published models and maps, which are not at {folder} (set RATHERTHAN_SHARED_DATA)")
    return folder


# For a module, not for the session: while it runs, its event loop is in the way of others in the same thread.
@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """The browser, a Browser of playwright's sync API; skips where there is none."""
    with opened() as browser:
        yield browser


@pytest.fixture
def visit(chromium: Any) -> Callable[..., AbstractContextManager[Seen]]:
    """``with visit(path_or_address, width=375, scheme="dark") as seen`` opens a page: see tests/browsing.py."""
    return partial(visiting, chromium)


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """``golden(name, text)`` compares `text` with tests/golden/`name`, or writes it there with --update-golden.

    The comparison is of bytes: line ends and the last newline count.
    """
    update = request.config.getoption("--update-golden")

    def compare(name: str, text: str) -> None:
        path = GOLDEN / name
        if update:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text.encode("utf-8"))
            return
        if not path.exists():
            pytest.fail(f"tests/golden/{name} does not exist: write it with `make golden` and review it", pytrace=False)
        expected = path.read_bytes().decode("utf-8")
        assert text == expected, f"differs from tests/golden/{name}; if that is meant: `make golden`"

    return compare
