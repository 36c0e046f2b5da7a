"""Compiled kernels: they compute what the plain ones do, are made once, and nothing that happens to the files breaks them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from importlib import import_module
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ratherthan.model.compiling import fast, shipped, source, store, tally
from ratherthan.model.compiling.fast import Fast, digest_of
from ratherthan.model.compiling.signature import UnusualError, described, taken
from ratherthan.model.memory import memory_held

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"), reason="compiling is switched off"
)


class Pair(NamedTuple):
    """Two arrays and a number."""

    one: np.ndarray
    other: np.ndarray
    count: int


def folded(pair, weights, truths, scale, least, flag):
    """Take arrays, a tuple, numbers and a truth; give all kinds back."""
    total = 0.0
    kept = np.zeros(len(weights), np.float64)
    marks = np.zeros(len(weights), np.bool_)
    for i in range(len(weights)):
        if truths[i] or (flag and weights[i] > least):
            kept[i] = scale * weights[i] + pair.one[i]
            marks[i] = True
            total += kept[i]
    return Pair(pair.one[: pair.count].copy(), kept, len(pair.other)), total, marks, total > 0.0


def columns(table):
    """Sum the columns of a table."""
    sums = np.zeros(table.shape[1])
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            sums[j] += table[i, j]
    return sums


def begun(values, count):
    """Return the beginning of an argument itself."""
    return values[:count]


def twice(values):
    """Return the same memory under two names."""
    made = values.copy()
    return made, made[1:]


def filled(values, number):
    """Write to what is given and return nothing."""
    for i in range(len(values)):
        values[i] = number


def shared_out(total, parts):
    """Divide."""
    return total // parts


def copied_into(values, others):
    """Copy one array over another, which must be as long."""
    values[:] = others


def huge(count):
    """Ask for memory."""
    return np.zeros(count, np.float64)


@pytest.fixture(autouse=True)
def own_folder(monkeypatch, tmp_path_factory):
    """Every test of this module compiles into one folder of its own."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path_factory.getbasetemp() / "code"))


@pytest.fixture(scope="module")
def compiled():
    """Return what compiles a kernel by the short way, and fails where it goes another."""
    made = {}

    def get(kernel):
        return made.setdefault(kernel, Fast(kernel))

    tally.plain.clear()
    yield get
    assert "folded" not in tally.plain
    assert "twice" not in tally.plain


@given(data=st.data(), length=st.integers(0, 6), flag=st.booleans(), least=st.integers(-(2**40), 2**40))
def test_compiled_and_plain_kernels_compute_the_same(compiled, data, length, flag, least):
    numbers = hnp.arrays(np.float64, length, elements=st.floats(-1e6, 1e6))
    one, weights = data.draw(numbers), data.draw(numbers)
    truths = data.draw(hnp.arrays(np.bool_, length))
    pair = Pair(one, np.arange(3, dtype=np.int32), data.draw(st.integers(0, length)))
    for given_pair, number in ((pair, 0.5), (pair, np.float64(0.5))):
        wanted = folded(given_pair, weights, truths, number, least, flag)
        got = compiled(folded)(given_pair, weights, truths, number, least, flag)
        assert type(got) is tuple
        assert type(got[0]) is Pair
        assert (got[0].count, got[1], got[3]) == (wanted[0].count, wanted[1], wanted[3])
        assert [type(part) for part in (got[0].count, got[1], got[3])] == [int, float, bool]
        for mine, theirs in zip((*got[0][:2], got[2]), (*wanted[0][:2], wanted[2]), strict=True):
            np.testing.assert_array_equal(mine, theirs, strict=True)
            assert mine.flags.writeable


@pytest.mark.parametrize("order", ["C", "F", "strided", "locked"])
def test_tables_are_read_in_any_order(compiled, order):
    table = np.arange(24.0).reshape(4, 6)
    if order == "F":
        table = np.asfortranarray(table)
    elif order == "strided":
        table = np.arange(96.0).reshape(8, 12)[::2, ::2]
    elif order == "locked":
        table.flags.writeable = False
    np.testing.assert_array_equal(compiled(columns)(table), table.sum(axis=0))


