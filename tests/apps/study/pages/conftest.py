"""A design enters, a participant's page in a browser leaves: fixtures of the tests of the study's pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from apps.study.designs import small_design
from apps.study.pages.fake import Fake, served

from ratherthan.apps.study.design.nouns import Screen
from ratherthan.apps.study.design.screens import screens

pytest.importorskip("jinja2", reason="needs jinja2, which the extra study brings")

STUDY = {"title": "A small study", "language": "en", "contact": "researcher@example.org", "simulated": False}


@pytest.fixture
def listed(tmp_path: Path) -> tuple[Screen, ...]:
    """The screens of one participant: one of each phase, of a study with one map and three kinds."""
    return screens(small_design(tmp_path, maps=1, kinds=("none", "naive-path", "selective")), 0)


@pytest.fixture
def serve() -> Iterator[Callable[..., Fake]]:
    """``serve(screens, **state)`` starts a server of the study's API, which keeps all in memory."""
    with ExitStack() as stack:

        def start(shown: Sequence[Screen], **state: Any) -> Fake:
            return stack.enter_context(served(Fake(shown, {**STUDY, **state.pop("study", {})}, **state)))

        yield start
