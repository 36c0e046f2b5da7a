"""How long people wait for the study's server: 200 of them answer at the same time, through its real door.

The server is a process of its own, on a new database; the 200 are connections of this one. *At once*: each page is answered by all in
the same moment, and only then the next: a server that takes a thousand answers a second needs a fifth of a second for them.
*Thinking*: everybody answers in their own time, a page every two seconds on average. The notes tell the median, the 99th percentile and
the longest of the times from sending an answer to having the next page, in which the answer is on the disk.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from benchmarks.harness import Case, Seen, UnavailableError

PEOPLE = 200
COMMAND = str(Path(sys.executable).parent / "ratherthan")
PAUSE = 2.0
PAGES = 12
"""Pages that each person answers: consent, instructions, check, then trials."""


class Person:
    """A connection that is kept, and what the server said last."""

    def __init__(self, host: str, port: int, right: dict[str, Any]) -> None:
        self.host, self.port, self.right = host, port, right
        self.token, self.told = "", dict[str, Any]()

    async def connect(self) -> None:
        """Open the connection."""
        self.reader, self.writer = await asyncio.open_connection(self.host, self.port)

    async def ask(self, method: str, path: str, body: Any = None) -> dict[str, Any]:
        """Send a request and return the answer; raise where it is none."""
        content = b"" if body is None else json.dumps(body).encode()
        head = f"{method} {path} HTTP/1.1\r\nHost: {self.host}\r\nContent-Length: {len(content)}\r\n"
        head += "Content-Type: application/json\r\n"
        head += f"Authorization: Bearer {self.token}\r\n" if self.token else ""
        self.writer.write(head.encode() + b"\r\n" + content)
        told = await self.reader.readuntil(b"\r\n\r\n")
        length = int(re.search(rb"content-length: (\d+)", told.lower())[1])  # type: ignore[index]
        answer = await self.reader.readexactly(length)
        if not told.startswith(b"HTTP/1.1 200"):
            raise RuntimeError(told.split(b"\r\n")[0].decode() + " " + answer[:200].decode())
        found: dict[str, Any] = json.loads(answer)
        return found

    async def enter(self, query: dict[str, str]) -> None:
        """Enter with the query of a link."""
        self.token = (await self.ask("POST", "/api/enter", {"platform": query}))["token"]
        self.told = await self.ask("GET", "/api/now")

    async def answer(self, lot: random.Random) -> float:
        """Answer the present page; return how long the next one took."""
        screen, values = self.told["screen"], {}
        for record in screen["records"]:
            name, options = record["name"], record["options"]
            value = self.right.get(name, options[0]["value"] if name == "consent" else None)
            values[name] = lot.choice(options)["value"] if value is None else value
        body = {
            "screen": screen["id"],
            "attempt": self.told["attempt"],
            "values": values,
            "time_ms": 4000,
            "hidden_ms": 0,
        }
        began = time.perf_counter()
        self.told = await self.ask("POST", "/api/answer", body)
        return time.perf_counter() - began


async def visits(address: str, link: str, right: dict[str, Any], *, at_once: bool) -> list[float]:
    """Let everybody answer; return how long each answer took."""
    parts, lot = urlsplit(address), random.Random(1)
    query = {name: values[0] for name, values in parse_qs(urlsplit(link).query).items()}
    folk = [Person(str(parts.hostname), int(parts.port or 80), right) for _ in range(PEOPLE)]
    for person in folk:
        await person.connect()
        await person.enter(query)
    waited: list[float] = []
    if at_once:
        for _ in range(PAGES):
            waited += await asyncio.gather(*(person.answer(lot) for person in folk))
    else:

        async def alone(person: Person) -> None:
            await asyncio.sleep(lot.uniform(0, 2 * PAUSE))
            for _ in range(PAGES):
                waited.append(await person.answer(lot))
                await asyncio.sleep(lot.uniform(0, 2 * PAUSE))

        await asyncio.gather(*(alone(person) for person in folk))
    for person in folk:
        person.writer.close()
    return waited


def served(*, at_once: bool) -> Callable[[], object]:
    """Return a function that serves a new study, and lets everybody answer."""

    def run() -> Seen:
        try:
            from ratherthan.apps.study.design.reading import read_design
            from ratherthan.apps.study.design.screens import screens
            from ratherthan.apps.study.extra import require_study

            require_study()
        except Exception as missing:
            raise UnavailableError(str(missing)) from missing
        with tempfile.TemporaryDirectory(prefix="ratherthan-study-") as place:
            folder = Path(place) / "study"
            subprocess.run([COMMAND, "study", "new", str(folder), "--quota", "252"], check=True, capture_output=True)
            shown = screens(read_design(folder), 0)
            right = {one.name: one.correct for screen in shown for one in screen.records if one.correct is not None}
            server = subprocess.Popen(
                [COMMAND, "study", "serve", str(folder), "--port", "0"],
                stdout=subprocess.PIPE,
                text=True,
                env=os.environ | {"NO_COLOR": "1"},
            )
            try:
                said = iter(server.stdout or ())
                link = next(found[0] for row in said if (found := re.search(r"http://\S+\?link=\S+", row)))
                address = f"http://127.0.0.1:{urlsplit(link).port}"
                waited = asyncio.run(visits(address, link, right, at_once=at_once))
            finally:
                server.terminate()
                server.wait()
                if server.stdout is not None:
                    server.stdout.close()
        middle, last = statistics.median(waited), statistics.quantiles(waited, n=100)[98]
        told = f"{len(waited)} answers, no error: median {middle * 1000:.0f} ms, p99 {last * 1000:.0f} ms, "
        return Seen(note=told + f"longest {max(waited) * 1000:.0f} ms")

    return run


def cases() -> list[Case]:
    """Return the cases."""
    return [
        Case(name=f"{PEOPLE} people, all at once", run=served(at_once=True), group="answers"),
        Case(name=f"{PEOPLE} people, thinking", run=served(at_once=False), group="answers"),
    ]