def test_what_comes_back_outlives_the_kernel_and_its_arguments(compiled):
    one, other = compiled(twice)(np.arange(5.0))
    assert np.shares_memory(one, other)
    del one
    np.testing.assert_array_equal(other, [1.0, 2.0, 3.0, 4.0])
    part = compiled(begun)(np.arange(1000.0), 10)
    np.testing.assert_array_equal(part, np.arange(10.0))


def test_a_part_of_a_locked_argument_is_locked(compiled):
    values = np.arange(4.0)
    assert compiled(begun)(values, 2).flags.writeable
    values.flags.writeable = False
    part = compiled(begun)(values, 2)
    assert np.shares_memory(part, values)
    assert not part.flags.writeable


def test_memory_is_given_back(compiled):
    kernel = compiled(huge)
    kernel(10)
    before = memory_held()
    for _ in range(100):
        assert kernel(2_000_000)[-1] == 0.0  # 16 MB each
    assert memory_held() - before < 400 * 2**20


def test_a_locked_array_is_never_written_to(compiled):
    values = np.zeros(3)
    compiled(filled)(values, 1.0)
    assert values.tolist() == [1.0, 1.0, 1.0]
    values.flags.writeable = False
    with pytest.raises(Exception, match=r"(?i)readonly|read-only"):
        compiled(filled)(values, 2.0)
    assert values.tolist() == [1.0, 1.0, 1.0]


def test_errors_of_kernels_keep_their_names(compiled):
    with pytest.raises(ZeroDivisionError):
        compiled(shared_out)(1, 0)
    with pytest.raises(ValueError, match="negative dimensions"):
        compiled(huge)(-1)
    with pytest.raises(MemoryError):
        compiled(huge)(2**58)
    with pytest.raises(ValueError, match="fit"):
        compiled(copied_into)(np.zeros(3), np.zeros(4))


@pytest.mark.parametrize("argument", [None, "text", 1j, np.zeros(2, complex), np.zeros(()), [1.0], ()])
def test_unusual_arguments_are_left_to_numba(argument):
    with pytest.raises(UnusualError):
        taken((argument,))


def test_numba_takes_over_what_the_short_way_does_not_know(monkeypatch):
    complex_numbers = np.arange(4, dtype=complex)
    np.testing.assert_array_equal(Fast(begun)(complex_numbers, 2), [0.0, 1.0])
    assert "complex128" in tally.plain["begun"]

    def another_machine(*_):
        raise UnusualError("another kind of machine")

    monkeypatch.setattr(fast, "machine", another_machine)
    np.testing.assert_array_equal(Fast(columns)(np.ones((2, 3))), [2.0, 2.0, 2.0])
    assert tally.plain["columns"] == "another kind of machine"


