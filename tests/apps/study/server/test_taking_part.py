from __future__ import annotations

import json
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from apps.study.designs import small_design
from apps.study.server.visitors import Visitor, at, in_phase
from sqlalchemy import func, select, update

from ratherthan.apps.study.server.opening import opened
from ratherthan.apps.study.server.running import serving
from ratherthan.apps.study.server.tables import ANSWER, ATTEMPT, IDENTITY, PARTICIPANT, PLACE, STUDY, TOMBSTONE


def count(study: Any, table: Any) -> int:
    return study.store.read(lambda connection: connection.execute(select(func.count()).select_from(table)).scalar_one())


def rows(study: Any, table: Any) -> list[Any]:
    return study.store.read(lambda connection: connection.execute(select(table)).all())


def test_a_whole_participation_ends_with_thanks_and_a_code(design, database, served, visitor):
    study, address = served(design, database)
    person = visitor(study, address)
    told = person.walk()
    assert told["state"] == "finished"
    assert told["screen"]["phase"] == "thanks"
    assert told["ending"] == {"code": design.codes.done, "redirect": None, "post": None}
    stored = {row.screen: row.content for row in rows(study, ANSWER)}
    assert set(stored) == set(person.acknowledged)
    assert len(stored) == told["of"] - 1


def test_right_answers_never_leave_the_server(design, tmp_path, served, visitor):
    study, address = served(design, str(tmp_path / "a.sqlite3"))
    person = visitor(study, address)
    person.enter()
    person.now()
    while person.told["state"] == "running":
        assert '"correct"' not in person.request("GET", "/api/now").text
        person.now()
        assert all("correct" not in record for record in person.told["screen"]["records"])
        person.step()


def test_an_answer_sent_again_is_stored_once_and_the_first_is_kept(design, database, served, visitor):
    study, address = served(design, database)
    person = visitor(study, address)
    person.walk(in_phase("trial"))
    before, first = person.told, person.values()
    after = person.post(first).json()
    names = [record["name"] for record in before["screen"]["records"]]
    other = {name: 1 if first[name] != 1 else 2 for name in names}
    person.told = before
    again = person.post(other)
    assert again.status_code == 200
    assert again.json() == after  # the attempt as well: the screen is not opened a second time
    kept = [json.loads(row.content) for row in rows(study, ANSWER) if row.screen == before["screen"]["id"]]
    assert kept == [first]


