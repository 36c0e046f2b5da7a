"""A list of screens enters, a small server that speaks the study's API leaves: for tests of the pages that need no database.

It keeps everything in memory, answers with the headers that a strict policy demands, and can be told to be away.
"""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

from ratherthan.apps.study import pages
from ratherthan.apps.study.design.nouns import Screen

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; frame-src 'self'; base-uri 'none'; "
    "frame-ancestors 'self'; form-action 'self' https://www.mturk.com https://workersandbox.mturk.com"
)
TYPES = {"js": "text/javascript", "css": "text/css", "txt": "text/plain", "svg": "image/svg+xml"}
MAP = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="400" height="400" viewBox="0 0 400 400"><rect width="400" height="400" fill="#fff"/>'
    '<path d="M40 40H360V360" fill="none" stroke="#06c" stroke-width="12"/></svg>'
)


@dataclass
class Taking:
    """One participant: where they are, and what they answered."""

    place: int = 0
    attempts: int = 0
    tries: int = 0
    state: str = "running"
    answers: dict[str, dict[str, Any]] = field(default_factory=dict)
    opened: list[str] = field(default_factory=list)
    times: list[dict[str, Any]] = field(default_factory=list)


@dataclass
class Fake:
    """The server's whole state, which tests read and change."""

    screens: Sequence[Screen]
    study: dict[str, Any]
    start: str = ""  # the screen at which people come in; the first one if empty
    tries: int = 2
    away: str | None = None  # "down": the connection breaks; a number: that status
    paused: bool = False
    ending: dict[str, Any] | None = None
    address: str = ""
    people: dict[str, Taking] = field(default_factory=dict)
    platforms: list[dict[str, str]] = field(default_factory=list)
    withdrawn: list[dict[str, Any]] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    posted: list[tuple[str, dict[str, list[str]]]] = field(default_factory=list)
    pages: dict[str, str] = field(default_factory=dict)  # further pages: path to HTML
    picture: str = MAP
    picture_faults: int = 0  # so many times the picture is not there

    def reply(self, person: Taking, *, again: bool = False) -> dict[str, Any]:
        """Return what /api/now says, and open an attempt."""
        state = "paused" if self.paused else person.state
        screen = self.screens[person.place] if person.place < len(self.screens) else None
        if screen is not None and screen.phase == "thanks":
            state = person.state = "finished"
        if state == "running":
            assert screen is not None
            person.attempts += 1
            person.opened.append(screen.id)
        shown = None
        if screen is not None and state in ("running", "finished"):
            shown = asdict(screen)
            for record in shown["records"]:
                record.pop("correct")
            where = None if screen.map is None else f"/media/{quote(screen.map, safe='')}.svg?v=1"
            shown["picture"] = where and {
                "address": where,
                "text": f"The map {screen.map}.",
                "width": 400,
                "height": 400,
            }
        return {
            "state": state,
            "screen": shown,
            "number": person.place + 1,
            "of": len(self.screens),
            "attempt": person.attempts,
            "study": {name: self.study[name] for name in ("title", "language", "contact")},
            "ending": None if state in ("running", "paused") else self.ending,
            "withdrawal_code": "WORD-WORD-1234",
            "again": again,
            "tries_left": self.tries - person.tries if again else None,
            "preview": False,
        }

    def answer(self, person: Taking, given: dict[str, Any]) -> dict[str, Any]:
        """Take an answer once, and return what comes next."""
        screen = self.screens[person.place]
        if given["screen"] != screen.id:
            return self.reply(person)
        right = all(r.correct is None or given["values"].get(r.name) == r.correct for r in screen.records)
        if screen.phase == "comprehension" and not right:
            person.tries += 1
            if person.tries < self.tries:
                return self.reply(person, again=True)
            person.state = "screened-out"
        if screen.phase == "consent" and given["values"].get("consent") == "no":
            person.state = "no-consent"
        person.answers[screen.id] = given
        person.place += 1
        return self.reply(person)