def test_threads_that_ask_at_once_get_the_same(compiled):
    kernel, answers = Fast(twice), []

    def ask():
        answers.extend(float(kernel(np.arange(1000.0))[0].sum()) for _ in range(50))

    threads = [threading.Thread(target=ask) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [499500.0] * 300


def test_types_are_told_apart_and_what_is_locked_is_not():
    locked = np.zeros(2)
    locked.flags.writeable = False
    same = [taken((np.zeros(2), 3))[0], taken((np.ones(5), np.int32(3)))[0], taken((locked, 2**62))[0]]
    others = [
        (np.zeros(2, np.float32), 3),
        (np.zeros((2, 2)), 3),
        (np.zeros(4)[::2], 3),
        (np.zeros(2), 3.0),
        (np.zeros(2), True),
    ]
    others += [((np.zeros(2), 3),), (Pair(np.zeros(2), np.zeros(2), 1), 3)]
    assert len({described(types) for types in same}) == 1
    assert len({described(taken(arguments)[0]) for arguments in others} | {described(same[0])}) == 1 + len(others)


def writes_by_another_name(values, others, room):
    """Write through other names."""
    mine = values
    _, second = room
    mine[0] = others[0]
    second[0] += 1


def writes_by_method(values, others):
    """Write by a method and a function."""
    values.sort()
    np.copyto(others, values)


def writes_to_its_own(values, begin):
    """Write only to what it made."""
    made = values.copy()
    free = begin[:-1].copy()
    made[0] = len(values) + free[0]
    return made


@pytest.mark.parametrize(
    ("kernel", "places"),
    [
        (writes_by_another_name, {0, 2}),
        (writes_by_method, {0, 1}),
        (writes_to_its_own, set()),
        (filled, {0}),
        (folded, set()),
    ],
)
def test_what_a_kernel_writes_to_is_seen_in_its_text(kernel, places):
    assert source.written(kernel) == places


def test_another_text_constant_or_type_is_another_kernel():
    rooms = []
    for text in ("def kernel(x):\n    return x * FACTOR\n", "def kernel(x):\n    return FACTOR * x\n"):
        for factor in (2, 3):
            room = {"FACTOR": factor, "__name__": "room"}
            exec(compile(text, "<nowhere>", "exec"), room)
            rooms.append(room["kernel"])
    digests = {digest_of(kernel, types) for kernel in rooms for types in ("<i8", "<f8")}
    assert len(digests) == 8


def test_what_changed_since_it_was_loaded_is_not_taken_for_the_new_text(tmp_path, monkeypatch):
    path = tmp_path / "changing.py"
    path.write_text("def kernel(x):\n    return x + 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    kernel = import_module("changing").kernel
    path.write_text("def kernel(x):\n    return x + 2\n")
    assert not source.is_current(kernel)
    assert Fast(kernel)(1) == 2
    assert not list(store.folder().glob("changing*"))
    assert source.is_current(folded)


def test_every_kernel_that_is_shipped_is_the_one_of_the_source():
    """What differs is compiled on every new machine: `make kernels` writes the archive anew."""
    stale = []
    for name, head in shipped.heads().items():
        room, _, kernel = head["kernel"].partition(":")
        function = getattr(import_module(room), kernel, None)
        if function is None or not name.endswith(digest_of(function, head["types"])):
            stale.append(head["kernel"])
    assert len(shipped.heads()) > 20
    assert stale == []


USES = """
import json, sys
import numpy as np
from ratherthan.model.compiling import compiled, tally
from ratherthan.model._kernels import sorted_by
target = np.random.default_rng(0).integers(0, 50, 20_000)
begin, value = compiled(sorted_by, 20_000)(target, np.arange(20_000), 50)
right = bool((value == np.argsort(target, kind="stable")).all())
print(json.dumps({"right": right, "kept": tally.kept, "made": tally.shipped + tally.compiled, "numba": "numba" in sys.modules}))
"""


def begin_use(folder, **more):
    env = {key: value for key, value in os.environ.items() if not key.startswith(("RATHERTHAN", "NUMBA"))}
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", USES],
        env=env | {"NUMBA_CACHE_DIR": str(folder)} | more,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def used(process):
    out, err = process.communicate()
    assert (process.returncode, err) == (0, "")
    answer = json.loads(out)
    assert answer.pop("right")
    return answer


def test_a_second_process_compiles_nothing_and_loads_no_compiler(tmp_path):
    assert len(used(begin_use(tmp_path))["made"]) == 1
    assert used(begin_use(tmp_path)) == {"kept": ["sorted_by"], "made": [], "numba": False}


@pytest.mark.parametrize("harm", ["empty", "cut", "changed", "a folder", "another file's"])
def test_a_damaged_file_is_made_anew(tmp_path, harm):
    used(begin_use(tmp_path))
    (path,) = (tmp_path / "ratherthan").glob("*.code")
    whole = path.read_bytes()
    if harm == "a folder":
        path.unlink()
        path.mkdir()
    else:
        bytes_of = {
            "empty": b"",
            "cut": whole[:-1],
            "changed": whole[:-9] + b"x" + whole[-8:],
            "another file's": b"x" * 9999,
        }
        path.write_bytes(bytes_of[harm])
    assert len(used(begin_use(tmp_path))["made"]) == 1
    if harm != "a folder":
        assert used(begin_use(tmp_path))["made"] == []


def test_what_numba_alone_kept_may_be_damaged_too(tmp_path):
    used(begin_use(tmp_path, RATHERTHAN_COMPILE="numba"))
    kept = [path for path in tmp_path.rglob("*.nb?") if path.is_file()]
    assert {path.suffix for path in kept} == {".nbi", ".nbc"}
    for path in kept:
        path.write_bytes(path.read_bytes()[:-20])
    assert used(begin_use(tmp_path, RATHERTHAN_COMPILE="numba"))["numba"]


def test_processes_that_begin_at_once_do_not_disturb_each_other(tmp_path):
    for process in [begin_use(tmp_path) for _ in range(3)]:
        used(process)
    assert len(list((tmp_path / "ratherthan").iterdir())) == 1


def test_where_nothing_can_be_written_the_answer_is_the_same(tmp_path):
    (tmp_path / "file").touch()
    nowhere = str(tmp_path / "file" / "below")
    answer = used(begin_use(nowhere, XDG_CACHE_HOME=nowhere, HOME=nowhere, TMPDIR=str(tmp_path)))
    assert len(answer["made"]) == 1
    assert [path.name for path in tmp_path.iterdir() if path.is_dir()] == [f"ratherthan-{os.getuid()}"]


def test_code_is_not_taken_from_a_folder_that_others_write_to(tmp_path):
    place = tmp_path / "ratherthan-1"
    assert store._is_private(place, os.getuid())
    place.chmod(0o777)
    assert not store._is_private(place, os.getuid())
    place.chmod(0o700)
    assert not store._is_private(place, os.getuid() + 1)
    link = tmp_path / "link"
    link.symlink_to(place)
    assert not store._is_private(link, os.getuid())


def test_what_nobody_uses_is_removed_when_another_takes_its_place(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    store.keep("room.kernel-old", {}, b"1")
    store.keep("room.kernel-used", {}, b"2")
    store.keep("room.other-old", {}, b"3")
    long_ago = 1_000_000_000.0
    for name in ("room.kernel-old", "room.other-old"):
        os.utime(store.folder() / (name + store.SUFFIX), (long_ago, long_ago))
    store.keep("room.kernel-new", {}, b"4")
    assert [path.name.removesuffix(store.SUFFIX) for path in store.held()] == [
        "room.kernel-new",
        "room.kernel-used",
        "room.other-old",
    ]
    assert store.kept("room.kernel-used") == ({}, b"2")
    assert store.clear() > 0
    assert store.held() == []


def test_a_word_is_said_once_when_compiling_takes_long(monkeypatch):
    said = []
    monkeypatch.setattr(tally, "seconds", 0.0)
    monkeypatch.setattr(tally, "announce", said.append)
    fast._took(0.6)
    assert said == []
    fast._took(0.6)
    fast._took(0.6)
    assert len(said) == 1
    assert "once" in said[0]


def test_the_end_of_a_process_is_silent_while_arrays_of_kernels_are_alive(tmp_path):
    code = USES + "\nimport builtins\nbuiltins.alive = [begin, value]\nclass Late:\n    begin = begin\n"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


def test_a_kernel_that_is_forgotten_takes_nothing_down_with_it():
    code = """
import gc
import numpy as np
from ratherthan.model._kernels import reversed_rows
from ratherthan.model.compiling.fast import Fast
from ratherthan.model.compiling import _kernels
for _ in range(20):
    kernel = Fast(reversed_rows)
    kernel(np.array([0, 1, 2]), np.array([1, 0], dtype=np.int32))
    del kernel
    gc.collect()
    assert str(_kernels._target_machine().target_data)
print("still here")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["still", "here"]
