"""kill -9 at random moments: nothing that was acknowledged is lost, nothing is there twice, everybody goes on."""

from __future__ import annotations

import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import httpx
from apps.study.server.settings import little
from apps.study.server.visitors import Visitor, query_of
from sqlalchemy import create_engine, select

from ratherthan.apps.study.server.database import address
from ratherthan.apps.study.server.opening import opened
from ratherthan.apps.study.server.researchers import entrance
from ratherthan.apps.study.server.tables import ANSWER, PARTICIPANT, PLACE

SERVER = """
import sys, pathlib
from apps.study.server.settings import little
from ratherthan.apps.study.server.opening import opened
from ratherthan.apps.study.server.running import listening, serve
folder, database, port = sys.argv[1:]
study = opened(little(pathlib.Path(folder), quota=20), database)
serve(study, [listening("127.0.0.1", int(port))], lambda: print("ready", flush=True))
"""
PEOPLE = 20
KILLS = 4


def started(folder: Path, database: str, port: int) -> subprocess.Popen[str]:
    root = Path(__file__).resolve().parents[4]
    path = os.pathsep.join((str(root / "tests"), os.environ.get("PYTHONPATH", "")))
    process = subprocess.Popen(
        [sys.executable, "-c", SERVER, str(folder), database, str(port)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def test_killing_the_server_loses_nothing_that_was_acknowledged(tmp_path, database):
    folder = tmp_path / "design"
    design = little(folder, quota=PEOPLE)
    study = opened(design, database)  # its links
    link = entrance(study.secret, "http://test")
    study.close()
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    lot = random.Random()
    process = started(folder, database, port)
    folk = [Visitor(f"http://127.0.0.1:{port}", design, query_of(link), seed=i) for i in range(PEOPLE)]
    faults: list[Exception] = []

    def take_part(person: Visitor) -> None:
        try:
            person.waits = 60
            time.sleep(lot.random())
            person.enter()
            person.now()
            while person.told["state"] == "running":
                time.sleep(lot.random() * 0.4)
                if lot.random() < 0.1:
                    person.now()  # a reload
                person.step()
        except (httpx.HTTPError, AssertionError) as fault:
            faults.append(fault)

    threads = [threading.Thread(target=take_part, args=(person,)) for person in folk]
    for thread in threads:
        thread.start()
    kills = 0
    try:
        while kills < KILLS and any(thread.is_alive() for thread in threads):
            time.sleep(lot.uniform(0.3, 1.2))
            process.send_signal(signal.SIGKILL)
            process.wait()
            assert process.stdout is not None
            process.stdout.close()
            kills += 1
            process = started(folder, database, port)
        for thread in threads:
            thread.join(90)
    finally:
        process.kill()
        process.wait()
        assert process.stdout is not None
        process.stdout.close()
    assert not faults, faults
    assert kills >= 2
    assert not any(thread.is_alive() for thread in threads)
    _check(database, folk)


def _check(database: str, folk: list[Visitor]) -> None:
    engine = create_engine(address(database))
    with engine.connect() as connection:
        people = {row.key: row for row in connection.execute(select(PARTICIPANT))}
        answers: dict[int, dict[str, Any]] = {}
        for row in connection.execute(select(ANSWER)):
            assert row.screen not in answers.setdefault(row.participant, {})
            answers[row.participant][row.screen] = json.loads(row.content)
        held = [row.holder for row in connection.execute(select(PLACE))]
    engine.dispose()
    for person in folk:
        row = people[person.token.split(".")[0]]
        assert row.state == "finished"
        assert person.told["state"] == "finished"
        assert answers[row.id] == person.acknowledged
    finished = [row for row in people.values() if row.state == "finished"]
    assert sorted(row.slot for row in finished) == list(range(len(folk)))
    assert len(set(held)) == len(held)
