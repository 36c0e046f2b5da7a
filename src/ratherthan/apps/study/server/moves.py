"""The reads and writes of one participation, each a statement that is prepared once: what `sessions` does with the database."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import Connection, bindparam, case, func, insert, literal, select, update

from ratherthan.apps.study.server.statements import Statement
from ratherthan.apps.study.server.tables import ANSWER, ATTEMPT, PARTICIPANT, STUDY

__all__ = [
    "KEPT",
    "keep_answer",
    "last_attempt",
    "last_try",
    "move",
    "new_attempt",
    "participant",
    "paused",
    "see",
    "spend",
]

KEPT = ("state", "slot", "answered", "tries", "failed", "seen", "ended")
"""What of a participant's row ever changes."""

_WHO = Statement(select(PARTICIPANT).where(PARTICIPANT.c.key == bindparam("key_")).with_for_update())
_OPEN = Statement(
    insert(ATTEMPT)
    .from_select(
        ["participant", "screen", "number", "opened", "visible", "hidden"],
        select(
            bindparam("who_", type_=ATTEMPT.c.participant.type),
            bindparam("screen_", type_=ATTEMPT.c.screen.type),
            func.coalesce(func.max(ATTEMPT.c.number), 0) + 1,
            bindparam("now_", type_=ATTEMPT.c.opened.type),
            literal(0),
            literal(0),
        ).where(ATTEMPT.c.participant == bindparam("who_"), ATTEMPT.c.screen == bindparam("screen_")),
    )
    .returning(ATTEMPT.c.number)
)
_LAST = Statement(
    select(func.coalesce(func.max(ATTEMPT.c.number), 0)).where(
        ATTEMPT.c.participant == bindparam("who_"), ATTEMPT.c.screen == bindparam("screen_")
    )
)
_SPEND = Statement(
    update(ATTEMPT)
    .where(
        ATTEMPT.c.participant == bindparam("who_"),
        ATTEMPT.c.screen == bindparam("screen_"),
        ATTEMPT.c.number == bindparam("number_"),
    )
    .values(  # told again and again while the page is open: the longest is the last
        visible=case((ATTEMPT.c.visible < bindparam("visible_"), bindparam("visible_")), else_=ATTEMPT.c.visible),
        hidden=case((ATTEMPT.c.hidden < bindparam("hidden_"), bindparam("hidden_")), else_=ATTEMPT.c.hidden),
    )
)
_TRIED = Statement(
    select(func.coalesce(func.max(ANSWER.c.attempt), 0)).where(
        ANSWER.c.participant == bindparam("who_"), ANSWER.c.screen == bindparam("screen_")
    )
)
_STORE = Statement(insert(ANSWER))
_SEEN = Statement(update(PARTICIPANT).where(PARTICIPANT.c.id == bindparam("id_")).values(seen=bindparam("now_")))
_MOVE = Statement(
    update(PARTICIPANT)
    .where(PARTICIPANT.c.id == bindparam("id_"))
    .values({name: bindparam(f"{name}_") for name in KEPT})
)


_PAUSED = Statement(select(STUDY.c.paused))


def participant(connection: Connection, key: str) -> dict[str, Any] | None:
    """Return the row of a participant, which nobody else changes until the transaction ends."""
    return _WHO.row(connection, {"key_": key})


def new_attempt(connection: Connection, who: int, screen: str, now: int) -> int:
    """Begin an attempt at a screen, and return its number."""
    return int(_OPEN.scalar(connection, {"who_": who, "screen_": screen, "now_": now}))


def last_attempt(connection: Connection, who: int, screen: str) -> int:
    """Return the number of the last attempt at a screen, 0 where there was none."""
    return int(_LAST.scalar(connection, {"who_": who, "screen_": screen}))


def last_try(connection: Connection, who: int, screen: str) -> int:
    """Return the attempt of the last answer to a screen, 0 where there is none."""
    return int(_TRIED.scalar(connection, {"who_": who, "screen_": screen}))


def spend(connection: Connection, who: int, at: tuple[str, int], spent: tuple[int, int]) -> bool:
    """Keep the (visible, hidden) milliseconds of an attempt (screen, number); return whether it was ever begun."""
    given = {"who_": who, "screen_": at[0], "number_": at[1], "visible_": spent[0], "hidden_": spent[1]}
    return bool(_SPEND.run(connection, given).rowcount)


def keep_answer(connection: Connection, row: Mapping[str, Any]) -> None:
    """Store an answer."""
    _STORE.run(connection, row)


def see(connection: Connection, who: int, now: int) -> None:
    """Note that a participant was heard of."""
    _SEEN.run(connection, {"id_": who, "now_": now})


def paused(connection: Connection) -> bool:
    """Whether nobody may begin now."""
    return bool(_PAUSED.scalar(connection, {}))


def move(connection: Connection, who: Mapping[str, Any]) -> None:
    """Store where a participant stands now."""
    _MOVE.run(connection, {"id_": who["id"], **{f"{name}_": who[name] for name in KEPT}})
