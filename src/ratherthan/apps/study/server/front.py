"""What was typed enters, lines to print leave: serving a design, exporting, erasing, a new password."""

from __future__ import annotations

import ipaddress
import logging
import ssl
import sys
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import click

from ratherthan.apps.study.design.reading import design_file, read_design
from ratherthan.apps.study.server.database import address
from ratherthan.apps.study.server.erasing import erase, meant
from ratherthan.apps.study.server.exporting import written
from ratherthan.apps.study.server.opening import Study, existing, forgotten, new_password, opened
from ratherthan.apps.study.server.researchers import entrance
from ratherthan.apps.study.server.running import PEOPLE, ROBOTS, default_database, listening, robots_key, serve
from ratherthan.errors import InputError

__all__ = ["Wanted", "change_password", "erase_participant", "export_study", "found_participant", "serve_design"]

SHORTEST = 12
LONGEST = 200


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """How a design is to be served; see ``ratherthan study serve --help``."""

    database: str | None = None
    host: str = "127.0.0.1"
    port: int = 8000
    url: str | None = None
    certificate: str | None = None
    private_key: str | None = None
    proxy: str | None = None
    simulated: bool = False
    log: bool = False


def serve_design(path: str, wanted: Wanted) -> None:
    """Serve a design until this process is told to stop.

    Parameters
    ----------
    path : str
        Its folder.
    wanted : Wanted

    Raises
    ------
    InputError
        Where the design has faults, or the database or the address cannot be had.
    """
    _check_https(wanted)
    _check_addresses(wanted)
    design = read_design(path)
    database = wanted.database or str(default_database(design, simulated=wanted.simulated))
    if wanted.database is None and not design_file(path).is_file():
        raise InputError(f"A study must be a folder with its design, but '{path}' has none.")
    socket = listening(wanted.host, wanted.port)
    with closing(socket), closing(opened(design, database, simulated=wanted.simulated)) as study:
        port = socket.getsockname()[1]
        _log(every=wanted.log)
        serve(
            study,
            [socket],
            lambda: _announce(study, wanted, port, database),
            certificate=wanted.certificate,
            private_key=wanted.private_key,
            proxy=wanted.proxy,
        )
    click.echo("Stopped. What was acknowledged is stored; the same command goes on.")


def export_study(place: str, output: str, *, simulated: bool = False) -> list[str]:
    """Write an export, and return what to say.

    Parameters
    ----------
    place : str
        The folder of a study, or its database.
    output : str
        A folder.
    simulated : bool
        Of a folder: the answers of robots.
    """
    with existing(database_of(place, simulated=simulated)) as (connection, design):
        facts = written(connection, design, Path(output))
    robots = " (simulated)" if facts["simulated"] else ""
    return [
        f"{output}: {facts['observations']} observations of {facts['participants']} participants{robots}.",
        f"What the columns mean: {Path(output) / 'codebook.md'}",
    ]


def found_participant(place: str, text: str, *, simulated: bool = False) -> str:
    """Return the number of a participant.

    Raises
    ------
    InputError
        Where there is none, or more than one.
    """
    with existing(database_of(place, simulated=simulated)) as (connection, _):
        who = meant(connection, text)
    if who is None:
        raise InputError(
            "A participant must be named by the number in exports, the withdrawal code or what the platform calls them; "
            "exactly one must bear it, and none or several do."
        )
    return f"P{who['number']:04d}"


def erase_participant(place: str, number: str, *, simulated: bool = False) -> list[str]:
    """Erase a participant, and return what to say."""
    database = database_of(place, simulated=simulated)
    with existing(database, writes=True) as (connection, _):
        who = meant(connection, number)
        if who is None:
            raise InputError(f"A participant must be there to be erased, but {number} is not any more.")
        erase(connection, who["id"])
    forgotten(database)
    return [f"{number} is erased. Export anew: older tables, and copies of the database, still have them."]


