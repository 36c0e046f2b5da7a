"""A participant enters, a row of the balanced plan leaves, which nobody else has; places of those who go are given to others.

A *place* is a slot: a row of the plan, counted on through all rounds. A study that wants n people has the places 0 … n-1, and each is
to be *finished* by exactly one person. So the balance over those who finish is that of the plan: exact after every full round.
Who comes takes the lowest free place, one that somebody left before a new one; new ones come from a counter row by UPDATE … RETURNING.
That row is written first, and so is the lock: two who come at the same time, through one server or two, wait for each other there.
A place is free again when its holder drops out (longer away than the design allows), is screened out, withdraws or is erased.
Who comes back after that gets their old place if it is still free, and no other: they have seen a part of that one.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, bindparam, func, null, select, update

from ratherthan.apps.study.server.statements import Statement
from ratherthan.apps.study.server.tables import PARTICIPANT, PLACE, STUDY

__all__ = ["DROPPED", "RUNNING", "free_abandoned", "is_full", "leave", "retake", "take"]

RUNNING = "running"
DROPPED = "dropped-out"
UNLIMITED = 2**31 - 1

_LOCK = Statement(update(STUDY).values(entered=STUDY.c.entered).returning(STUDY.c.quota, STUDY.c.next_slot))
_COUNTS = Statement(select(STUDY.c.quota, STUDY.c.next_slot))
_NEXT = Statement(update(STUDY).values(next_slot=STUDY.c.next_slot + 1).returning(STUDY.c.next_slot - 1))
_LOWEST = Statement(select(func.min(PLACE.c.slot)).where(PLACE.c.holder.is_(None), PLACE.c.slot < bindparam("quota")))
_MAKE = Statement(PLACE.insert())
_LEAVE = Statement(update(PLACE).where(PLACE.c.holder == bindparam("holder_")).values(holder=null()))
_HOLD = Statement(
    update(PLACE)
    .where(PLACE.c.slot == bindparam("slot_"), PLACE.c.holder.is_(None))
    .values(holder=bindparam("holder_"))
    .returning(PLACE.c.slot)
)


def take(connection: Connection, participant: int) -> int | None:
    """Return the slot of a participant from now on, None where all places are taken.

    Parameters
    ----------
    connection : Connection
        In a transaction that writes.
    participant : int
    """
    quota, counter = _limits(_LOCK.run(connection, {}).fetchone())
    free = _LOWEST.scalar(connection, {"quota": quota})
    if free is not None:
        return int(_HOLD.scalar(connection, {"slot_": free, "holder_": participant}))
    if counter >= quota:
        return None
    slot = int(_NEXT.scalar(connection, {}))
    _MAKE.run(connection, {"slot": slot, "holder": participant})
    return slot


def is_full(connection: Connection) -> bool:
    """Whether nobody can be given a place now."""
    quota, counter = _limits(_COUNTS.run(connection, {}).fetchone())
    return counter >= quota and _LOWEST.scalar(connection, {"quota": quota}) is None


def retake(connection: Connection, participant: int, slot: int | None) -> bool:
    """Give a participant who comes back late their old place; return whether it was still free.

    Parameters
    ----------
    connection : Connection
    participant : int
    slot : int, optional
        None where they had none yet: then there is nothing to give.
    """
    if slot is None:
        return True
    _LOCK.run(connection, {})
    return _HOLD.scalar(connection, {"slot_": slot, "holder_": participant}) is not None


def leave(connection: Connection, participant: int) -> None:
    """Let others have the place of a participant."""
    _LEAVE.run(connection, {"holder_": participant})


def free_abandoned(connection: Connection, before: int) -> int:
    """Let others have the places of those who were last seen before a time; return how many.

    Parameters
    ----------
    connection : Connection
    before : int
        Milliseconds since 1970.
    """
    gone = connection.execute(
        update(PARTICIPANT)
        .where(PARTICIPANT.c.state == RUNNING, PARTICIPANT.c.seen < before)
        .values(state=DROPPED, ended=PARTICIPANT.c.seen)
        .returning(PARTICIPANT.c.id)
    ).scalars()
    found: list[dict[str, Any]] = [{"gone": one} for one in gone]
    if found:
        connection.execute(update(PLACE).where(PLACE.c.holder == bindparam("gone")).values(holder=None), found)
    return len(found)


def _limits(row: Any) -> tuple[int, int]:
    """Return how many places there may be, and how many have been given out."""
    quota, counter = row
    return (UNLIMITED if quota is None else quota), counter
