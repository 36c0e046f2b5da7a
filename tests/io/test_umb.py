"""UMB archives: what is written is read, what Storm writes is read, and no stranger's archive does harm."""

from __future__ import annotations

import contextlib
import functools
import gzip
import io
import json
import lzma
import struct
import tarfile
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.errors import InputError, ModelError, SourceError
from ratherthan.io._files import Limits
from ratherthan.io._packing import GzipWriter
from ratherthan.io.umb import read_umb, write_umb
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem

Files = dict[str, bytes]


def words(*numbers: int) -> bytes:
    return np.array(numbers, dtype="<u8").tobytes()


def doubles(*numbers: float) -> bytes:
    return np.array(numbers, dtype="<f8").tobytes()


def small_index() -> dict:
    """The index of the four-state example that comes with the format's specification."""
    return {
        "format-version": 1,
        "format-revision": 0,
        "transition-system": {
            "time": "discrete",
            "#players": 1,
            "#states": 4,
            "#initial-states": 1,
            "#choices": 5,
            "#choice-actions": 2,
            "#branches": 8,
            "#branch-actions": 0,
            "#observations": 0,
            "branch-probability-type": {"type": "double", "size": 64},
        },
        "annotations": {
            "aps": {"g": {"alias": "the goal", "applies-to": ["states"], "type": {"type": "bool", "size": 1}}},
            "rewards": {"r": {"applies-to": ["choices"], "type": {"type": "double"}}},
        },
        "valuations": {
            "states": {
                "unique": True,
                "classes": [
                    {
                        "variables": [
                            {"name": "x", "type": {"type": "uint", "size": 2}},
                            {"name": "b", "type": {"type": "bool", "size": 1}},
                            {"padding": 5},
                        ]
                    }
                ],
            }
        },
    }


def small_files() -> Files:
    return {
        "state-to-choices.bin": words(0, 2, 3, 4, 5),
        "choice-to-branches.bin": words(0, 2, 4, 6, 7, 8),
        "branch-to-probability.bin": doubles(0.5, 0.5, 0.2, 0.8, 0.9, 0.1, 1.0, 1.0),
        "branch-to-target.bin": words(1, 2, 2, 3, 0, 1, 2, 3),
        "state-is-initial.bin": words(0b0001),
        "actions/choices/string-mapping.bin": words(0, 1, 2),
        "actions/choices/strings.bin": b"ab",
        "actions/choices/values.bin": np.array([0, 1, 0, 0, 0], dtype="<u4").tobytes(),
        "annotations/aps/g/states/values.bin": words(0b1000),
        "annotations/rewards/r/choices/values.bin": doubles(0, 1, 0, 0, 0),
        "valuations/states/valuations.bin": bytes([0b000, 0b001, 0b010, 0b110]),
    }


def tar_bytes(index: object, files: Files, *, form: int = tarfile.USTAR_FORMAT) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=form) as archive:
        text = index if isinstance(index, bytes) else json.dumps(index).encode()
        members = ({"index.json": text} if index is not None else {}) | files
        for name, data in members.items():
            member = tarfile.TarInfo(name)
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))
    return buffer.getvalue()


@pytest.fixture
def archive(tmp_path: Path) -> Callable[..., Path]:
    """``archive(index, files)`` writes an archive and returns its path."""

    def make(index: object = None, files: Files | None = None, *, pack: Callable[[bytes], bytes] = bytes) -> Path:
        path = tmp_path / "model.umb"
        path.write_bytes(
            pack(tar_bytes(small_index() if index is None else index, small_files() if files is None else files))
        )
        return path

    return make


# what is read


def test_the_specifications_example_is_read_as_it_says(archive):
    problem = read_umb(archive())
    mdp = problem.mdp
    assert (mdp.states, mdp.choices, mdp.branches) == (4, 5, 8)
    assert [mdp.action_name(choice) for choice in range(5)] == ["a", "b", "a", "a", "a"]
    assert mdp.branch_to_target.tolist() == [1, 2, 2, 3, 0, 1, 2, 3]
    assert mdp.labels["the goal"].tolist() == [False, False, False, True]
    assert mdp.rewards["r"].choice.tolist() == [0, 1, 0, 0, 0]
    assert mdp.rewards["r"].state is None
    assert mdp.initial.tolist() == [0]
    assert [mdp.names[s] for s in range(4)] == ["x=0, b=false", "x=1, b=false", "x=2, b=false", "x=2, b=true"]
    assert problem.notes == ()


@pytest.mark.parametrize("pack", [bytes, gzip.compress, lzma.compress], ids=["plain", "gzip", "xz"])
@pytest.mark.parametrize("form", [tarfile.USTAR_FORMAT, tarfile.GNU_FORMAT, tarfile.PAX_FORMAT])
def test_every_packing_reads_the_same(tmp_path, assert_equal, archive, pack, form):
    path = tmp_path / "packed.umb"
    path.write_bytes(pack(tar_bytes(small_index(), small_files(), form=form)))
    assert_equal(read_umb(path), read_umb(archive()))


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress], ids=["gzip", "xz"])
def test_several_packed_streams_in_a_row_are_one_archive(tmp_path, assert_equal, archive, pack):
    whole = tar_bytes(small_index(), small_files())
    path = tmp_path / "streams.umb"
    path.write_bytes(pack(whole[:700]) + pack(b"") + pack(whole[700:]) + b"\x00" * 8)
    assert_equal(read_umb(path), read_umb(archive()))


def test_the_order_of_the_files_does_not_matter(tmp_path, assert_equal, archive):
    path = tmp_path / "last.umb"
    files = dict(reversed(list(small_files().items()))) | {"index.json": json.dumps(small_index()).encode()}
    path.write_bytes(tar_bytes(None, files))
    assert_equal(read_umb(path), read_umb(archive()))


