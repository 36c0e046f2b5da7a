"""What must hold of real workers: the same answers, also when one is killed, and nothing left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import ratherthan as rt
from benchmarks.models import slippery_map
from ratherthan.cluster import ask, explain_many, solved_in_blocks
from ratherthan.io.umb_write import write_umb

pytest.importorskip("distributed", reason="needs the extra 'cluster'")
psutil = pytest.importorskip("psutil")
pytestmark = pytest.mark.slow

MISSIONS = [
    {"source": f"example:{name}", "state": state, "kind": "responsibility"}
    for name in ("paper-5x5", "office", "nowhere")
    for state in range(12)
]


def workers():
    """Return the processes of this one's workers."""
    found = psutil.Process().children(recursive=True)
    return [process for process in found if "spawn_main" in " ".join(process.cmdline())]


def assert_all_gone():
    until = time.monotonic() + 5.0
    while workers() and time.monotonic() < until:
        time.sleep(0.05)
    assert workers() == []


def without_times(rows):
    return [{key: cell for key, cell in row.items() if key != "seconds"} for row in rows]


def test_two_workers_answer_as_one_process_does(tmp_path):
    plain = explain_many(MISSIONS, workers=1)
    spread = explain_many(MISSIONS, tmp_path / "results.jsonl", workers=2)
    assert without_times(spread.rows) == without_times(plain.rows)
    assert_all_gone()


def test_a_killed_worker_costs_no_row():
    plain = explain_many(MISSIONS, workers=1)
    killed = []

    def kill(_):
        if not killed:
            killed.append(workers()[0])
            killed[0].kill()

    spread = explain_many(MISSIONS, workers=2, tell=kill)
    assert killed
    assert without_times(spread.rows) == without_times(plain.rows)
    assert_all_gone()


def test_a_worker_killed_half_way_costs_time_and_not_the_answer(tmp_path):
    problem = slippery_map(40)
    path = tmp_path / "model.umb"
    write_umb(problem, path, packing="none")
    solution = rt.solve(problem)
    killed = []

    def kill(text):
        if text.startswith("round 1: rims") and not killed:
            killed.append(workers()[0])
            killed[0].kill()

    with solved_in_blocks(path, workers=2, tell=kill) as solved:
        assert killed
        addresses = {address for process in workers() for address in listening(process)}
        assert addresses == {"127.0.0.1"}
        states = np.flatnonzero(np.isfinite(solution.values[0]))
        values, _ = solved.at_states(states)
        lower, upper = solved.bounds(values)
        assert (lower <= solution.upper[0][states]).all()
        assert (solution.lower[0][states] <= upper).all()
        assert (upper - lower <= 1e-6 * values).all()
        workers()[0].kill()  # and another after all is solved
        told = ask(solved, int(states[0]))
        assert told.text == rt.narrate(rt.explain(solution, "responsibility", state=int(states[0])))
    assert_all_gone()


def listening(process):
    """Return where a process listens."""
    ports = process.net_connections(kind="inet")
    return {port.laddr.ip for port in ports if port.status == psutil.CONN_LISTEN}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["Ctrl-C", "kill"])
def test_nothing_is_left_of_a_run_that_is_ended(number, tmp_path):
    missions = tmp_path / "missions.csv"
    rows = [f"example:city-{1 + k % 3},{k % 90},contrastive" for k in range(3000)]
    missions.write_text("source,state,kind\n" + "\n".join(rows) + "\n", encoding="utf-8")
    words = [
        sys.executable,
        "-m",
        "ratherthan",
        "batch",
        str(missions),
        "-o",
        str(tmp_path / "r.csv"),
        "--workers",
        "2",
    ]
    with subprocess.Popen(words, stderr=subprocess.PIPE, start_new_session=True) as run:
        journal = tmp_path / "r.csv.journal"
        until = time.monotonic() + 60
        while time.monotonic() < until and not (journal.exists() and journal.read_bytes().count(b"\n") > 3):
            time.sleep(0.1)
            assert run.poll() is None
        begun = time.monotonic()
        (os.killpg if number == signal.SIGINT else os.kill)(run.pid, number)
        run.wait(30)
        took = time.monotonic() - begun
        if number == signal.SIGINT:
            assert run.returncode == 130
            assert took < 5.0  # a second on a machine that is not busy with other tests
    until = time.monotonic() + 10
    while members(run.pid) and time.monotonic() < until:
        time.sleep(0.1)
    assert members(run.pid) == []
    assert journal.read_bytes().count(b"\n") > 3


def members(group):
    """Return the living processes of a process group."""
    found = []
    for process in psutil.process_iter():
        try:
            if os.getpgid(process.pid) == group and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process.pid)
        except (ProcessLookupError, psutil.Error):
            continue
    return found


@pytest.mark.parametrize("moment", [0.0, 0.15, 0.4, 0.8])
def test_an_interrupt_while_workers_start_ends_them_without_a_word(moment, tmp_path):
    path = tmp_path / "model.umb"
    write_umb(slippery_map(40), path)
    words = [sys.executable, "-m", "ratherthan", "solve", str(path), "--cluster"]
    room = tmp_path / "temporary"
    room.mkdir()
    own = os.environ | {"TMPDIR": str(room)}
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True, env=own
    ) as run:
        until = time.monotonic() + 60
        while time.monotonic() < until and len(members(run.pid)) < 3:  # a worker and what tidies up
            time.sleep(0.02)
            assert run.poll() is None
        time.sleep(moment)
        os.killpg(run.pid, signal.SIGINT)
        shown, said = run.communicate(timeout=30)
    assert (run.returncode, shown, said.strip()) == (130, b"", b"")
    until = time.monotonic() + 10
    while members(run.pid) and time.monotonic() < until:
        time.sleep(0.1)
    assert members(run.pid) == []
    assert list(room.glob("ratherthan-*")) == []


def test_a_time_limit_while_workers_start_is_told_once_and_soon(tmp_path):
    path = tmp_path / "model.umb"
    write_umb(slippery_map(40), path)
    words = [sys.executable, "-m", "ratherthan", "solve", str(path), "--cluster", "--time-limit", "1s"]
    begun = time.monotonic()
    done = subprocess.run(words, capture_output=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (1, b"")
    assert done.stderr.count(b"The time limit of 1 s was reached") == done.stderr.count(b"\n") == 1
    assert time.monotonic() - begun < 8.0  # two seconds on a machine that is not busy with other tests


def test_workers_that_cannot_start_are_told_of(tmp_path):
    path = tmp_path / "model.umb"
    write_umb(slippery_map(20), path)
    code = f"from ratherthan.cluster import solve_in_blocks\nsolve_in_blocks({str(path)!r})\n"
    done = subprocess.run([sys.executable, "-"], input=code.encode(), capture_output=True, timeout=60, check=False)
    assert done.returncode == 1
    assert b"not what is read from standard input" in done.stderr
