"""Fixtures of the study's server: designs, databases of both kinds, and a server in a thread."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("sqlalchemy", reason="needs the extra [study]")
pytest.importorskip("starlette", reason="needs the extra [study]")

from apps.study.server.clusters import cluster
from apps.study.server.settings import little, new_database
from apps.study.server.visitors import Visitor, query_of

from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.server.opening import Study, opened
from ratherthan.apps.study.server.researchers import entrance
from ratherthan.apps.study.server.running import robots_key, serving


@pytest.fixture
def design(tmp_path: Path) -> Design:
    """One map, three kinds, six orders: a study that is through in a few requests."""
    return little(tmp_path)


@pytest.fixture(scope="session")
def postgres() -> Iterator[str]:
    """The address of a PostgreSQL server."""
    with cluster() as url:
        yield url


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The address of a database with nothing in it."""
    if request.param == "sqlite":
        return str(tmp_path / "answers.sqlite3")
    return new_database(request.getfixturevalue("postgres"))


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    """Nobody's connection is left open after a test."""
    yield
    while Visitor.clients:
        Visitor.clients.pop().close()


@pytest.fixture
def served() -> Iterator[Callable[..., tuple[Study, str]]]:
    """``served(design, database)`` returns (study, address) of a server that runs until the test ends."""
    with ExitStack() as stack:

        def serve(design: Design, database: str, **how: Any) -> tuple[Study, str]:
            study = opened(design, database, **how)
            stack.callback(study.close)
            return study, stack.enter_context(serving(study))

        yield serve


@pytest.fixture
def visitor(served: Callable[..., tuple[Study, str]]) -> Callable[..., Visitor]:
    """``visitor(study, address)`` is somebody who came with the participants' link, or with another query."""

    def come(study: Study, address: str, platform: dict[str, str] | None = None, *, seed: int = 0) -> Visitor:
        usual = {"simulated": robots_key(study)} if study.simulated else query_of(entrance(study.secret, address))
        return Visitor(address, study.design, platform or usual, seed=seed)

    return come
