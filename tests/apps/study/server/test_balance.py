"""Every place of the plan is finished by exactly one person, whoever drops out, and whoever comes at the same time."""

from __future__ import annotations

import random
import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import pytest
from apps.study.designs import small_design
from apps.study.server.settings import new_database
from apps.study.server.visitors import Visitor
from sqlalchemy import select, update

from ratherthan.apps.study.design.orders import plan
from ratherthan.apps.study.server import places, sessions
from ratherthan.apps.study.server.arriving import come
from ratherthan.apps.study.server.course import Course
from ratherthan.apps.study.server.monitor import monitored
from ratherthan.apps.study.server.opening import opened
from ratherthan.apps.study.server.platforms import Arrival
from ratherthan.apps.study.server.tables import PARTICIPANT, PLACE


def people(study: Any) -> list[Any]:
    return study.store.read(lambda connection: connection.execute(select(PARTICIPANT)).all())


def long_ago(study: Any, state: str = "running") -> int:
    """Let everybody of a state have been away for long, and look for them."""

    def job(connection: Any) -> int:
        connection.execute(update(PARTICIPANT).where(PARTICIPANT.c.state == state).values(seen=1))
        return places.free_abandoned(connection, 2)

    return study.store.write_now(job)


class Hand:
    """Somebody who takes part without a browser: jobs on the database."""

    def __init__(self, study: Any, seed: int) -> None:
        self.study, self.course, self.lot = study, study.course, random.Random(seed)
        arrived = Arrival(platform="link")
        self.key, self.state = study.store.write_now(lambda c: come(c, self.course, arrived, None))

    def answer(self) -> str:
        standing = self.study.store.write_now(lambda c: sessions.present(c, self.course, self.key))
        if standing.state != "running":
            return standing.state
        screen = self.course.way(standing.who["slot"]).screens[standing.who["answered"]]
        values: dict[str, Any] = {}
        for record in screen.records:
            if record.correct is not None:
                values[record.name] = record.correct
            elif record.options:
                values[record.name] = (
                    record.options[0].value if record.name == "consent" else self.lot.choice(record.options).value
                )
            elif record.required:
                values[record.name] = {"number": 30, "flag": True}.get(record.type, "text")
        posted = sessions.Posted(screen.id, standing.attempt, values, 1000, 0)
        return self.study.store.write_now(lambda c: sessions.answer(c, self.course, self.key, posted)).state

    def go(self, screens: int) -> str:
        state = self.state
        for _ in range(screens):
            if state != "running":
                break
            state = self.answer()
        return state


def test_a_full_round_of_42_is_exact_over_those_who_finish_whoever_drops_out(tmp_path):
    design = small_design(tmp_path, quota=42)
    study = opened(design, str(tmp_path / "a.sqlite3"))
    lot, dropped = random.Random(7), 0
    for wave in range(60):
        hands = [Hand(study, seed=1000 * wave + i) for i in range(lot.randint(1, 9))]
        leaving = [hand for hand in hands if hand.key and lot.random() < 0.35]
        for hand in hands:
            hand.go(lot.randint(1, 30) if hand in leaving else 1000)
        dropped += long_ago(study)
        if sum(who.state == "finished" for who in people(study)) == 42:
            break
    finished = [who for who in people(study) if who.state == "finished"]
    assert dropped > 5
    assert len(finished) == 42
    assert sorted(who.slot for who in finished) == list(range(42))
    kinds, maps = Counter[Any](), Counter[Any]()
    for who in finished:
        for place, (shown, order) in enumerate(plan(design, who.slot)):
            maps[shown, place] += 1
            kinds.update((shown, kind, at) for at, kind in enumerate(order))
    assert set(kinds.values()) == {6}
    assert set(maps.values()) == {14}
    told = study.store.read(lambda connection: monitored(connection, study))
    assert told["balanced"]
    assert told["full"]
    assert {row["finished"] for row in told["balance"]} == {18}
    assert Hand(study, 1).state == "closed"
    study.close()