def test_long_names_leading_dots_and_folders_are_read(tmp_path):
    long = "r" * 150
    index, files = small_index(), small_files()
    index["annotations"]["rewards"][long] = {"applies-to": ["states"], "type": {"type": "double"}}
    files[f"annotations/rewards/{long}/states/values.bin"] = doubles(1, 2, 3, 4)
    for form in (tarfile.GNU_FORMAT, tarfile.PAX_FORMAT):
        buffer = io.BytesIO()
        with tarfile.open(fileobj=buffer, mode="w", format=form) as tar:
            folder = tarfile.TarInfo("./annotations/")
            folder.type = tarfile.DIRTYPE
            tar.addfile(folder)
            for name, data in ({"index.json": json.dumps(index).encode()} | files).items():
                member = tarfile.TarInfo("./" + name)
                member.size = len(data)
                tar.addfile(member, io.BytesIO(data))
        path = tmp_path / "dots.umb"
        path.write_bytes(buffer.getvalue())
        assert read_umb(path).mdp.rewards[long].state.tolist() == [1, 2, 3, 4]


def test_files_that_are_absent_mean_what_the_format_says(archive):
    """Offsets 0, 1, 2 …, probability 1, action 0, labels nowhere, rewards 0."""
    index = small_index()
    index["transition-system"] |= {"#choices": 4, "#branches": 4}
    problem = read_umb(archive(index, {"branch-to-target.bin": words(1, 2, 3, 3), "state-is-initial.bin": words(1)}))
    mdp = problem.mdp
    assert mdp.state_to_choices.tolist() == mdp.choice_to_branches.tolist() == [0, 1, 2, 3, 4]
    assert mdp.branch_to_probability.tolist() == [1, 1, 1, 1]
    assert not mdp.labels["the goal"].any()
    assert not list(mdp.rewards["r"].parts())
    assert mdp.actions == ("a0", "a1")
    assert mdp.choice_to_action.tolist() == [0, 0, 0, 0]
    assert "a0" in problem.notes[0]
    assert not mdp.names.named


def test_probabilities_may_be_absent_only_where_every_choice_has_one_branch(archive):
    files = small_files()
    del files["branch-to-probability.bin"]
    with pytest.raises(ModelError, match="5 choices and 8 branches"):
        read_umb(archive(files=files))


def test_states_without_choices_get_a_loop_that_earns_nothing_and_a_note(archive):
    index, files = small_index(), small_files()
    index["transition-system"] |= {"#states": 6, "#initial-states": 1}
    del index["valuations"]
    files |= {"state-to-choices.bin": words(0, 0, 2, 3, 4, 5, 5), "state-is-initial.bin": words(0b10)}
    files["branch-to-target.bin"] = words(2, 3, 3, 4, 1, 2, 3, 4)
    index["annotations"]["rewards"]["s"] = {"applies-to": ["branches"], "type": {"type": "double"}}
    files["annotations/rewards/s/branches/values.bin"] = doubles(1, 2, 3, 4, 5, 6, 7, 8)
    problem = read_umb(archive(index, files))
    mdp = problem.mdp
    assert mdp.state_to_choices.tolist() == [0, 1, 3, 4, 5, 6, 7]
    assert mdp.branch_to_target.tolist() == [0, 2, 3, 3, 4, 1, 2, 3, 4, 5]
    assert mdp.rewards["r"].choice.tolist() == [0, 0, 1, 0, 0, 0, 0]
    assert mdp.rewards["s"].branch.tolist() == [0, 1, 2, 3, 4, 5, 6, 7, 8, 0]
    assert mdp.choice_to_action.tolist() == [-1, 0, 1, 0, 0, 0, -1]
    assert problem.notes == (
        "2 states (0, 5) have no choice in the source and got a loop in place that earns nothing.",
    )


def test_a_dtmc_is_an_mdp_with_one_choice_per_state(archive):
    index = small_index()
    index["transition-system"] |= {"#players": 0, "#choices": 4, "#choice-actions": 0, "#branches": 5}
    files = {
        "choice-to-branches.bin": words(0, 2, 3, 4, 5),
        "branch-to-target.bin": words(1, 2, 3, 3, 3),
        "branch-to-probability.bin": doubles(0.5, 0.5, 1, 1, 1),
        "state-is-initial.bin": words(1),
    }
    problem = read_umb(archive(index, files))
    assert problem.mdp.choices == 4
    assert "DTMC" in problem.notes[0]
    index = small_index()
    index["transition-system"]["#players"] = 0
    with pytest.raises(ModelError, match="one choice per state"):
        read_umb(archive(index))


def test_without_an_initial_state_any_may_be_the_start(archive):
    index, files = small_index(), small_files()
    index["transition-system"]["#initial-states"] = 0
    del files["state-is-initial.bin"]
    problem = read_umb(archive(index, files))
    assert problem.mdp.initial.tolist() == [0, 1, 2, 3]
    assert "no initial state" in problem.notes[0]


