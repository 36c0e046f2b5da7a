"""Researchers' requests enter: their login, and behind it the monitor, pausing, the quota, links, the export, erasing one participant.

The password is kept as an argon2 hash and checked in a thread, one at a time, as that takes a third of a second of a core. Who is
logged in bears a cookie that scripts cannot read and other sites cannot send; every form carries a token that belongs to it. A new
password ends every session. Over an unencrypted connection a login is taken from this very machine alone.
"""

from __future__ import annotations

import asyncio
import hashlib
import ipaddress
import secrets
from typing import Any
from urllib.parse import parse_qs, urlsplit

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from sqlalchemy import Connection, select, update
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import Route

from ratherthan.apps.study.pages import render
from ratherthan.apps.study.server import tokens
from ratherthan.apps.study.server.api import machine_of
from ratherthan.apps.study.server.erasing import erase, meant
from ratherthan.apps.study.server.exporting import FILES, packed
from ratherthan.apps.study.server.frame import about
from ratherthan.apps.study.server.limits import Limit
from ratherthan.apps.study.server.monitor import monitored, person_row
from ratherthan.apps.study.server.opening import Study
from ratherthan.apps.study.server.platforms import OPEN
from ratherthan.apps.study.server.refusals import RefusedError
from ratherthan.apps.study.server.tables import STUDY
from ratherthan.apps.study.server.values import clean_text

__all__ = ["Researchers", "entrance"]

COOKIE = "researcher"
HOURS = 12
MOST_LINKS = 1000
MOST_QUOTA = 1_000_000
NOTICES = ("paused", "resumed", "quota", "erased", "wrong-quota", "no-participant", "wrong-count")


def entrance(secret: str, base: str, name: str = OPEN) -> str:
    """Return a link for participants.

    Parameters
    ----------
    secret : str
        Of the study.
    base : str
        The address of the server.
    name : str
        Of the participant, for a link of their own.
    """
    return f"{base.rstrip('/')}/?link={tokens.signed(secret, 'link', name)}"


