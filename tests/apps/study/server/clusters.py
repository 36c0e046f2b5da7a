"""Nothing enters, a PostgreSQL server of our own leaves, for tests: run by an unprivileged user, in a temporary folder."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


def program(name: str) -> str | None:
    found = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"), key=lambda path: float(path.parts[-3]))
    return str(found[-1]) if found else shutil.which(name)


@contextmanager
def cluster() -> Iterator[str]:
    """``with cluster() as url``: a server that ends with the block; skips where there is none."""
    pytest.importorskip("psycopg", reason="needs the extra [postgres]")
    initdb, control = program("initdb"), program("pg_ctl")
    if initdb is None or control is None:
        pytest.skip("needs PostgreSQL's programs initdb and pg_ctl, which are not here")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as made:
        yield from _started(Path(made), initdb, control)


def _started(folder: Path, initdb: str, control: str) -> Iterator[str]:
    other: dict[str, str] = {}
    if os.geteuid() == 0:  # PostgreSQL refuses to run as root
        user = next((name for name in ("postgres", "nobody") if _known(name)), None)
        if user is None:
            pytest.skip("needs a user other than root to run PostgreSQL")
        other = {"user": user}
        shutil.chown(folder, user)
    data, quiet = folder / "data", {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    made = [initdb, "-D", data, "-U", "tester", "-A", "trust", "-E", "UTF8", "--locale=C"]
    subprocess.run(made, check=True, timeout=120, **quiet, **other)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    settings = f"-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories='' -c fsync=on"
    subprocess.run(
        [control, "-D", data, "-w", "-t", "60", "-l", folder / "log", "-o", settings, "start"],
        check=True,
        timeout=90,
        **quiet,
        **other,
    )
    try:
        yield f"postgresql://tester@127.0.0.1:{port}/postgres"
    finally:
        subprocess.run([control, "-D", data, "-m", "immediate", "stop"], check=False, timeout=60, **quiet, **other)


def _known(name: str) -> bool:
    try:
        pwd.getpwnam(name)
    except KeyError:
        return False
    return True
