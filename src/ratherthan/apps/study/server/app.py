"""A study enters, the application leaves that a server runs: the pages, the pictures, and the routes of the API and of researchers."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import mimetypes
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from ratherthan.apps.study.pages import STATIC, render
from ratherthan.apps.study.server import places
from ratherthan.apps.study.server.api import Api, as_json
from ratherthan.apps.study.server.database import StorageError
from ratherthan.apps.study.server.erasing import forget_looks
from ratherthan.apps.study.server.frame import about
from ratherthan.apps.study.server.opening import Study
from ratherthan.apps.study.server.platforms import NO_ASSIGNMENT, platform_of
from ratherthan.apps.study.server.refusals import RefusedError
from ratherthan.apps.study.server.researchers import Researchers
from ratherthan.apps.study.server.sessions import gap, milliseconds
from ratherthan.apps.study.server.shield import Shield, fault

__all__ = ["application"]

SWEEP = 60.0
"""Seconds after which those who went away are looked for again."""
MESSAGES = {404: "not-found", 403: "link", 429: "too-many", 503: "storage"}
SMALL = 1000
"""Bytes below which packing is not worth it."""


def application(study: Study) -> Shield:
    """Return the application of a study.

    Parameters
    ----------
    study : Study

    Returns
    -------
    Shield
        An ASGI application.
    """
    app = Starlette(
        routes=[*_pages(study), *Api(study).routes(), *Researchers(study).routes()],
        lifespan=lambda _: _sweeping(study),
        exception_handlers={
            RefusedError: _on_refused(study),
            HTTPException: _on_http(study),
            StorageError: _on_storage(study),
            Exception: _on_fault(study),
        },
    )
    app.router.redirect_slashes = False
    return Shield(app)


def _pages(study: Study) -> list[Route]:
    """Return the routes of the entry, of withdrawing, of pictures and of what pages are made of."""
    held = {f"/static/{name}": content for name, content in _files(STATIC)}
    for name, picture in study.design.pictures.items():
        held[f"/media/{name}.svg"] = _content(f"{name}.svg", picture.file.read_bytes())

    async def entry(request: Request) -> Response:
        """Return the page on which people take part."""
        query = dict(request.query_params)
        platform = platform_of(query)
        looks = query.get("preview") in ("1", "true", "yes") or query.get("assignmentId") == NO_ASSIGNMENT
        if platform == "mturk":
            request.scope["state"]["policy"] = "mturk"
        return HTMLResponse(render("entry.html", about(study), preview=looks, platform=platform))

    async def leaving(_request: Request) -> Response:
        """Return the page on which people withdraw."""
        return HTMLResponse(render("withdraw.html", about(study)))

    async def file(request: Request) -> Response:
        """Return a file or a picture."""
        content = held.get(request.url.path)
        if content is None:
            raise RefusedError(404, "address", "place", "There is no such page.")
        kind, plain, packed, mark = content
        request.scope["state"]["steady"] = request.query_params.get("v") == mark
        if kind == "image/svg+xml":
            request.scope["state"]["policy"] = "picture"
        zips = packed is not None and "gzip" in request.headers.get("accept-encoding", "")
        headers = {"vary": "accept-encoding"} | ({"content-encoding": "gzip"} if zips else {})
        return Response(packed if zips else plain, media_type=kind, headers=headers)

    return [
        Route("/", entry, methods=["GET"]),
        Route("/withdraw", leaving, methods=["GET"]),
        Route("/static/{name:path}", file, methods=["GET"]),
        Route("/media/{name}", file, methods=["GET"]),
    ]


Content = tuple[str, bytes, bytes | None, str]


def _files(folder: Path) -> list[tuple[str, Content]]:
    """Return the files that pages are made of, by their names below a folder."""
    found = sorted(
        path for path in folder.rglob("*") if path.is_file() and path.suffix in (".js", ".css", ".svg", ".txt")
    )
    return [(path.relative_to(folder).as_posix(), _content(path.name, path.read_bytes())) for path in found]


def _content(name: str, plain: bytes) -> Content:
    """Return (type, bytes, the same packed, mark of the bytes)."""
    kinds = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
    kind = kinds.get(Path(name).suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream"
    packed = gzip.compress(plain, 9, mtime=0) if len(plain) > SMALL else None
    return kind, plain, packed, hashlib.sha256(plain).hexdigest()[:12]


@asynccontextmanager
async def _sweeping(study: Study) -> AsyncIterator[None]:
    """Look for those who went away, as long as the server runs."""
    task = asyncio.create_task(_sweep(study))
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


async def _sweep(study: Study) -> None:
    """Look for those who went away, every minute."""
    while True:
        with suppress(StorageError):  # tried again in a minute, and whenever somebody enters
            await study.store.write(
                lambda connection: places.free_abandoned(connection, milliseconds() - gap(study.course))
            )
            await study.looks.write(forget_looks)
        if study.store.remembers:
            await asyncio.to_thread(study.store.forget)
        await asyncio.sleep(SWEEP)


def _on_refused(study: Study) -> Any:
    async def handle(request: Request, refused: Exception) -> Response:
        assert isinstance(refused, RefusedError)
        return _said(study, request, refused)

    return handle


def _on_http(study: Study) -> Any:
    async def handle(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        if error.status_code == 405:
            refused = RefusedError(405, "method", "method", "This cannot be asked in this way.")
        elif error.status_code == 404:
            refused = RefusedError(404, "address", "place", "There is no such page.")
        else:
            refused = RefusedError(error.status_code, "request", "request", "This request cannot be read.")
        return _said(study, request, refused)

    return handle


def _on_storage(study: Study) -> Any:
    async def handle(request: Request, _error: Exception) -> Response:
        sentence = "The server cannot save at the moment. What it said is saved is saved; try again in a while."
        return _said(study, request, RefusedError(503, "storage", "storage", sentence))

    return handle


def _on_fault(study: Study) -> Any:
    async def handle(request: Request, _error: Exception) -> Response:
        return _said(study, request, fault())

    return handle


def _said(study: Study, request: Request, refused: RefusedError) -> Response:
    """Return a refusal: as a page to people, as JSON to programs."""
    wants_page = request.method in ("GET", "POST") and "text/html" in request.headers.get("accept", "")
    if wants_page and not request.url.path.startswith("/api/"):
        kind = MESSAGES.get(refused.status, "server")
        answer: Response = HTMLResponse(
            render("message.html", about(study), kind=kind, status=refused.status), refused.status
        )
    else:
        answer = as_json(refused.document(), refused.status)
    if refused.status in (429, 503):
        answer.headers["retry-after"] = "5"
    if refused.status in (408, 413):  # the rest of the body is not waited for
        answer.headers["connection"] = "close"
    return answer
