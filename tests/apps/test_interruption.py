"""Ctrl-C at any moment: the process is gone within a second, with its exit code, no traceback and nothing half-written."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.models import slippery_map
from ratherthan.io import write

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs signals of Unix")
SLACK = 4.0
"""Seconds beyond the promised one, for a machine on which other tests run."""
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}


@pytest.fixture(scope="module")
def city(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("city") / "city.npz"
    write(slippery_map(60), path)
    return path


def started(*words: object, code: str | None = None, **settings) -> subprocess.Popen[bytes]:
    command = ["-m", "ratherthan"] if code is None else ["-c", code]
    return subprocess.Popen(
        [sys.executable, *command, *map(str, words)],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **settings,
    )  # fmt: skip


def interrupted(running: subprocess.Popen[bytes], number: signal.Signals) -> tuple[float, bytes]:
    """Send a signal; return how long it took until the process was gone, and what it said."""
    begun = time.monotonic()
    running.send_signal(number)
    _, said = running.communicate(timeout=60)
    return time.monotonic() - begun, said


def length_of(*words: object) -> float:
    begun, running = time.monotonic(), started(*words)
    running.communicate(timeout=600)
    assert running.returncode == 0
    return time.monotonic() - begun


def until_heard(running: subprocess.Popen[bytes]) -> None:
    """Wait until the process hears signals: the interpreter takes its time to come to the first line of ours."""
    status = Path(f"/proc/{running.pid}/status")
    for _ in range(200):
        if not status.exists():
            time.sleep(1.0)
            return
        caught = next(line for line in status.read_text(encoding="utf-8").splitlines() if line.startswith("SigCgt"))
        if int(caught.split()[1], 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("command", ["solve", "explain", "convert"])
def test_a_command_ends_within_a_second_at_any_moment(city, tmp_path, command, number):
    output = [tmp_path / "made.umb"] if command == "convert" else ["--output", tmp_path / "made.txt"]
    words = (command, city, *output)
    whole = length_of(*words)
    made = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    chance = random.Random(f"{command} {number}")
    for _ in range(4):
        running = started(*words)
        until_heard(running)
        time.sleep(chance.random() * whole)
        took, said = interrupted(running, number)
        assert took < 1.0 + SLACK
        assert running.returncode in (CODES[number], 0, -number)  # it was ready, or even being taken down
        assert b"Traceback" not in said
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == made


WORK = """
import sys, time
import ratherthan.io
def read(*words, **settings):
    print("reading", file=sys.stderr, flush=True)
    {work}
sys.modules["ratherthan.io"].read = read
from ratherthan.apps.cli import run
run()
"""
STUCK = {
    "in a compiled kernel": """
    import numba
    @numba.njit(nogil=True)
    def spin(n):
        x = 0.0
        for i in range(n):
            x += i % 7
        return x
    spin(10)
    print("stuck", file=sys.stderr, flush=True)
    spin(10**12)""",
    "in a library that lets the interpreter go": """
    print("stuck", file=sys.stderr, flush=True)
    import ctypes
    ctypes.CDLL(None).sleep(30)
    ctypes.CDLL(None).sleep(30)""",
    "in a place that swallows every error": """
    class Swallows:
        def __del__(self):
            print("stuck", file=sys.stderr, flush=True)
            time.sleep(30)
    Swallows()
    time.sleep(30)""",
    "in a loop that catches everything": """
    print("stuck", file=sys.stderr, flush=True)
    while True:
        try:
            time.sleep(30)
        except BaseException:
            pass""",
    "in a file that is being written": """
    from ratherthan.io._files import write_atomically
    with write_atomically(sys.argv[-1]) as file:
        file.write(b"half")
        file.flush()
        print("stuck", file=sys.stderr, flush=True)
        import ctypes
        ctypes.CDLL(None).sleep(30)
        ctypes.CDLL(None).sleep(30)""",
    "waiting for a process of its own": """
    from ratherthan.io._apart import apart
    print("stuck", file=sys.stderr, flush=True)
    apart(lambda: time.sleep(300))""",
}


def until(running: subprocess.Popen[bytes], word: bytes) -> None:
    """Wait until the process has said something."""
    assert running.stderr is not None
    for line in running.stderr:
        if word in line:
            return
    raise AssertionError(f"the process ended before it said {word!r}")


@pytest.mark.slow
@pytest.mark.parametrize("place", STUCK)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_python_cannot_interrupt_is_ended_all_the_same(tmp_path, place, number):
    running = started("solve", "x", "--output", tmp_path / "made.txt", code=WORK.format(work=STUCK[place]))
    until(running, b"stuck")
    time.sleep(0.2)
    took, said = interrupted(running, number)
    assert took < 1.0 + SLACK
    assert running.returncode == CODES[number]
    assert b"Traceback" not in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("place", ["in a compiled kernel", "in a loop that catches everything"])
def test_a_time_limit_ends_what_python_cannot_interrupt(tmp_path, place):
    running = started("solve", "x", "--time-limit", "1s", code=WORK.format(work=STUCK[place]))
    _, said = running.communicate(timeout=60)
    assert running.returncode == 1
    assert b"Traceback" not in said
    assert b"ratherthan: The time limit of 1 s was reached while reading x." in said


def test_a_time_limit_ends_a_loop_that_does_not_look_at_the_clock():
    running = started("solve", "x", "--time-limit", "1s", code=WORK.format(work="\n    while True: pass"))
    _, said = running.communicate(timeout=60)
    assert (running.returncode, said) == (
        1,
        b"reading\nratherthan: The time limit of 1 s was reached while reading x.\n",
    )


CHILD = """
import os, sys, time
import ratherthan.io
def read(*words, **settings):
    from ratherthan.io._apart import apart
    def work():
        with open(sys.argv[-1], "w") as file:
            file.write(str(os.getpid()))
        time.sleep(300)
    apart(work)