def test_twenty_copies_of_one_answer_at_once_are_one_answer(design, database, served, visitor):
    study, address = served(design, database)
    person = visitor(study, address)
    person.walk(in_phase("trial"))
    values = person.values()
    told: list[Any] = []
    threads = [threading.Thread(target=lambda: told.append(person.post(values))) for _ in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [one.status_code for one in told] == [200] * 20
    assert len({one.text for one in told}) == 1
    assert sum(row.screen == person.told["screen"]["id"] for row in rows(study, ANSWER)) == 1


def test_a_reload_shows_the_same_screen_and_its_times_add_up(design, database, served, visitor):
    study, address = served(design, database)
    person = visitor(study, address)
    person.walk(in_phase("trial"))
    screen = person.told["screen"]["id"]
    body = {"screen": screen, "attempt": 1, "time_ms": 3000, "hidden_ms": 100}
    assert person.request("POST", "/api/time", body).status_code == 204
    assert (
        person.request("POST", "/api/time", {**body, "time_ms": 2000}).status_code == 204
    )  # late: the longer one counts
    assert person.now()["screen"]["id"] == screen
    assert person.told["attempt"] == 2
    person.told = person.post(time_ms=1500, hidden_ms=7).json()
    spent = [(row.number, row.visible, row.hidden) for row in rows(study, ATTEMPT) if row.screen == screen]
    assert sorted(spent) == [(1, 3000, 100), (2, 1500, 7)]


def test_a_new_server_on_the_same_database_goes_on_where_it_was(design, database, visitor):
    study = opened(design, database)
    with serving(study) as address:
        person = visitor(study, address)
        person.walk(in_phase("trial"))
        stood = person.told["screen"]["id"]
    study.close()
    study = opened(design, database)
    assert study.password is None  # made once
    with serving(study) as address:
        same = Visitor(address, design, person.platform)
        same.token = person.token
        assert same.enter()["state"] == "running"
        assert same.now()["screen"]["id"] == stood
        assert same.walk()["state"] == "finished"
    study.close()


def test_screens_are_answered_in_their_order(design, tmp_path, served, visitor):
    study, address = served(design, str(tmp_path / "a.sqlite3"))
    person = visitor(study, address)
    person.walk(in_phase("trial"))
    later = person.post(screen="thanks")
    assert later.status_code == 409
    assert later.json()["error"]["kind"] == "order"
    assert person.post(screen="nothing").status_code == 409
    assert person.post(attempt=7).status_code == 409  # never begun
    assert person.post().status_code == 200


def test_who_declines_leaves_no_answer_and_no_identity(design, database, served, visitor):
    study, address = served(design, database)
    person = visitor(study, address, {"PROLIFIC_PID": "p1", "STUDY_ID": "s", "SESSION_ID": "x1"})
    person.enter()
    person.now()
    told = person.post({"consent": "no"}).json()
    assert told["state"] == "no-consent"
    assert told["screen"] is None
    assert told["ending"] is None or told["ending"]["code"] == design.codes.no_consent
    assert not rows(study, ANSWER)
    assert not rows(study, IDENTITY)
    assert not rows(study, PLACE)
    assert person.post({"consent": "yes"}).json()["state"] == "no-consent"  # a retry changes nothing


def test_wrong_answers_to_the_comprehension_check_screen_out_and_free_the_place(design, database, served, visitor):
    study, address = served(design, database)
    person = visitor(study, address)
    person.walk(in_phase("comprehension"))
    wrong = {}
    for record in person.told["screen"]["records"]:
        wrong[record["name"]] = next(
            o["value"] for o in record["options"] if o["value"] != person.right[record["name"]]
        )
    left = design.comprehension.attempts
    while left:
        assert person.told["state"] == "running"
        assert person.told["tries_left"] == left
        before = person.told
        first = person.post(wrong).json()
        assert person.post(wrong).json() == first  # the same try again is not a second one
        person.told, left = first, left - 1
        assert first["state"] == "screened-out" or (first["again"] and first["attempt"] == before["attempt"] + 1)
    assert person.told["state"] == "screened-out"
    assert sum(row.screen == "comprehension" for row in rows(study, ANSWER)) == design.comprehension.attempts
    assert [row.holder for row in rows(study, PLACE)] == [None]


def test_a_right_try_after_a_wrong_one_goes_on(design, tmp_path, served, visitor):
    study, address = served(design, str(tmp_path / "a.sqlite3"))
    person = visitor(study, address)
    person.walk(in_phase("comprehension"))
    name = person.told["screen"]["records"][0]["name"]
    options = [o["value"] for o in person.told["screen"]["records"][0]["options"]]
    wrong = {**person.values(), name: next(o for o in options if o != person.right[name])}
    person.told = person.post(wrong).json()
    assert person.told["again"]
    assert person.step()["screen"]["phase"] == "trial"
    assert [row.tries for row in rows(study, PARTICIPANT)] == [1]


def test_failed_attention_checks_are_counted_and_end_with_their_code(tmp_path, served, visitor):
    design = small_design(
        tmp_path,
        maps=1,
        kinds=("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive"),
    )
    design = replace(design, failed_checks_allowed=0, codes=replace(design.codes, failed_checks="CHECKS"))
    study, address = served(design, str(tmp_path / "a.sqlite3"))
    person = visitor(study, address)
    checks = [screen.records[0].name for screen in study.course.way(0).screens if screen.phase == "attention"]
    assert checks
    person.walk(in_phase("attention"))
    record = person.told["screen"]["records"][0]
    wrong = next(o["value"] for o in record["options"] if o["value"] != person.right[record["name"]])
    person.told = person.post({record["name"]: wrong}).json()
    assert person.walk()["ending"]["code"] == "CHECKS"
    assert [row.failed for row in rows(study, PARTICIPANT)] == [1]


def test_withdrawing_with_the_code_keeps_or_erases(design, database, served, visitor):
    study, address = served(design, database)
    keeps, goes = visitor(study, address), visitor(study, address)
    keeps.walk(in_phase("trial"))
    goes.walk()
    code = keeps.told["withdrawal_code"]
    stranger = Visitor(address, design, {})
    assert stranger.request("POST", "/api/withdraw", {"code": "aaaa-bbbb-cccc"}).json()["error"]["kind"] == "code"
    typed = f"  {code.upper().replace('-', ' ')} "
    assert stranger.request("POST", "/api/withdraw", {"code": typed, "erase": False}).json()["state"] == "withdrawn"
    late = keeps.post()
    assert late.status_code == 200
    assert late.json()["state"] == "withdrawn"
    assert keeps.now()["state"] == "withdrawn"
    before = count(study, ANSWER)
    assert goes.request("POST", "/api/withdraw", {"erase": True}).json() == {"state": "withdrawn", "erased": True}
    assert goes.request("GET", "/api/now").status_code == 401
    assert 0 < count(study, ANSWER) < before
    assert count(study, PARTICIPANT) == 1
    assert [row.holder for row in rows(study, PLACE)] == [None, None]
    (stone,) = rows(study, TOMBSTONE)
    assert set(stone._mapping) == {"id", "day"}
    assert len(stone.day) == 10


def test_erasing_leaves_no_byte_of_the_text_in_the_file(design, tmp_path, served, visitor):
    study, address = served(small_design(tmp_path, maps=1), str(tmp_path / "a.sqlite3"))
    person = visitor(
        study, address, {"PROLIFIC_PID": "VERYSECRETPERSON", "STUDY_ID": "s", "SESSION_ID": "VERYSECRETSESSION"}
    )
    person.walk(in_phase("about"))
    text = next(record["name"] for record in person.told["screen"]["records"] if record["type"] == "text")
    person.told = person.post({**person.values(), text: "AVERYSECRETREMARK"}).json()
    person.walk()
    held = b"".join(path.read_bytes() for path in tmp_path.glob("a.sqlite3*"))
    assert b"AVERYSECRETREMARK" in held
    assert b"VERYSECRETPERSON" in held
    assert person.request("POST", "/api/withdraw", {"erase": True}).status_code == 200
    held = b"".join(path.read_bytes() for path in tmp_path.glob("a.sqlite3*"))
    for secret in (
        b"AVERYSECRETREMARK",
        b"VERYSECRETPERSON",
        b"VERYSECRETSESSION",
        person.token.split(".")[0].encode(),
    ):
        assert secret not in held


def test_a_preview_is_a_whole_study_that_leaves_nothing(design, tmp_path, served, visitor):
    study, address = served(design, str(tmp_path / "a.sqlite3"))
    person = visitor(study, address, {"preview": "1"})
    assert person.enter()["preview"] is True
    told = person.now()
    assert told["preview"]
    assert told["withdrawal_code"] is None
    assert person.walk()["state"] == "finished"
    assert person.told["ending"] is None
    assert not rows(study, PARTICIPANT)
    assert not rows(study, PLACE)
    assert not rows(study, ANSWER)
    assert rows(study, STUDY)[0].entered == 0


def test_pausing_stops_those_who_come_and_not_those_on_their_way(design, database, served, visitor):
    study, address = served(design, database)
    within, waits = visitor(study, address), visitor(study, address)
    within.walk(in_phase("trial"))
    waits.enter()
    waits.now()
    study.store.write_now(lambda connection: connection.execute(update(STUDY).values(paused=True)).rowcount)
    late = visitor(study, address)
    assert late.enter() == {"token": "", "state": "paused", "preview": False}
    assert waits.post().json()["state"] == "paused"
    assert within.walk()["state"] == "finished"
    study.store.write_now(lambda connection: connection.execute(update(STUDY).values(paused=False)).rowcount)
    assert waits.walk()["state"] == "finished"


def test_who_comes_when_all_places_are_taken_is_told_so(design, tmp_path, served, visitor):
    study, address = served(replace(design, quota=2), str(tmp_path / "a.sqlite3"))
    first, second, waits = (visitor(study, address) for _ in range(3))
    waits.enter()
    waits.now()
    first.walk()
    second.walk(at("instructions-1"))
    assert visitor(study, address).enter()["state"] == "closed"
    assert waits.post().json()["state"] == "closed"  # agreed, and all places were gone by then
    assert second.walk()["state"] == "finished"


def test_robots_and_people_never_share_a_database(design, tmp_path, served, visitor):
    from ratherthan.errors import InputError

    _people, address = served(design, str(tmp_path / "people.sqlite3"))
    robots, elsewhere = served(design, str(tmp_path / "robots.sqlite3"), simulated=True)
    robot = visitor(robots, elsewhere)
    assert robot.walk()["state"] == "finished"
    lost = Visitor(address, design, robot.platform)
    assert lost.request("POST", "/api/enter", {"platform": lost.platform}).json()["error"]["kind"] == "simulated"
    person = Visitor(elsewhere, design, {"PROLIFIC_PID": "p", "STUDY_ID": "s", "SESSION_ID": "x"})
    assert person.request("POST", "/api/enter", {"platform": person.platform}).status_code == 403
    for path, simulated in (("people", True), ("robots", False)):
        with pytest.raises(InputError, match="people or of robots"):
            opened(design, str(tmp_path / f"{path}.sqlite3"), simulated=simulated)


def test_a_changed_design_is_refused_as_soon_as_somebody_entered(design, tmp_path, visitor):
    from ratherthan.errors import InputError

    database = str(tmp_path / "a.sqlite3")
    opened(design, database).close()
    changed = replace(design, title="Another title", fingerprint="e" * 64)
    study = opened(changed, database)  # nobody has entered yet
    with serving(study) as address:
        visitor(study, address).enter()
    study.close()
    with pytest.raises(InputError, match="fingerprint"):
        opened(design, database)


def test_the_file_of_a_database_is_its_owners_alone(design, tmp_path: Path):
    opened(design, str(tmp_path / "a.sqlite3")).close()
    assert (tmp_path / "a.sqlite3").stat().st_mode & 0o077 == 0


def test_previews_do_not_pile_up(design, tmp_path, served, visitor, monkeypatch):
    from ratherthan.apps.study.server import erasing

    monkeypatch.setattr(erasing, "MOST_LOOKS", 3)
    study, address = served(design, str(tmp_path / "a.sqlite3"))
    folk = [visitor(study, address, {"preview": "1"}) for _ in range(6)]
    for person in folk:
        person.walk(in_phase("trial"))
    study.looks.write_now(erasing.forget_looks)
    told = [person.request("GET", "/api/now").status_code for person in folk]
    assert told == [401, 401, 401, 200, 200, 200]


def test_what_a_reader_held_up_is_forgotten_later(design, tmp_path, served, visitor):
    study, address = served(design, str(tmp_path / "a.sqlite3"))
    person = visitor(study, address, {"PROLIFIC_PID": "VERYSECRETPERSON", "STUDY_ID": "s", "SESSION_ID": "x"})
    person.walk()
    held = study.store.reader.raw_connection()
    held.cursor().execute("PRAGMA busy_timeout=50")
    held.cursor().execute("BEGIN")
    held.cursor().execute("SELECT count(*) FROM answer").fetchone()  # an export that takes its time
    other = study.store.reader.raw_connection()
    other.cursor().execute("PRAGMA busy_timeout=50")  # the one that `forget` will take
    other.close()
    assert person.request("POST", "/api/withdraw", {"erase": True}).status_code == 200
    assert study.store.remembers
    held.rollback()
    held.close()
    study.store.forget()
    assert not study.store.remembers
    assert b"VERYSECRETPERSON" not in b"".join(path.read_bytes() for path in tmp_path.glob("a.sqlite3*"))