@pytest.mark.parametrize("limbs", [1, 2])
def test_fractions_become_the_nearest_doubles(archive, limbs):
    index, files = small_index(), small_files()
    index["transition-system"]["branch-probability-type"] = {"type": "rational", "size": 128 * limbs}
    wide = 10 ** (25 if limbs == 2 else 18)
    pairs = [(1, 3), (2, 3), (wide // 7, wide), (wide - wide // 7, wide), (9, 10), (1, 10), (1, 1), (wide, wide)]
    size = 8 * limbs
    files["branch-to-probability.bin"] = b"".join(
        n.to_bytes(size, "little") + d.to_bytes(size, "little") for n, d in pairs
    )
    index["annotations"]["rewards"]["r"]["type"] = {"type": "rational", "size": 128 * limbs}
    rewards = [(-1, 3), (wide, 3), (-wide, 7), (0, 1), (5, 1)]
    files["annotations/rewards/r/choices/values.bin"] = b"".join(
        n.to_bytes(size, "little", signed=True) + d.to_bytes(size, "little") for n, d in rewards
    )
    mdp = read_umb(archive(index, files)).mdp
    np.testing.assert_allclose(mdp.branch_to_probability, [n / d for n, d in pairs], rtol=3e-16)
    assert mdp.rewards["r"].choice.tolist() == [n / d for n, d in rewards]


def test_a_fraction_with_denominator_0_is_refused(archive):
    index, files = small_index(), small_files()
    index["transition-system"]["branch-probability-type"] = {"type": "rational"}
    files["branch-to-probability.bin"] = words(*[1, 0] * 8)
    with pytest.raises(SourceError, match="denominator 0"):
        read_umb(archive(index, files))


# state valuations


def packed(entries: list[dict], rows: list[list[tuple[int, int]]], **more: object) -> tuple[dict, Files]:
    """Index and files with valuations: each row lists (value, bits), the least significant first."""
    index, files = small_index(), small_files()
    index["valuations"]["states"] = {"unique": False, "classes": [{"variables": entries}], **more}
    block = b""
    for row in rows:
        number = at = 0
        for value, bits in row:
            number |= (value % (1 << bits)) << at
            at += bits
        block += number.to_bytes(at // 8, "little")
    files["valuations/states/valuations.bin"] = block
    return index, files


def test_bits_are_unpacked_wherever_they_lie(archive):
    values = [
        (True, -3, 2**61 - 1, 0.25),
        (False, 3, 0, -1e300),
        (True, 0, 12345678901234567, 0.0),
        (False, -4, 1, 1.5),
    ]
    entries = [
        {"padding": 3},
        {"name": "flag", "type": {"type": "bool", "size": 2}},
        {"name": "signed", "type": {"type": "int", "size": 3}},
        {"name": "wide", "type": {"type": "uint", "size": 61}},
        {"name": "real", "type": {"type": "double"}},
        {"padding": 3},
    ]
    rows = [
        [(7, 3), (2 * flag, 2), (signed, 3), (wide, 61), (struct.unpack("<Q", struct.pack("<d", real))[0], 64), (5, 3)]
        for flag, signed, wide, real in values
    ]
    variables = read_umb(archive(*packed(entries, rows))).mdp.names.variables
    for column, name in enumerate(("flag", "signed", "wide", "real")):
        assert variables[name].tolist() == [row[column] for row in values], name


@given(st.integers(1, 64), st.integers(0, 40), st.booleans(), st.data())
def test_whole_numbers_of_every_width_place_and_offset_are_read(tmp_path_factory, bits, before, signed, data):
    low, high = (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if signed else (0, (1 << bits) - 1)
    stored = data.draw(st.lists(st.integers(low, high), min_size=4, max_size=4))
    offset = data.draw(
        st.integers(max(-(2**63), -(2**63) - low), min(2**63 - 1, 2**63 - 1 - high) if high < 2**63 else 0)
    )
    entries = [{"name": "v", "type": {"type": "int" if signed else "uint", "size": bits}, "offset": offset}]
    before += -(before + bits) % 8
    entries = [{"padding": before}, *entries] if before else entries
    index, files = packed(entries, [[(0, before), (value, bits)] for value in stored])
    path = tmp_path_factory.mktemp("widths") / "m.umb"
    path.write_bytes(tar_bytes(index, files))
    problem = read_umb(path)
    expected = [value + offset for value in stored]
    fits_signed = min(expected) >= -(2**63) and max(expected) < 2**63
    if fits_signed or (min(expected) >= 0 and max(expected) < 2**64):
        assert problem.mdp.names.variables["v"].tolist() == expected
    else:
        with pytest.raises(SourceError, match="64 bits"):
            problem.mdp.names.variables["v"]


def test_strings_and_fractions_are_decoded(archive):
    entries = [{"name": "s", "type": {"type": "string"}}, {"name": "q", "type": {"type": "rational", "size": 16}}]
    rows = [
        [(2, 64), (-1, 8), (3, 8)],
        [(0, 64), (1, 8), (2, 8)],
        [(1, 64), (0, 8), (1, 8)],
        [(2, 64), (7, 8), (255, 8)],
    ]
    index, files = packed(entries, rows, **{"#strings": 3})
    files |= {
        "valuations/states/string-mapping.bin": words(0, 3, 3, 7),
        "valuations/states/strings.bin": "xyzüab".encode(),
    }
    names = read_umb(archive(index, files)).mdp.names
    assert names.variables["s"].tolist() == ["üab", "xyz", "", "üab"]
    assert names.variables["q"].tolist() == [-1 / 3, 0.5, 0.0, 7 / 255]
    assert names.find("s=xyz") == 1


def test_an_optional_variable_is_a_number_where_all_have_it_else_text(archive):
    entries = [
        {"name": "always", "is-optional": True, "type": {"type": "uint", "size": 3}},
        {"name": "some", "is-optional": True, "type": {"type": "int", "size": 3}},
    ]
    rows = [
        [(1, 1), (5, 3), (1, 1), (-2, 3)],
        [(1, 1), (0, 3), (0, 1), (3, 3)],
        [(1, 1), (1, 3), (1, 1), (3, 3)],
        [(1, 1), (2, 3), (0, 1), (0, 3)],
    ]
    names = read_umb(archive(*packed(entries, rows))).mdp.names
    assert names.variables["always"].tolist() == [5, 0, 1, 2]
    assert names.variables["some"].tolist() == ["-2", "none", "3", "none"]
    assert names.find("some=none, always=2") == 3


def test_several_classes_of_valuations_are_merged(archive):
    index, files = small_index(), small_files()
    x = {"name": "x", "type": {"type": "uint", "size": 8}}
    y = {"name": "y", "type": {"type": "uint", "size": 16}}
    index["valuations"]["states"] = {"unique": True, "classes": [{"variables": [x]}, {"variables": [y, x]}]}
    files["valuations/states/valuation-to-class.bin"] = np.array([0, 1, 0, 1], dtype="<u4").tobytes()
    files["valuations/states/valuations.bin"] = bytes([7, 1, 2, 9, 8, 3, 0, 10])
    names = read_umb(archive(index, files)).mdp.names
    assert names.variables["x"].tolist() == [7, 9, 8, 10]
    assert names.variables["y"].tolist() == ["none", "513", "none", "3"]
    files["valuations/states/valuations.bin"] += b"\x00"
    with pytest.raises(SourceError, match="must have 8 bytes, got 9"):
        read_umb(archive(index, files))


def test_a_number_too_wide_to_read_is_left_out_with_a_note(archive):
    entries = [
        {"name": "huge", "type": {"type": "uint", "size": 72}},
        {"name": "x", "type": {"type": "uint", "size": 8}},
    ]
    problem = read_umb(archive(*packed(entries, [[(5, 72), (i, 8)] for i in range(4)])))
    assert list(problem.mdp.names.variables) == ["x"]
    assert problem.mdp.names.variables["x"].tolist() == [0, 1, 2, 3]
    assert "'huge'" in problem.notes[0]


def test_a_column_is_decoded_only_when_it_is_asked_for(archive, monkeypatch):
    from ratherthan.io import _umb_valuations

    asked = []
    whole = _umb_valuations.Columns._decode
    monkeypatch.setattr(_umb_valuations.Columns, "_decode", lambda self, name: asked.append(name) or whole(self, name))
    names = read_umb(archive()).mdp.names
    assert asked == []
    assert names.variables["b"].tolist() == [False, False, False, True]
    assert names[3] == "x=2, b=true"
    assert asked == ["b", "x"]


def test_a_string_that_points_nowhere_is_refused(archive):
    index, files = packed([{"name": "s", "type": {"type": "string"}}], [[(i, 64)] for i in range(4)], **{"#strings": 1})
    files |= {"valuations/states/string-mapping.bin": words(0, 1), "valuations/states/strings.bin": b"x"}
    problem = read_umb(archive(index, files))
    with pytest.raises(SourceError, match="points to 3"):
        problem.mdp.names.variables["s"]


# round trips


@given(st.integers(0, 2**32), st.sampled_from(["gzip", "none"]))
def test_what_is_written_is_read_back_equal(tmp_path_factory, random_problem, assert_equal, seed, packing):
    problem = random_problem(seed)
    path = tmp_path_factory.mktemp("round") / "model.umb"
    write_umb(problem, path, packing=packing)
    back = read_umb(path)
    assert_equal(problem, back)
    assert back.source == str(path)


def test_the_same_problem_gives_the_same_bytes(tmp_path, random_problem):
    for name in ("a.umb", "b.umb"):
        write_umb(random_problem(3), tmp_path / name)
    assert (tmp_path / "a.umb").read_bytes() == (tmp_path / "b.umb").read_bytes()


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, random_problem, monkeypatch):
    path = tmp_path / "model.umb"
    path.write_bytes(b"old")

    def fail(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(GzipWriter, "write", fail)
    with pytest.raises(SourceError, match="No space left"):
        write_umb(random_problem(0), path)
    assert path.read_bytes() == b"old"
    assert [item.name for item in tmp_path.iterdir()] == ["model.umb"]


def test_a_place_that_cannot_be_written_is_said(tmp_path, random_problem):
    problem = random_problem(0)
    with pytest.raises(SourceError, match="is a folder"):
        write_umb(problem, tmp_path)
    with pytest.raises(SourceError, match="cannot be written"):
        write_umb(problem, tmp_path / "missing" / "model.umb")
    with pytest.raises(SourceError, match="gzip, xz, none"):
        write_umb(problem, tmp_path / "model.umb", packing="zip")


def test_an_own_part_of_another_version_is_left_alone_with_a_note(archive):
    files = small_files() | {"ratherthan/problem.json": b'{"version": 99, "names": "strings"}'}
    assert "version 99" in read_umb(archive(files=files)).notes[0]


@pytest.mark.parametrize(
    "text",
    [
        b"{",
        b"[]",
        b"\xff",
        b"[" * 100_000,
        b'{"version": 1, "objective": {"kind": "best"}}',
        b'{"version": 1, "objective": 5}',
        b'{"version": 1, "objective": {"kind": "reach-avoid", "goal": 3, "maximise": true}}',
        b'{"version": 1, "properties": {"p": {"kind": "threshold", "relation": "=", "bound": 1}}}',
        b'{"version": 1, "properties": {"p": {"kind": "threshold", "relation": "<", "bound": NaN}}}',
        b'{"version": 1, "definitions": {"N": 5}}',
        b'{"version": 1, "lexicon": []}',
        b'{"version": 1, "notes": "x"}',
        b'{"version": 1, "names": true}',
        b'{"version": 1, "texts": ["x"]}',
        b'{"version": 1, "labels": ["init"]}',
        b'{"version": 1, "world": {"width": 2, "height": -1, "kinds": []}}',
        b'{"version": 1, "world": {"width": 2, "height": 2, "kinds": []}}',
        b'{"version": 1, "world": {"width": 2000000000, "height": 2000000000, "kinds": ["x"]}}',
    ],
)
def test_a_broken_own_part_is_one_sentence(archive, text):
    with pytest.raises(InputError, match=r"problem\.json"):
        read_umb(archive(files=small_files() | {"ratherthan/problem.json": text}))


# what is refused: the kind of model


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"time": "stochastic", "#players": 0}, "CTMC"),
        ({"time": "stochastic"}, "CTMDP"),
        ({"time": "urgent-stochastic"}, "Markov automaton"),
        ({"#players": 2}, "game of 2 players"),
        ({"#observations": 3, "observations-apply-to": "states"}, "POMDP"),
        ({"branch-probability-type": {"type": "double-interval"}}, "intervals"),
        ({"branch-probability-type": {"type": "rational-interval"}}, "intervals"),
    ],
)
def test_other_kinds_of_models_are_refused_with_the_reason(archive, change, reason):
    index = small_index()
    index["transition-system"] |= change
    with pytest.raises(SourceError, match=reason):
        read_umb(archive(index))


