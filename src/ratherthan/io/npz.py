"""A NumPy archive (``.npz``) enters, a Problem leaves, and back.

Written are these arrays; those marked * are there only where the model has them:

========================================= ============================================================================
``state_to_choices``, ``choice_to_branches``, ``branch_to_target``, ``branch_to_probability``, ``choice_to_action``,
``initial``                               the fields of the MDP
``actions``                               the names of the actions, text ``[A]``
``label:NAME`` *                          truth values ``[S]``
``reward:NAME:PART`` *                    numbers on each PART: ``state``, ``choice`` or ``branch``; an empty list on the part
                                          ``nothing`` for a reward that is 0 everywhere
``names`` *                               the names of the states, text ``[S]``
``variable:NAME`` *                       a state variable ``[S]``
``ratherthan/FILE`` *                     map, objective and words, as bytes: see `ratherthan.io._extras`
========================================= ============================================================================

Read are also the other forms of `from_arrays` by the names of its arguments: ``transitions``, ``rewards`` (or
``reward:NAME``), ``order``, ``s_indices``, ``a_indices``, ``actions``, ``names``, ``label:NAME``, ``initial``.

The archive is a stranger: sizes are checked before anything is unpacked, and pickled objects are refused.
"""

from __future__ import annotations

import mmap
import os
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from ratherthan.errors import RatherthanError, SourceError
from ratherthan.io._extras import Extras, packed_extras, problem_of
from ratherthan.io._files import Limits, open_source, write_atomically
from ratherthan.io._npy import array_from, mapped_array
from ratherthan.io.arrays import ROW_FIELDS, from_arrays
from ratherthan.io.grids.names import CellNames
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem
from ratherthan.model.watch import look

__all__ = ["read_npz", "write_npz"]

Arrays = dict[str, npt.NDArray[Any]]
OWN = "ratherthan/"
NOTHING = "nothing"
"""The part of a reward that is 0 everywhere."""

ARGUMENTS = ("transitions", "rewards", "order", "s_indices", "a_indices", "actions", "names", "initial")
LEVEL = 1
"""Higher levels of packing take three to six times as long and save a few per cent of a model, or nothing."""
MAPPED = 1 << 20
"""From how many bytes on an array that is not packed is mapped into memory."""
ALIGNED, ZIP64_FIELD, FILLER_FIELD = 64, 20, 0xD935
PACKINGS = {"deflate": zipfile.ZIP_DEFLATED, "none": zipfile.ZIP_STORED}
FAMILIES = ("label:", "reward:", "variable:", OWN)


def read_npz(path: str | os.PathLike[str], *, limits: Limits | None = None) -> Problem:
    """Read a model from a NumPy archive.

    Parameters
    ----------
    path : path
    limits : Limits, optional
        What the archive may unpack to.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        Where the file is missing, damaged, of another kind, too large, holds pickled objects or unknown arrays.
    ModelError
        Where the model in it breaks a law.
    """
    shown = os.fspath(path)
    arrays = load_arrays(path, limits or Limits())
    try:
        return _problem(arrays, shown)
    except RatherthanError as error:
        error.place.setdefault("path", shown)
        raise


