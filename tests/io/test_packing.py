"""Archives are packed the same way on every machine, and those that are not packed are mapped into memory."""

from __future__ import annotations

import gzip
import io
import os
import zipfile

import numpy as np
import pytest

from ratherthan.errors import SourceError
from ratherthan.io import read, write
from ratherthan.io._packing import BLOCK, GzipWriter
from ratherthan.io._tar_writer import Numbers
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.problem import Problem

FIELDS = ("state_to_choices", "choice_to_branches", "branch_to_target", "branch_to_probability", "choice_to_action")


@pytest.fixture(scope="module")
def large():
    """A model of which some arrays are large enough to be mapped."""
    states, rng = 60_000, np.random.default_rng(1)
    share = rng.random(2 * states)
    mdp = MDP(
        state_to_choices=np.arange(0, 2 * states + 1, 2),
        choice_to_branches=np.arange(0, 4 * states + 1, 2),
        branch_to_target=rng.integers(0, states, 4 * states),
        branch_to_probability=np.stack([share, 1.0 - share], axis=1).reshape(-1),
        choice_to_action=np.tile([0, 1], states),
        actions=("left", "right"),
        labels={"goal": np.arange(states) == 7},
        rewards={"cost": Reward(branch=rng.random(4 * states))},
        initial=np.array([3]),
    )
    return Problem(mdp=mdp)


def same(one, other):
    assert all(np.array_equal(getattr(one, name), getattr(other, name)) for name in FIELDS)
    assert np.array_equal(one.rewards["cost"].branch, other.rewards["cost"].branch)
    assert np.array_equal(one.labels["goal"], other.labels["goal"])


@pytest.mark.parametrize(
    ("name", "packing"),
    [("m.umb", "gzip"), ("m.umb", "xz"), ("m.umb", "none"), ("m.npz", "deflate"), ("m.npz", "none")],
)
def test_a_large_model_comes_back_whatever_the_packing(large, tmp_path, name, packing):
    write(large, tmp_path / name, packing=packing)
    got = read(tmp_path / name).mdp
    same(got, large.mdp)
    arrays = [getattr(got, field) for field in FIELDS] + [got.rewards["cost"].branch]
    assert not any(array.flags.writeable for array in arrays)
    assert all(array.flags.aligned for array in arrays)


@pytest.mark.parametrize("name", ["m.umb", "m.npz"])
def test_what_is_not_packed_is_mapped(large, tmp_path, name):
    write(large, tmp_path / name, packing="none")
    got = read(tmp_path / name).mdp
    for array in (got.branch_to_probability, got.rewards["cost"].branch):
        base = array
        while isinstance(base, np.ndarray):
            last, base = base, base.base
        assert type(base).__name__ in ("mmap", "memoryview"), type(last)
    (tmp_path / name).unlink()  # what was read stays
    same(got, large.mdp)


def test_the_number_of_processors_does_not_show(monkeypatch):
    data, packed = np.random.default_rng(0).integers(0, 9, 3 * BLOCK + 5, dtype=np.uint8).tobytes(), []
    for processors in (1, 7):
        monkeypatch.setattr(os, "cpu_count", lambda processors=processors: processors)
        out = io.BytesIO()
        with GzipWriter(out) as writer:
            for first in range(0, len(data), 777_777):
                writer.write(data[first : first + 777_777])
        packed.append(out.getvalue())
    assert packed[0] == packed[1]
    assert gzip.decompress(packed[0]) == data


@pytest.mark.parametrize("size", [0, 1, BLOCK, BLOCK + 1])
def test_a_gzip_file_of_any_size_is_whole(size):
    out = io.BytesIO()
    with GzipWriter(out) as writer:
        writer.write(bytes(size))
    assert gzip.decompress(out.getvalue()) == bytes(size)


def test_numbers_are_stored_as_a_whole_conversion_would_store_them():
    array = np.arange(300_000, dtype=np.int32)
    assert b"".join(Numbers(array, "<u8").blocks()) == array.astype("<u8").tobytes()
    assert len(Numbers(array, "<u8")) == 8 * len(array)


def test_an_archive_of_numpys_own_that_is_not_aligned_is_read(large, tmp_path):
    arrays = {name: getattr(large.mdp, name) for name in (*FIELDS, "initial")}
    np.savez(tmp_path / "own.npz", **arrays, actions=np.array(["left", "right"]))
    got = read(tmp_path / "own.npz").mdp
    assert all(np.array_equal(getattr(got, name), getattr(large.mdp, name)) for name in FIELDS)


def test_a_changed_byte_in_a_mapped_array_is_noticed(large, tmp_path):
    path = tmp_path / "m.npz"
    write(large, path, packing="none")
    with zipfile.ZipFile(path) as archive:
        begin = archive.getinfo("reward:cost:branch.npy").header_offset
    whole = bytearray(path.read_bytes())
    whole[begin + 100_000] ^= 1
    path.write_bytes(whole)
    with pytest.raises(SourceError, match="CRC"):
        read(path)


def test_a_target_beyond_32_bits_is_told_with_its_place(large, tmp_path):
    path = tmp_path / "m.umb"
    write(large, path, packing="none")
    whole = bytearray(path.read_bytes())
    at = whole.index(b"branch-to-target.bin") + 512
    whole[at + 8 * 12_345 + 5] = 1
    path.write_bytes(whole)
    with pytest.raises(Exception, match="at entry 12345"):
        read(path)