sys.modules["ratherthan.io"].read = read
from ratherthan.apps.cli import run
run()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the work is done in the process itself")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, "limit"])
def test_no_child_is_left_behind(tmp_path, how):
    note = tmp_path / "number"
    limit = ("--time-limit", "1s") if how == "limit" else ()
    running = started("solve", "x", *limit, "--output", note, code=CHILD)
    for _ in range(600):
        if note.exists() and note.read_text(encoding="ascii"):
            break
        time.sleep(0.05)
    child = int(note.read_text(encoding="ascii"))
    if how != "limit":
        interrupted(running, how)
    running.communicate(timeout=60)
    assert running.returncode == (1 if how == "limit" else CODES[how])
    assert not Path(f"/proc/{child}").exists() or Path(f"/proc/{child}/stat").read_text().split()[2] == "Z"


def test_the_terminal_is_as_it_was(tmp_path):
    import pty
    import termios

    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    code = WORK.format(work=STUCK["in a compiled kernel"])
    running = subprocess.Popen(
        [sys.executable, "-c", code, "solve", "x"], stdin=theirs, stdout=theirs, stderr=theirs,
        env=os.environ | {"TERM": "xterm"},
    )  # fmt: skip
    shown = b""
    while b"s)" not in shown:  # the line with the seconds
        shown += os.read(ours, 4096)
    assert b"\x1b[?25l" in shown
    running.send_signal(signal.SIGINT)
    assert running.wait(timeout=60) == 130
    assert termios.tcgetattr(theirs) == before
    os.close(theirs)
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:
            break
        if not part:
            break
        shown += part
    os.close(ours)
    assert shown.rindex(b"\x1b[?25h") > shown.rindex(b"\x1b[?25l")


@pytest.mark.skipif(sys.platform == "win32", reason="signals cannot be sent to a process of its own there")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("working", [False, True])
def test_a_signal_between_two_that_catch_it_ends_the_command_in_silence(number, working):
    code = (
        "import os, sys, time\nfrom ratherthan.apps import guard\n"
        f"guard.stand_guard(print).working = {working}\nos.kill(os.getpid(), {int(number)})\ntime.sleep(20)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (CODES[number], b"", b"")


def test_standing_guard_costs_a_start_next_to_nothing():
    code = (
        "import time, threading\nfrom ratherthan.apps import guard\nbegun = time.process_time()\n"
        "guard.stand_guard(print)\nprint(time.process_time() - begun)"
    )
    shown = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True) for _ in range(5)]
    assert min(float(done.stdout) for done in shown) < 0.01
