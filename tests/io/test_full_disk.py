"""A disk that fills while something is written: the old file stays, the sentence names it, nothing else is left."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import ratherthan as rt
from benchmarks.models import slippery_map
from ratherthan.io import _leftovers
from ratherthan.io._files import write_atomically

FULL = """
import resource, sys
from ratherthan.apps.cli import run
resource.setrlimit(resource.RLIMIT_FSIZE, ({most}, resource.RLIM_INFINITY))
run()
"""
MOST = 20_000


@pytest.fixture(scope="module")
def town(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("town") / "town.npz"
    rt.write(slippery_map(40), path)
    return path


def on_a_full_disk(*words: object, most: int = MOST) -> subprocess.CompletedProcess[str]:
    """Run a command that can write so many bytes to a file."""
    return subprocess.run(
        [sys.executable, "-c", FULL.format(most=most), *map(str, words)], capture_output=True, text=True, check=False,
        env=os.environ | {"RATHERTHAN_COMPILE": "never"},
    )  # fmt: skip


WRITERS = {
    "town.umb": ("convert",),
    "copy.npz": ("convert",),
    "town.drn": ("convert",),
    "factors.json": ("factors",),
    "factors.csv": ("factors",),
    "factors.parquet": ("factors",),
}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of file sizes")
@pytest.mark.parametrize("old", [None, b"what was there before"])
@pytest.mark.parametrize("name", WRITERS)
def test_nothing_is_half_written_on_a_full_disk(town, tmp_path, name, old):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    path = tmp_path / name
    if old is not None:
        path.write_bytes(old)
    command = WRITERS[name]
    words = (*command, town, path) if command == ("convert",) else (*command, town, "--output", path)
    done = on_a_full_disk(*words)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ratherthan: '{path}' must be writable, but it cannot be written: ")
    assert "Make room there" in last
    assert [file.name for file in tmp_path.iterdir()] == ([] if old is None else [name])
    assert old is None or path.read_bytes() == old


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of file sizes")
def test_plans_are_whole_or_not_there(tmp_path):
    folder = tmp_path / "plans"
    done = on_a_full_disk("tradeoffs", "example:pedestrians", "--policies", folder, most=100)
    assert done.returncode == 2, done.stderr
    assert "must be writable" in done.stderr
    assert list(folder.glob("*")) + list(folder.glob(".*")) == []


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError, ValueError])
def test_what_breaks_off_leaves_the_old_file(tmp_path, error):
    path = tmp_path / "file"
    path.write_bytes(b"old")

    def write() -> None:
        with write_atomically(path) as file:
            file.write(b"new")
            raise error

    with pytest.raises(error):
        write()
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [("file", b"old")]


def test_what_is_left_over_can_be_removed_from_outside(tmp_path):
    with _leftovers.unfinished(tmp_path / "part") as part, _leftovers.temporary_folder() as folder:
        part.write_bytes(b"half")
        (folder / "model").write_bytes(b"half")
        _leftovers.remove_leftovers()
        assert not part.exists()
        assert not folder.exists()
    assert _leftovers._paths == {}


def test_a_header_that_claims_too_much_is_refused_at_once(tmp_path):
    """A million million states, in a file of some hundred bytes."""
    drn = tmp_path / "claims.drn"
    drn.write_text(
        "@type: MDP\n@parameters\n\n@reward_models\n\n@nr_states\n1000000000000\n@nr_choices\n1000000000000\n@model\n"
        "state 0 init\n\taction 0\n\t\t0 : 1\n",
        encoding="ascii",
    )
    with pytest.raises(rt.InputError, match="1000000000000"):
        rt.read(drn)


@pytest.mark.parametrize("what", ["states", "branches"])
def test_an_archive_that_claims_too_much_is_refused_at_once(tmp_path, what):
    import io
    import json
    import tarfile

    path = tmp_path / "claims.umb"
    rt.write(rt.read("example:paper-5x5"), path, packing="none")
    made = io.BytesIO()
    with tarfile.open(path) as old, tarfile.open(fileobj=made, mode="w") as new:
        for member in old:
            content = old.extractfile(member).read() if member.isfile() else b""
            if member.name == "index.json":
                index = json.loads(content)
                index["transition-system"][f"#{what}"] = 10**12
                content = json.dumps(index).encode()
                member.size = len(content)
            new.addfile(member, io.BytesIO(content) if member.isfile() else None)
    path.write_bytes(made.getvalue())
    with pytest.raises((rt.InputError, rt.LimitError)) as refused:
        rt.read(path)
    assert "claims.umb" in refused.value.message