# what is refused: the index


def changed(*keys: str, to: object) -> dict:
    index = small_index()
    table = index
    for key in keys[:-1]:
        table = table[key]
    if to is None:
        del table[keys[-1]]
    else:
        table[keys[-1]] = to
    return index


TS = "transition-system"
KIND = {"type": "bool"}


@pytest.mark.parametrize(
    "index",
    [
        b"",
        b"{",
        b"nonsense",
        b"\xff\xfe",
        b"[" * 100_000,
        b"[]",
        b"{}",
        b'"text"',
        changed("format-version", to=2),
        changed("format-version", to="1"),
        changed("format-version", to=None),
        changed(TS, to=None),
        changed(TS, to=[]),
        changed(TS, "time", to="slow"),
        changed(TS, "time", to=None),
        changed(TS, "#players", to=-1),
        changed(TS, "#states", to=0),
        changed(TS, "#states", to=-4),
        changed(TS, "#states", to=4.5),
        changed(TS, "#states", to=True),
        changed(TS, "#states", to=2**64),
        changed(TS, "#states", to=2**63),
        changed(TS, "#choices", to=10**15),
        changed(TS, "#branches", to=None),
        changed(TS, "#choice-actions", to=-1),
        changed(TS, "branch-probability-type", to={"type": "bool"}),
        changed(TS, "branch-probability-type", to={"type": "double", "size": 32}),
        changed(TS, "branch-probability-type", to={"type": "rational", "size": 100}),
        changed(TS, "branch-probability-type", to={"type": "float"}),
        changed(TS, "branch-probability-type", to="double"),
        changed(TS, "#initial-states", to=2),
        changed("annotations", to=[]),
        changed("annotations", "aps", to=[]),
        changed("annotations", "aps", "g", to=None)
        | {"annotations": {"aps": {"../g": {"applies-to": ["states"], "type": KIND}}}},
        changed("annotations", "aps", "g", "applies-to", to=["choices"]),
        changed("annotations", "aps", "g", "applies-to", to=[]),
        changed("annotations", "aps", "g", "type", to={"type": "double"}),
        changed("annotations", "aps", "g", "alias", to=5),
        changed("annotations", "aps", "h", to={"alias": "the goal", "applies-to": ["states"], "type": KIND}),
        changed("annotations", "rewards", "r", "type", to=KIND),
        changed("annotations", "rewards", "r", "type", to={"type": "double-interval"}),
        changed("annotations", "rewards", "r", "applies-to", to=["players"]),
        changed("annotations", "rewards", "r", "probability-type", to={"type": "double"}),
        changed("valuations", "states", "classes", to=[]),
        changed(
            "valuations", "states", "classes", to=[{"variables": [{"name": "x", "type": {"type": "uint", "size": 7}}]}]
        ),
        changed(
            "valuations", "states", "classes", to=[{"variables": [{"name": "x", "type": {"type": "int-interval"}}]}]
        ),
        changed(
            "valuations", "states", "classes", to=[{"variables": [{"name": "x", "type": {"type": "uint", "size": 16}}]}]
        ),
        changed("valuations", "states", "classes", to=[{"variables": [{"type": {"type": "uint", "size": 8}}]}]),
        changed("valuations", "states", "classes", to=[{"variables": [{"padding": -8}]}]),
        changed(
            "valuations",
            "states",
            "classes",
            to=[{"variables": 2 * [{"name": "x", "type": {"type": "uint", "size": 4}}]}],
        ),
    ],
    ids=range(50),
)
def test_a_broken_index_is_one_sentence_about_the_archive(archive, index):
    path = archive(index)
    with pytest.raises(InputError) as caught:
        read_umb(path)
    assert str(path) in caught.value.message or caught.value.path == str(path)
    assert "\n" not in caught.value.message
    assert len(caught.value.message) < 400


