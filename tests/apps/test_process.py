"""The command as a process of its own: pipes, terminals, full disks, signals, and how long a person waits."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAPER = "example:paper-5x5"
CONTRASTIVE = (
    "First, we move south at critical grid 5 because it leads to the shortest and most flexible future route. "
    "Then, we move east at critical grid 10 because it leads to the shortest and most flexible future route. "
    "Next, we move north at critical grid 12 because it leads to the shortest route. "
    "Finally, we move east at critical grid 7 because it leads to the shortest route. "
    "All other decisions result in equivalent routes."
)
HEAVY = ("numba", "numpy", "scipy", "rich", "pyarrow", "stormpy", "jsonschema", "lark")
posix = pytest.mark.skipif(os.name != "posix", reason="needs pipes and terminals of Unix")


def test_the_answer_goes_to_standard_output_and_nothing_else_does(process):
    done = process("explain", PAPER)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.decode("utf-8") == CONTRASTIVE + "\n"


def test_no_answer_is_no_byte(process):
    done = process("explain", PAPER, "--kind", "none")
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-16"])
def test_text_is_utf_8_whatever_the_surroundings_say(process, encoding):
    done = process("info", PAPER, env={"PYTHONIOENCODING": encoding, "LC_ALL": "C"})
    assert done.returncode == 0
    assert "5 × 5 cells" in done.stdout.decode("utf-8")


@pytest.mark.parametrize("words", [("--help",), ("-h",), (), ("--version",)])
def test_help_loads_no_heavy_library(words):
    code = (
        "import sys\nsys.argv = ['ratherthan', *sys.argv[1:]]\nfrom ratherthan.apps.cli import run\n"
        "try:\n    run()\nexcept SystemExit:\n    pass\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == "[]"
    assert done.stdout


def test_a_small_map_is_explained_without_compilers_and_sparse_solvers():
    code = (
        "import sys\nsys.argv = ['ratherthan', 'explain', 'example:city-1']\nfrom ratherthan.apps.cli import run\n"
        "try:\n    run()\nexcept SystemExit:\n    pass\n"
        "print([name for name in ('numba', 'scipy', 'rich', 'stormpy', 'pyarrow', 'jsonschema') if name in sys.modules], "
        "file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == "[]"


@posix
@pytest.mark.parametrize(
    "words", ["--help", "explain --help", f"factors {PAPER} --format csv", f"factors {PAPER}", "examples"]
)
def test_a_reader_who_leaves_is_no_error(words):
    command = f"set -o pipefail; {sys.executable} -W error -m ratherthan {words} | head -1"
    done = subprocess.run(["bash", "-c", command], capture_output=True, check=False)
    assert done.stdout.count(b"\n") == 1
    assert done.stderr == b""
    assert done.returncode in (0, 141)


@posix
def test_a_reader_who_never_reads_is_no_error(tmp_path):
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "ratherthan", "factors", PAPER, "--format", "json"],
        stdout=write, stderr=subprocess.PIPE, check=False,
    )  # fmt: skip
    os.close(write)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_is_told(process):
    with Path("/dev/full").open("wb") as full:
        done = process("explain", PAPER, stdout=full, stderr=subprocess.PIPE, capture_output=False)
    assert done.returncode == 2
    assert done.stderr.startswith(b"ratherthan: ")
    assert done.stderr.count(b"\n") == 1


@posix
def test_a_closed_standard_output_is_no_fault(process):
    command = f"{sys.executable} -m ratherthan explain {PAPER} >&-"
    done = subprocess.run(["bash", "-c", command], capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


@posix
def test_a_device_is_written_to_and_not_replaced(process, tmp_path):
    fifo = tmp_path / "pipe"
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    assert process("explain", PAPER, "--kind", "naive-state", "--output", fifo).returncode == 0
    assert os.read(reader, 1000) == b"We move south at grid 5.\n"
    os.close(reader)
    assert fifo.is_fifo()
    assert process("explain", PAPER, "--output", os.devnull).returncode == 0
    assert not Path(os.devnull).is_file()


@posix
def test_a_link_is_followed_and_not_replaced(process, tmp_path):
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    assert process("explain", PAPER, "--output", tmp_path / "link.txt").returncode == 0
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text(encoding="utf-8") == CONTRASTIVE + "\n"


def on_terminal(*words: str, columns: int, env: dict[str, str] | None = None) -> tuple[str, int]:
    """Run the command on a terminal so many columns wide; return what it shows and its exit code."""
    import fcntl
    import pty
    import struct
    import termios

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    kept = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES", "NO_COLOR")}
    surroundings = kept | {"TERM": "xterm"} | (env or {})
    command = [sys.executable, "-m", "ratherthan", *words]
    running = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=surroundings)
    os.close(theirs)
    shown = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:
            break
        if not part:
            break
        shown += part
    os.close(ours)
    return shown.decode("utf-8").replace("\r\n", "\n"), running.wait()


@posix
def test_on_a_terminal_text_is_wrapped_at_words():
    shown, code = on_terminal("explain", PAPER, columns=50)
    assert code == 0
    lines = shown.removesuffix("\n").split("\n")
    assert max(map(len, lines)) <= 50
    assert " ".join(lines) == CONTRASTIVE
    assert len(lines) > 5


@posix
def test_colour_is_only_where_it_is_seen_and_wanted(process):
    assert "\x1b[" in on_terminal("info", PAPER, columns=100)[0]
    assert "\x1b[" not in on_terminal("info", PAPER, columns=100, env={"NO_COLOR": "1"})[0]
    assert "\x1b[" not in on_terminal("info", PAPER, columns=100, env={"TERM": "dumb"})[0]
    assert b"\x1b[" not in process("info", PAPER).stdout


@posix
def test_a_file_has_no_colour_though_a_terminal_looks_on(tmp_path):
    for words in (("info", PAPER), ("solve", PAPER), ("examples",)):
        assert on_terminal(*words, "--output", str(tmp_path / "answer.txt"), columns=100) == ("", 0)
        assert "\x1b" not in (tmp_path / "answer.txt").read_text(encoding="utf-8")


@posix
def test_parquet_is_kept_off_a_terminal():
    shown, code = on_terminal("factors", PAPER, "--format", "parquet", columns=100)
    assert code == 2
    assert "--output FILE" in shown


WAIT = """
import sys, time
from ratherthan.apps.waiting import waiting
with waiting("Solving") as tell:
    tell("half way")
    time.sleep(float(sys.argv[1]))
