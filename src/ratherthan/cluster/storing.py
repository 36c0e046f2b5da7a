"""A model solved in blocks enters, a file with the values of all its states leaves: ``.npz``, written block by block.

The arrays are ``values``, ``lower`` and ``upper`` (float64) and ``policy`` (int64, the choice taken, -1 where there is none), ``[S]`` each.
"""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import numpy as np

from ratherthan.cluster import working
from ratherthan.cluster.block import States
from ratherthan.cluster.blocks import TRIES, Blocks, always
from ratherthan.errors import SourceError, UnsolvedError
from ratherthan.io._files import check_target, write_atomically
from ratherthan.model.mdp import Floats

__all__ = ["check_place", "store"]

ARRAYS = {"values": "<f8", "lower": "<f8", "upper": "<f8", "policy": "<i8"}


def store(solved: Blocks, path: str | os.PathLike[str]) -> None:
    """Write the values and bounds of all states, and the choice taken at each; whole or not at all.

    Raises
    ------
    SourceError
        Where the file cannot be written, or has another suffix.
    """
    check_place(path)
    for _ in range(TRIES):
        try:
            _store(solved, path)
        except _ChangedError:
            solved.settle()
        else:
            return
    raise UnsolvedError("Workers must live long enough to tell what they solved, but they were lost again and again.")


def check_place(path: str | os.PathLike[str]) -> None:
    """Raise SourceError where values cannot be written, before anything long begins."""
    if Path(path).suffix.lower() != ".npz":
        raise SourceError(f"Values must go to a file .npz, got '{os.fspath(path)}'.", path=os.fspath(path))
    check_target(path)


class _ChangedError(Exception):
    """A block was solved anew since it was checked."""


def _store(solved: Blocks, path: str | os.PathLike[str]) -> None:
    """Write the file; nothing is written where a block tells other values than were checked."""
    count = solved.about.header.states
    with write_atomically(path) as file, zipfile.ZipFile(file, "w") as archive:
        for name, kind in ARRAYS.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                head = {"descr": kind, "fortran_order": False, "shape": (count,)}
                np.lib.format.write_array_header_1_0(member, head)
                for k in range(len(solved.extents)):
                    values, choice, digest = solved.every(working.values_of, solved.final, always(None), which=[k])[0]
                    if solved.shares is not None and digest != solved.digests[k]:
                        raise _ChangedError
                    member.write(_part(solved, name, values, choice))


def _part(solved: Blocks, name: str, values: Floats, choice: States) -> bytes:
    lower, upper = solved.bounds(values)
    array = {"values": values, "lower": lower, "upper": upper, "policy": choice}[name]
    return np.ascontiguousarray(array, dtype=ARRAYS[name]).tobytes()
