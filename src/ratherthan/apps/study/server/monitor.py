"""A database enters, how the study is going leaves: who began, finished and left where, the balance, times and failed checks."""

from __future__ import annotations

import datetime as dt
import json
import statistics
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from sqlalchemy import Connection, and_, func, select

from ratherthan.apps.study.design.nouns import Screen
from ratherthan.apps.study.design.orders import plan
from ratherthan.apps.study.server import places
from ratherthan.apps.study.server.course import Course
from ratherthan.apps.study.server.opening import Study
from ratherthan.apps.study.server.places import DROPPED, RUNNING
from ratherthan.apps.study.server.sessions import (
    CLOSED,
    FINISHED,
    NO_CONSENT,
    SCREENED_OUT,
    WITHDRAWN,
    gap,
    milliseconds,
)
from ratherthan.apps.study.server.tables import ANSWER, ATTEMPT, PARTICIPANT, STUDY, TOMBSTONE
from ratherthan.apps.study.server.values import all_correct

__all__ = ["monitored", "person_row", "state_now"]

SHOWN = 200
ENTERED = "entered"
Rows = list[Mapping[str, Any]]


def state_now(who: Mapping[str, Any], before: int) -> str:
    """Return the state of a participant, who may have gone away since somebody last looked.

    Parameters
    ----------
    who : mapping
        Their row.
    before : int
        Who was last seen before this time has dropped out.
    """
    state = str(who["state"])
    return DROPPED if state == RUNNING and who["seen"] < before else state


def monitored(connection: Connection, study: Study) -> dict[str, Any]:
    """Return how a study is going; docs/study/serving.md lists what is in it.

    Parameters
    ----------
    connection : Connection
    study : Study
    """
    course = study.course
    about = connection.execute(select(STUDY)).one()
    before = milliseconds() - gap(course)
    everybody: Rows = [
        {**row._asdict(), "state": state_now(row._asdict(), before)}
        for row in connection.execute(select(PARTICIPANT).order_by(PARTICIPANT.c.entered.desc()))
    ]
    erased = connection.execute(select(func.count()).select_from(TOMBSTONE)).scalar_one()
    slots = _slots(everybody, course)
    return {
        "simulated": study.simulated,
        "paused": about.paused,
        "quota": about.quota,
        "full": places.is_full(connection),
        "design": course.design.title,
        "fingerprint": course.design.fingerprint,
        **_counts(everybody, erased),
        "dropouts": _dropouts(everybody, course),
        "slots": slots,
        **_balance(everybody, course),
        "balanced": len({one["finished"] for one in slots}) <= 1,
        "round": course.round,
        "times": _times(connection, course),
        "checks": _checks(connection, course),
        "checks_failed": _failed(everybody),
        "people": [_person(who, course) for who in everybody[:SHOWN]],
    }


def person_row(who: Mapping[str, Any], study: Study) -> dict[str, Any]:
    """Return one participant as the monitor shows them."""
    before = milliseconds() - gap(study.course)
    return _person({**who, "state": state_now(who, before)}, study.course)


def _counts(everybody: Rows, erased: int) -> dict[str, Any]:
    """Return how many are in which state."""
    states = Counter(ENTERED if who["state"] == RUNNING and who["slot"] is None else who["state"] for who in everybody)
    shown = [ENTERED, RUNNING, FINISHED, DROPPED, SCREENED_OUT, NO_CONSENT, WITHDRAWN]
    shown += [CLOSED] if states[CLOSED] else []
    rows = [{"state": state, "people": states[state]} for state in shown]
    return {
        "states": [*rows, {"state": "erased", "people": erased}],
        "started": len(everybody),
        "consented": sum(who["slot"] is not None for who in everybody),
        "finished": states[FINISHED],
        "running": states[RUNNING],
        "dropped_out": states[DROPPED],
        "screened_out": states[SCREENED_OUT],
        "no_consent": states[NO_CONSENT],
        "withdrawn": states[WITHDRAWN],
        "erased": erased,
    }


def _dropouts(everybody: Rows, course: Course) -> list[dict[str, Any]]:
    """Return where those stood who dropped out, in the order of the screens."""
    stood: Counter[str] = Counter()
    phases: dict[str, str] = {}
    for who in everybody:
        if who["state"] == DROPPED:
            screen = _screen(who, course)
            stood[screen.id] += 1
            phases[screen.id] = screen.phase
    order = course.way(0).places
    names = sorted(stood, key=lambda name: order.get(name, len(order)))
    return [{"screen": name, "phase": phases[name], "people": stood[name]} for name in names]


def _slots(everybody: Rows, course: Course) -> list[dict[str, int]]:
    """Return how many are at and through each row of the plan."""
    finished, running = Counter[int](), Counter[int]()
    for who in everybody:
        if who["slot"] is not None:
            finished[who["slot"] % course.round] += who["state"] == FINISHED
            running[who["slot"] % course.round] += who["state"] == RUNNING
    return [{"slot": slot, "running": running[slot], "finished": finished[slot]} for slot in range(course.round)]


