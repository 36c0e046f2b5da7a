"""Nothing enters; how much memory this process holds and how much it can still have leave, as the system tells it.

On Linux the files of the kernel are read: they cost some microseconds, and they tell of a container, too, whose memory is
limited by a control group (version 1 or 2) far below what the machine has. Elsewhere psutil is asked.
"""

from __future__ import annotations

import functools
import os
import sys
from pathlib import Path

__all__ = ["memory_held", "memory_left", "size_text"]

UNITS = ((2**40, "TB"), (2**30, "GB"), (2**20, "MB"), (2**10, "kB"))
PROC = Path("/proc")
GROUPS = Path("/sys/fs/cgroup")


def memory_held() -> int:
    """Return the bytes of memory that this process holds, 0 where the system does not tell."""
    if sys.platform != "linux":
        return _told("rss")
    try:
        return int((PROC / "self/statm").read_bytes().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return 0


def memory_left() -> float:
    """Return the bytes of memory that the machine can still give, and its container; ∞ where the system does not tell."""
    if sys.platform != "linux":
        return _told("available") or float("inf")
    left = float("inf")
    try:
        lines = (PROC / "meminfo").read_bytes().splitlines()
        left = next(int(line.split()[1]) * 1024 for line in lines if line.startswith(b"MemAvailable:"))
    except (OSError, ValueError, IndexError, StopIteration):
        pass
    return min([left, *(_group_left(*group) for group in _groups(PROC, GROUPS))])


def _told(what: str) -> int:
    """Return what psutil tells, 0 where it does not."""
    try:
        import psutil
    except ImportError:
        return 0
    told = psutil.Process().memory_info().rss if what == "rss" else psutil.virtual_memory().available
    return int(told)


@functools.cache
def _groups(proc: Path, groups: Path) -> tuple[tuple[Path, str, str, str], ...]:
    """Return the control groups that hold this process's memory, with the names of limit, use, and cache that can be given up."""
    try:
        lines = (proc / "self/cgroup").read_text(encoding="utf-8").splitlines()
    except OSError:
        return ()
    found = []
    for line in lines:
        number, _, rest = line.partition(":")
        kinds, _, place = rest.partition(":")
        if number == "0" and not kinds:
            root, names = groups, ("memory.max", "memory.current", "inactive_file")
        elif "memory" in kinds.split(","):
            root, names = groups / "memory", ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        else:
            continue
        folder = root / place.lstrip("/")
        # In a container the place is often that of the host, and what is mounted is the container's own group.
        folders = (
            [root]
            if not folder.is_dir()
            else [folder, *(above for above in folder.parents if root in above.parents), root]
        )
        found += [(folder, *names) for folder in folders if (folder / names[0]).is_file()]
    return tuple(found)


def _group_left(folder: Path, limit: str, use: str, cache: str) -> float:
    """Return what a control group leaves, ∞ where it has no limit."""
    try:
        most = (folder / limit).read_text(encoding="ascii").strip()
        if most == "max" or int(most) >= 1 << 60:  # version 1 writes a very large number
            return float("inf")
        used = int((folder / use).read_text(encoding="ascii"))
        pairs = (line.split() for line in (folder / "memory.stat").read_text(encoding="ascii").splitlines())
        given_up = next((int(pair[1]) for pair in pairs if pair[0] == cache), 0)
    except (OSError, ValueError, IndexError):
        return float("inf")
    return float(max(int(most) - used + given_up, 0))


def size_text(size: float) -> str:
    """Return a number of bytes in a unit that suits.

    Examples
    --------
    >>> size_text(3 * 2**30), size_text(1500 * 2**10)
    ('3 GB', '1.46 MB')
    """
    unit, name = next(((unit, name) for unit, name in UNITS if size >= unit), (1, "bytes"))
    return f"{size / unit:.3g} {name}"
