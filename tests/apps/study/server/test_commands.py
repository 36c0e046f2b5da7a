"""``ratherthan study serve``, ``export``, ``erase`` and ``password`` as they are typed."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import httpx
import pytest
from apps.study.server.visitors import Visitor, in_phase, query_of
from click.testing import CliRunner

from ratherthan.apps.cli import main
from ratherthan.apps.study.design.reading import read_design
from ratherthan.apps.study.design.writing import New, new_study

COMMAND = (sys.executable, "-m", "ratherthan", "study")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("studies") / "mine"
    new_study(place, New(kinds=("none", "contrastive")))
    return place


class Served:
    """A server that was started by its command; `said` is what it printed."""

    def __init__(self, folder: Path, *words: str) -> None:
        self.process = subprocess.Popen(
            [*COMMAND, "serve", str(folder), "--port", "0", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )
        assert self.process.stdout is not None
        self.said = ""
        for row in self.process.stdout:
            self.said += row
            if row.startswith("Stop with"):
                return
        raise AssertionError(self.process.communicate(timeout=30)[1])

    def link(self, pattern: str) -> str:
        found = re.search(pattern, self.said)
        assert found is not None, self.said
        return found[1]

    def stop(self, number: int = signal.SIGINT) -> tuple[int, str, str]:
        self.process.send_signal(number)
        out, err = self.process.communicate(timeout=30)
        return self.process.returncode, out, err


def run(*words: Any, code: int = 0, given: str | None = None) -> str:
    done = CliRunner().invoke(main, ["study", *map(str, words)], input=given)
    assert done.exit_code == code, done.output
    return done.output


def refused(*words: Any) -> str:
    """Return the one line with which a command refuses."""
    said = run(*words, code=2)
    assert said.startswith("ratherthan: ")
    assert "Traceback" not in said
    return said


def test_a_study_is_served_stopped_served_again_exported_and_erased(folder, tmp_path):
    database = str(tmp_path / "a.sqlite3")
    first = Served(folder, "--database", database, "--log")
    link = first.link(r"Participants +(\S+)")
    password = first.link(r"password +(\S+)")
    design = read_design(folder)
    person = Visitor(link.split("/?")[0], design, query_of(link))
    person.walk(in_phase("trial"))
    stood = person.told["screen"]["id"]
    code, out, err = first.stop()
    assert code == 0
    assert "goes on" in out
    assert "POST /api/answer 200" in err
    assert person.token not in err

    second = Served(folder, "--database", database)
    assert password not in second.said
    again = Visitor(
        second.link(r"Participants +(\S+)").split("/?")[0], design, query_of(second.link(r"Participants +(\S+)"))
    )
    again.token = person.token
    again.enter()
    assert again.now()["screen"]["id"] == stood
    again.walk()
    secret = again.told["withdrawal_code"]
    assert "1 participants" in run("export", database, "-o", tmp_path / "live")  # while it is served
    assert second.stop(signal.SIGTERM)[0] == 0

    run("export", database, "-o", tmp_path / "out")
    assert (tmp_path / "out" / "observations.csv").is_file()
    number = run("erase", database, secret, given="n\n", code=130)
    assert re.search(r"P\d{4}", number)
    assert "is erased" in run("erase", database, secret, "--yes")
    assert "0 participants" in run("export", database, "-o", tmp_path / "out")
    refused("erase", database, secret, "--yes")
    assert password not in run("password", database)
    assert "changed" in run("password", database, "--ask", given="my own long password\nmy own long password\n")


def test_the_default_database_lies_in_the_studys_folder(folder):
    server = Served(folder)
    assert httpx.get(server.link(r"Researchers +(\S+)") + "/login", trust_env=False).status_code == 200
    server.stop()
    assert (folder / "answers.sqlite3").is_file()
    refused("export", folder, "-o", folder / "out", "--simulated")  # there are no robots
    server = Served(folder, "--simulated")
    assert "robots" in server.said
    server.stop()
    assert (folder / "simulated.sqlite3").is_file()
    assert "(simulated)" in run("export", folder, "-o", folder / "out", "--simulated")


def certificate(place: Path) -> Path:
    """Make a folder with a certificate and its key."""
    if shutil.which("openssl") is None:
        pytest.skip("needs openssl to make certificates")
    place.mkdir()
    made = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout key.pem -out cert.pem -days 1 -subj /CN=localhost"
    subprocess.run(made.split(), cwd=place, check=True, capture_output=True)
    return place


def test_what_cannot_be_served_gets_one_sentence(folder, tmp_path):
    refused("serve", tmp_path / "nothing")
    assert "--private-key" in refused("serve", folder, "--certificate", folder / "design.toml")
    assert "no/cert.pem" in refused(
        "serve", folder, "--certificate", "no/cert.pem", "--private-key", folder / "design.toml"
    )
    key, other = certificate(tmp_path / "one"), certificate(tmp_path / "other")
    database = ("--database", tmp_path / "none.sqlite3")
    for file, its in ((folder / "design.toml", key / "key.pem"), (other / "cert.pem", key / "key.pem")):
        assert "PEM" in refused("serve", folder, *database, "--certificate", file, "--private-key", its)
    for url in (
        "javascript:alert(1)",
        "",
        "study.example.org",
        "https://",
        "https://x y",
        "http://x:abc",
        "http://x?y",
    ):
        assert "--url" in refused("serve", folder, *database, "--url", url)
    for proxy in ("*", "not an address", ""):
        assert "--proxy" in refused("serve", folder, *database, "--proxy", proxy)
    assert "folder" in refused("serve", folder, "--database", tmp_path / "no" / "a.sqlite3")
    assert "port" in refused("serve", folder, "--host", "203.0.113.77", "--port", "0")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        assert "free" in refused("serve", folder, "--port", taken.getsockname()[1])
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "design.toml").write_text("title = ", encoding="utf-8")
    assert "TOML" in refused("serve", broken)
    assert not list(tmp_path.glob("**/*.sqlite3"))


@pytest.mark.parametrize("command", ["export", "erase", "password"])
def test_what_is_no_study_gets_one_sentence(command, tmp_path):
    words = {"export": ("-o", tmp_path / "out"), "erase": ("P0001", "--yes"), "password": ()}[command]
    text = tmp_path / "a.txt"
    text.write_text("no database" * 100, encoding="utf-8")
    empty = tmp_path / "empty.sqlite3"
    empty.touch()
    for place in (tmp_path, tmp_path / "nothing", text, empty, "postgresql://nobody@127.0.0.1:1/none", "mysql://x"):
        refused(command, place, *words)
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "answers.sqlite3").exists()
    assert empty.stat().st_size == 0


def test_without_the_extra_each_command_says_what_to_install(folder, monkeypatch):
    from ratherthan.apps.study import extra

    monkeypatch.setattr(extra, "NEEDED", ("no_such_library",))
    for words in (("serve", folder), ("export", folder, "-o", "x"), ("erase", folder, "P0001"), ("password", folder)):
        assert "ratherthan[study]" in refused(*words)