class Quiet(ThreadingHTTPServer):
    """A browser that goes away in the middle is no error."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


def handler(fake: Fake) -> type[BaseHTTPRequestHandler]:
    """Return the class that answers requests from `fake`."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the base class's name
            """Say nothing."""

        def send(self, status: int, kind: str, body: str | bytes) -> None:
            content = body.encode() if isinstance(body, str) else body
            self.send_response(status)
            self.send_header("Content-Type", f"{kind}; charset=utf-8")
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Content-Security-Policy", POLICY)
            self.send_header("X-Content-Type-Options", "nosniff")
            self.send_header("Referrer-Policy", "no-referrer")
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(content)

        def tell(self, status: int, content: Any) -> None:
            self.send(status, "application/json", json.dumps(content))

        def refuse(self, status: int, kind: str, place: str = "", sentence: str = "No.") -> None:
            self.tell(status, {"error": {"place": place, "kind": kind, "sentence": sentence}})

        def do_GET(self) -> None:
            asked = urlsplit(self.path)
            fake.asked.append(self.path)
            if asked.path.startswith("/api/"):
                self.api({})
            elif asked.path in fake.pages:
                self.send(200, "text/html", fake.pages[asked.path])
            elif asked.path == "/":
                self.send(200, "text/html", pages.render("entry.html", fake.study, platform=""))
            elif asked.path == "/withdraw":
                self.send(200, "text/html", pages.render("withdraw.html", fake.study))
            elif asked.path.startswith("/media/"):
                if fake.picture_faults > 0:
                    fake.picture_faults -= 1
                    self.send(503, "text/plain", "no")
                else:
                    self.send(200, "image/svg+xml", fake.picture)
            elif asked.path.startswith("/static/"):
                path = pages.STATIC / asked.path.removeprefix("/static/")
                self.send(200, TYPES[path.suffix[1:]], path.read_bytes())
            else:
                self.send(404, "text/html", pages.render("message.html", fake.study, kind="not-found"))

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            if self.path.startswith("/api/"):
                fake.asked.append(self.path)
                self.api(json.loads(body))
            else:
                fake.posted.append((self.path, parse_qs(body.decode())))
                self.send(200, "text/html", pages.render("message.html", fake.study, heading="Posted", paragraphs=[]))

        def api(self, given: dict[str, Any]) -> None:
            path = urlsplit(self.path).path
            if fake.away == "down":
                self.close_connection = True
                return
            if fake.away is not None:
                self.refuse(int(fake.away), "storage")
                return
            if path == "/api/enter":
                self.enter(given)
                return
            if path == "/api/withdraw":
                if given["code"] != "WORD-WORD-1234":
                    self.refuse(404, "code")
                    return
                fake.withdrawn.append(given)
                self.tell(200, {"state": "withdrawn", "erased": given["erase"]})
                return
            person = fake.people.get(self.headers.get("Authorization", "").removeprefix("Bearer "))
            if person is None:
                self.refuse(401, "token")
            elif path == "/api/now":
                self.tell(200, fake.reply(person))
            elif path == "/api/time":
                person.times.append(given)
                self.send(204, "text/plain", "")
            else:
                self.take(person, given)

        def enter(self, given: dict[str, Any]) -> None:
            fake.platforms.append(given["platform"])
            token = given.get("token")
            if token is not None and token not in fake.people:
                self.refuse(401, "token")
                return
            if token is None:
                token = f"token-{len(fake.people) + 1}"
                begin = [screen.id for screen in fake.screens].index(fake.start) if fake.start else 0
                fake.people[token] = Taking(place=begin)
            self.tell(200, {"token": token, "state": fake.people[token].state, "preview": False})

        def take(self, person: Taking, given: dict[str, Any]) -> None:
            values = given["values"]
            if values.get("age") == 99:
                self.refuse(422, "other", "values.age", "Ages end at 98 here.")
            elif "answer" in values and values["answer"] == "refuse":
                self.refuse(422, "control-characters", "values.answer")
            else:
                self.tell(200, fake.answer(person, given))

    return Handler


@contextmanager
def served(fake: Fake) -> Iterator[Fake]:
    """Serve `fake` on a free port of this machine."""
    server = Quiet(("127.0.0.1", 0), handler(fake))
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    fake.address = f"http://127.0.0.1:{server.server_port}"
    try:
        yield fake
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
