"""A design meets a database: a new one gets its tables and a password, an old one is compared with the design; a `Study` leaves.

A database belongs to one design, and to people or to robots. As long as nobody has entered, it takes a changed design; from then on
another fingerprint is refused, as answers to two different studies would stand in one table.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import URL, Connection, create_engine, func, insert, inspect, select, update

from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.server import tokens
from ratherthan.apps.study.server.archive import design_of, text_of
from ratherthan.apps.study.server.course import Course
from ratherthan.apps.study.server.database import (
    StorageError,
    Store,
    address,
    connected,
    engine_of,
    only_read,
    opened_file,
)
from ratherthan.apps.study.server.migrations import brought_up_to_date
from ratherthan.apps.study.server.sessions import milliseconds
from ratherthan.apps.study.server.tables import METADATA, PARTICIPANT, PLACE, SERVED, STUDY
from ratherthan.errors import InputError

__all__ = ["Study", "existing", "forgotten", "hashed", "new_password", "opened"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Study:
    """A study that can be served.

    Parameters
    ----------
    course : Course
        The design and its screens.
    store : Store
        The database.
    looks : Store
        Another one, in memory, of previews: they cannot count, as they are not there.
    secret : str
        Signs tokens.
    simulated : bool
        Whether the participants are robots.
    password : str, optional
        The researchers', where it was made just now: only its hash is kept.
    """

    course: Course
    store: Store
    looks: Store
    secret: str = field(repr=False)
    simulated: bool
    password: str | None = field(default=None, repr=False)

    @property
    def design(self) -> Design:
        """The design that is served."""
        return self.course.design

    def close(self) -> None:
        """Let go of the databases."""
        self.store.close()
        self.looks.close()


def opened(design: Design, database: str, *, simulated: bool = False) -> Study:
    """Return the study of a design in a database.

    Parameters
    ----------
    design : Design
        Checked and built.
    database : str
        A URL, or the path of an SQLite file, made where there is none.
    simulated : bool
        Whether the participants are robots.

    Raises
    ------
    InputError
        Where the database is of another design, of the other kind of participants, of a newer version, or cannot be used.
    """
    url = address(database)
    _folder_there(url)
    brought_up_to_date(url)
    _private(url)
    password = tokens.new_password()
    engine = engine_of(url)
    try:
        with connected(engine) as connection:
            made = _met(connection, design, simulated=simulated, password=password)
            secret = connection.execute(select(STUDY.c.secret)).scalar_one()
    except StorageError as error:
        raise InputError(f"The database must be one that can be written, but it says: {error}.") from error
    finally:
        engine.dispose()
    course = Course(design)
    course.prepare(design.quota)
    looks = Store(URL.create("sqlite", database=":memory:"))
    looks.write_now(lambda connection: _preview(connection, design, secret))
    return Study(
        course=course,
        store=Store(url),
        looks=looks,
        secret=secret,
        simulated=simulated,
        password=password if made else None,
    )


@contextmanager
def existing(database: str, *, writes: bool = False) -> Iterator[tuple[Connection, Design]]:
    """``with existing(database) as (connection, design)``: a database that a study has written.

    Parameters
    ----------
    database : str
    writes : bool
        Whether anything is changed.

    Raises
    ------
    InputError
        Where there is none.
    """
    url = address(database)
    file = opened_file(url)
    if file is not None and not file.is_file():
        raise InputError(f"The database of a study must be there, but '{file}' is no file.")
    _holds_a_study(url)
    brought_up_to_date(url)
    engine = engine_of(url, writes=writes)
    try:
        with connected(engine) as connection:
            if not writes:
                only_read(connection)
            row = connection.execute(select(SERVED.c.design)).one_or_none()
            if row is None:
                raise InputError("The database holds no study yet: 'ratherthan study serve' begins one.")
            yield connection, design_of(row.design)
    except StorageError as error:
        raise InputError(f"The database must be one that can be read, but it says: {error}.") from error
    finally:
        engine.dispose()


def forgotten(database: str) -> None:
    """Let nothing of what was deleted stay beside a database; see `Store.forget`.

    Parameters
    ----------
    database : str
    """
    store = Store(address(database))
    try:
        store.forget()
    finally:
        store.close()


def hashed(password: str) -> str:
    """Return what is kept of a password."""
    from argon2 import PasswordHasher

    return PasswordHasher().hash(password)


def new_password(connection: Connection, password: str | None = None) -> str:
    """Give the researchers a new password, and return it; whoever is logged in is not any more.

    Parameters
    ----------
    connection : Connection
    password : str, optional
        A new one is made where this is None.
    """
    given = password or tokens.new_password()
    connection.execute(update(STUDY).values(password=hashed(given)))
    return given


def _met(connection: Connection, design: Design, *, simulated: bool, password: str) -> bool:
    """Compare a design with the database's, or store it; return whether the database was new."""
    row = connection.execute(select(STUDY)).one_or_none()
    if row is None:
        _begun(connection, design, tokens.new_secret(), simulated=simulated, password=hashed(password))
        return True
    if row.simulated != simulated:
        kinds = ("robots", "people") if row.simulated else ("people", "robots")
        raise InputError(
            f"A database must hold answers of people or of robots, never of both: this one is of {kinds[0]}. Name another for {kinds[1]}."
        )
    people = connection.execute(select(func.count()).select_from(PARTICIPANT)).scalar_one()
    if row.fingerprint == design.fingerprint:
        if not people:
            connection.execute(update(SERVED).values(design=text_of(design)))
        return False
    if people or row.entered:
        raise InputError(
            f"The database must be that of this design, but {row.entered} participants answered another version of it (fingerprint "
            f"{row.fingerprint[:12]}, the design's is {design.fingerprint[:12]}). Put the design back as it was, or begin a new "
            "database with --database; 'ratherthan study export' saves what is in this one."
        )
    connection.execute(update(STUDY).values(fingerprint=design.fingerprint, quota=design.quota))
    connection.execute(update(SERVED).values(design=text_of(design)))
    return False


