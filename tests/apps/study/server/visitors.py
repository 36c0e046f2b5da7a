"""A server's address enters, people who take part leave: a client that answers every screen, in tests of the server."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Mapping
from typing import Any, ClassVar
from urllib.parse import parse_qs, urlsplit

import httpx

from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.design.screens import screens


def query_of(link: str) -> dict[str, str]:
    return {name: values[0] for name, values in parse_qs(urlsplit(link).query).items()}


def right_answers(design: Design) -> dict[str, Any]:
    return {
        record.name: record.correct
        for screen in screens(design, 0)
        for record in screen.records
        if record.correct is not None
    }


class Visitor:
    """Somebody who takes part; `told` is what the server said last, `acknowledged` what it said it has stored."""

    clients: ClassVar[list[httpx.Client]] = []  # closed after each test

    def __init__(self, base: str, design: Design, platform: Mapping[str, Any], *, seed: int = 0) -> None:
        self.client = httpx.Client(base_url=base, timeout=30, trust_env=False)
        Visitor.clients.append(self.client)
        self.right = right_answers(design)
        self.platform = dict(platform)
        self.lot = random.Random(seed)
        self.token = ""
        self.told: dict[str, Any] = {}
        self.acknowledged: dict[str, dict[str, Any]] = {}
        self.waits = 0.0  # seconds for which a request is tried again

    def request(self, method: str, path: str, body: Any = None) -> httpx.Response:
        headers = {"Authorization": f"Bearer {self.token}"} if self.token else {}
        until = time.monotonic() + self.waits
        while True:
            try:
                answer = self.client.request(method, path, json=body, headers=headers)
                if answer.status_code not in (500, 502, 503) or time.monotonic() > until:
                    return answer
            except httpx.TransportError:
                if time.monotonic() > until:
                    raise
            time.sleep(0.05)

    def enter(self) -> dict[str, Any]:
        answer = self.request("POST", "/api/enter", {"platform": self.platform, "token": self.token or None})
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        self.token = found["token"]
        return found

    def now(self) -> dict[str, Any]:
        answer = self.request("GET", "/api/now")
        assert answer.status_code == 200, answer.text
        self.told = answer.json()
        return self.told

    def values(self) -> dict[str, Any]:
        """Return answers to the present screen: the right one where there is one, else any that is allowed."""
        found: dict[str, Any] = {}
        for record in self.told["screen"]["records"]:
            if record["name"] in self.right:
                found[record["name"]] = self.right[record["name"]]
            elif record["name"] == "consent":
                found[record["name"]] = "yes"
            elif record["options"]:
                found[record["name"]] = self.lot.choice(record["options"])["value"]
            elif record["type"] == "number":
                found[record["name"]] = int(record["least"] or 20)
            elif record["type"] == "flag":
                found[record["name"]] = True
            else:
                found[record["name"]] = f"because {self.lot.random()}"
        return found

    def post(self, values: Mapping[str, Any] | None = None, **other: Any) -> httpx.Response:
        body = {
            "screen": self.told["screen"]["id"],
            "attempt": self.told["attempt"],
            "values": self.values() if values is None else dict(values),
            "time_ms": self.lot.randrange(500, 5000),
            "hidden_ms": 0,
        }
        return self.request("POST", "/api/answer", {**body, **other})

    def step(self) -> dict[str, Any]:
        """Answer the present screen."""
        values, screen = self.values(), self.told["screen"]["id"]
        answer = self.post(values)
        assert answer.status_code == 200, answer.text
        self.acknowledged[screen] = values
        self.told = answer.json()
        return self.told

    def walk(self, until: Callable[[dict[str, Any]], bool] | None = None) -> dict[str, Any]:
        """Enter, and answer until the end, or until something is the case."""
        if not self.told:
            self.enter()
            self.now()
        while self.told["state"] == "running" and not (until is not None and until(self.told)):
            self.step()
        return self.told


def at(screen: str) -> Callable[[dict[str, Any]], bool]:
    return lambda told: bool(told["screen"]["id"] == screen)


def in_phase(phase: str) -> Callable[[dict[str, Any]], bool]:
    return lambda told: bool(told["screen"]["phase"] == phase)
