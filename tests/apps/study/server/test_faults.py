"""Faults that studies on the web have had, each once: what must not happen again, and what hostile requests get."""

from __future__ import annotations

import json
import logging
import socket
import time
from contextlib import suppress
from typing import Any

import httpx
import pytest
from apps.study.server.visitors import Visitor, in_phase
from sqlalchemy import select

from ratherthan.apps.study.server.limits import Limit
from ratherthan.apps.study.server.refusals import RefusedError
from ratherthan.apps.study.server.tables import ANSWER, IDENTITY, PARTICIPANT


@pytest.fixture
def place(design, tmp_path, served):
    return served(design, str(tmp_path / "a.sqlite3"))


@pytest.fixture
def person(place, visitor):
    found = visitor(*place)
    found.walk(in_phase("trial"))
    return found


def sent(person: Visitor, body: str | bytes, path: str = "/api/answer", **headers: str) -> httpx.Response:
    head = {"Authorization": f"Bearer {person.token}", "Content-Type": "application/json", **headers}
    return person.client.post(path, content=body, headers=head)


def answered(study: Any) -> int:
    return len(study.store.read(lambda connection: connection.execute(select(ANSWER)).all()))


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "9" * 400])
def test_numbers_that_are_none_are_refused_and_not_echoed(person, number):
    told = person.told["screen"]
    name = told["records"][0]["name"]
    answer = sent(person, f'{{"screen": "{told["id"]}", "attempt": 1, "values": {{"{name}": {number}}}}}')
    assert answer.status_code == 422
    assert set(answer.json()["error"]) == {"place", "kind", "sentence"}
    assert number not in answer.text
    assert person.post().status_code == 200  # nothing is broken


@pytest.mark.parametrize(
    "text",
    ["a\\u0000b", "a\\u0007", "\\ud800", "\\u001b[31m", "\\u009f"],
    ids=["null", "bell", "half", "escape", "c1"],
)
@pytest.mark.parametrize("place_", ["values", "screen", "platform", "code"])
def test_control_characters_are_refused_in_every_string(person, text, place_):
    bodies = {
        "values": ("/api/answer", f'{{"screen": "x", "attempt": 1, "values": {{"a": "{text}"}}}}'),
        "screen": ("/api/answer", f'{{"screen": "{text}", "attempt": 1, "values": {{}}}}'),
        "platform": ("/api/enter", f'{{"platform": {{"PROLIFIC_PID": "{text}", "SESSION_ID": "s"}}}}'),
        "code": ("/api/withdraw", f'{{"code": "{text}"}}'),
    }
    path, body = bodies[place_]
    answer = sent(person, body, path)
    assert answer.status_code == 422
    assert answer.json()["error"]["kind"] == "control-characters"


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"null",
        b"[]",
        b'"text"',
        b"{",
        b"\xff\xfe",
        b"[" * 8000,
        b'{"screen": 1, "screen": 2}',
        b'{"attempt": 1}',
        b'{"screen": "x", "attempt": true, "values": {}}',
        b'{"screen": "x", "attempt": -1, "values": {}}',
        b'{"screen": ["x"], "attempt": 1, "values": {}}',
        b'{"screen": "x", "attempt": 1, "values": {}, "time_ms": "soon"}',
        b'{"screen": "x", "attempt": 1, "values": {}, "time_ms": 1e300}',
        b'{"a":' * 2000 + b"1" + b"}" * 2000,
    ],
)
def test_broken_bodies_get_a_sentence(person, body):
    answer = sent(person, body)
    assert answer.status_code == 422
    assert answer.json()["error"]["sentence"]


def test_values_must_be_those_that_the_screen_offers(person, place):
    study, _ = place
    before = answered(study)
    names = [record["name"] for record in person.told["screen"]["records"]]
    right = person.values()
    wrong: list[Any] = [0, 6, 1.5, "1", True, None, [], {}, "=1+1"]
    for value in wrong:
        answer = person.post({**right, names[0]: value})
        assert answer.status_code == 422, value
        assert answer.json()["error"]["place"] == f"values.{names[0]}"
    assert person.post({**right, "another": 1}).json()["error"]["kind"] == "unknown"
    assert person.post({names[0]: right[names[0]]}).json()["error"]["kind"] == "missing"
    assert answered(study) == before


