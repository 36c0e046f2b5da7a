"""Requests of participants' browsers and of robots enter, JSON leaves: entering, the present screen, answers, times, withdrawing.

All that is acknowledged is committed. What cannot be taken is answered by {"error": {"place", "kind", "sentence"}}.
"""

from __future__ import annotations

import asyncio
import json
from typing import Any

from sqlalchemy import Connection
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from ratherthan.apps.study.server import sessions, tokens
from ratherthan.apps.study.server.arriving import come
from ratherthan.apps.study.server.database import Store
from ratherthan.apps.study.server.erasing import withdraw
from ratherthan.apps.study.server.limits import Limit
from ratherthan.apps.study.server.opening import Study
from ratherthan.apps.study.server.places import RUNNING
from ratherthan.apps.study.server.platforms import arrival
from ratherthan.apps.study.server.refusals import RefusedError
from ratherthan.apps.study.server.sessions import Posted
from ratherthan.apps.study.server.telling import told
from ratherthan.apps.study.server.values import body_of, clean_text, whole_number

__all__ = ["Api", "as_json", "machine_of"]

PEOPLE, LOOKS = "participant", "preview"
"""Salts of tokens: of those who count, and of previews."""
LOOK = "look"
LONGEST_TIME = 7 * 24 * 3600 * 1000
MOST_ATTEMPTS = 1_000_000


def as_json(document: Any, status: int = 200) -> Response:
    """Return an answer in JSON."""
    body = document if isinstance(document, bytes) else json.dumps(document, ensure_ascii=False).encode()
    return Response(body, status, media_type="application/json")


def machine_of(request: Request) -> str:
    """Return which machine asks: kept in memory alone, to count requests."""
    return request.client.host if request.client is not None else ""


