"""Where the disk is full nothing is acknowledged, what was acknowledged stays, and it goes on when there is room again."""

from __future__ import annotations

import json
from typing import Any

import httpx
from apps.study.server.visitors import Visitor, in_phase
from sqlalchemy import select

from ratherthan.apps.study.server.tables import ANSWER


def limited(study: Any, pages: int | None) -> None:
    """Let the database have no more pages than it has, or as many as it likes."""

    def job(connection: Any) -> None:
        cursor = connection.connection.cursor()
        cursor.execute("PRAGMA page_count")
        most = cursor.fetchone()[0] if pages is None else pages
        cursor.execute(f"PRAGMA max_page_count={most}")

    study.store.write_now(job)


def kept(study: Any) -> list[dict[str, Any]]:
    found: dict[int, dict[str, Any]] = {}
    for row in study.store.read(lambda connection: connection.execute(select(ANSWER)).all()):
        found.setdefault(row.participant, {})[row.screen] = json.loads(row.content)
    return list(found.values())


def test_a_full_disk_is_said_and_nothing_is_acknowledged_that_is_not_stored(tmp_path, served, visitor):
    from apps.study.designs import small_design

    study, address = served(small_design(tmp_path), str(tmp_path / "a.sqlite3"))
    folk = [visitor(study, address, seed=number) for number in range(8)]
    for person in folk:
        person.walk(in_phase("trial"))
    limited(study, None)
    refused = [answered(person) for _ in range(20) for person in folk]
    told = [answer for answer in refused if answer is not None]
    assert told
    for answer in told:
        assert answer.status_code == 503
        assert answer.json()["error"]["kind"] == "storage"
        assert answer.headers["retry-after"]
    assert _ordered(kept(study)) == _ordered([person.acknowledged for person in folk])
    assert folk[0].client.get("/researchers/login").status_code == 200
    limited(study, 1_000_000)
    for person in folk:
        assert person.walk()["state"] == "finished"
    assert _ordered(kept(study)) == _ordered([person.acknowledged for person in folk])


def _ordered(answers: list[dict[str, Any]]) -> list[str]:
    return sorted(json.dumps(one, sort_keys=True) for one in answers)


def answered(person: Visitor) -> httpx.Response | None:
    """Answer the present screen; return the answer of the server where it refused."""
    values = person.values()
    answer = person.post(values)
    if answer.status_code != 200:
        return answer
    person.acknowledged[person.told["screen"]["id"]] = values
    person.told = answer.json()
    return None


def test_one_refused_job_does_not_spoil_those_beside_it(design, tmp_path):
    from concurrent.futures import Future

    from ratherthan.apps.study.server.database import Store, Waiting, address
    from ratherthan.apps.study.server.migrations import brought_up_to_date
    from ratherthan.apps.study.server.tables import TOMBSTONE

    url = address(str(tmp_path / "a.sqlite3"))
    brought_up_to_date(url)
    store = Store(url)

    def stone(day: str, then: Exception | None = None, sql: str = "") -> Any:
        def job(connection: Any) -> str:
            connection.execute(TOMBSTONE.insert(), {"day": day})
            if sql:
                connection.exec_driver_sql(sql)
            if then is not None:
                raise then
            return day

        return job

    jobs = [stone("a"), stone("b", ValueError("no")), stone("c", sql="INSERT INTO nothing VALUES (1)"), stone("d")]
    waiting = [Waiting(job, None, Future()) for job in jobs]
    store.write_now(lambda _: [store.jobs.put(one) for one in waiting])  # so that they are taken together
    told = [one.result.exception() or one.result.result() for one in waiting]
    assert [told[0], told[3]] == ["a", "d"]
    assert isinstance(told[1], ValueError)
    assert type(told[2]).__name__ == "StorageError"
    days = store.read(lambda connection: connection.execute(select(TOMBSTONE.c.day)).scalars().all())
    assert sorted(days) == ["a", "d"]
    store.close()


def test_a_database_that_was_away_is_found_again(design, postgres, served, visitor):
    import psycopg
    from apps.study.server.settings import new_database

    url = new_database(postgres)
    study, address = served(design, url)
    person = visitor(study, address)
    person.waits = 20
    person.walk(in_phase("trial"))
    with psycopg.connect(postgres, autocommit=True) as connection:
        for _ in range(3):
            name = url.rpartition("/")[2]
            connection.execute("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = %s", (name,))
            assert person.step()["state"] in ("running", "finished")
    assert person.walk()["state"] == "finished"
    assert _ordered(kept(study)) == _ordered([person.acknowledged])