def places(tree: object, path: tuple = ()) -> list[tuple]:
    """Every place in a tree of JSON."""
    below = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [path, *(place for key, value in below for place in places(value, (*path, key)))]


STRANGE = [
    None,
    True,
    -1,
    0,
    1,
    3,
    5,
    64,
    2**32,
    2**63,
    2**64,
    0.5,
    1e300,
    "",
    "x",
    "double",
    "rational",
    [],
    {},
    [{}],
    ["states"],
]


@given(st.data())
def test_any_change_of_the_index_is_read_or_told(tmp_path_factory, data):
    index = small_index()
    for _ in range(data.draw(st.integers(1, 3))):
        *above, last = data.draw(st.sampled_from(places(index)[1:]))
        table = index
        for key in above:
            table = table[key]
        table[last] = json.loads(json.dumps(data.draw(st.sampled_from(STRANGE))))
    path = tmp_path_factory.mktemp("strange") / "m.umb"
    path.write_bytes(tar_bytes(index, small_files()))
    with contextlib.suppress(InputError):
        problem = read_umb(path)
        assert all(problem.mdp.names[state] for state in range(problem.mdp.states))


def test_an_archive_without_index_says_so_and_finds_it_in_a_folder(archive):
    path = archive(files=small_files())
    path.write_bytes(tar_bytes(None, small_files()))
    with pytest.raises(SourceError, match=r"index\.json at its top, but .* has none\."):
        read_umb(path)
    path.write_bytes(tar_bytes(None, {"model/index.json": b"{}"}))
    with pytest.raises(SourceError, match="without their folder"):
        read_umb(path)


# what is refused: the files