def test_a_body_that_is_too_large_is_refused_with_and_without_its_length(person):
    large = b'{"screen": "' + b"x" * 20_000 + b'"}'
    assert sent(person, large).status_code == 413

    def parts():
        for _ in range(40):
            yield b"x" * 1000

    head = {"Content-Type": "application/json", "Authorization": f"Bearer {person.token}"}
    answer = person.client.post("/api/answer", content=parts(), headers=head)
    assert answer.request.headers["transfer-encoding"] == "chunked"
    assert answer.status_code == 413
    assert answer.json()["error"]["kind"] == "too-large"
    assert person.client.get(f"/?x={'y' * 9000}").status_code == 414
    assert person.client.get("/", headers={"X-Long": "y" * 20_000}).status_code == 431


def test_a_body_that_never_comes_is_not_waited_for(place, monkeypatch):
    from ratherthan.apps.study.server import shield

    monkeypatch.setattr(shield, "PATIENCE", 0.3)
    _, address = place
    host, port = address.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=10) as slow:
        slow.sendall(
            b"POST /api/enter HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{"
        )
        began = time.monotonic()
        assert received(slow).startswith(b"HTTP/1.1 408")
        assert time.monotonic() - began < 8


def received(connection: socket.socket) -> bytes:
    """Return all that comes until the server closes the connection."""
    parts = []
    while part := connection.recv(65536):
        parts.append(part)
    return b"".join(parts)


@pytest.mark.parametrize("head", [b"", b"GET / HTTP/1.1\r\nHost: x\r\n"])
def test_a_head_that_never_ends_is_not_waited_for(place, monkeypatch, head):
    from ratherthan.apps.study.server import patience

    monkeypatch.setattr(patience, "WAITED", 0.3)
    host, port = place[1].removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=5) as slow:
        slow.sendall(head)
        assert received(slow) == b""


def test_a_connection_at_rest_is_kept_but_not_one_in_the_midst_of_a_head(place, monkeypatch):
    from ratherthan.apps.study.server import patience

    monkeypatch.setattr(patience, "WAITED", 1.0)
    host, port = place[1].removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=5) as slow:
        slow.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
        assert slow.recv(65536).startswith(b"HTTP/1.1 200")
        time.sleep(1.2)
        slow.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
        assert slow.recv(65536).startswith(b"HTTP/1.1 200")
        slow.sendall(b"GET /")
        assert received(slow) == b""


def test_a_head_that_grows_and_grows_is_cut_off(place):
    host, port = place[1].removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=5) as long:
        long.sendall(b"GET / HTTP/1.1\r\nHost: x\r\nX: ")
        taken = 0
        with suppress(ConnectionError):
            for _ in range(400):
                long.sendall(b"y" * 1000)
                taken += 1
                time.sleep(0.002)
        assert taken < 400


def test_the_rest_of_a_body_that_is_too_large_is_not_read(place):
    host, port = place[1].removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=5) as large:
        large.sendall(b"POST /api/enter HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n")
        large.sendall(b"Transfer-Encoding: chunked\r\n\r\n" + b"4e20\r\n" + b"x" * 20_000 + b"\r\n")
        assert received(large).startswith(b"HTTP/1.1 413")


def test_only_json_is_taken_so_that_no_other_site_can_send_an_answer(person):
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""):
        assert sent(person, b"{}", **{"Content-Type": kind}).status_code == 415


def test_whoever_types_anothers_prolific_id_gets_a_participant_of_their_own(place, visitor):
    study, address = place
    first = visitor(study, address, {"PROLIFIC_PID": "p1", "STUDY_ID": "s", "SESSION_ID": "secret-1"})
    first.walk(in_phase("trial"))
    thief = visitor(study, address, {"PROLIFIC_PID": "p1", "STUDY_ID": "s", "SESSION_ID": "guessed"})
    thief.enter()
    assert thief.token != first.token
    assert thief.now()["screen"]["id"] == "consent"
    other = visitor(study, address, {"PROLIFIC_PID": "p2", "STUDY_ID": "s", "SESSION_ID": "secret-1"})
    refused = other.request("POST", "/api/enter", {"platform": other.platform})
    assert refused.status_code == 403
    back = visitor(study, address, dict(first.platform))  # another browser, the same session
    back.enter()
    assert back.now()["screen"]["id"] == first.told["screen"]["id"]
    people = study.store.read(lambda c: c.execute(select(PARTICIPANT).order_by(PARTICIPANT.c.entered)).all())
    assert sorted(row.repeated for row in people) == [False, True]