class Api:
    """The routes of participants.

    Parameters
    ----------
    study : Study
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.entering = Limit(burst=400, each_second=5)  # a class of students behind one address enters at once
        self.asking = Limit(burst=400, each_second=10)  # of one participant
        self.strangers = Limit(burst=60, each_second=0.5)  # tokens and codes that are not ours

    def routes(self) -> list[Route]:
        """Return the routes."""
        return [
            Route("/api/enter", self.enter, methods=["POST"]),
            Route("/api/now", self.now, methods=["GET"]),
            Route("/api/answer", self.answer, methods=["POST"]),
            Route("/api/time", self.time, methods=["POST"]),
            Route("/api/withdraw", self.withdraw, methods=["POST"]),
            Route("/healthz", self.health, methods=["GET"]),
        ]

    async def enter(self, request: Request) -> Response:
        """Let somebody in: as a new participant, or as the one they were."""
        study, body = self.study, await _body(request)
        if not study.simulated:
            self.entering.take(machine_of(request))
        query = body.get("platform", {})
        if not isinstance(query, dict):
            raise RefusedError(422, "platform", "type", "The platform must be an object: the query of the address.")
        arrived = arrival(query, study.secret, simulated=study.simulated)
        if arrived.preview == LOOK:
            return await self._look()
        salt, store = (LOOKS, study.looks) if arrived.preview else (PEOPLE, study.store)
        old = body.get("token") or None
        kept = (
            None if old is None else tokens.read(study.secret, salt, clean_text(old, "token", longest=tokens.LONGEST))
        )
        key, state = await store.write(lambda connection: come(connection, study.course, arrived, kept))
        token = tokens.signed(study.secret, salt, key) if key else ""
        return as_json({"token": token, "state": state, "preview": bool(arrived.preview)})

    async def now(self, request: Request) -> Response:
        """Tell the present screen; an attempt at it begins."""
        store, key, preview = self._who(_bearer(request), request)
        if key == LOOK:
            return as_json(await study_look(self.study))
        course = self.study.course

        def job(connection: Connection) -> bytes:
            return told(connection, course, sessions.present(connection, course, key), preview=preview)

        return as_json(await store.write(job))

    async def answer(self, request: Request) -> Response:
        """Store an answer, and tell the next screen."""
        store, key, preview = self._who(_bearer(request), request)
        if key == LOOK:
            raise RefusedError(403, "token", "preview", "This is a preview: accept the task before you answer.")
        posted, course = _posted(await _body(request)), self.study.course

        def job(connection: Connection) -> bytes:
            return told(connection, course, sessions.answer(connection, course, key, posted), preview=preview)

        return as_json(await store.write(job))

    async def time(self, request: Request) -> Response:
        """Keep how long a screen was open so far; sent while a page is left."""
        body = await _body(request)
        token = body.get("token") or _bearer(request)
        store, key, _ = self._who(clean_text(token, "token", longest=tokens.LONGEST), request)
        posted = _posted({**body, "values": {}})
        if key != LOOK:
            await store.write(lambda connection: sessions.spend(connection, key, posted))
        return Response(status_code=204)

    async def withdraw(self, request: Request) -> Response:
        """Let a participant withdraw, by their code or by their token."""
        body, study = await _body(request), self.study
        code = body.get("code")
        erased = body.get("erase", False)
        if not isinstance(erased, bool):
            raise RefusedError(422, "erase", "type", "This must be true or false.")
        typed = None if code in (None, "") else clean_text(code, "code", longest=100).strip()
        store, key = study.store, None
        if typed is None:
            store, key, _ = self._who(_bearer(request), request)
        self.strangers.take(f"code {machine_of(request)}")
        done = await store.write(lambda connection: withdraw(connection, code=typed, key=key, erased=erased))
        if not done:
            raise RefusedError(404, "code", "code", "There is no such withdrawal code.")
        if erased:
            await asyncio.to_thread(store.forget)
        return as_json({"state": sessions.WITHDRAWN, "erased": erased})

    async def health(self, _request: Request) -> Response:
        """Tell whether the database can be written."""
        await self.study.store.write(lambda connection: connection.exec_driver_sql("SELECT 1").scalar_one())
        return as_json({"state": "ok"})

    async def _look(self) -> Response:
        """Let somebody look who has not accepted the task yet: no participant is made."""
        token = tokens.signed(self.study.secret, LOOKS, LOOK)
        return as_json({"token": token, "state": RUNNING, "preview": True})

    def _who(self, token: str, request: Request) -> tuple[Store, str, bool]:
        """Return (database, key, whether it is a preview) of whoever asks."""
        study = self.study
        key = tokens.read(study.secret, PEOPLE, token)
        preview = None if key is not None else tokens.read(study.secret, LOOKS, token)
        found = key or preview
        if found is None:
            self.strangers.take(machine_of(request))
            raise RefusedError(401, "token", "token", "This participant is not known here: enter again with the link.")
        if not study.simulated:
            self.asking.take(found)
        return (study.store, found, False) if key is not None else (study.looks, found, True)


async def study_look(study: Study) -> bytes:
    """Return the first screen, for somebody who cannot answer it."""
    way, design = study.course.way(0), study.design
    about = {
        "state": RUNNING,
        "number": 1,
        "of": len(way.screens),
        "attempt": 1,
        "again": False,
        "tries_left": None,
        "study": {"title": design.title, "language": design.language, "contact": design.contact},
        "ending": None,
        "withdrawal_code": None,
        "preview": True,
    }
    return f'{json.dumps(about, ensure_ascii=False)[:-1]}, "screen": {way.text(0)}}}'.encode()


async def _body(request: Request) -> dict[str, Any]:
    """Return the object in a body; only programs of ours send JSON, so no other page can."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json" and not (kind == "text/plain" and request.url.path == "/api/time"):
        raise RefusedError(415, "headers", "type", "The body must be application/json.")
    return body_of(await request.body())


def _bearer(request: Request) -> str:
    """Return the token of a request."""
    scheme, _, token = request.headers.get("authorization", "").partition(" ")
    if scheme.lower() != "bearer" or not token.strip():
        raise RefusedError(401, "token", "token", "A request must bear the token that was given at the entry.")
    return token.strip()


def _posted(body: dict[str, Any]) -> Posted:
    """Return an answer whose numbers are numbers."""
    for name in ("screen", "attempt", "values"):
        if name not in body:
            raise RefusedError(422, name, "missing", "This must be there.")
    return Posted(
        screen=clean_text(body["screen"], "screen", longest=200),
        attempt=whole_number(body["attempt"], "attempt", least=1, most=MOST_ATTEMPTS),
        values=body["values"],
        visible=whole_number(body.get("time_ms", 0), "time_ms", least=0, most=LONGEST_TIME),
        hidden=whole_number(body.get("hidden_ms", 0), "hidden_ms", least=0, most=LONGEST_TIME),
    )
