"""A code, a token's name or a number enters, a participant withdraws, or nothing of them is left but the day on which it was erased."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from typing import Any

from sqlalchemy import Connection, delete, func, insert, or_, select, update

from ratherthan.apps.study.server import places
from ratherthan.apps.study.server.sessions import WITHDRAWN, milliseconds
from ratherthan.apps.study.server.tables import IDENTITY, PARTICIPANT, PLACE, TOMBSTONE
from ratherthan.apps.study.server.tokens import code_of

__all__ = ["erase", "forget_looks", "meant", "withdraw"]

MOST_LOOKS = 500
"""Previews that are kept: of those who look at the study at the same time."""


def meant(connection: Connection, text: str) -> Mapping[str, Any] | None:
    """Return the participant that a researcher means, None where there is none or more than one.

    Parameters
    ----------
    connection : Connection
    text : str
        A number as exports have it ("P0042"), a withdrawal code, or what the platform calls the person.
    """
    text = text.strip()
    number = int(text[1:]) if text[:1] in "Pp" and text[1:].isascii() and text[1:].isdigit() and len(text) < 9 else -1
    found = connection.execute(
        select(PARTICIPANT)
        .outerjoin(IDENTITY, IDENTITY.c.participant == PARTICIPANT.c.id)
        .where(or_(PARTICIPANT.c.number == number, PARTICIPANT.c.code == code_of(text), IDENTITY.c.person == text))
    ).all()
    return found[0]._asdict() if len(found) == 1 else None


def withdraw(connection: Connection, *, code: str | None, key: str | None, erased: bool) -> bool:
    """Let a participant withdraw; return whether there is one.

    Parameters
    ----------
    connection : Connection
    code : str, optional
        As it was typed.
    key : str, optional
        That of the token, where no code is given.
    erased : bool
        Whether everything that they answered goes, too.
    """
    same = PARTICIPANT.c.code == code_of(code) if code is not None else PARTICIPANT.c.key == key
    row = connection.execute(select(PARTICIPANT.c.id).where(same).with_for_update()).one_or_none()
    if row is None:
        return False
    if erased:
        erase(connection, row.id)
        return True
    now = milliseconds()
    connection.execute(
        update(PARTICIPANT)
        .where(PARTICIPANT.c.id == row.id, PARTICIPANT.c.state != WITHDRAWN)
        .values(state=WITHDRAWN, ended=now, seen=now)
    )
    places.leave(connection, row.id)
    return True


def erase(connection: Connection, participant: int) -> None:
    """Delete a participant with everything that hangs on them; their place is free again.

    Parameters
    ----------
    connection : Connection
    participant : int
        The id of the row.
    """
    places.leave(connection, participant)
    connection.execute(delete(PARTICIPANT).where(PARTICIPANT.c.id == participant))
    day = dt.datetime.now(dt.UTC).date().isoformat()
    connection.execute(insert(TOMBSTONE), {"day": day})


def forget_looks(connection: Connection) -> None:
    """Forget all previews but the newest.

    Parameters
    ----------
    connection : Connection
        Of the database of previews.
    """
    newest = connection.execute(select(func.max(PARTICIPANT.c.id))).scalar_one() or 0
    old = select(PARTICIPANT.c.id).where(PARTICIPANT.c.id <= newest - MOST_LOOKS)
    connection.execute(delete(PLACE).where(PLACE.c.holder.in_(old)))
    connection.execute(delete(PARTICIPANT).where(PARTICIPANT.c.id.in_(old)))