def test_an_old_token_of_another_session_is_not_taken(place, visitor):
    study, address = place
    first = visitor(study, address, {"PROLIFIC_PID": "p1", "STUDY_ID": "s", "SESSION_ID": "s1"})
    first.walk(in_phase("trial"))
    second = visitor(study, address, {"PROLIFIC_PID": "p2", "STUDY_ID": "s", "SESSION_ID": "s2"})
    second.token = first.token  # the same browser, another person
    second.enter()
    assert second.token != first.token
    assert second.now()["screen"]["id"] == "consent"


@pytest.mark.parametrize("token", ["x", "a.b", "é", "." * 500, "a" * 10_000])
def test_tokens_that_are_not_ours_are_refused(place, visitor, token):
    study, address = place
    person = visitor(study, address)
    answer = person.client.get("/api/now", headers={"Authorization": f"Bearer {token}".encode()})
    assert answer.status_code == 401
    person.enter()
    key, _, signature = person.token.partition(".")
    forged = f"{key[:-1]}{'0' if key[-1] != '0' else '1'}.{signature}"
    assert person.client.get("/api/now", headers={"Authorization": f"Bearer {forged}"}).status_code == 401


def test_an_open_link_must_be_the_one_that_was_sent(place, visitor):
    study, address = place
    for query in ({}, {"link": "everybody"}, {"link": "everybody.forged"}, {"PROLIFIC_PID": "p"}, {"simulated": "x"}):
        answer = visitor(study, address, query or {"other": "1"}).client.post("/api/enter", json={"platform": query})
        assert answer.status_code == 403, query
    assert not study.store.read(lambda c: c.execute(select(PARTICIPANT)).all())


@pytest.mark.parametrize(
    "back",
    [
        "https://evil.example",
        "https://www.mturk.com.evil.example",
        "http://www.mturk.com",
        "https://[",
        "javascript:alert(1)",
        "",
    ],
)
def test_an_assignment_is_submitted_to_mturk_and_nowhere_else(place, visitor, back):
    study, address = place
    query = {"assignmentId": "A", "hitId": "H", "workerId": "W", "turkSubmitTo": back}
    answer = visitor(study, address, query).client.post("/api/enter", json={"platform": query})
    assert answer.status_code == 403
    assert answer.json()["error"]["kind"] == "submit-to"


def test_mturk_previews_and_ends_as_it_wants(place, visitor):
    study, address = place
    looks = visitor(study, address, {"assignmentId": "ASSIGNMENT_ID_NOT_AVAILABLE", "hitId": "H"})
    assert looks.enter()["preview"] is True
    assert looks.now()["screen"]["id"] == "consent"
    assert looks.post({"consent": "yes"}).json()["error"]["kind"] == "preview"
    assert not study.store.read(lambda c: c.execute(select(PARTICIPANT)).all())
    query = {"assignmentId": "A1", "hitId": "H", "workerId": "W", "turkSubmitTo": "https://workersandbox.mturk.com/"}
    told = visitor(study, address, query).walk()
    assert told["ending"]["post"] == {
        "action": "https://workersandbox.mturk.com/mturk/externalSubmit",
        "fields": {"assignmentId": "A1", "code": study.design.codes.done},
    }
    page = httpx.get(f"{address}/", params=query, trust_env=False)
    rules = page.headers["content-security-policy"]
    assert "form-action 'self' https://www.mturk.com https://workersandbox.mturk.com;" in rules
    assert "frame-ancestors https://worker.mturk.com" in rules
    assert "x-frame-options" not in page.headers


def test_prolific_ends_with_a_redirect_after_the_last_answer(place, visitor):
    study, address = place
    person = visitor(study, address, {"PROLIFIC_PID": "p", "STUDY_ID": "s", "SESSION_ID": "x"})
    person.enter()
    person.now()
    while person.told["state"] == "running":
        assert person.told["ending"] is None
        person.step()
    code = study.design.codes.done
    assert person.told["ending"]["redirect"] == f"https://app.prolific.com/submissions/complete?cc={code}"