def _problem(arrays: Arrays, shown: str) -> Problem:
    unknown = [name for name in arrays if name not in ARGUMENTS + ROW_FIELDS and not name.startswith(FAMILIES)]
    if unknown or not {"state_to_choices", "transitions"} & set(arrays):
        came = f"unknown arrays: {', '.join(unknown[:5])}" if unknown else f"only {', '.join(arrays) or 'nothing'}"
        raise SourceError(
            f"A NumPy archive must hold state_to_choices … or transitions, and what belongs to them; '{shown}' has {came}. "
            "Save the arrays under the names of from_arrays.",
            path=shown,
        )
    given: dict[str, Any] = {name: arrays[name] for name in ARGUMENTS + ROW_FIELDS if name in arrays}
    for name in ("actions", "names"):
        if name in given:
            given[name] = _texts(given[name], name, shown)
    if "order" in given:
        given["order"] = str(given["order"])
    rewards = _rewards(arrays, shown, parts="state_to_choices" in arrays)
    if rewards and "rewards" in given:
        raise SourceError(f"'{shown}' must name its rewards in one way, got both rewards and reward:NAME.", path=shown)
    labels = {name.removeprefix("label:"): array for name, array in arrays.items() if name.startswith("label:")}
    problem = from_arrays(**given | ({"rewards": rewards} if rewards else {}), labels=labels)
    own = {name.removeprefix(OWN): array for name, array in arrays.items() if name.startswith(OWN)}
    if any(array.dtype != np.uint8 or array.ndim != 1 for array in own.values()):
        raise SourceError(f"'{shown}' must hold bytes under {OWN}, got other arrays. Write the file anew.", path=shown)
    extras = Extras.unpacked(own, shown)
    mdp = problem.mdp
    variables = {
        name.removeprefix("variable:"): array for name, array in arrays.items() if name.startswith("variable:")
    }
    own_names = extras.names(mdp.states)
    if own_names is not None:
        mdp = replace(mdp, names=StateNames(count=mdp.states, strings=own_names))
    elif variables:
        mdp = replace(mdp, names=_with_variables(variables, mdp.states, shown))
    return problem_of(mdp, extras, source=shown, notes=problem.notes)


def _rewards(arrays: Arrays, shown: str, *, parts: bool) -> dict[str, Any]:
    """Return the rewards by name, as tables of parts where the model is in compressed rows."""
    rewards: dict[str, Any] = {}
    for key, array in arrays.items():
        if not key.startswith("reward:"):
            continue
        name = key.removeprefix("reward:")
        if not parts:
            rewards[name] = array
            continue
        name, colon, part = name.rpartition(":")
        if not colon:
            raise SourceError(
                f"'{shown}' must name rewards reward:NAME:PART, got '{key}'. Rename the array.", path=shown
            )
        rewards.setdefault(name, {}).update({} if part == NOTHING else {part: array})
    return rewards


def _texts(array: npt.NDArray[Any], name: str, shown: str) -> list[str]:
    if array.ndim != 1 or (array.dtype.kind != "U" and array.size):
        raise SourceError(
            f"'{name}' of '{shown}' must be a list of text, got {array.dtype} of shape {array.shape}.", path=shown
        )
    texts: list[str] = array.tolist()
    return texts


def _with_variables(variables: Mapping[str, npt.NDArray[Any]], states: int, shown: str) -> StateNames:
    for name, column in variables.items():
        if column.shape != (states,) or column.dtype.kind not in "biufU":
            raise SourceError(
                f"State variable '{name}' of '{shown}' must have one value per state ({states}), got {column.dtype} of "
                f"shape {column.shape}.",
                path=shown,
            )
    return StateNames(count=states, variables=variables)


def load_arrays(path: str | os.PathLike[str], limits: Limits) -> Arrays:
    """Return the arrays of a NumPy archive by name, each checked before it is unpacked.

    Parameters
    ----------
    path : path
    limits : Limits

    Raises
    ------
    SourceError
        Where it is no zip archive, damaged, too large, or holds pickled objects or other files.
    """
    shown = os.fspath(path)
    arrays: Arrays = {}
    with open_source(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                members = archive.infolist()
                total = sum(member.file_size for member in members)
                limits.check_bytes(total, shown)
                limits.check_ratio(total, os.fstat(file.fileno()).st_size, shown)
                for member in members:
                    name = member.filename.removesuffix(".npy")
                    if name == member.filename or name in arrays:
                        raise SourceError(
                            f"A NumPy archive must hold arrays (.npy), each once, but '{shown}' has '{member.filename}'.",
                            path=shown,
                        )
                    called = f"'{member.filename}' of '{shown}'"
                    mapped = _mapped(file, member)
                    found = None if mapped is None else mapped_array(mapped, called)
                    if found is None:
                        with archive.open(member) as stream:
                            found = array_from(stream, member.file_size, called)
                    arrays[name] = found
        except (
            zipfile.BadZipFile,
            zlib.error,
            EOFError,
            NotImplementedError,
            RuntimeError,
            ValueError,
            OverflowError,
        ) as error:
            if isinstance(error, RatherthanError):
                raise
            raise SourceError(
                f"A NumPy archive must be a whole zip archive of arrays, but '{shown}' is not: {error}. Save it anew.",
                path=shown,
            ) from error
    return arrays


def _mapped(file: BinaryIO, member: zipfile.ZipInfo) -> npt.NDArray[np.uint8] | None:
    """Return a large member that is not packed as a part of the mapped file, its checksum checked; else None."""
    if member.compress_type != zipfile.ZIP_STORED or member.file_size < MAPPED or member.flag_bits & 1:
        return None
    whole = np.frombuffer(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ), dtype=np.uint8)
    head = whole[member.header_offset : member.header_offset + 30].tobytes()
    if len(head) < 30 or not head.startswith(b"PK\x03\x04"):
        return None
    begin = member.header_offset + 30 + sum(struct.unpack("<HH", head[26:30]))
    data = whole[begin : begin + member.file_size]
    if len(data) != member.file_size or zlib.crc32(data.data) != member.CRC:
        return None  # what is wrong is told where it is read
    return data


