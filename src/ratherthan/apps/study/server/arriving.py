"""Somebody who comes enters, the participant that they are leaves: the one they were before, or a new one."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from typing import Any

from sqlalchemy import Connection, and_, func, insert, select, update

from ratherthan.apps.study.server import moves, places, tokens
from ratherthan.apps.study.server.course import Course
from ratherthan.apps.study.server.places import RUNNING
from ratherthan.apps.study.server.platforms import Arrival
from ratherthan.apps.study.server.refusals import RefusedError
from ratherthan.apps.study.server.sessions import CLOSED, ENDED, PAUSED, gap, milliseconds, woken
from ratherthan.apps.study.server.tables import IDENTITY, PARTICIPANT, STUDY

__all__ = ["come"]


def come(connection: Connection, course: Course, arrived: Arrival, key: str | None) -> tuple[str, str]:
    """Return (key, state) of who comes: of the participant they were before, or of a new one; the key is "" where they cannot enter.

    Parameters
    ----------
    connection : Connection
    course : Course
    arrived : Arrival
    key : str, optional
        Of the token that their browser kept.

    Raises
    ------
    RefusedError
        Where the session belongs to another person.
    """
    before = _before(connection, arrived, key)
    if before is not None:
        return str(before["key"]), woken(connection, before).state
    if moves.paused(connection):
        return "", PAUSED
    if places.is_full(connection):
        places.free_abandoned(connection, milliseconds() - gap(course))
    if places.is_full(connection):
        return "", CLOSED
    return _created(connection, arrived), RUNNING


def _before(connection: Connection, arrived: Arrival, key: str | None) -> Mapping[str, Any] | None:
    """Return the row of the participant that somebody was before, None where they are new."""
    if arrived.session is not None:
        joined = PARTICIPANT.join(IDENTITY, IDENTITY.c.participant == PARTICIPANT.c.id)
        row = connection.execute(
            select(PARTICIPANT, IDENTITY.c.person).select_from(joined).where(IDENTITY.c.session == arrived.session)
        ).one_or_none()
        if row is None:
            return None
        if row.person != arrived.person:
            raise RefusedError(
                403, "platform", "another", "This session belongs to another person: open the study from your own page."
            )
        return row._asdict()
    if key is None:
        return None
    row = connection.execute(select(PARTICIPANT).where(PARTICIPANT.c.key == key)).one_or_none()
    if row is None or row.platform != arrived.platform or (arrived.anew and row.state in ENDED):
        return None
    return row._asdict()


def _created(connection: Connection, arrived: Arrival) -> str:
    """Make a new participant; return the key."""
    now, key = milliseconds(), tokens.new_key()
    connection.execute(update(STUDY).values(entered=STUDY.c.entered + 1))
    known = arrived.person is not None and _took_part(connection, arrived)
    made = connection.execute(
        insert(PARTICIPANT).returning(PARTICIPANT.c.id),
        {
            "number": _number(connection),
            "key": key,
            "code": tokens.new_code(),
            "platform": arrived.platform,
            "state": RUNNING,
            "slot": None,
            "answered": 0,
            "tries": 0,
            "failed": 0,
            "repeated": known,
            "entered": now,
            "seen": now,
            "ended": None,
        },
    ).scalar_one()
    if arrived.session is not None or arrived.person is not None:
        connection.execute(
            insert(IDENTITY),
            {
                "participant": made,
                "session": arrived.session,
                "person": arrived.person,
                "study": arrived.study,
                "submit_to": arrived.submit_to,
            },
        )
    return key


def _took_part(connection: Connection, arrived: Arrival) -> bool:
    """Whether the platform's person was here before, in another session."""
    joined = PARTICIPANT.join(IDENTITY, IDENTITY.c.participant == PARTICIPANT.c.id)
    same = and_(IDENTITY.c.person == arrived.person, PARTICIPANT.c.platform == arrived.platform)
    return connection.execute(select(PARTICIPANT.c.id).select_from(joined).where(same).limit(1)).first() is not None


def _number(connection: Connection) -> int:
    """Return a number that no participant has, drawn by lot, so that it tells nothing of the order in which they came."""
    count = connection.execute(select(func.count()).select_from(PARTICIPANT)).scalar_one()
    most = 9999
    while count * 2 > most:
        most = most * 10 + 9
    while True:
        drawn = secrets.randbelow(most) + 1
        if connection.execute(select(PARTICIPANT.c.id).where(PARTICIPANT.c.number == drawn)).first() is None:
            return drawn