def test_every_answer_bears_the_headers(place, person):
    _, address = place
    asked = [
        "/",
        "/withdraw",
        "/nothing",
        "/api/nothing",
        "/api/now",
        "/static/style.css",
        "/media/m1.svg",
        "/researchers",
    ]
    asked += [
        "/researchers/login",
        "/healthz",
        "/static/../../secret",
        "/media/%2e%2e/x",
        "/%00",
        "/researchers/export",
    ]
    for path in asked:
        answer = httpx.get(address + path, trust_env=False)
        found = answer.headers
        assert "default-src 'none'" in found["content-security-policy"], path
        assert "unsafe-eval" not in found["content-security-policy"]
        assert found["x-content-type-options"] == "nosniff"
        assert found["referrer-policy"] == "no-referrer"
        assert "server" not in found
        assert answer.status_code < 500
        if "static" not in path and "media" not in path:
            assert found["cache-control"] == "no-store"
            assert "unsafe-inline" not in found["content-security-policy"]
    assert person.client.get("/nothing", headers={"Accept": "text/html"}).status_code == 404
    assert person.client.delete("/api/now").json()["error"]["kind"] == "method"


def test_pictures_and_files_may_be_kept_for_ever_where_their_mark_is_right(place, person):
    study, _ = place
    picture = study.course.media["m1"]
    assert person.told["screen"]["picture"]["address"] == picture
    steady = person.client.get(picture)
    assert steady.status_code == 200
    assert steady.headers["content-type"] == "image/svg+xml"
    assert "immutable" in steady.headers["cache-control"]
    assert person.client.get(picture.split("?")[0]).headers["cache-control"] == "no-store"


def test_the_log_knows_nobody(place, visitor, caplog):
    study, address = place
    with caplog.at_level(logging.DEBUG):
        person = visitor(study, address, {"PROLIFIC_PID": "VERYSECRET", "STUDY_ID": "s", "SESSION_ID": "ALSOSECRET"})
        person.client.get("/?PROLIFIC_PID=VERYSECRET&SESSION_ID=ALSOSECRET")
        person.client.get("/VERYSECRET/page?x=ALSOSECRET")
        person.walk(in_phase("trial"))
        sent(person, '{"screen": "VERYSECRET"}')
    ours = [record.getMessage() for record in caplog.records if not record.name.startswith(("httpx", "httpcore"))]
    said = "\n".join(ours)
    assert "POST /api/answer 200" in said
    assert "VERYSECRET" not in said
    assert "ALSOSECRET" not in said
    assert "127.0.0.1" not in said
    assert person.token not in said


def test_identities_lie_apart_from_answers(place, visitor):
    study, address = place
    visitor(study, address, {"PROLIFIC_PID": "p", "STUDY_ID": "s", "SESSION_ID": "x"}).walk()
    for table in (PARTICIPANT, ANSWER):
        rows = study.store.read(lambda c, table=table: c.execute(select(table)).all())
        assert all(cell not in ("p", "x") for row in rows for cell in row)
    (row,) = study.store.read(lambda c: c.execute(select(IDENTITY)).all())
    assert row.person == "p"


def test_a_limit_lets_a_burst_through_and_then_a_trickle(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    limit = Limit(burst=3, each_second=2)
    for _ in range(3):
        limit.take("a")
    with pytest.raises(RefusedError):
        limit.take("a")
    limit.take("b")
    now[0] += 0.5
    limit.take("a")
    with pytest.raises(RefusedError):
        limit.take("a")
    now[0] += 100
    for _ in range(3):
        limit.take("a")
    with pytest.raises(RefusedError):
        limit.take("a")


def test_strangers_who_guess_are_slowed_down(place):
    _, address = place
    with httpx.Client(base_url=address, trust_env=False) as client:
        told = [client.post("/api/withdraw", json={"code": f"aaaa-bbbb-{i:04d}"}) for i in range(80)]
    kinds = [one.status_code for one in told]
    assert kinds[0] == 404
    assert kinds[-1] == 429
    assert told[-1].headers["retry-after"]


def test_hostile_texts_come_back_as_they_were_sent(tmp_path, served, visitor):
    from apps.study.designs import small_design

    study, address = served(small_design(tmp_path, maps=1), str(tmp_path / "b.sqlite3"))
    person = visitor(study, address)
    person.walk(in_phase("about"))
    name = next(record["name"] for record in person.told["screen"]["records"] if record["type"] == "text")
    text = "<script>alert('x')</script> \"quotes\" 漢字 🧭 مرحبا\nsecond line\ttab; DROP TABLE answer; --"
    assert person.post({**person.values(), name: text}).status_code == 200
    rows = study.store.read(lambda c: c.execute(select(ANSWER)).all())
    (kept,) = [json.loads(row.content) for row in rows if row.screen == "about-you"]
    assert kept[name] == text