def _balance(everybody: Rows, course: Course) -> dict[str, Any]:
    """Return how often each kind and each map stood in each place, over those who finished."""
    kinds, maps = Counter[tuple[str, int]](), Counter[tuple[str, int]]()
    design = course.design
    through = Counter(who["slot"] % course.round for who in everybody if who["state"] == FINISHED)
    for slot, people in through.items():
        for place, (shown, order) in enumerate(plan(design, slot), 1):
            maps[shown, place] += people
            for kind_place, kind in enumerate(order, 1):
                kinds[kind, kind_place] += people
    own = [kind.id for kind in design.kinds]
    sites = [one.id for one in design.maps]
    return {
        "balance": [
            {"kind": kind, "place": place, "finished": kinds[kind, place]}
            for kind in own
            for place in range(1, len(own) + 1)
        ],
        "maps": [
            {"map": one, "place": place, "finished": maps[one, place]}
            for one in sites
            for place in range(1, len(sites) + 1)
        ],
    }


def _times(connection: Connection, course: Course) -> list[dict[str, Any]]:
    """Return the visible time of answered trials, by kind."""
    kinds = {screen.id: screen.kind for screen in course.way(0).screens if screen.phase == "trial"}
    same = and_(ANSWER.c.participant == ATTEMPT.c.participant, ANSWER.c.screen == ATTEMPT.c.screen)
    rows = connection.execute(
        select(ATTEMPT.c.screen, func.sum(ATTEMPT.c.visible).label("spent"))
        .join(ANSWER, same)
        .where(ATTEMPT.c.screen.in_(kinds))
        .group_by(ATTEMPT.c.participant, ATTEMPT.c.screen)
    )
    spent: dict[str, list[float]] = {}
    for row in rows:
        spent.setdefault(str(kinds[row.screen]), []).append(float(row.spent) / 1000)
    return [
        {
            "kind": kind.id,
            "label": kind.label,
            "trials": len(spent.get(kind.id, [])),
            **_quartiles(spent.get(kind.id, [])),
        }
        for kind in course.design.kinds
    ]


def _quartiles(values: Iterable[float]) -> dict[str, float | None]:
    found = sorted(values)
    if not found:
        return {"low_s": None, "median_s": None, "high_s": None}
    low, middle, high = statistics.quantiles(found, n=4, method="inclusive") if len(found) > 1 else found * 3
    return {"low_s": low, "median_s": middle, "high_s": high}


def _checks(connection: Connection, course: Course) -> list[dict[str, Any]]:
    """Return how often each check was answered, and how often wrongly."""
    asked = {
        screen.id: screen
        for screen in course.way(0).screens
        if screen.phase in ("comprehension", "attention")
        and any(record.correct is not None for record in screen.records)
    }
    answered, failed = Counter[str](), Counter[str]()
    rows = connection.execute(select(ANSWER.c.screen, ANSWER.c.content).where(ANSWER.c.screen.in_(asked)))
    for screen, content in rows:
        answered[screen] += 1
        failed[screen] += not all_correct(asked[screen], json.loads(content))
    return [{"screen": name, "answered": answered[name], "failed": failed[name]} for name in asked]


def _failed(everybody: Rows) -> list[dict[str, int]]:
    """Return how many of those who finished failed how many attention checks."""
    counts = Counter(int(who["failed"]) for who in everybody if who["state"] == FINISHED)
    return [{"failed": failed, "people": counts[failed]} for failed in range(max(counts, default=-1) + 1)]


def _screen(who: Mapping[str, Any], course: Course) -> Screen:
    """Return the screen at which a participant stands, or stood last."""
    screens = course.way(who["slot"]).screens
    return screens[min(int(who["answered"]), len(screens) - 1)]


def _person(who: Mapping[str, Any], course: Course) -> dict[str, Any]:
    """Return a participant as a row of a table."""
    way = course.way(who["slot"])
    return {
        "key": f"P{who['number']:04d}",
        "state": ENTERED if who["state"] == RUNNING and who["slot"] is None else who["state"],
        "slot": who["slot"],
        "screen": _screen(who, course).id,
        "number": min(who["answered"] + 1, len(way.screens)),
        "of": len(way.screens),
        "entered": _moment(who["entered"]),
        "last": _moment(who["seen"]),
        "minutes": round((who["seen"] - who["entered"]) / 60_000, 1),
        "checks_failed": who["failed"],
        "platform": who["platform"],
    }


def _moment(when: int) -> str:
    """Return a time as it is shown."""
    return dt.datetime.fromtimestamp(when / 1000, dt.UTC).strftime("%Y-%m-%d %H:%M UTC")
