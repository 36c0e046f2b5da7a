"""A study and an address enter, a process that serves leaves, until it is told to stop.

Stopping by Ctrl-C or SIGTERM is in good order: what was begun is answered, within seconds. Stopping in any other way loses nothing that
was acknowledged, either: see `ratherthan.apps.study.server.database`.
"""

from __future__ import annotations

import contextlib
import logging
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import uvicorn

from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.server.app import application
from ratherthan.apps.study.server.opening import Study
from ratherthan.apps.study.server.patience import Patience
from ratherthan.apps.study.server.platforms import simulated_key
from ratherthan.errors import InputError, LimitError

__all__ = ["default_database", "listening", "robots_key", "serve", "serving"]

PEOPLE, ROBOTS = "answers.sqlite3", "simulated.sqlite3"
PATIENCE = 5
"""Seconds in which requests that were begun are answered after the server was told to stop."""
MOST_AT_ONCE = 4000
WAITING = 2048
"""Connections that wait to be taken."""


def default_database(design: Design, *, simulated: bool = False) -> Path:
    """Return where the answers to a design lie, if nothing else is said: in its folder.

    Parameters
    ----------
    design : Design
    simulated : bool
        Whether the participants are robots.
    """
    return design.folder / (ROBOTS if simulated else PEOPLE)


def robots_key(study: Study) -> str:
    """Return what robots say to enter: {"platform": {"simulated": KEY}}."""
    return simulated_key(study.secret)


def listening(host: str, port: int) -> socket.socket:
    """Return a socket on which a server can listen.

    Parameters
    ----------
    host : str
    port : int
        0: any that is free.

    Raises
    ------
    InputError
        Where it cannot be had.
    """
    try:
        family, _, _, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        found = socket.socket(family, socket.SOCK_STREAM)
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            found.bind(where)
        except OSError:
            found.close()
            raise
    except (OSError, OverflowError) as error:
        said = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"A server must have an address and a port of this machine that are free, got {host}, port {port}: {said}. Try another --port."
        ) from error
    return found


def serve(
    study: Study,
    sockets: list[socket.socket],
    announce: Callable[[], None],
    *,
    certificate: str | None = None,
    private_key: str | None = None,
    proxy: str | None = None,
) -> None:
    """Serve a study until this process is told to stop.

    Parameters
    ----------
    study : Study
    sockets : list of socket
        From `listening`.
    announce : callable
        Called when people can come.
    certificate, private_key : str, optional
        Files, for https.
    proxy : str, optional
        The address of a machine whose word is taken on who asks and whether that was by https, besides this one.
    """
    server = Server(_config(study, certificate, private_key, proxy), announce)
    with contextlib.suppress(ValueError):  # this server hears signals itself, and ends in good order
        signal.set_wakeup_fd(-1)
    server.run(sockets=sockets)


@contextlib.contextmanager
def serving(study: Study, host: str = "127.0.0.1", port: int = 0) -> Iterator[str]:
    """``with serving(study) as address``: a study is served by a thread of this process.

    Parameters
    ----------
    study : Study
    host : str
    port : int
        0: any that is free.
    """
    ready = threading.Event()
    found = listening(host, port)
    server = Server(_config(study), ready.set)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [found]}, name="server", daemon=True)
    thread.start()
    try:
        until = time.monotonic() + 30
        while not ready.wait(0.05):
            if not thread.is_alive() or time.monotonic() > until:
                raise LimitError(
                    "The server must start within half a minute, and did not.", limit="time", phase="starting"
                )
        name = f"[{host}]" if ":" in host else host
        yield f"http://{name}:{found.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join(PATIENCE + 5)
        found.close()


class Server(uvicorn.Server):
    """A server that says when it is ready, and ends quietly when it is told to."""

    def __init__(self, config: uvicorn.Config, announce: Callable[[], None]) -> None:
        super().__init__(config)
        self.announce = announce

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin, and say so."""
        await super().startup(sockets)
        if self.started and not self.should_exit:
            self.announce()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Hear the signals that end a process, and end in good order."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        known = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
        heard = [
            one for one in known if signal.getsignal(one) != signal.SIG_IGN
        ]  # nohup ignores that the terminal goes
        before = {number: signal.signal(number, self.on_signal) for number in heard}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def on_signal(self, _number: int, _frame: FrameType | None) -> None:
        """Stop; at once if it is said twice."""
        if self.should_exit:
            self.force_exit = True
        self.should_exit = True


def _config(
    study: Study, certificate: str | None = None, private_key: str | None = None, proxy: str | None = None
) -> uvicorn.Config:
    """Return the settings of a server: no log of who asks, no word on what program answers."""
    logging.getLogger("uvicorn").setLevel(logging.ERROR)
    settings: dict[str, Any] = {
        "http": Patience,
        "access_log": False,
        "log_config": None,
        "server_header": False,
        "ws": "none",
        "lifespan": "on",
        "timeout_keep_alive": 30,
        "timeout_graceful_shutdown": PATIENCE,
        "limit_concurrency": MOST_AT_ONCE,
        "backlog": WAITING,
        "forwarded_allow_ips": ["127.0.0.1", "::1", *([proxy] if proxy else [])],
        "ssl_certfile": certificate,
        "ssl_keyfile": private_key,
    }
    return uvicorn.Config(application(study), **settings)
