"""Limits: what they refuse, when they hold, and what they say."""

from __future__ import annotations

import time

import pytest

import ratherthan as rt
from ratherthan.model import memory, watch


@pytest.mark.parametrize(
    "given", [{"seconds": 0}, {"seconds": -1.0}, {"seconds": float("nan")}, {"seconds": float("inf")}, {"seconds": "10"},
              {"seconds": True}, {"memory": 0}, {"memory": -5}, {"memory": "4GB"}]
)  # fmt: skip
def test_a_limit_that_is_no_number_above_zero_is_refused_in_a_sentence(given):
    with pytest.raises(rt.QuestionError, match=r"A limit must be a number of (seconds|bytes) above 0, got"):
        rt.Limits(**given)


def looked_late() -> None:
    """Look when the time is over."""
    time.sleep(0.02)
    watch.look()


def test_a_limit_of_time_is_told_with_what_was_being_done():
    with (
        pytest.raises(rt.LimitError, match=r"^The time limit of 0.01 s was reached while reading 'x'\.$") as stopped,
        rt.watching(rt.Limits(seconds=0.01)),
        watch.phase("reading 'x'"),
    ):
        looked_late()
    assert (stopped.value.limit, stopped.value.phase) == ("time", "reading 'x'")


def test_a_limit_ends_with_its_block():
    with rt.watching(rt.Limits(seconds=0.01)):
        pass
    time.sleep(0.02)
    watch.look()


def test_of_two_limits_the_one_that_is_reached_first_holds():
    for seconds in ((0.01, 100.0), (100.0, 0.01)):
        outer, inner = (rt.watching(rt.Limits(seconds=one)) for one in seconds)
        with pytest.raises(rt.LimitError, match=r"of 0\.01 s"), outer, inner:
            looked_late()


def test_an_inner_limit_of_memory_cannot_widen_an_outer_one():
    with rt.watching(rt.Limits(memory=10**9)), rt.watching(rt.Limits(memory=10**12)) as inner:
        assert inner.limits.memory == 10**9


def test_more_memory_than_is_permitted_is_told():
    said = r"The memory limit of 1 kB was reached: .* were held"
    with pytest.raises(rt.LimitError, match=said) as stopped, rt.watching(rt.Limits(memory=1024)):
        watch.look()
    assert stopped.value.limit == "memory"


def test_an_array_that_is_not_granted_under_a_limit_is_that_limit():
    said = "The memory limit of 1 TB was reached while counting"
    limits = rt.watching(rt.Limits(memory=2**40))
    with pytest.raises(rt.LimitError, match=said), limits, watch.phase("counting"):
        raise MemoryError
    with pytest.raises(MemoryError), rt.watching(rt.Limits(seconds=100)):
        raise MemoryError


def test_what_has_no_room_is_refused_before_it_is_made():
    with pytest.raises(
        rt.LimitError, match=r"^A model of 10 states must have about 1e\+03 TB of memory, but this machine"
    ):
        watch.room_for(2.0**50 * 0.977, "A model of 10 states")
    with rt.watching(rt.Limits(memory=memory.memory_held() + (1 << 20))):
        watch.room_for(1000, "A small thing")
        with pytest.raises(rt.LimitError, match="but the limit of .* leaves"):
            watch.room_for(1 << 24, "A large thing")


def test_what_is_told_reaches_whoever_watches():
    told: list[str] = []
    with rt.watching(rt.Limits(), tell=told.append):
        watch.look("half way")
        with rt.watching(rt.Limits(seconds=100)), watch.phase("solving"):
            watch.look("nearly there")
    assert told == ["half way", "Solving", "nearly there"]


def test_where_nobody_watches_nothing_is_kept():
    watch.keep(guess=[1, 2, 3])
    assert watch.current().board.kept == {}
    with rt.watching(rt.Limits(seconds=100)):
        watch.keep(guess=[1])
        assert watch.current().board.kept == {"guess": [1]}
    assert watch.current().board.kept == {}


def test_a_limit_that_is_lifted_holds_again_afterwards():
    with rt.watching(rt.Limits(seconds=0.01)):
        time.sleep(0.02)
        with watch.unlimited():
            watch.look()
        with pytest.raises(rt.LimitError):
            watch.look()


def group(folder, files):
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="ascii")


@pytest.mark.parametrize(
    ("line", "place", "names"),
    [
        ("0::/box\n", "box", ("memory.max", "memory.current", "inactive_file")),
        ("4:cpu:/box\n3:memory:/box\n", "memory/box", ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")),
        ("0::/not/mounted/here\n", ".", ("memory.max", "memory.current", "inactive_file")),
    ],
)  # fmt: skip
def test_a_container_leaves_what_its_control_group_leaves(tmp_path, line, place, names):
    proc, groups = tmp_path / "proc", tmp_path / "cgroup"
    group(proc / "self", {"cgroup": line})
    group(groups / place, {names[0]: "1000000\n", names[1]: "700000\n", "memory.stat": f"anon 1\n{names[2]} 200000\n"})
    memory._groups.cache_clear()
    found = memory._groups(proc, groups)
    assert min(memory._group_left(*one) for one in found) == 500000.0
    (groups / place / names[0]).write_text("max" if "max" in names[0] else str(2**63 - 4096), encoding="ascii")
    assert min(memory._group_left(*one) for one in found) == float("inf")
    memory._groups.cache_clear()


def test_a_system_that_tells_nothing_has_no_end_of_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "PROC", tmp_path)
    monkeypatch.setattr(memory, "GROUPS", tmp_path)
    memory._groups.cache_clear()
    if memory.sys.platform == "linux":
        assert memory.memory_left() == float("inf")
        assert memory.memory_held() == 0
    memory._groups.cache_clear()