def test_people_who_come_at_the_same_time_get_different_places(design, database, served, visitor):
    study, address = served(replace(design, quota=12), database)
    folk = [visitor(study, address, seed=i) for i in range(16)]

    with ThreadPoolExecutor(16) as pool:
        states = Counter(pool.map(_safely, folk))
    assert states == {"running": 12, "closed": 4}
    taken = study.store.read(lambda connection: connection.execute(select(PLACE)).all())
    assert sorted(place.slot for place in taken) == list(range(12))
    assert len({place.holder for place in taken}) == 12


def _safely(person: Visitor) -> str:
    if not person.enter()["token"]:
        return "closed"
    person.now()
    return str(person.step()["state"])


def test_two_servers_on_one_postgresql_database_never_give_a_place_twice(design, postgres):
    url = new_database(postgres)
    studies = [opened(replace(design, quota=20), url) for _ in range(2)]
    hands: list[Hand] = []
    lock = threading.Lock()

    def come(study: Any, seed: int) -> None:
        hand = Hand(study, seed)
        hand.go(1)
        with lock:
            hands.append(hand)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda i: come(studies[i % 2], i), range(20)))
    taken = studies[0].store.read(lambda connection: connection.execute(select(PLACE)).all())
    assert sorted(place.slot for place in taken) == list(range(20))
    assert len({place.holder for place in taken}) == 20
    for study in studies:
        study.close()


def test_who_was_away_too_long_goes_on_if_the_place_is_still_free(design, database):
    study = opened(replace(design, quota=2), database)
    away, other = Hand(study, 1), Hand(study, 2)
    away.go(5)
    other.go(5)
    assert long_ago(study) == 2
    assert away.answer() == "running"  # back in the old place
    stranger = Hand(study, 3)
    stranger.go(1000)
    assert {who.slot: who.state for who in people(study) if who.state == "finished"} == {1: "finished"}
    assert other.answer() == "closed"  # the place went to the stranger, who finished it
    assert away.go(1000) == "finished"
    assert sorted(who.slot for who in people(study) if who.state == "finished") == [0, 1]
    study.close()


@pytest.mark.parametrize("way", ["withdraw", "erase"])
def test_who_withdraws_after_the_end_is_replaced(design, tmp_path, way):
    from ratherthan.apps.study.server.erasing import withdraw

    study = opened(replace(design, quota=1), str(tmp_path / "a.sqlite3"))
    first = Hand(study, 1)
    assert first.go(1000) == "finished"
    assert Hand(study, 2).state == "closed"
    study.store.write_now(lambda c: withdraw(c, code=None, key=first.key, erased=way == "erase"))
    second = Hand(study, 3)
    assert second.go(1000) == "finished"
    assert [who.slot for who in people(study) if who.state == "finished"] == [0]
    study.close()


def test_a_quota_that_shrinks_and_grows_is_kept(design, tmp_path):
    from ratherthan.apps.study.server.tables import STUDY

    study = opened(replace(design, quota=4), str(tmp_path / "a.sqlite3"))

    def quota(number: int | None) -> None:
        study.store.write_now(lambda c: c.execute(update(STUDY).values(quota=number)).rowcount)

    assert [Hand(study, i).go(1000) for i in range(2)] == ["finished"] * 2
    quota(2)
    assert Hand(study, 9).state == "closed"
    quota(3)
    assert Hand(study, 10).go(1000) == "finished"
    assert Hand(study, 11).state == "closed"
    quota(None)
    assert [Hand(study, 20 + i).go(1000) for i in range(3)] == ["finished"] * 3
    assert sorted(who.slot for who in people(study)) == list(range(6))
    study.close()


def test_all_begin_alike_so_that_consent_needs_no_place(tmp_path):
    course = Course(small_design(tmp_path))
    first = course.way(0)
    count = next(i for i, screen in enumerate(first.screens) if screen.phase == "trial")
    assert count > 1
    for slot in range(0, 84, 5):
        assert [course.way(slot).text(i) for i in range(count)] == [first.text(i) for i in range(count)]