def change_password(place: str, own: str | None, *, simulated: bool = False) -> list[str]:
    """Give the researchers a new password, and return what to say."""
    if own is not None and not SHORTEST <= len(own) <= LONGEST:
        raise InputError(f"A password must have from {SHORTEST} to {LONGEST} characters, got {len(own)}.")
    with existing(database_of(place, simulated=simulated), writes=True) as (connection, _):
        given = new_password(connection, own)
    return [f"The researchers' password is now: {given}" if own is None else "The researchers' password is changed."]


def database_of(place: str, *, simulated: bool) -> str:
    """Return the database that is meant by a folder, a file or a URL."""
    if "://" in place:
        address(place)
        return place
    path = Path(place)
    if path.name == "design.toml":
        path = path.parent
    return str(path / (ROBOTS if simulated else PEOPLE)) if path.is_dir() else place


def _check_https(wanted: Wanted) -> None:
    """Refuse files of https that are not there."""
    if (wanted.certificate is None) != (wanted.private_key is None):
        raise InputError("Https needs both --certificate and --private-key, got one of them.")
    for name, path in (("--certificate", wanted.certificate), ("--private-key", wanted.private_key)):
        if path is not None and not Path(path).is_file():
            raise InputError(f"{name} must be a file, but '{path}' is none.")
    if wanted.certificate is None or wanted.private_key is None:
        return
    try:  # before a new database has got a password that would never be printed
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(wanted.certificate, wanted.private_key, _no_passphrase)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--certificate must be a certificate in PEM and --private-key its key without a passphrase, but '{wanted.certificate}' "
            f"and '{wanted.private_key}' cannot be used: {getattr(error, 'reason', None) or error}."
        ) from error


def _no_passphrase() -> str:
    raise ValueError("the key has a passphrase")


def _check_addresses(wanted: Wanted) -> None:
    """Refuse addresses that nobody could come to, or come from."""
    if wanted.url is not None:
        try:
            parts = urlsplit(wanted.url)
            good = parts.scheme in ("http", "https") and bool(parts.hostname) and not parts.query and not parts.fragment
            good = (
                good and (parts.port is None or parts.port > 0) and wanted.url.isprintable() and " " not in wanted.url
            )
        except ValueError:
            good = False
        if not good:
            raise InputError(f"--url must be an address such as https://study.example.org, got '{wanted.url}'.")
    if wanted.proxy is not None:
        try:
            ipaddress.ip_network(wanted.proxy, strict=False)
        except ValueError as error:
            raise InputError(f"--proxy must be the IP address of a machine, got '{wanted.proxy}'.") from error


def _log(*, every: bool) -> None:
    """Tell of faults, and of every request where that is wanted."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
    log = logging.getLogger("ratherthan.study")
    log.handlers, log.propagate = [handler], False
    log.setLevel(logging.INFO if every else logging.ERROR)


def _announce(study: Study, wanted: Wanted, port: int, database: str) -> None:
    """Print the links."""
    scheme = "https" if wanted.certificate is not None else "http"
    host = "localhost" if wanted.host in ("0.0.0.0", "::", "127.0.0.1", "::1") else wanted.host
    base = (wanted.url or f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}").rstrip("/")
    design = study.design
    lines = [f"{design.title}: served at {base}, answers in {address(database).render_as_string(hide_password=True)}"]
    if study.simulated:
        lines += ["The participants are robots. Their key:", f"  {robots_key(study)}"]
    else:
        lines += [
            f"  Participants         {entrance(study.secret, base)}",
            f"  Prolific             {base}/?PROLIFIC_PID={{{{%PROLIFIC_PID%}}}}&STUDY_ID={{{{%STUDY_ID%}}}}&SESSION_ID={{{{%SESSION_ID%}}}}",
            f"  Mechanical Turk      {base}/",
            f"  To look at it        {base}/?preview=1",
            f"  To withdraw          {base}/withdraw",
        ]
    lines.append(f"  Researchers          {base}/researchers")
    if study.password is not None:
        lines.append(
            f"  Their password       {study.password}   (shown this once; 'ratherthan study password' makes another)"
        )
    lines.append("Stop with Ctrl-C.")
    click.echo("\n".join(lines))
    sys.stdout.flush()
