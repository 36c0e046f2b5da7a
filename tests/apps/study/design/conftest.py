"""A study as `ratherthan study new` makes it, computed once and copied for each test that changes it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from ratherthan.apps.study.design.reading import FILE
from ratherthan.apps.study.design.writing import New, new_study


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The default study; not to be changed."""
    folder = tmp_path_factory.mktemp("studies") / "study"
    new_study(folder, New())
    return folder


@pytest.fixture
def study(made: Path, tmp_path: Path) -> Path:
    """A copy of it that a test may change."""
    return Path(shutil.copytree(made, tmp_path / "study"))


@pytest.fixture
def changed(study: Path) -> Callable[..., Path]:
    """Replace pieces of the design's text, each of which must be there, and return the folder."""

    def change(*pairs: tuple[str, str]) -> Path:
        text = (study / FILE).read_text(encoding="utf-8")
        for old, new in pairs:
            assert old in text, old
            text = text.replace(old, new, 1)
        (study / FILE).write_text(text, encoding="utf-8")
        return study

    return change
