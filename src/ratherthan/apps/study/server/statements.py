"""A statement enters, one leaves that is turned into SQL once and then handed to the driver as it is.

Answering a page takes a handful of statements. SQLAlchemy prepares each anew for every execution, which takes longer than the
database needs: while 200 people answer at once, that is what they would wait for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import Connection
from sqlalchemy.sql.expression import ClauseElement

__all__ = ["Statement"]


class Statement:
    """A statement with named parameters.

    Parameters
    ----------
    clause : ClauseElement
        Its parameters are bindparam() with names, or literals.
    """

    def __init__(self, clause: ClauseElement) -> None:
        self.clause = clause
        self._made: dict[str, tuple[str, dict[str, Any]]] = {}

    def run(self, connection: Connection, given: Mapping[str, Any]) -> Any:
        """Return the driver's cursor, after the statement was done with these parameters."""
        name = connection.dialect.name
        made = self._made.get(name)
        if made is None:
            compiled = self.clause.compile(dialect=connection.dialect)
            constant = {key: value for key, value in compiled.params.items() if value is not None}
            made = self._made[name] = str(compiled), constant
        text, constant = made
        cursor = connection.connection.cursor()
        cursor.execute(text, {**constant, **given} if constant else given)
        return cursor

    def scalar(self, connection: Connection, given: Mapping[str, Any]) -> Any:
        """Return the first cell of the first row, None where there is no row."""
        row = self.run(connection, given).fetchone()
        return None if row is None else row[0]

    def row(self, connection: Connection, given: Mapping[str, Any]) -> dict[str, Any] | None:
        """Return the first row by the names of its columns, None where there is none."""
        cursor = self.run(connection, given)
        found = cursor.fetchone()
        if found is None:
            return None
        return dict(zip((column[0] for column in cursor.description), found, strict=True))
