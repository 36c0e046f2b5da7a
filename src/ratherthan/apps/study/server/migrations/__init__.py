"""A database of any version enters, one of this version leaves; a newer one is refused.

A change of `tables.METADATA` goes with a new file in versions/, written by ``alembic revision --autogenerate`` or by hand; a test
compares the two. Tables are rebuilt by batches, as SQLite needs it, with foreign keys off meanwhile: else
rebuilding a table would erase what hangs on it.
"""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import URL, create_engine, inspect
from sqlalchemy.engine import Connection
from sqlalchemy.exc import DBAPIError

from ratherthan.apps.study.server.tables import METADATA
from ratherthan.errors import InputError

__all__ = ["brought_up_to_date", "config_of"]

HERE = Path(__file__).resolve().parent
LOCK = 7_283_474_028
"""The number by which processes that open a database on PostgreSQL wait for each other."""


def config_of(connection: Connection, *folders: Path) -> Config:
    """Return the settings with which Alembic works on a connection.

    Parameters
    ----------
    connection : Connection
    *folders : Path
        With more versions, after those of this package.
    """
    config = Config()
    config.set_main_option("script_location", str(HERE).replace("%", "%%"))
    config.set_main_option("path_separator", "newline")
    places = "\n".join(str(folder) for folder in (HERE / "versions", *folders))
    config.set_main_option("version_locations", places.replace("%", "%%"))
    config.attributes["connection"] = connection
    return config


def brought_up_to_date(url: URL, *folders: Path) -> None:
    """Make the tables of a new database, or migrate those of an older one.

    Parameters
    ----------
    url : URL
    *folders : Path
        With more versions, after those of this package.

    Raises
    ------
    InputError
        Where it was written by a newer version, is another program's, no database at all, or cannot be reached.
    """
    named = f"The database {url.render_as_string(hide_password=True)}"
    sqlite = url.get_backend_name() == "sqlite"
    engine = create_engine(url, hide_parameters=True)
    try:
        with engine.connect() as connection:
            if sqlite:
                raw = connection.connection.driver_connection
                if raw is not None:
                    raw.isolation_level = None
                connection.exec_driver_sql("PRAGMA busy_timeout=10000")
                connection.exec_driver_sql("PRAGMA secure_delete=ON")
                connection.exec_driver_sql("PRAGMA foreign_keys=OFF")
                connection.exec_driver_sql("BEGIN IMMEDIATE")
            else:
                connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({LOCK})")
            _migrate(connection, named, *folders)
            connection.exec_driver_sql("COMMIT") if sqlite else connection.commit()
    except DBAPIError as error:
        cause = str(error.orig).split("\n", maxsplit=1)[0]
        raise InputError(f"{named} must be one that can be opened and written, but it says: {cause}.") from error
    finally:
        engine.dispose()


def _migrate(connection: Connection, named: str, *folders: Path) -> None:
    """Bring the tables up to date within the transaction of a connection."""
    config = config_of(connection, *folders)
    known = {one.revision for one in ScriptDirectory.from_config(config).walk_revisions()}
    found = MigrationContext.configure(connection).get_current_heads()
    tables = set(inspect(connection).get_table_names())
    if not found and tables:
        raise InputError(
            f"{named} must be a new one or one of a study, but it holds other tables ('{min(tables)}'). Name another."
        )
    if newer := sorted(set(found) - known):
        raise InputError(
            f"{named} was written by a newer version of this program (its tables are of version '{newer[0]}', which this one "
            "does not know). Nothing was changed. Install that version, or name another database."
        )
    try:
        command.upgrade(config, "heads")
    except CommandError as error:
        raise InputError(f"{named} must be of a version that can be brought up to date: {error}.") from error
    missing = set(METADATA.tables) - set(inspect(connection).get_table_names())
    if missing:
        raise InputError(f"{named} is broken: the table '{min(missing)}' is missing. Take a copy that was saved.")