print("done")
"""


@posix
@pytest.mark.parametrize(("wait", "shown"), [("0.2", False), ("1.8", True)])
def test_work_is_shown_on_a_terminal_after_a_second(wait, shown):
    import pty

    ours, theirs = pty.openpty()
    running = subprocess.Popen(
        [sys.executable, "-c", WAIT, wait], stdout=subprocess.PIPE, stderr=theirs, env=os.environ | {"TERM": "xterm"}
    )
    os.close(theirs)
    output, _ = running.communicate(timeout=60)
    seen = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:
            break
        if not part:
            break
        seen += part
    os.close(ours)
    assert output == b"done\n"
    assert (b"half way" in seen) == shown


def test_work_is_not_shown_where_nobody_looks():
    done = subprocess.run([sys.executable, "-c", WAIT, "1.3"], capture_output=True, check=False)
    assert (done.stdout, done.stderr) == (b"done\n", b"")


INTERRUPTED = """
import os, signal, sys, time
import ratherthan.io
def read(*words, **settings):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(10)
sys.modules["ratherthan.io"].read = read
sys.argv = ["ratherthan", "explain", "x"]
from ratherthan.apps.cli import run
run()
"""


@posix
def test_an_interrupted_command_ends_with_130():
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, check=False, timeout=60)
    assert done.returncode == 130
    assert b"Traceback" not in done.stderr
    assert done.stdout == b""


FAULT = """
import sys
import ratherthan.io
def read(*words, **settings):
    raise ZeroDivisionError("two\\nlines \\x1b[31m")
sys.modules["ratherthan.io"].read = read
sys.argv = ["ratherthan", "explain", "x"]
from ratherthan.apps.cli import run
run()
"""


@pytest.mark.parametrize("debug", [False, True])
def test_a_fault_of_the_program_asks_to_be_reported(debug):
    env = {key: value for key, value in os.environ.items() if key != "RATHERTHAN_DEBUG"}
    env |= {"RATHERTHAN_DEBUG": "1"} if debug else {}
    done = subprocess.run([sys.executable, "-c", FAULT], capture_output=True, text=True, check=False, env=env)
    assert done.returncode == 1
    assert ("Traceback" in done.stderr) == debug
    last = done.stderr.splitlines()[-1]
    assert re.match(
        r"ratherthan: This is a fault of the program \(ZeroDivisionError: two lines .*\)\. Please report", last
    )
    assert ("RATHERTHAN_DEBUG=1" in last) == (not debug)
    assert "\x1b" not in last


def test_python_dash_m_is_the_command(process):
    assert process("--version").stdout.startswith(b"ratherthan ")


def test_names_from_a_file_cannot_steer_the_terminal(process, tmp_path, fork_with):
    import ratherthan as rt

    names = rt.StateNames(count=4, strings=["ho\x1b[31mme", "bri\ndge", "mar\u202eket", "ditch"])
    rt.write(rt.Problem(mdp=fork_with(names=names)), tmp_path / "names.npz")
    for words in (("explain", "--kind", "naive-path"), ("factors",), ("info",)):
        done = process(words[0], tmp_path / "names.npz", *words[1:])
        assert done.returncode == 0
        text = done.stdout.decode("utf-8")
        assert not set(text) & {"\x1b", "\u202e"}
    assert text
    done = process("factors", tmp_path / "names.npz", "--format", "json")
    assert {row["state_name"] for row in json.loads(done.stdout)["rows"]} >= {"ho\x1b[31mme", "bri\ndge"}
