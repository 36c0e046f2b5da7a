"""An application enters, one leaves whose every answer has its headers, whose requests have a size and a pace, and that tells no secrets.

It stands outside everything else, so that answers of the framework (an unknown page, a fault) bear the headers too. The log says which
kind of request it was, what it was answered and how long that took: no address of a machine, no query, no token, no text that came.
"""

from __future__ import annotations

import asyncio
import json
import logging
import time
import traceback
from collections.abc import Awaitable, Callable, MutableMapping
from functools import cache
from typing import Any

from starlette.requests import ClientDisconnect

from ratherthan.apps.study.server.platforms import MTURK_ENDS, MTURK_FRAMES
from ratherthan.apps.study.server.refusals import RefusedError

__all__ = ["MOST_BYTES", "Shield", "fault", "faults_of", "policy"]

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

MOST_BYTES = 16 * 1024
MOST_HEADERS = 16 * 1024
MOST_QUERY = 4 * 1024
PATIENCE = 15.0
"""Seconds in which the body of a request must have come."""
LOG = logging.getLogger("ratherthan.study")
NO_FRAMES = "frame-ancestors 'none'"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; base-uri 'none'; "
    "form-action 'self'"
)
PICTURE = "default-src 'none'; style-src 'unsafe-inline'; sandbox; frame-ancestors 'none'"
STEADY = "public, max-age=31536000, immutable"
FEATURES = (
    "accelerometer=(), camera=(), display-capture=(), geolocation=(), gyroscope=(), hid=(), magnetometer=(), "
    "microphone=(), midi=(), payment=(), serial=(), usb=()"
)


def policy(kind: str) -> str:
    """Return the Content-Security-Policy of a page.

    Parameters
    ----------
    kind : str
        "page", "mturk" (shown in a frame, and ends with a form posted to MTurk) or "picture".
    """
    if kind == "picture":
        return PICTURE
    if kind == "mturk":
        return f"{POLICY} {' '.join(MTURK_ENDS)}; frame-ancestors {' '.join(MTURK_FRAMES)}"
    return f"{POLICY}; {NO_FRAMES}"


class Shield:
    """What stands between the network and an application.

    Parameters
    ----------
    app : callable
        An ASGI application. It may set "policy" in a request's state to another kind than "page".
    """

    def __init__(self, app: App) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":  # a websocket: there are none
            await send({"type": "websocket.close", "code": 1008})
            return
        began, told = time.perf_counter(), Told()
        scope.setdefault("state", {})

        async def answering(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                told.status = message["status"]
                message["headers"] = [*_kept(message["headers"]), *_headers(scope, message["status"])]
            await send(message)

        try:
            refused = _too_large(scope)
            if refused is not None:
                await _refuse(answering, refused)
            else:
                await self.app(scope, Body(receive), answering)
        except RefusedError as refusal:
            await _refuse(answering, refusal, begun=bool(told.status))
        except ClientDisconnect:  # who asked went away: nobody waits for an answer
            pass
        except Exception as error:  # noqa: BLE001 - whatever it is, who asked gets an answer that tells nothing of it
            LOG.error("fault: %s", faults_of(error))
            await _refuse(answering, fault(), begun=bool(told.status))
        finally:
            LOG.info(
                "%s %s %d %.0f ms", scope["method"], _route(scope), told.status, 1000 * (time.perf_counter() - began)
            )


class Told:
    """What was answered."""

    status = 0


class Body:
    """The parts of a request as they come, no more than `MOST_BYTES` in all and in no more than `PATIENCE` seconds."""

    def __init__(self, receive: Receive) -> None:
        self.receive, self.size, self.whole = receive, 0, False
        self.until = time.monotonic() + PATIENCE

    async def __call__(self) -> MutableMapping[str, Any]:
        """Return the next part."""
        if self.whole:
            return await self.receive()
        try:
            async with asyncio.timeout(max(self.until - time.monotonic(), 0.01)):
                message = await self.receive()
        except TimeoutError:
            raise RefusedError(408, "body", "time", "The body of a request must come within seconds.") from None
        self.size += len(message.get("body", b""))
        if self.size > MOST_BYTES:
            raise _too_many_bytes()
        self.whole = not message.get("more_body", False)
        return message


def fault() -> RefusedError:
    """Return what is told of a fault of the program."""
    return RefusedError(500, "server", "fault", "Something went wrong on the server. What it said is saved is saved.")


def _too_many_bytes() -> RefusedError:
    return RefusedError(413, "body", "too-large", f"The body of a request must have at most {MOST_BYTES} bytes.")


def faults_of(error: BaseException) -> str:
    """Return what went wrong and where, without any text that may be a person's."""
    frames = traceback.extract_tb(error.__traceback__)
    places = " < ".join(
        f"{frame.filename.rsplit('/', maxsplit=1)[-1]}:{frame.lineno}" for frame in reversed(frames[-6:])
    )
    return f"{type(error).__name__} at {places}"


def _too_large(scope: Scope) -> RefusedError | None:
    """Return why a request is too large already by its head."""
    if len(scope.get("query_string", b"")) + len(scope.get("raw_path") or b"") > MOST_QUERY:
        return RefusedError(
            414, "address", "too-large", f"The address of a request must have at most {MOST_QUERY} bytes."
        )
    if sum(len(name) + len(value) for name, value in scope["headers"]) > MOST_HEADERS:
        return RefusedError(
            431, "headers", "too-large", f"The headers of a request must have at most {MOST_HEADERS} bytes."
        )
    for name, value in scope["headers"]:
        if name == b"content-length" and (not value.isdigit() or len(value) > 12 or int(value) > MOST_BYTES):
            return _too_many_bytes()
    return None


async def _refuse(send: Send, refused: RefusedError, *, begun: bool = False) -> None:
    """Answer with what is wrong, where no answer was begun."""
    if begun:
        return
    body = json.dumps(refused.document()).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
    if refused.status in (408, 413, 414, 431):
        headers.append((b"connection", b"close"))
    await send({"type": "http.response.start", "status": refused.status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


def _kept(headers: Any) -> list[tuple[bytes, bytes]]:
    return [(name, value) for name, value in headers if name.lower() != b"server"]


def _headers(scope: Scope, status: int) -> tuple[tuple[bytes, bytes], ...]:
    """Return the headers of an answer."""
    steady = bool(scope["state"].get("steady")) and status == 200
    return _made(scope["state"].get("policy", "page"), steady=steady, encrypted=scope.get("scheme") == "https")


@cache
def _made(kind: str, *, steady: bool, encrypted: bool) -> tuple[tuple[bytes, bytes], ...]:
    """Return the headers of answers of a kind."""
    found = {
        "content-security-policy": policy(kind),
        "x-content-type-options": "nosniff",
        "referrer-policy": "no-referrer",
        "permissions-policy": FEATURES,
        "cross-origin-opener-policy": "same-origin",
        "cross-origin-resource-policy": "same-origin",
        "x-robots-tag": "noindex, nofollow",
        "cache-control": STEADY if steady else "no-store",
    }
    if kind != "mturk":
        found["x-frame-options"] = "DENY"
    if encrypted:
        found["strict-transport-security"] = "max-age=31536000"
    return tuple((name.encode(), value.encode()) for name, value in found.items())


def _route(scope: Scope) -> str:
    """Return which kind of request it is: the path as the routes have it, never as it came."""
    route = scope.get("route")
    return str(getattr(route, "path", "") or "(no such page)")