@pytest.mark.parametrize("name", sorted(small_files()))
@pytest.mark.parametrize("change", ["longer", "shorter", "empty"])
def test_a_file_of_another_size_than_its_counts_is_refused(archive, name, change):
    files = small_files()
    files[name] = {"longer": files[name] + b"\x00", "shorter": files[name][:-1], "empty": b""}[change]
    with pytest.raises(SourceError):
        read_umb(archive(files=files))


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("state-to-choices.bin", words(1, 2, 3, 4, 5), "begin at 0, got 1"),
        ("state-to-choices.bin", words(0, 3, 2, 4, 5), "fall, but it does from 3 to 2 after row 1"),
        ("state-to-choices.bin", words(0, 2, 3, 4, 4), "end at 5, got 4"),
        ("state-to-choices.bin", words(0, 2, 3, 2**63, 5), "fall"),
        ("choice-to-branches.bin", words(0, 2, 4, 6, 7, 2**64 - 1), "end at 8"),
        ("choice-to-branches.bin", words(0, 2, 2, 6, 7, 8), "choice 1 has none"),
        ("branch-to-target.bin", words(1, 2, 2, 3, 0, 1, 2, 4), r"0 … 3, got 4 at entry 7"),
        ("branch-to-target.bin", words(1, 2, 2, 3, 0, 1, 2, 2**64 - 1), "got 18446744073709551615"),
        ("branch-to-target.bin", words(1, 2, 2, 3, 0, 1, 2, 2**32), "got 4294967296"),
        (
            "branch-to-probability.bin",
            doubles(0.5, 0.4, 0.2, 0.8, 0.9, 0.1, 1, 1),
            "sum to 1, got 0.9 at action 'a' of state 0",
        ),
        ("branch-to-probability.bin", doubles(0.5, 0.5, 0.2, 0.8, 0.9, 0.1, 1, np.nan), "between 0 and 1, got nan"),
        ("actions/choices/values.bin", np.array([0, 2, 0, 0, 0], dtype="<u4").tobytes(), "got 2 at entry 1"),
        ("actions/choices/string-mapping.bin", words(0, 2, 1), "actions/choices"),
        ("actions/choices/string-mapping.bin", words(0, 1, 2**64 - 1), "actions/choices"),
        ("actions/choices/strings.bin", b"\xff\xfe", "UTF-8"),
        ("actions/choices/strings.bin", "ü".encode(), "UTF-8"),
        ("annotations/rewards/r/choices/values.bin", doubles(0, np.inf, 0, 0, 0), "r"),
        ("state-is-initial.bin", words(0b11), "mark 1 initial states .* got 2"),
    ],
)
def test_broken_contents_are_told_with_their_place(archive, name, data, message):
    path = archive(files=small_files() | {name: data})
    with pytest.raises(InputError, match=message) as caught:
        read_umb(path)
    assert caught.value.path == str(path)


@pytest.mark.parametrize(
    "missing",
    ["state-to-choices.bin", "choice-to-branches.bin", "branch-to-target.bin", "actions/choices/string-mapping.bin"],
)
def test_a_file_that_cannot_be_absent_is_missed(archive, missing):
    files = small_files()
    del files[missing]
    with pytest.raises(SourceError, match=missing):
        read_umb(archive(files=files))


# what is refused: the archive


def hostile(tmp_path: Path, *members: tarfile.TarInfo) -> Path:
    path = tmp_path / "hostile.umb"
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as tar:
        for name, data in ({"index.json": json.dumps(small_index()).encode()} | small_files()).items():
            member = tarfile.TarInfo(name)
            member.size = len(data)
            tar.addfile(member, io.BytesIO(data))
        for member in members:
            tar.addfile(member, io.BytesIO(b"\x00" * member.size))
    path.write_bytes(buffer.getvalue())
    return path


@pytest.mark.parametrize("name", ["/etc/passwd", "../up.bin", "a/../../up.bin", "..", "a\\b"])
def test_names_that_point_outside_are_refused(tmp_path, name):
    with pytest.raises(SourceError, match="points outside"):
        read_umb(hostile(tmp_path, tarfile.TarInfo(name)))


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (tarfile.SYMTYPE, "a link"),
        (tarfile.LNKTYPE, "a link"),
        (tarfile.CHRTYPE, "a device"),
        (tarfile.BLKTYPE, "a device"),
        (tarfile.FIFOTYPE, "a device"),
        (b"S", "neither a file nor a folder"),
        (b"Z", "neither a file nor a folder"),
    ],
)
def test_links_devices_and_stranger_things_are_refused(tmp_path, kind, message):
    member = tarfile.TarInfo("extra.bin")
    member.type, member.linkname = kind, "/etc/passwd"
    with pytest.raises(SourceError, match=message):
        read_umb(hostile(tmp_path, member))


def test_a_name_that_comes_twice_is_refused(tmp_path):
    with pytest.raises(SourceError, match=r"'state-to-choices\.bin' twice"):
        read_umb(hostile(tmp_path, tarfile.TarInfo("./state-to-choices.bin")))


