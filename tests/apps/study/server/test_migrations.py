"""A database of an older version is brought up to date with all it holds; one of a newer version is refused and left as it is."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from alembic import command
from apps.study.server.visitors import in_phase
from sqlalchemy import create_engine, inspect, select, text

from ratherthan.apps.study.server.database import address
from ratherthan.apps.study.server.migrations import brought_up_to_date, config_of
from ratherthan.apps.study.server.opening import opened
from ratherthan.apps.study.server.tables import ANSWER, METADATA
from ratherthan.errors import InputError

NEXT = """
import sqlalchemy as sa
from alembic import op

revision, down_revision, branch_labels, depends_on = "9999", "{before}", None, None


def upgrade() -> None:
    with op.batch_alter_table("participant") as table:
        table.add_column(sa.Column("mood", sa.Text(), nullable=False, server_default="fine"))
        table.alter_column("tries", new_column_name="attempts_failed")


def downgrade() -> None:
    pass
"""


@pytest.fixture
def future(tmp_path: Path) -> Path:
    """A folder with the version after this one, which rebuilds the table that all else hangs on."""
    from alembic.script import ScriptDirectory

    engine = create_engine("sqlite://")
    with engine.connect() as connection:
        head = ScriptDirectory.from_config(config_of(connection)).get_current_head()
    engine.dispose()
    folder = tmp_path / "versions"
    folder.mkdir()
    (folder / "v9999_the_next.py").write_text(NEXT.format(before=head), encoding="utf-8")
    return folder


def test_the_migrations_make_the_tables_that_the_program_has(database):
    url = address(database)
    brought_up_to_date(url)
    engine = create_engine(url)
    with engine.connect() as connection:
        command.check(config_of(connection))  # raises where anything differs
        assert set(METADATA.tables) < set(inspect(connection).get_table_names())
    engine.dispose()


def test_opening_twice_changes_nothing(design, database):
    opened(design, database).close()
    opened(design, database).close()


def test_an_older_database_is_migrated_with_all_it_holds(design, database, future, served, visitor):
    study, place = served(design, database)
    person = visitor(study, place)
    person.walk(in_phase("trial"))
    before = study.store.read(lambda c: c.execute(select(ANSWER)).all())
    assert before
    brought_up_to_date(address(database), future)
    engine = create_engine(address(database))
    with engine.connect() as connection:
        assert connection.execute(select(ANSWER)).all() == before
        assert connection.execute(text("SELECT mood, attempts_failed FROM participant")).all() == [("fine", 0)]
        assert connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one() == "9999"
    engine.dispose()


def test_a_newer_database_is_refused_and_left_as_it_is(design, database, future):
    opened(design, database).close()
    brought_up_to_date(address(database), future)
    with pytest.raises(InputError, match="newer version"):
        opened(design, database)
    engine = create_engine(address(database))
    with engine.connect() as connection:
        assert connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one() == "9999"
    engine.dispose()


def test_a_database_of_another_program_is_refused_and_left_as_it_is(design, tmp_path):
    path = tmp_path / "other.sqlite3"
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE cats (name TEXT)")
    other.commit()
    other.close()
    before = path.read_bytes()
    with pytest.raises(InputError, match="cats"):
        opened(design, str(path))
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("mysql://host/name", "postgresql"),
        ("sqlite://", "file"),
        ("://", "postgresql"),
        ("no/such/folder/a.sqlite3", "folder"),
        ("postgresql://nobody@127.0.0.1:1/none", "opened"),
        ("postgresql://nobody:SECRETWORD@127.0.0.1:1/none", "opened"),
    ],
)
def test_addresses_that_are_none_get_a_sentence(design, named, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=said) as refused:
        opened(design, named)
    assert "SECRETWORD" not in str(refused.value)


def test_a_file_that_is_no_database_is_refused(design, tmp_path):
    path = tmp_path / "a.sqlite3"
    path.write_text("These are words, not a database. " * 100, encoding="utf-8")
    with pytest.raises(InputError, match="database"):
        opened(design, str(path))
    with pytest.raises(InputError, match="folder"):
        opened(design, str(tmp_path))
