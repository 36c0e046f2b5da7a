"""A connection enters, one leaves that is closed where the head of a request does not come within seconds, or does not end.

Uvicorn waits for the head of a request for as long as a connection is open, and reads as much of it as comes. A few thousand connections
that say nothing, or one header a minute, would then keep everybody else out.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

__all__ = ["MOST_HEAD", "WAITED", "Patience"]

WAITED = 15.0
"""Seconds within which the head of a request must have come, from the opening of the connection or its first byte."""
MOST_HEAD = 64 * 1024
"""Bytes that may come before a head has ended; see `shield` for what a whole one may have."""


class Patience(HttpToolsProtocol):
    """A connection whose requests must begin in time."""

    head_timer: asyncio.TimerHandle | None = None
    head_size = 0

    def connection_made(self, transport: Any) -> None:
        """Begin to wait."""
        super().connection_made(transport)
        self._wait()

    def data_received(self, data: bytes) -> None:
        """Read what came; stop waiting when a request has begun, wait on where only a part of its head is there."""
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete:
            self._begun()
            return
        self.head_size += len(data)
        if self.head_size > MOST_HEAD:
            self._close()
        elif self.head_timer is None:
            self._wait()

    def on_headers_complete(self) -> None:
        """Stop waiting: the rest of the request has limits of its own."""
        super().on_headers_complete()
        self._begun()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._begun()
        super().connection_lost(exc)

    def _wait(self) -> None:
        self.head_timer = self.loop.call_later(WAITED, self._close)

    def _begun(self) -> None:
        if self.head_timer is not None:
            self.head_timer.cancel()
        self.head_timer, self.head_size = None, 0

    def _close(self) -> None:
        if not self.transport.is_closing():
            self.transport.close()