@pytest.mark.parametrize("pack", [bytes, gzip.compress, lzma.compress], ids=["plain", "gzip", "xz"])
def test_an_archive_cut_off_anywhere_is_refused(tmp_path, pack):
    whole = pack(tar_bytes(small_index(), small_files()))
    path = tmp_path / "cut.umb"
    end = len(whole) if pack is not bytes else len(whole.rstrip(b"\x00"))
    for length in {1, 100, 511, 512, 513, 1024, end // 2, end - 400, end - 9, end - 1} | set(range(600, end, 517)):
        if 0 < length < end:
            path.write_bytes(whole[:length])
            with pytest.raises(SourceError):
                read_umb(path)


@pytest.mark.parametrize("pack", [bytes, gzip.compress, lzma.compress], ids=["plain", "gzip", "xz"])
@given(st.data())
def test_a_damaged_byte_is_one_sentence_or_does_no_harm(tmp_path_factory, pack, data):
    whole = bytearray(pack(tar_bytes(small_index(), small_files())))
    for _ in range(data.draw(st.integers(1, 3))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("damage") / "damaged.umb"
    path.write_bytes(whole)
    with contextlib.suppress(InputError):
        problem = read_umb(path)
        assert all(problem.mdp.names[state] for state in range(problem.mdp.states))


@pytest.mark.parametrize(
    "content",
    [b"hello", b"\x00" * 2000, b"PK\x03\x04" + b"\x00" * 600, bytes(range(256)) * 4, b"\x1f\x8b", b"\xfd7zXZ\x00"],
)
def test_another_kind_of_file_is_refused(tmp_path, content):
    path = tmp_path / "other.umb"
    path.write_bytes(content)
    with pytest.raises(SourceError) as caught:
        read_umb(path)
    assert str(path) in caught.value.message


def test_gzip_of_something_else_is_refused(tmp_path):
    path = tmp_path / "other.umb"
    path.write_bytes(gzip.compress(b"hello" * 500))
    with pytest.raises(SourceError, match="something else than a tar"):
        read_umb(path)


def test_a_missing_file_a_folder_and_an_empty_file_are_told_apart(tmp_path):
    with pytest.raises(SourceError, match="there is no"):
        read_umb(tmp_path / "no.umb")
    with pytest.raises(SourceError, match="is a folder"):
        read_umb(tmp_path)
    (tmp_path / "empty.umb").write_bytes(b"")
    with pytest.raises(SourceError, match="no bytes"):
        read_umb(tmp_path / "empty.umb")


# what is refused: too much


def bomb(size: int) -> bytes:
    """A tar archive with an unneeded member of `size` zeros."""
    member = tarfile.TarInfo("zeros.bin")
    member.size = size
    head = tar_bytes(small_index(), small_files()).rstrip(b"\x00")
    return head + b"\x00" * (-len(head) % 512) + member.tobuf()


@pytest.mark.parametrize("packed_as", ["gzip", "xz"])
def test_a_bomb_is_refused_before_it_fills_the_memory(tmp_path, packed_as):
    path = tmp_path / "bomb.umb"
    opener = gzip.open if packed_as == "gzip" else functools.partial(lzma.open, preset=0)
    size = 80 << 20
    with opener(path, "wb") as file:
        file.write(bomb(size))
        for _ in range(size >> 20):
            file.write(b"\x00" * (1 << 20))
    assert path.stat().st_size < 1 << 20
    tracemalloc.start()
    try:
        with pytest.raises(SourceError, match="500 times its size"):
            read_umb(path)
        assert tracemalloc.get_traced_memory()[1] < 32 << 20
    finally:
        tracemalloc.stop()


def test_counts_that_need_too_much_memory_are_refused_before_any_is_taken(archive):
    index = small_index()
    index["transition-system"] |= {"#states": 10**12, "#choices": 10**12, "#branches": 10**12}
    with pytest.raises(SourceError, match="TiB"):
        read_umb(archive(index))


def test_a_limit_can_be_set(archive):
    with pytest.raises(SourceError, match="100 bytes of memory"):
        read_umb(archive(), limits=Limits(most_bytes=100))
    with pytest.raises(SourceError, match="times its size"):
        read_umb(archive(pack=gzip.compress), limits=Limits(most_ratio=2, free_bytes=0))


def test_a_member_that_claims_to_be_huge_is_refused_before_it_is_read(tmp_path):
    """The strings have no size in the index: the limit on all of them together holds."""
    member = tarfile.TarInfo("actions/choices/strings.bin")
    member.size = 10**15
    files = small_files()
    del files["actions/choices/strings.bin"]
    head = tar_bytes(small_index(), files).rstrip(b"\x00")
    head += b"\x00" * (-len(head) % 512)
    path = tmp_path / "huge.umb"
    path.write_bytes(head + member.tobuf(format=tarfile.GNU_FORMAT) + b"ab" + b"\x00" * 2000)
    with pytest.raises(SourceError, match="TiB"):
        read_umb(path)


# Storm


@pytest.fixture(scope="module")
def storm():
    return pytest.importorskip("stormpy")


def built(storm, path: Path, constants: str = ""):
    program = storm.parse_prism_program(str(path))
    if constants:
        program, _ = storm.instantiate_constants(program, constants)
    return storm.build_model(program, options=storm.BuilderOptions(build_full=True))


MODELS = [
    ("consensus/consensus.2.prism", "K=2"),
    ("eajs/eajs.2.prism", "energy_capacity=40"),
    ("resource-gathering/resource-gathering.pm", "B=20,GOLD_TO_COLLECT=2,GEM_TO_COLLECT=2"),
    ("zeroconf/zeroconf.prism", "N=20,K=2,reset=true"),
    ("philosophers-mdp/philosophers-mdp.3.prism", ""),
]


@pytest.mark.parametrize(("name", "constants"), MODELS, ids=[name.split("/")[0] for name, _ in MODELS])
def test_what_storm_writes_is_read_with_the_same_model(storm, shared_data, tmp_path, name, constants):
    model = built(storm, shared_data / "models" / "qvbs" / name, constants)
    path = tmp_path / "storm.umb"
    storm.io.export_to_umb(model, str(path))
    assert_same_model(storm, model, read_umb(path).mdp)


def assert_same_model(storm, model, mdp: MDP) -> None:
    """Counts, rows, labels, rewards and actions of a Storm model are those of ours."""
    matrix = model.transition_matrix
    assert (model.nr_states, model.nr_choices) == (mdp.states, mdp.choices)
    assert model.initial_states == mdp.initial.tolist()
    for state in range(mdp.states):
        rows = matrix.get_rows_for_group(state)
        assert list(rows) == list(mdp.choices_of(state))
    for choice in range(mdp.choices):
        own = mdp.branches_of(choice)
        ours: dict[int, float] = {}
        for target, probability in zip(mdp.branch_to_target[own], mdp.branch_to_probability[own], strict=True):
            ours[int(target)] = ours.get(int(target), 0.0) + float(probability)
        theirs = {entry.column: entry.value for entry in matrix.get_row(choice)}
        assert ours == pytest.approx(theirs, rel=1e-12)
    for label in model.labeling.get_labels() - {"init"}:
        assert list(model.labeling.get_states(label)) == np.flatnonzero(mdp.labels[label]).tolist()
    for name, reward in model.reward_models.items():
        assert (mdp.rewards[name].state is not None) == reward.has_state_rewards
        if reward.has_state_rewards:
            assert list(reward.state_rewards) == mdp.rewards[name].state.tolist()
        assert (mdp.rewards[name].choice is not None) == reward.has_state_action_rewards
        if reward.has_state_action_rewards:
            assert list(reward.state_action_rewards) == mdp.rewards[name].choice.tolist()
    if model.has_choice_labeling():
        for choice in range(mdp.choices):
            action = mdp.choice_to_action[choice]
            assert model.choice_labeling.get_labels_of_choice(choice) == (
                {mdp.actions[action]} if action >= 0 else set()
            )


@pytest.mark.parametrize("seed", range(12))
def test_storm_reads_what_is_written_as_the_same_model(storm, tmp_path, random_problem, seed):
    from dataclasses import replace

    problem = random_problem(seed)
    actions = tuple(f"{name} {i}" for i, name in enumerate(problem.mdp.actions))  # Storm wants each name once
    rewards = {name: replace(reward, branch=None) for name, reward in problem.mdp.rewards.items()}
    problem = replace(problem, mdp=replace(problem.mdp, actions=actions, rewards=rewards))
    path = tmp_path / "ours.umb"
    write_umb(problem, path)
    options = storm.io.UmbImportOptions()
    options.build_choice_labeling = options.build_state_valuations = True
    model = storm.build_model_from_umb(str(path), options=options)
    assert_same_model(storm, model, problem.mdp)


CHAIN = """{kind}
module m
 x : [0..2] init 0;
 [] x=0 -> 0.25:(x'=1) + 0.75:(x'=2);
endmodule
rewards "r" x=0 : 2; [] true : 3; endrewards
label "goal" = x=2;
"""


def test_a_chain_of_storm_is_an_mdp(storm, tmp_path):
    (tmp_path / "chain.prism").write_text(CHAIN.format(kind="dtmc"))
    model = built(storm, tmp_path / "chain.prism")
    storm.io.export_to_umb(model, str(tmp_path / "chain.umb"))
    problem = read_umb(tmp_path / "chain.umb")
    assert problem.mdp.labels["goal"].tolist() == [False, False, True]
    assert problem.mdp.branch_to_probability.tolist() == [0.25, 0.75, 1, 1]
    assert "DTMC" in problem.notes[0]


def test_storms_continuous_time_is_refused(storm, tmp_path):
    (tmp_path / "chain.prism").write_text(CHAIN.format(kind="ctmc").replace("[] x=0 ->", "<> x=0 ->"))
    model = built(storm, tmp_path / "chain.prism")
    storm.io.export_to_umb(model, str(tmp_path / "chain.umb"))
    with pytest.raises(SourceError, match="CTMC"):
        read_umb(tmp_path / "chain.umb")


def test_storms_partial_observation_is_refused(storm, tmp_path):
    text = CHAIN.format(kind="pomdp").replace("module m", "observables x endobservables\nmodule m", 1)
    (tmp_path / "chain.prism").write_text(text)
    model = built(storm, tmp_path / "chain.prism")
    storm.io.export_to_umb(model, str(tmp_path / "chain.umb"))
    with pytest.raises(SourceError, match="POMDP"):
        read_umb(tmp_path / "chain.umb")


@pytest.mark.parametrize("mode", ["NO_COMPRESSION", "GZIP", "XZ"])
def test_every_packing_of_storm_is_read(storm, shared_data, tmp_path, mode):
    model = built(storm, shared_data / "models" / "qvbs" / "consensus" / "consensus.2.prism", "K=2")
    options = storm.io.UmbExportOptions()
    options.compression = getattr(storm.io.CompressionMode, mode)
    storm.io.export_to_umb(model, str(tmp_path / "m.umb"), options=options)
    assert_same_model(storm, model, read_umb(tmp_path / "m.umb").mdp)


def test_storm_finds_the_same_value_on_what_is_written(storm, shared_data, tmp_path):
    model = built(storm, shared_data / "models" / "qvbs" / "consensus" / "consensus.2.prism", "K=2")
    first, second = tmp_path / "storm.umb", tmp_path / "ours.umb"
    storm.io.export_to_umb(model, str(first))
    write_umb(read_umb(first), second)
    again = storm.build_model_from_umb(str(second))
    for text in ('Pmin=? [F "finished" & "all_coins_equal_1"]', 'R{"steps"}max=? [F "finished"]'):
        formula = storm.parse_property(text)
        values = [storm.model_checking(m, formula).get_value(m.initial_states[0]) for m in (model, again)]
        assert values[0] == values[1]


def test_storm_reads_the_variables_that_are_written(storm, tmp_path):
    variables = {
        "x": np.array([-3, 5]),
        "y": np.array([True, False]),
        "z": np.array([0.5, -2.0]),
        "w": np.array(["left", "right"], dtype=object),
    }
    mdp = MDP(
        state_to_choices=np.array([0, 1, 2]),
        choice_to_branches=np.array([0, 1, 2]),
        branch_to_target=np.array([1, 1]),
        branch_to_probability=np.ones(2),
        rewards={"r": Reward(choice=np.array([1.0, 0.0]), branch=np.array([0.5, 0.0]))},
        initial=np.array([0]),
        names=StateNames(count=2, variables=variables),
    )
    path = tmp_path / "variables.umb"
    write_umb(Problem(mdp=mdp), path)
    options = storm.io.UmbImportOptions()
    options.build_state_valuations = True
    model = storm.build_model_from_umb(str(path), options=options)
    on_branches = model.reward_models["r"].transition_rewards
    assert [entry.value for entry in on_branches.get_row(0)] == [0.5]
    shown = model.state_valuations.to_string(0), model.state_valuations.to_string(1)
    assert "x=-3" in shown[0].replace(" ", "")
    assert "x=5" in shown[1].replace(" ", "")
    assert "w=0" in shown[0].replace(" ", "")  # text is a number for Storm
    assert read_umb(path).mdp.names[1] == "x=5, y=false, z=-2, w=right"


def test_reading_loads_neither_storm_nor_a_solver(archive):
    import subprocess
    import sys

    code = (
        f"import sys; from ratherthan.io.umb import read_umb; read_umb({str(archive())!r});"
        "print([m for m in ('stormpy', 'scipy', 'numba') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
