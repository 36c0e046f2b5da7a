"""The researchers' pages: behind a password, safe from other sites, and telling what is so."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from typing import Any

import httpx
import pytest
from apps.study.server.visitors import Visitor, at, in_phase, query_of
from sqlalchemy import select

from ratherthan.apps.study.server.opening import existing, new_password
from ratherthan.apps.study.server.tables import PARTICIPANT, STUDY


def csrf_in(page: str) -> str:
    found = re.search(r'name="csrf" value="([^"]+)"', page)
    assert found is not None
    return found[1]


class Researcher:
    def __init__(self, address: str) -> None:
        self.client = httpx.Client(base_url=address, trust_env=False, timeout=30)
        Visitor.clients.append(self.client)
        self.csrf = ""

    def login(self, password: str) -> httpx.Response:
        csrf = csrf_in(self.client.get("/researchers/login").text)
        answer = self.client.post("/researchers/login", data={"csrf": csrf, "password": password})
        if answer.status_code == 303:
            self.csrf = csrf_in(self.client.get("/researchers").text)
        return answer

    def post(self, path: str, **fields: str) -> httpx.Response:
        return self.client.post(f"/researchers/{path}", data={"csrf": self.csrf, **fields})


@pytest.fixture
def place(design, tmp_path, served):
    return served(design, str(tmp_path / "a.sqlite3"))


@pytest.fixture
def researcher(place):
    study, address = place
    found = Researcher(address)
    assert found.login(study.password).status_code == 303
    return found


DEEDS = ["pause", "quota", "links", "export", "erase", "logout"]


@pytest.mark.parametrize("path", ["", "/export", "/erase"])
def test_pages_need_a_login(place, path):
    _, address = place
    answer = httpx.get(f"{address}/researchers{path}", trust_env=False)
    assert answer.status_code == 303
    assert answer.headers["location"].startswith("/researchers/login")


@pytest.mark.parametrize("path", DEEDS)
def test_deeds_need_a_login_and_the_forms_token(place, researcher, path):
    _, address = place
    assert (
        httpx.post(f"{address}/researchers/{path}", data={"csrf": researcher.csrf}, trust_env=False).status_code == 403
    )
    assert researcher.client.post(f"/researchers/{path}", data={"csrf": "x"}).status_code == 403
    assert researcher.client.post(f"/researchers/{path}", json={"csrf": researcher.csrf}).status_code == 415
    elsewhere = {"Origin": "https://evil.example"}
    form = {"csrf": researcher.csrf}
    assert researcher.client.post(f"/researchers/{path}", data=form, headers=elsewhere).status_code == 403
    assert (
        researcher.client.post(f"/researchers/{path}", data=form, headers={"Sec-Fetch-Site": "cross-site"}).status_code
        == 403
    )


def test_the_cookie_is_kept_from_scripts_and_other_sites(place):
    study, address = place
    cookie = Researcher(address).login(study.password).headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    assert "Path=/researchers" in cookie


def test_the_cookie_of_https_never_leaves_it(place):
    from starlette.requests import Request

    from ratherthan.apps.study.server.researchers import _encrypted

    def asked(scheme: str, host: str) -> Any:
        return Request(
            {"type": "http", "scheme": scheme, "client": (host, 1), "headers": [], "server": ("x", 1), "path": "/"}
        )

    assert _encrypted(asked("https", "203.0.113.5"))
    assert _encrypted(asked("http", "127.0.0.1"))
    assert not _encrypted(asked("http", "203.0.113.5"))


def test_wrong_passwords_are_slowed_down_and_the_right_one_too_then(place):
    study, address = place
    person = Researcher(address)
    told = [person.login("wrong").status_code for _ in range(7)]
    assert told[:5] == [403] * 5
    assert told[5:] == [429] * 2
    assert person.login(study.password).status_code == 429


def test_a_new_password_ends_every_session(place, researcher, tmp_path):
    _, address = place
    assert researcher.client.get("/researchers").status_code == 200
    with existing(str(tmp_path / "a.sqlite3"), writes=True) as (connection, _):
        given = new_password(connection)
    assert researcher.client.get("/researchers").status_code == 303
    assert Researcher(address).login(given).status_code == 303


def test_logging_out_ends_the_session_for_every_copy_of_the_cookie(place, researcher):
    copy = Researcher(place[1])
    copy.client.cookies.update(researcher.client.cookies)
    assert copy.client.get("/researchers").status_code == 200
    assert researcher.post("logout").status_code == 303
    assert researcher.client.get("/researchers").status_code == 303
    assert copy.client.get("/researchers").status_code == 303


def test_the_password_is_nowhere_but_hashed(place, tmp_path):
    study, _ = place
    held = b"".join(path.read_bytes() for path in tmp_path.glob("a.sqlite3*"))
    assert study.password.encode() not in held
    assert b"$argon2id$" in held
    assert study.password not in repr(study)


def test_the_monitor_tells_what_is_so(place, researcher, visitor):
    from ratherthan.apps.study.server.monitor import monitored

    study, address = place
    for number in range(2):
        visitor(study, address, seed=number).walk()
    visitor(study, address).walk(in_phase("trial"))
    visitor(study, address).enter()
    told = study.store.read(lambda connection: monitored(connection, study))
    states = {row["state"]: row["people"] for row in told["states"]}
    assert states["finished"] == 2
    assert states["running"] == 1
    assert states["entered"] == 1
    assert told["started"] == 4
    assert told["consented"] == 3
    assert sum(row["finished"] for row in told["slots"]) == 2
    assert {row["trials"] for row in told["times"]} == {2}
    assert all(0.5 <= row["low_s"] <= row["median_s"] <= row["high_s"] <= 5 for row in told["times"])
    page = researcher.client.get("/researchers").text
    for person in told["people"]:
        assert person["key"] in page
    link = re.search(r"http://[^\s<\"]+/\?link=[^\s<\"]+", page)
    assert link is not None
    newcomer = visitor(study, address, query_of(link[0]))
    assert newcomer.enter()["state"] == "running"


def test_pausing_and_the_quota_by_form(place, researcher, visitor):
    study, address = place
    assert researcher.post("pause", paused="yes").headers["location"].endswith("said=paused")
    assert visitor(study, address).enter()["state"] == "paused"
    researcher.post("pause", paused="no")
    assert researcher.post("quota", quota="1").status_code == 303
    visitor(study, address).walk()
    assert visitor(study, address).enter()["state"] == "closed"
    researcher.post("quota", quota="")
    assert visitor(study, address).enter()["state"] == "running"
    for wrong in ("0", "-1", "1.5", "many", "99999999999", "٣"):
        assert "wrong-quota" in researcher.post("quota", quota=wrong).headers["location"]
    assert study.store.read(lambda c: c.execute(select(STUDY.c.quota)).scalar_one()) is None


def test_personal_links_bring_the_same_participant_back(place, researcher, visitor):
    study, address = place
    answer = researcher.post("links", count="3")
    links = [row["link"] for row in csv.DictReader(io.StringIO(answer.text))]
    assert len(set(links)) == 3
    first = visitor(study, address, query_of(links[0]))
    first.walk(at("instructions-1"))
    again = visitor(study, address, query_of(links[0]))  # another browser
    again.enter()
    assert again.now()["screen"]["id"] == "instructions-1"
    other = visitor(study, address, query_of(links[1]))
    other.enter()
    assert other.now()["screen"]["id"] == "consent"
    assert "wrong-count" in researcher.post("links", count="100000").headers["location"]


def test_erasing_one_participant_asks_first(place, researcher, visitor):
    study, address = place
    person = visitor(study, address, {"PROLIFIC_PID": "p9", "STUDY_ID": "s", "SESSION_ID": "x"})
    person.walk()
    other = visitor(study, address)
    other.walk()
    (row,) = study.store.read(
        lambda c: c.execute(select(PARTICIPANT).where(PARTICIPANT.c.platform == "prolific")).all()
    )
    number = f"P{row.number:04d}"
    for name in (number, person.told["withdrawal_code"], "p9"):
        assert number in researcher.client.get("/researchers/erase", params={"participant": name}).text
    assert researcher.post("erase", participant=number).status_code == 200  # not confirmed
    assert researcher.post("erase", participant=number, confirm="yes").headers["location"].endswith("said=erased")
    assert person.request("GET", "/api/now").status_code == 401
    assert other.now()["state"] == "finished"
    assert (
        researcher.post("erase", participant=number, confirm="yes").headers["location"].endswith("said=no-participant")
    )


def test_the_export_by_form_is_the_whole_one(place, researcher, visitor):
    study, address = place
    visitor(study, address).walk()
    page = researcher.client.get("/researchers/export").text
    answer = researcher.post("export")
    assert answer.headers["content-type"] == "application/zip"
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        names = archive.namelist()
        assert archive.testzip() is None
    assert {"observations.csv", "observations.parquet", "participants.csv", "codebook.csv", "study.json"} < set(names)
    assert all(name in page for name in names)