class Researchers:
    """The routes of researchers.

    Parameters
    ----------
    study : Study
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.machine = Limit(burst=5, each_second=1 / 12)
        self.all = Limit(burst=30, each_second=0.5)
        self.checking = asyncio.Semaphore(1)
        self.ended: set[str] = set()

    def routes(self) -> list[Route]:
        """Return the routes."""
        return [
            Route("/researchers/login", self.login_page, methods=["GET"]),
            Route("/researchers/login", self.login, methods=["POST"]),
            Route("/researchers/logout", self.logout, methods=["POST"]),
            Route("/researchers", self.monitor, methods=["GET"]),
            Route("/researchers/pause", self.pause, methods=["POST"]),
            Route("/researchers/quota", self.quota, methods=["POST"]),
            Route("/researchers/links", self.links, methods=["POST"]),
            Route("/researchers/export", self.export_page, methods=["GET"]),
            Route("/researchers/export", self.export, methods=["POST"]),
            Route("/researchers/erase", self.erase_page, methods=["GET"]),
            Route("/researchers/erase", self.erase, methods=["POST"]),
        ]

    async def login_page(self, request: Request) -> Response:
        """Return the form that asks for the password."""
        return self._ask(request, "expired" if request.query_params.get("expired") else "")

    async def login(self, request: Request) -> Response:
        """Check a password, and let its owner in."""
        form = await _form(request)
        if not _encrypted(request):
            raise RefusedError(
                403, "connection", "unencrypted", "A login needs https, or the machine on which the server runs."
            )
        machine = machine_of(request)
        if tokens.read_dated(self.study.secret, "login", form.get("csrf", ""), age=HOURS * 3600) is None:
            return self._ask(request, "expired", 403)
        try:
            self.machine.take(machine)
            self.all.take("everybody")
        except RefusedError:
            return self._ask(request, "too-many", 429)
        kept = await self._password()
        async with self.checking:
            right = await asyncio.to_thread(_verified, kept, form.get("password", ""))
        if not right:
            return self._ask(request, "wrong", 403)
        session = tokens.signed_dated(self.study.secret, _salt(kept), secrets.token_hex(8))
        answer = RedirectResponse("/researchers", 303)
        answer.set_cookie(
            COOKIE,
            session,
            max_age=HOURS * 3600,
            httponly=True,
            secure=request.url.scheme == "https",
            samesite="strict",
            path="/researchers",
        )
        return answer

    async def logout(self, request: Request) -> Response:
        """Forget who was logged in; a copy of their cookie is worth nothing from now on."""
        await self._deed(request)
        self.ended.add(request.cookies[COOKIE])
        answer = RedirectResponse("/researchers/login", 303)
        answer.delete_cookie(COOKIE, path="/researchers")
        return answer

    async def monitor(self, request: Request) -> Response:
        """Return how the study is going."""
        session = await self._session(request)
        if session is None:
            return _to_login(request)
        found = await self._read(lambda connection: monitored(connection, self.study))
        base = str(request.base_url)
        found |= {"entrance": entrance(self.study.secret, base), "preview_link": f"{base.rstrip('/')}/?preview=1"}
        said = request.query_params.get("said", "")
        return self._page("monitor.html", session, monitor=found, notice=said if said in NOTICES else "")

    async def pause(self, request: Request) -> Response:
        """Let nobody begin any more, or again."""
        form = await self._deed(request)
        paused = form.get("paused") == "yes"
        await self.study.store.write(
            lambda connection: connection.execute(update(STUDY).values(paused=paused)).rowcount
        )
        return _back("paused" if paused else "resumed")

    async def quota(self, request: Request) -> Response:
        """Set how many may finish."""
        text = (await self._deed(request)).get("quota", "").strip()
        if text and not (text.isascii() and text.isdigit() and len(text) < 8 and 0 < int(text) <= MOST_QUOTA):
            return _back("wrong-quota")
        wanted = int(text) if text else None
        await self.study.store.write(lambda connection: connection.execute(update(STUDY).values(quota=wanted)).rowcount)
        return _back("quota")

    async def links(self, request: Request) -> Response:
        """Return personal links, as a table."""
        text = (await self._deed(request)).get("count", "").strip()
        if not (text.isascii() and text.isdigit() and len(text) < 5 and 0 < int(text) <= MOST_LINKS):
            return _back("wrong-count")
        base = str(request.base_url)
        rows = [entrance(self.study.secret, base, tokens.new_key()) for _ in range(int(text))]
        body = "link\r\n" + "".join(f"{row}\r\n" for row in rows)
        return _download(body.encode(), "links.csv", "text/csv")

    async def export_page(self, request: Request) -> Response:
        """Return what an export holds."""
        session = await self._session(request)
        if session is None:
            return _to_login(request)
        files = [{"name": name, "about": told, "address": ""} for name, told in FILES.items()]
        return self._page("export.html", session, files=files)

    async def export(self, request: Request) -> Response:
        """Return the export, in one archive."""
        await self._deed(request)
        archive = await self._read(lambda connection: packed(connection, self.study.design))
        return _download(archive, "export.zip", "application/zip")

    async def erase_page(self, request: Request) -> Response:
        """Ask whether a participant is to be erased."""
        session = await self._session(request)
        if session is None:
            return _to_login(request)
        asked = clean_text(request.query_params.get("participant", ""), "participant", longest=300)
        return await self._asked(session, asked, "")

    async def erase(self, request: Request) -> Response:
        """Erase a participant, where that was confirmed."""
        form = await self._deed(request)
        asked = form.get("participant", "")
        if form.get("confirm") != "yes":
            return await self._asked(request.cookies[COOKIE], asked, "confirm")

        def job(connection: Connection) -> bool:
            who = meant(connection, asked)
            if who is not None:
                erase(connection, who["id"])
            return who is not None

        if not await self.study.store.write(job):
            return _back("no-participant")
        await asyncio.to_thread(self.study.store.forget)
        return _back("erased")

    async def _asked(self, session: str, asked: str, refused: str) -> Response:
        """Return the page that asks once more before somebody is erased."""

        def job(connection: Connection) -> dict[str, Any] | None:
            who = meant(connection, asked) if asked else None
            return None if who is None else person_row(who, self.study)

        found = await self._read(job)
        return self._page("erase.html", session, participant=found, asked=asked, refused=refused)

    def _ask(self, request: Request, refused: str, status: int = 200) -> Response:
        """Return the login's page."""
        csrf = tokens.signed_dated(self.study.secret, "login", "form")
        status = status if request.method == "POST" else 200
        return HTMLResponse(render("login.html", about(self.study), csrf=csrf, refused=refused), status)

    def _page(self, name: str, session: str, **context: Any) -> Response:
        csrf = tokens.csrf_of(self.study.secret, session)
        return HTMLResponse(render(name, about(self.study), csrf=csrf, **context))

    async def _session(self, request: Request) -> str | None:
        """Return the session of a request, None where nobody is logged in."""
        session = request.cookies.get(COOKIE, "")
        if not session or session in self.ended:
            return None
        salt = _salt(await self._password())
        found = tokens.read_dated(self.study.secret, salt, session, age=HOURS * 3600)
        return None if found is None else session

    async def _deed(self, request: Request) -> dict[str, str]:
        """Return the form by which somebody who is logged in changes something."""
        form, session = await _form(request), await self._session(request)
        if session is None:
            raise RefusedError(403, "session", "session", "Log in again: nobody is logged in.")
        if not secrets.compare_digest(form.get("csrf", ""), tokens.csrf_of(self.study.secret, session)):
            raise RefusedError(403, "csrf", "csrf", "This form is an old one: load the page again.")
        return form

    async def _password(self) -> str:
        """Return the hash of the password."""
        kept: str = await self._read(lambda connection: connection.execute(select(STUDY.c.password)).scalar_one())
        return kept

    async def _read(self, job: Any) -> Any:
        return await asyncio.to_thread(self.study.store.read, job)