def _begun(connection: Connection, design: Design, secret: str, *, simulated: bool, password: str) -> None:
    """Store the row of a new study."""
    row: dict[str, Any] = {
        "id": 1,
        "fingerprint": design.fingerprint,
        "simulated": simulated,
        "secret": secret,
        "password": password,
        "paused": False,
        "quota": design.quota,
        "next_slot": 0,
        "entered": 0,
        "created": milliseconds(),
    }
    connection.execute(insert(STUDY), row)
    connection.execute(insert(SERVED), {"id": 1, "design": text_of(design)})


def _preview(connection: Connection, design: Design, secret: str) -> None:
    """Make the tables of previews, without a quota; they begin at an order drawn by lot, so that all are seen in time."""
    METADATA.create_all(connection)
    _begun(connection, design, secret, simulated=False, password="")
    first = secrets.randbelow(places_of(design))
    connection.execute(update(STUDY).values(quota=None, next_slot=first))
    connection.execute(PLACE.delete())


def places_of(design: Design) -> int:
    """Return how many slots a round has, at least one."""
    from ratherthan.apps.study.design.screens import rounds

    return max(rounds(design), 1)


def _holds_a_study(url: URL) -> None:
    """Refuse a database in which no study was ever served, before anything is written into it."""
    engine = create_engine(url, hide_parameters=True)  # without our settings: they would be written into the file
    try:
        with connected(engine) as connection:
            tables = inspect(connection).get_table_names()
    except StorageError as error:
        raise InputError(f"The database must be one that can be read, but it says: {error}.") from error
    finally:
        engine.dispose()
    if "alembic_version" not in tables or "study" not in tables:
        raise InputError(
            "The database must be one of a study, but it has no tables of one. Name the one that was served."
        )


def _folder_there(url: URL) -> None:
    """Refuse a file in a folder that is not there."""
    file = opened_file(url)
    if file is not None and not file.absolute().parent.is_dir():
        raise InputError(f"The folder of a database must be there, but '{file.parent}' is none. Make it first.")
    if file is not None and file.is_dir():
        raise InputError(f"A database must be a file, but '{file}' is a folder.")


def _private(url: URL) -> None:
    """Let nobody but its owner read the file of a database."""
    file = opened_file(url)
    if file is not None and file.exists():
        file.chmod(0o600)
