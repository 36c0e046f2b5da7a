"""Fixtures of the cluster's tests: workers that are this process, and forget everything now and then."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from random import Random
from typing import Any

import pytest


class Here:
    """An engine whose workers are this process; with a chance it forgets what a worker had, before each call."""

    def __init__(self, workers: int, forgetting: float, random: Random) -> None:
        self.count, self.forgetting, self.random = workers, forgetting, random
        self.calls = 0

    def workers(self) -> list[str]:
        return [f"here-{k}" for k in range(self.count)]

    def submit(self, function: Callable[..., Any], *given: Any, at: str | None = None) -> Any:  # noqa: ARG002 - as Engine's
        from ratherthan.cluster import spreading

        self.calls += 1
        if self.random.random() < self.forgetting:
            spreading._held.clear()
        return function(*given)

    def all_of(self, pending: list[Any], meanwhile: object = None) -> list[Any]:  # noqa: ARG002 - as Engine's
        return pending


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """``here(forgetting=0.2)`` lets models be solved in blocks by workers that are this process."""

    def install(forgetting: float = 0.0, seed: int = 0) -> None:
        @contextmanager
        def engine(address: str | None = None, *, workers: int = 2) -> Iterator[Here]:
            yield Here(workers, forgetting, Random(seed))

        monkeypatch.setattr("ratherthan.cluster.blockwise.engine", engine)
        monkeypatch.setattr("ratherthan.cluster.blocks.here", lambda: "here-0")

    return install