def _verified(kept: str, password: str) -> bool:
    """Whether a password is the one of a hash."""
    try:
        return PasswordHasher().verify(kept, password)
    except (VerificationError, InvalidHashError):
        return False


def _salt(kept: str) -> str:
    """Return what signs sessions: another one as soon as the password is another one."""
    return f"researcher {hashlib.sha256(kept.encode()).hexdigest()[:16]}"


def _encrypted(request: Request) -> bool:
    """Whether nobody in between can read along."""
    if request.url.scheme == "https":
        return True
    try:
        return ipaddress.ip_address(machine_of(request)).is_loopback
    except ValueError:
        return False


async def _form(request: Request) -> dict[str, str]:
    """Return the fields of a form that one of our own pages sent."""
    if request.headers.get("content-type", "").partition(";")[0].strip().lower() != "application/x-www-form-urlencoded":
        raise RefusedError(415, "headers", "type", "The body must be a form.")
    origin = request.headers.get("origin")
    if origin is not None and origin != "null" and urlsplit(origin).netloc != request.headers.get("host", ""):
        raise RefusedError(403, "headers", "origin", "This form must come from a page of the study.")
    if request.headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
        raise RefusedError(403, "headers", "origin", "This form must come from a page of the study.")
    try:
        fields = parse_qs(
            (await request.body()).decode("ascii"), keep_blank_values=True, max_num_fields=20, errors="strict"
        )
    except (ValueError, UnicodeDecodeError):
        raise RefusedError(422, "body", "form", "The body must be a form in UTF-8.") from None
    return {name[:40]: clean_text(values[-1], "form", longest=500) for name, values in fields.items()}


def _to_login(request: Request) -> Response:
    return RedirectResponse(f"/researchers/login{'?expired=1' if COOKIE in request.cookies else ''}", 303)


def _back(said: str) -> Response:
    return RedirectResponse(f"/researchers?said={said}", 303)


def _download(body: bytes, name: str, kind: str) -> Response:
    return Response(body, media_type=kind, headers={"content-disposition": f'attachment; filename="{name}"'})
