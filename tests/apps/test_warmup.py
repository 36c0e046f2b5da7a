"""``ratherthan warmup``: afterwards nothing is left to compile, and it says where what it made lies."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys

import pytest

import ratherthan as rt
from ratherthan.apps.warming import TASKS, _map, _ring

LATER = """
import json, sys
from ratherthan.model.compiling import tally
from ratherthan.apps.cli import main
for words in json.loads(sys.argv[1]):
    main(words, standalone_mode=False)
print(json.dumps({"made": tally.shipped + tally.compiled + sorted(tally.plain), "kept": len(tally.kept)}), file=sys.stderr)
"""


@pytest.fixture
def environment(tmp_path):
    env = {key: value for key, value in os.environ.items() if not key.startswith(("RATHERTHAN", "NUMBA"))}
    return env | {"NUMBA_CACHE_DIR": str(tmp_path / "code")}


def warmup(env, *words):
    return subprocess.run(
        [sys.executable, "-m", "ratherthan", "warmup", *words], env=env, capture_output=True, text=True, check=False
    )


@pytest.mark.slow
def test_nothing_is_left_to_compile(tmp_path, environment):
    done = warmup(environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.match(
        r"Made \d\d+ compiled loops in [\d.]+ s\.\n(.*)holds \d\d+ compiled loops, [\d.]+ [kM]B\.\n", done.stdout
    )
    rt.write(_map(), str(tmp_path / "map.npz"))
    rt.write(_map(walls=0.1, traps=0.05), str(tmp_path / "traps.npz"))
    rt.write(_ring(50), str(tmp_path / "ring.npz"))
    out = ["-o", str(tmp_path / "answer.json")]
    cost, safe, gains = 'R{"steps"}min=? [F "goal"]', 'Pmax=? [!"trap" U "goal"]', 'R{"gains"}max=? [Cdiscount=0.99]'
    asked = [
        [verb, str(tmp_path / f"{name}.npz"), "-p", wish, *out]
        for name, wish in (("map", cost), ("traps", safe), ("ring", gains))
        for verb in ("explain", "solve", "factors")
    ]
    later = subprocess.run(
        [sys.executable, "-c", LATER, json.dumps(asked)], env=environment, capture_output=True, text=True, check=False
    )
    assert later.returncode == 0, later.stderr
    answer = json.loads(later.stderr)
    assert answer["made"] == []
    assert answer["kept"] > 10
    assert warmup(environment).stdout.startswith("Nothing was left to compile.")


def test_it_says_what_is_there_and_removes_it(environment, tmp_path):
    there = warmup(environment, "--check")
    assert (there.returncode, there.stderr) == (0, "")
    assert there.stdout == f"{tmp_path / 'code' / 'ratherthan'} holds 0 compiled loops, 0 bytes.\n"
    (tmp_path / "code" / "ratherthan" / "room.kernel-1.code").write_bytes(b"x" * 2048)
    assert "1 compiled loop, 2 kB" in warmup(environment, "--check").stdout
    assert "2 kB were removed" in warmup(environment, "--clear").stdout
    assert "0 compiled loops" in warmup(environment, "--check").stdout


def test_contradicting_wishes_are_refused(environment):
    done = warmup(environment, "--check", "--clear")
    assert done.returncode == 2
    assert done.stderr.startswith("ratherthan: Either --check or --clear")


def test_compiling_that_is_switched_off_is_told(environment):
    done = warmup(environment | {"NUMBA_DISABLE_JIT": "1"})
    assert done.returncode == 2
    assert "NUMBA_DISABLE_JIT" in done.stderr
    assert done.stderr.count("\n") == 1


def test_every_task_has_a_name_that_can_be_shown():
    assert all(name.isprintable() and name for name in TASKS)


def test_a_small_model_loads_no_compiler_at_all(environment):
    code = (
        "import sys\nfrom ratherthan.apps.cli import main\nmain(['explain', 'example:city-1'], standalone_mode=False)\n"
        "sys.exit(', '.join(m for m in ('numba', 'llvmlite', 'scipy') if m in sys.modules) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
