"""The address of a database enters, a `Store` leaves: what it acknowledges is on the disk.

*Durable.* A write is told to be done after its transaction is committed, with ``synchronous=FULL`` on SQLite (the commit waits for
the disk) and PostgreSQL's default. *Whole.* A job (a function of a connection) is done wholly or not at all. *In turn.* One
thread writes. It takes all jobs that wait into one transaction, each behind a savepoint of its own, commits once, and tells
each its result: 200 people who answer at the same time cost a handful of commits. A job must do nothing but read and write
through its connection, as it is done again where another job of its transaction spoilt it.
"""

from __future__ import annotations

import asyncio
import queue
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError
from sqlalchemy.pool import StaticPool

from ratherthan.errors import InputError, MissingExtraError

__all__ = ["StorageError", "Store", "address", "connected", "engine_of", "only_read", "opened_file"]

T = TypeVar("T")
Job = Callable[[Connection], Any]
MOST_TOGETHER = 64
"""Jobs in one transaction: the first of them waits for the last."""
BUSY = 10_000
"""Milliseconds that SQLite waits for another process."""
RETRIED = ("40001", "40P01")
"""What PostgreSQL says where two processes met: the transaction is to be done again."""
TRIES = 5


def only_read(connection: Connection) -> None:
    """Let a transaction that has just begun see one state of the database; on SQLite it does anyway."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")


class StorageError(Exception):
    """The database cannot be written or read just now: nothing was stored."""


def address(text: str) -> URL:
    """Return the address of a database: a URL, or the path of an SQLite file.

    Parameters
    ----------
    text : str
        ``postgresql://user:password@host/name``, ``sqlite:///path`` or a path.

    Raises
    ------
    InputError
        Where it is no address, or of a database that cannot be used.
    MissingExtraError
        Where the driver is not installed.
    """
    if "://" not in text:
        return URL.create("sqlite", database=str(Path(text)))
    try:
        url = make_url(text)
        backend = url.get_backend_name()
    except (ArgumentError, NoSuchModuleError, ValueError):
        backend = ""
    if backend in ("postgresql", "postgres"):
        try:
            import psycopg  # noqa: F401 - whether it is there
        except ImportError as missing:
            raise MissingExtraError(
                "A study on PostgreSQL needs psycopg, which is not installed: pip install 'ratherthan[postgres]'."
            ) from missing
        return make_url(text.replace("postgres://", "postgresql://", 1)).set(drivername="postgresql+psycopg")
    if backend != "sqlite":
        raise InputError(
            "A database must be postgresql://…, sqlite:///FILE or the path of a file, got "
            f"'{text.split('://', maxsplit=1)[0]}://…'."
        )
    if not url.database or url.database == ":memory:":
        raise InputError("A database must lie in a file, got an address of SQLite without a path: sqlite:///FILE.")
    return URL.create("sqlite", database=url.database)


def opened_file(url: URL) -> Path | None:
    """Return the file of an SQLite database, None where it has none."""
    named = url.get_backend_name() == "sqlite" and url.database not in (None, ":memory:")
    return Path(str(url.database)) if named else None


def engine_of(url: URL, *, writes: bool = True) -> Engine:
    """Return a way to a database; connections that write on SQLite take its lock when they begin."""
    if url.get_backend_name() != "sqlite":
        return create_engine(
            url, pool_pre_ping=True, pool_size=4, hide_parameters=True, connect_args={"connect_timeout": 10}
        )
    memory = {"poolclass": StaticPool} if url.database == ":memory:" else {}
    engine = create_engine(
        url, hide_parameters=True, paramstyle="named", connect_args={"check_same_thread": False}, **memory
    )
    begin = "BEGIN IMMEDIATE" if writes else "BEGIN"

    @event.listens_for(engine, "connect")
    def on_connect(connection: Any, _record: Any) -> None:
        connection.isolation_level = None  # this module begins transactions, not the driver
        for setting in (
            f"busy_timeout={BUSY}",
            "journal_mode=WAL",
            "synchronous=FULL",
            "fullfsync=ON",  # macOS: to the disk itself, not to its cache
            "foreign_keys=ON",
            "secure_delete=ON",
        ):
            connection.execute(f"PRAGMA {setting}")

    @event.listens_for(engine, "begin")
    def on_begin(connection: Connection) -> None:
        connection.exec_driver_sql(begin)

    return engine


@contextmanager
def connected(engine: Engine) -> Iterator[Connection]:
    """``with connected(engine) as connection``: a transaction, committed at the end.

    Raises
    ------
    StorageError
        Where the database cannot be reached, read or written.
    """
    try:
        with engine.begin() as connection:
            yield connection
    except (DBAPIError, engine.dialect.loaded_dbapi.Error) as error:
        raise StorageError(_said(error)) from error


@dataclass(frozen=True, eq=False)
class Waiting:
    """A job, and who waits for it: a coroutine of a loop, or a thread."""

    job: Job
    loop: asyncio.AbstractEventLoop | None
    result: asyncio.Future[Any] | Future[Any]


Outcome = tuple[Any, BaseException | None]


class Store:
    """A database in which one thread writes; see the module.

    Parameters
    ----------
    url : URL
        From `address`.
    """

    def __init__(self, url: URL) -> None:
        self.url = url
        self.writer = engine_of(url)
        self.reader = self.writer if url.database == ":memory:" else engine_of(url, writes=False)
        self.faults: tuple[type[Exception], ...] = (DBAPIError, self.writer.dialect.loaded_dbapi.Error)
        self.remembers = False
        self.jobs: queue.SimpleQueue[Waiting | None] = queue.SimpleQueue()
        self.thread = threading.Thread(target=self._work, name="writer", daemon=True)
        self.thread.start()

    async def write(self, job: Callable[[Connection], T]) -> T:
        """Return what a job returns, after it is committed.

        Raises
        ------
        StorageError
            Where the database cannot be written: then nothing was.
        """
        loop = asyncio.get_running_loop()
        result: asyncio.Future[T] = loop.create_future()
        self.jobs.put(Waiting(job, loop, result))
        return await result

    def write_now(self, job: Callable[[Connection], T]) -> T:
        """Return what a job returns, after it is committed: for callers that are no coroutines."""
        result: Future[T] = Future()
        self.jobs.put(Waiting(job, None, result))
        return result.result()

    def read(self, job: Callable[[Connection], T]) -> T:
        """Return what a job finds in one consistent state of the database; nobody who writes waits for it."""
        with connected(self.reader) as connection:
            only_read(connection)
            return job(connection)

    def forget(self) -> None:
        """Let nothing of what was deleted stay in SQLite's log beside the database; `remembers` tells whether something does."""
        if opened_file(self.url) is None:
            return
        self.remembers = True
        with suppress(*self.faults), closing(self.reader.raw_connection()) as raw:
            busy, _, _ = raw.cursor().execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
            self.remembers = bool(busy)  # somebody still reads an older state: tried again later

    def close(self) -> None:
        """Finish what waits, and let go of the database."""
        self.jobs.put(None)
        self.thread.join()
        self.writer.dispose()
        self.reader.dispose()

    def _work(self) -> None:
        """Take what waits, until there is nothing more to come."""
        last = False
        while not last:
            found = self.jobs.get()
            batch = []
            while found is not None:
                batch.append(found)
                if len(batch) == MOST_TOGETHER:
                    break
                try:
                    found = self.jobs.get_nowait()
                except queue.Empty:
                    break
            last = found is None
            if batch:
                _tell(batch, self._outcomes(batch))

    def _outcomes(self, batch: list[Waiting]) -> list[Outcome]:
        """Do jobs in one transaction, or one by one where that fails; return what is to be told."""
        try:
            return self._transaction([one.job for one in batch])
        except Exception as error:  # noqa: BLE001 - whatever it is, those who wait are told
            if len(batch) > 1:
                return [outcome for one in batch for outcome in self._outcomes([one])]
            return [(None, StorageError(_said(error)) if isinstance(error, self.faults) else error)]

    def _transaction(self, jobs: list[Job]) -> list[Outcome]:
        """Return what each job returned or by what it was refused, after the commit; done again where processes met."""
        tries = TRIES
        while True:
            try:
                with self.writer.begin() as connection:
                    return [self._step(connection, job) for job in jobs]
            except self.faults as error:
                tries -= 1
                lost = isinstance(error, DBAPIError) and error.connection_invalidated
                met = getattr(getattr(error, "orig", error), "sqlstate", None) in RETRIED
                if not (lost or met) or not tries:
                    raise
                time.sleep(0.02)

    def _step(self, connection: Connection, job: Job) -> Outcome:
        """Do one job behind a savepoint; what the database itself refuses spoils the whole transaction."""
        cursor = connection.connection.cursor()
        cursor.execute("SAVEPOINT job")
        try:
            value = job(connection)
        except self.faults:
            raise
        except Exception as refusal:  # noqa: BLE001 - told to who waits
            cursor.execute("ROLLBACK TO SAVEPOINT job")
            cursor.execute("RELEASE SAVEPOINT job")
            return None, refusal
        cursor.execute("RELEASE SAVEPOINT job")
        return value, None


def _tell(batch: list[Waiting], outcomes: list[Outcome]) -> None:
    """Tell everybody who waits, each loop once."""
    loops: dict[asyncio.AbstractEventLoop | None, list[tuple[Waiting, Outcome]]] = {}
    for one, outcome in zip(batch, outcomes, strict=True):
        loops.setdefault(one.loop, []).append((one, outcome))
    for loop, told in loops.items():
        if loop is None:
            _resolve(told)
            continue
        with suppress(RuntimeError):  # the loop was closed meanwhile: nobody waits any more
            loop.call_soon_threadsafe(_resolve, told)


def _resolve(told: list[tuple[Waiting, Outcome]]) -> None:
    for one, (value, refusal) in told:
        if one.result.done():  # who waited gave up
            continue
        if refusal is None:
            one.result.set_result(value)
        else:
            one.result.set_exception(refusal)


def _said(error: Exception) -> str:
    """Return what the database said, without the statement and what was in it."""
    cause = getattr(error, "orig", None) or error
    return str(cause).split("\n", maxsplit=1)[0][:200]
