"""One participant's requests enter, what is stored and what comes next leave: the states of a participation and what moves them.

::

    (enters) ─► running ──────────► finished ──────────┐
                  │ ├─ declines ──► no-consent         │
                  │ ├─ too many wrong tries ─► screened-out
                  │ ├─ away too long ─► dropped-out ─► running, if the place is still free; else closed
                  │ └─ no place left at consent ─► closed
                  └────────────── withdraws ──────► withdrawn ◄┘      (or erased: then there is nothing left)

An answer is stored once. The same screen again, from a retry or a second tab, changes nothing and is told the present state. Each
function is a job of `database.Store`: it reads and writes through one connection, and is done wholly or not at all.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, delete, select

from ratherthan.apps.study.design.nouns import Screen
from ratherthan.apps.study.design.screens import CONSENT
from ratherthan.apps.study.server import moves, places
from ratherthan.apps.study.server.course import THANKS, Course, Way
from ratherthan.apps.study.server.places import DROPPED, RUNNING
from ratherthan.apps.study.server.refusals import RefusedError
from ratherthan.apps.study.server.tables import IDENTITY, PARTICIPANT
from ratherthan.apps.study.server.values import Value, all_correct, checked_values

__all__ = [
    "CLOSED",
    "ENDED",
    "FINISHED",
    "NO_CONSENT",
    "PAUSED",
    "SCREENED_OUT",
    "WITHDRAWN",
    "Posted",
    "Standing",
    "answer",
    "gap",
    "milliseconds",
    "present",
    "spend",
    "woken",
]

FINISHED, NO_CONSENT, SCREENED_OUT, WITHDRAWN = "finished", "no-consent", "screened-out", "withdrawn"
CLOSED, PAUSED = "closed", "paused"
ENDED = (FINISHED, NO_CONSENT, SCREENED_OUT, WITHDRAWN, CLOSED)


@dataclass(frozen=True)
class Standing:
    """Where a participant stands.

    Parameters
    ----------
    who : mapping
        Their row.
    state : str
        As the browser is told it: that of the row, or "paused".
    attempt : int, optional
        Which one of the present screen is open.
    again : bool
        Whether the last try of the comprehension check was wrong.
    """

    who: Mapping[str, Any]
    state: str
    attempt: int | None = None
    again: bool = False


@dataclass(frozen=True)
class Posted:
    """An answer as it came, its numbers checked.

    Parameters
    ----------
    screen : str
    attempt : int
    values : object
    visible, hidden : int
        Milliseconds.
    """

    screen: str
    attempt: int
    values: Any
    visible: int
    hidden: int


def milliseconds() -> int:
    """Return the time now, as it is stored."""
    return time.time_ns() // 1_000_000


def present(connection: Connection, course: Course, key: str, *, opens: bool = True) -> Standing:
    """Return where a participant stands; an attempt at the present screen begins.

    Parameters
    ----------
    connection : Connection
    course : Course
    key : str
    opens : bool
        Whether the screen is shown anew.

    Raises
    ------
    RefusedError
        Where there is no such participant.
    """
    standing = woken(connection, _found(connection, key))
    if standing.state != RUNNING:
        return standing
    who = standing.who
    moves.see(connection, who["id"], milliseconds())
    return _shown(connection, who, course.way(who["slot"]), opens=opens)


def answer(connection: Connection, course: Course, key: str, posted: Posted) -> Standing:
    """Store the answers of a screen, and return where the participant stands then.

    Parameters
    ----------
    connection : Connection
    course : Course
    key : str
    posted : Posted

    Raises
    ------
    RefusedError
        Where the screen is not the present one, nor one that was answered, or its values are not allowed.
    """
    standing = woken(connection, _found(connection, key))
    who = dict(standing.who)
    if standing.state != RUNNING:
        return standing
    way = course.way(who["slot"])
    index = way.places.get(posted.screen)
    if index is None or index > who["answered"]:
        raise RefusedError(409, "screen", "order", "This is not the present screen: ask for it anew.")
    screen = way.screens[index]
    if index < who["answered"] or _tried_already(connection, who, screen, posted):
        return _shown(connection, who, way, opens=False)
    values = checked_values(screen, posted.values)
    if not moves.spend(connection, who["id"], (screen.id, posted.attempt), (posted.visible, posted.hidden)):
        raise RefusedError(
            409, "attempt", "order", "This attempt at the screen was never begun: ask for the screen anew."
        )
    if screen.phase == CONSENT:
        ended = _consented(connection, who, values)
        if ended is not None:
            return ended
        way = course.way(who["slot"])
    return _stored(connection, course, (who, way, screen), (posted, values))


def spend(connection: Connection, key: str, posted: Posted) -> None:
    """Keep the time that a screen was open so far.

    Parameters
    ----------
    connection : Connection
    key : str
    posted : Posted
        Its values are not looked at.
    """
    who = connection.execute(select(PARTICIPANT.c.id).where(PARTICIPANT.c.key == key)).scalar_one_or_none()
    if who is not None:
        moves.spend(connection, who, (posted.screen, posted.attempt), (posted.visible, posted.hidden))


def _stored(
    connection: Connection,
    course: Course,
    at: tuple[dict[str, Any], Way, Screen],
    given: tuple[Posted, Mapping[str, Value]],
) -> Standing:
    """Store an answer, move on or try again."""
    who, way, screen = at
    posted, values = given
    now = milliseconds()
    checks = any(record.correct is not None for record in screen.records)
    wrong = checks and not all_correct(screen, values)
    trying = screen.phase == "comprehension"
    row = {
        "participant": who["id"],
        "screen": screen.id,
        "turn": who["tries"] + 1 if trying else 1,
        "attempt": posted.attempt,
        "place": who["answered"] + 1,
        "content": json.dumps(values, ensure_ascii=False),
        "stored": now,
    }
    moves.keep_answer(connection, row)
    who["seen"] = now
    if trying and wrong:
        who["tries"] += 1
        if who["tries"] >= course.design.comprehension.attempts:
            who.update(state=SCREENED_OUT, ended=now)
            places.leave(connection, who["id"])
    else:
        who["answered"] += 1
        who["failed"] += wrong
        if way.screens[who["answered"]].phase == THANKS:
            who.update(state=FINISHED, ended=now)
    moves.move(connection, who)
    if who["state"] != RUNNING:
        return Standing(who, who["state"])
    return _shown(connection, who, way, opens=True)


def _consented(connection: Connection, who: dict[str, Any], values: Mapping[str, Value]) -> Standing | None:
    """Give a place to who agrees; return where they stand if the study ends here."""
    now = milliseconds()
    if values.get(CONSENT) != "yes":
        who.update(state=NO_CONSENT, ended=now, seen=now)
        moves.move(connection, who)
        connection.execute(delete(IDENTITY).where(IDENTITY.c.participant == who["id"]))
        return Standing(who, NO_CONSENT)
    if moves.paused(connection):
        return Standing(who, PAUSED)
    who["slot"] = places.take(connection, who["id"])
    if who["slot"] is None:
        who.update(state=CLOSED, ended=now, seen=now)
        moves.move(connection, who)
        return Standing(who, CLOSED)
    return None


def _shown(connection: Connection, who: Mapping[str, Any], way: Way, *, opens: bool) -> Standing:
    """Return where a running participant stands, with a new attempt at the screen or the last one."""
    screen = way.screens[who["answered"]]
    last = 0 if opens else moves.last_attempt(connection, who["id"], screen.id)
    if not last:
        last = moves.new_attempt(connection, who["id"], screen.id, milliseconds())
    return Standing(who, RUNNING, last, again=screen.phase == "comprehension" and who["tries"] > 0)


def _tried_already(connection: Connection, who: Mapping[str, Any], screen: Screen, posted: Posted) -> bool:
    """Whether this very try of the comprehension check is stored, and was wrong."""
    if screen.phase != "comprehension" or not who["tries"]:
        return False
    return posted.attempt <= moves.last_try(connection, who["id"], screen.id)


def woken(connection: Connection, who: Mapping[str, Any]) -> Standing:
    """Return where a participant stands who is heard of again; who was away too long goes on if the place is free."""
    if who["state"] != DROPPED:
        return Standing(who, who["state"])
    if not places.retake(connection, who["id"], who["slot"]):
        return Standing(who, CLOSED)
    back = {**who, "state": RUNNING, "ended": None, "seen": milliseconds()}
    moves.move(connection, back)
    return Standing(back, RUNNING)


def _found(connection: Connection, key: str) -> Mapping[str, Any]:
    """Return the row of a participant."""
    row = moves.participant(connection, key)
    if row is None:
        raise RefusedError(401, "token", "token", "This participant is not known here: enter again with the link.")
    return row


def gap(course: Course) -> int:
    """Return the longest time that somebody may be away, in milliseconds."""
    return int(course.design.longest_gap * 3_600_000)
