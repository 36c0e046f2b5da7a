"""Where a participant stands enters, the document that their browser gets leaves."""

from __future__ import annotations

import json
from typing import Any

from sqlalchemy import Connection, select

from ratherthan.apps.study.server.course import Course
from ratherthan.apps.study.server.places import RUNNING
from ratherthan.apps.study.server.platforms import ending
from ratherthan.apps.study.server.sessions import FINISHED, Standing
from ratherthan.apps.study.server.tables import IDENTITY

__all__ = ["told"]


def told(connection: Connection, course: Course, standing: Standing, *, preview: bool) -> bytes:
    """Return the answer to ``/api/now`` and ``/api/answer``, as JSON.

    Parameters
    ----------
    connection : Connection
        In the transaction that found the standing.
    course : Course
    standing : Standing
    preview : bool
    """
    who, design = standing.who, course.design
    way = course.way(who["slot"])
    index = who["answered"] if standing.state in (RUNNING, FINISHED) else None
    screen = None if index is None else way.screens[index]
    trying = screen is not None and screen.phase == "comprehension"
    document: dict[str, Any] = {
        "state": standing.state,
        "number": min(who["answered"] + 1, len(way.screens)),
        "of": len(way.screens),
        "attempt": standing.attempt,
        "again": standing.again,
        "tries_left": max(design.comprehension.attempts - who["tries"], 0) if trying else None,
        "study": {"title": design.title, "language": design.language, "contact": design.contact},
        "ending": None if standing.state == RUNNING or preview else _ending(connection, course, standing),
        "withdrawal_code": None if preview else who["code"],
        "preview": preview,
    }
    shown = "null" if index is None else way.text(index)
    return f'{json.dumps(document, ensure_ascii=False)[:-1]}, "screen": {shown}}}'.encode()


def _ending(connection: Connection, course: Course, standing: Standing) -> dict[str, Any] | None:
    """Return how a participant is sent back."""
    who, design = standing.who, course.design
    row = connection.execute(
        select(IDENTITY.c.session, IDENTITY.c.submit_to).where(IDENTITY.c.participant == who["id"])
    ).one_or_none()
    arrived = {
        "platform": who["platform"],
        "session": None if row is None else row.session,
        "submit_to": None if row is None else row.submit_to,
    }
    return ending(standing.state, arrived, design.codes, failed=who["failed"] > design.failed_checks_allowed)
