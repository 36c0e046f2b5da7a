"""A UMB archive enters; what its index tells leaves, and the bytes of some rows: never the whole.

Of a plain archive the rows are read where they lie. A packed one is read through from its beginning, and what is not wanted is
dropped on the way: that takes a reader per pass the time of unpacking, and no more memory. ``ratherthan convert`` writes plain
ones where that time matters (packing ``"none"`` in Python).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._extras import Extras, problem_of
from ratherthan.io._files import Limits, open_source
from ratherthan.io._tar import Archive, is_tar
from ratherthan.io._umb_archive import OWN, read_header
from ratherthan.io._umb_index import Header
from ratherthan.io._unpacking import packing_of
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.problem import Problem

__all__ = ["Described", "described", "read_parts"]

Bytes = npt.NDArray[np.uint8]
ANY_SIZE = Limits(most_bytes=1 << 62, most_ratio=float("inf"))
"""What is read in parts need not fit into memory."""
WHOLE = (
    OWN + "problem.json",
    "actions/choices/string-mapping.bin",
    "actions/choices/strings.bin",
    "state-is-initial.bin",
)
"""The small files that are read whole."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Described:
    """What an archive tells of its model beside the rows.

    Parameters
    ----------
    path : str
    header : Header
    sizes : mapping from str to int
        The files in it.
    small : mapping from str to array of uint8
        The small ones.
    """

    path: str
    header: Header
    sizes: Mapping[str, int]
    small: Mapping[str, Bytes]

    @property
    def actions(self) -> tuple[str, ...]:
        """The names of the actions, as the numbers in the archive count them."""
        from ratherthan.io._strings import PackedStrings

        offsets, block = (self.small.get(f"actions/choices/{name}.bin") for name in ("string-mapping", "strings"))
        if offsets is None:
            return tuple(f"a{number}" for number in range(self.header.choice_actions))
        strings = PackedStrings(
            offsets.view("<u8"), np.zeros(0, np.uint8) if block is None else block, f"actions in '{self.path}'"
        )
        return tuple(strings)

    @property
    def initial(self) -> npt.NDArray[np.int64]:
        """The initial states."""
        bits = self.small.get("state-is-initial.bin")
        if bits is None:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(np.unpackbits(bits, count=self.header.states, bitorder="little"))

    def outline(self) -> Problem:
        """Return a problem of one state with the labels, rewards, objective and words of this one: for reading properties."""
        one = np.ones(1)
        parts = {"states": "state", "choices": "choice", "branches": "branch"}
        rewards = {
            reward.name: Reward(**{parts[entity]: one for entity in reward.applies_to})
            for reward in self.header.rewards
        }
        mdp = MDP(
            state_to_choices=np.array([0, 1]),
            choice_to_branches=np.array([0, 1]),
            branch_to_target=np.array([0]),
            branch_to_probability=one,
            labels={label.name: np.ones(1, dtype=np.bool_) for label in self.header.labels},
            rewards=rewards,
            initial=np.array([0]),
        )
        extras = Extras(shown=self.path)
        main = self.small.get(OWN + "problem.json")
        if main is not None:
            extras = Extras.unpacked({"problem.json": main}, self.path)
            kept = {
                key: value for key, value in extras.table.items() if key not in ("names", "texts", "labels", "world")
            }
            extras = replace(extras, table=kept)
        return problem_of(mdp, extras, source=self.path, notes=())


def described(path: str | os.PathLike[str]) -> Described:
    """Return what an archive tells of its model.

    Raises
    ------
    SourceError
        Where it is no such archive, or damaged.
    """
    shown = os.fspath(path)
    with open_source(path) as file:
        head = file.read(512)
        if not packing_of(head) and not is_tar(head):
            raise SourceError(
                f"What is solved in blocks must be a UMB archive (.umb), but '{shown}' is none. "
                f"Convert it: ratherthan convert '{shown}' model.umb.",
                path=shown,
            )
        header = read_header(file, ANY_SIZE, shown)
        sizes, small = {}, {}
        archive = Archive(file, ANY_SIZE, shown)
        for member in archive.members():
            sizes[member.name] = member.size
            if member.name in WHOLE:
                small[member.name] = archive.read(member)
    return Described(path=shown, header=header, sizes=sizes, small=small)


def read_parts(path: str, parts: Mapping[str, tuple[int, int]]) -> dict[str, Bytes]:
    """Return the bytes from the first to the second number of each of some files of an archive.

    Parameters
    ----------
    path : str
    parts : mapping from str to pair of int
        Files that are not there are left out.
    """
    with open_source(path) as file:
        packed = bool(packing_of(file.read(512)))
        if packed:
            found = {}
            archive = Archive(file, ANY_SIZE, path)
            for member in archive.members():
                if member.name in parts:
                    found[member.name] = archive.read_part(*_inside(parts[member.name], member.size, member.name, path))
                    if len(found) == len(parts):
                        break
            return found
        status = os.fstat(file.fileno())
        places = _places(path, status.st_size, status.st_mtime_ns)
        found = {}
        for name in sorted(set(parts) & set(places), key=lambda name: places[name][0]):
            begin, end = _inside(parts[name], places[name][1], name, path)
            file.seek(places[name][0] + begin)
            found[name] = np.fromfile(file, dtype=np.uint8, count=end - begin)
            if len(found[name]) != end - begin:
                raise SourceError(f"An archive must be whole, but '{path}' breaks off. Copy it anew.", path=path)
        return found


def _inside(part: tuple[int, int], size: int, name: str, path: str) -> tuple[int, int]:
    begin, end = part
    if not 0 <= begin <= end <= size:
        raise SourceError(
            f"'{name}' of '{path}' must have at least {end} bytes by the counts in index.json, got {size}. "
            "Write the archive anew.",
            path=path,
            member=name,
        )
    return begin, end


@lru_cache(maxsize=4)
def _places(path: str, size: int, changed: int) -> dict[str, tuple[int, int]]:  # noqa: ARG001 - they tell the versions of a file apart
    """Return where each file of a plain archive begins, and how long it is."""
    with open_source(path) as file:
        archive = Archive(file, ANY_SIZE, path)
        return {member.name: (file.tell(), member.size) for member in archive.members()}