def _filler(at: int, name: str) -> bytes:
    """Return an extra field that lets the data of a member that begins at this place begin at a multiple of 64 bytes."""
    head = 30 + len(name.encode("utf-8")) + ZIP64_FIELD + 4
    count = -(at + head) % ALIGNED
    return struct.pack("<HH", FILLER_FIELD, count) + bytes(count)


def write_npz(problem: Problem, path: str | os.PathLike[str], *, packing: str = "deflate") -> None:
    """Write a model as a NumPy archive, whole or not at all; the same Problem gives the same bytes.

    Parameters
    ----------
    problem : Problem
    path : path
        Replaced only once the new file is whole.
    packing : str
        ``"deflate"`` or ``"none"``: ten times as large, and read by mapping it into memory.

    Raises
    ------
    SourceError
        Where the file cannot be written, or `packing` is another.
    """
    if packing not in PACKINGS:
        raise SourceError(f"A NumPy archive must be packed by one of {', '.join(PACKINGS)}, got '{packing}'.")
    mdp = problem.mdp
    arrays: Arrays = {name: getattr(mdp, name) for name in (*ROW_FIELDS, "initial")}
    arrays["actions"] = np.array(mdp.actions, dtype=np.str_)
    arrays |= {f"label:{name}": mask for name, mask in mdp.labels.items()}
    for name, reward in mdp.rewards.items():
        parts = dict(reward.parts()) or {NOTHING: np.zeros(0)}
        arrays |= {f"reward:{name}:{part}": values for part, values in parts.items()}
    by_cells = isinstance(mdp.names.strings, CellNames)
    if mdp.names.strings is not None and not by_cells:
        arrays["names"] = np.array(list(mdp.names.strings), dtype=np.str_)
    for name, column in mdp.names.variables.items() if mdp.names.strings is None else ():
        column = np.asarray(column)
        arrays[f"variable:{name}"] = column.astype(np.str_) if column.dtype.kind in "OT" else column
    for name, data in packed_extras(problem, names=mdp.names.strings if by_cells else None).items():
        arrays[OWN + name] = np.frombuffer(data, dtype=np.uint8)
    for name in arrays:
        if "\x00" in name or any("\ud800" <= letter <= "\udfff" for letter in name):
            raise SourceError(f"Names must be whole Unicode text to be written, got {name!r}. Rename it.")
    with write_atomically(path) as file, zipfile.ZipFile(file, "w", PACKINGS[packing], compresslevel=LEVEL) as archive:
        for name, array in arrays.items():
            look()
            member = zipfile.ZipInfo(f"{name}.npy")
            member.compress_type, member._compresslevel = PACKINGS[packing], LEVEL  # type: ignore[attr-defined]  # noqa: SLF001 - no other way to it before Python 3.13
            if packing == "none":
                member.extra = _filler(file.tell(), member.filename)
            with archive.open(member, "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.ascontiguousarray(array), allow_pickle=False)
