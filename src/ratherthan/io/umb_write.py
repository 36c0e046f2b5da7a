"""A Problem enters, an archive of the Unified Markov Binary format (``.umb``) leaves, whole or not at all.

Storm reads what is written here, and reading it back gives the same Problem: what the format has no place for lies in
the archive's own folder ``ratherthan/`` (`ratherthan.io._extras`), which other tools pass over. The same Problem gives
the same bytes.

Text goes there too: Storm 2.0 refuses an archive with variables of the format's type ``string``, because it spells that
type ``String``. A state variable that is text is therefore written as a number, and what the numbers stand for in our
folder; names of states are there only.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._extras import packed_extras
from ratherthan.io._files import write_atomically
from ratherthan.io._strings import pack_strings
from ratherthan.io._tar_writer import PACKINGS, Numbers, write_tar
from ratherthan.io._umb_valuations import pack_columns
from ratherthan.model.mdp import MDP, Bools
from ratherthan.model.problem import Problem

__all__ = ["write_umb"]

OFTEN_RESERVED = "init"
"""Storm calls the initial states so, and refuses a label of that name."""


def write_umb(problem: Problem, path: str | os.PathLike[str], *, packing: str = "gzip", players: int = 1) -> None:
    """Write a model as an archive of the Unified Markov Binary format, version 1.

    Parameters
    ----------
    problem : Problem
    path : path
        Replaced only once the new file is whole.
    packing : str
        ``"gzip"``, ``"xz"`` (smaller and much slower) or ``"none"``: ten times as large, and read by mapping it into memory.
    players : int
        1, an MDP; or 0 for a model with one choice per state, which is then called a DTMC.

    Raises
    ------
    SourceError
        Where the file cannot be written, or `packing` is another.
    """
    if packing not in PACKINGS:
        raise SourceError(f"A UMB file must be packed by one of {', '.join(PACKINGS)}, got '{packing}'.")
    files = _files(problem, players)
    with write_atomically(path) as file:
        write_tar(file, files, packing)


def _files(problem: Problem, players: int) -> dict[str, bytes | Numbers]:
    """Return every file of the archive by name, the index first."""
    mdp = problem.mdp
    files: dict[str, bytes | Numbers] = {
        "state-to-choices.bin": _words(mdp.state_to_choices),
        "state-is-initial.bin": _bits(np.isin(np.arange(mdp.states), mdp.initial)),
        "choice-to-branches.bin": _words(mdp.choice_to_branches),
        "branch-to-target.bin": _words(mdp.branch_to_target),
        "branch-to-probability.bin": Numbers(mdp.branch_to_probability, "<f8"),
    }
    action_count = _add_actions(mdp, files)
    held_back = {name: mask for name, mask in mdp.labels.items() if name == OFTEN_RESERVED}
    annotations = {
        "aps": _add_labels({name: mask for name, mask in mdp.labels.items() if name not in held_back}, files),
        "rewards": _add_rewards(mdp, files),
    }
    valuations, texts = _add_variables(mdp, files)
    own = packed_extras(problem, names=mdp.names.strings, texts=texts, labels=held_back)
    for name, data in own.items():
        files[f"ratherthan/{name}"] = data
    index: dict[str, Any] = {
        "format-version": 1,
        "format-revision": 0,
        "file-data": {"tool": "ratherthan"},
        "transition-system": {
            "time": "discrete",
            "#players": players,
            "#states": mdp.states,
            "#initial-states": len(mdp.initial),
            "#choices": mdp.choices,
            "#choice-actions": action_count,
            "#branches": mdp.branches,
            "#branch-actions": 0,
            "#observations": 0,
            "branch-probability-type": {"type": "double", "size": 64},
        },
        "annotations": {group: table for group, table in annotations.items() if table},
    }
    if valuations is not None:
        index["valuations"] = {"states": valuations}
    return {"index.json": json.dumps(index, indent=1).encode("ascii")} | files


def _words(array: npt.NDArray[Any]) -> Numbers:
    return Numbers(array, "<u8")


def _bits(mask: Bools) -> bytes:
    """Return a set as one bit each, in words of 64."""
    return np.packbits(np.pad(mask, (0, -len(mask) % 64)), bitorder="little").tobytes()


def _add_actions(mdp: MDP, files: dict[str, bytes | Numbers]) -> int:
    """Add the actions, an empty one last where some choice has no name; return how many there are."""
    unnamed = mdp.choice_to_action < 0
    actions = list(mdp.actions)
    if not actions and unnamed.all():
        return 0
    if unnamed.any() and "" not in actions:
        actions.append("")
    if unnamed.any():
        numbers = np.where(unnamed, actions.index(""), mdp.choice_to_action)
    else:
        numbers = mdp.choice_to_action
    offsets, block = pack_strings(actions)
    files["actions/choices/values.bin"] = Numbers(numbers, "<u4")
    files["actions/choices/string-mapping.bin"] = _words(offsets)
    files["actions/choices/strings.bin"] = block.tobytes()
    return len(actions)


def _identifiers(names: Iterable[str]) -> dict[str, str]:
    """Return an identifier of small letters, digits, ``-`` and ``_`` for every name, each once."""
    taken: set[str] = set()
    identifiers = {}
    for name in names:
        plain = re.sub(r"[^0-9a-z_-]", "_", name.lower())[:60] or "_"
        unique, count = plain, 2
        while unique in taken:
            unique, count = f"{plain}-{count}", count + 1
        taken.add(unique)
        identifiers[name] = unique
    return identifiers


def _add_labels(labels: dict[str, Bools], files: dict[str, bytes | Numbers]) -> dict[str, Any]:
    table = {}
    for name, identifier in _identifiers(labels).items():
        files[f"annotations/aps/{identifier}/states/values.bin"] = _bits(labels[name])
        table[identifier] = {"alias": name, "applies-to": ["states"], "type": {"type": "bool", "size": 1}}
    return table


def _add_rewards(mdp: MDP, files: dict[str, bytes | Numbers]) -> dict[str, Any]:
    table = {}
    for name, identifier in _identifiers(mdp.rewards).items():
        applies = []
        for part, values in mdp.rewards[name].parts():
            entity = {"state": "states", "choice": "choices", "branch": "branches"}[part]
            files[f"annotations/rewards/{identifier}/{entity}/values.bin"] = Numbers(values, "<f8")
            applies.append(entity)
        kind = {"type": "double", "size": 64}
        table[identifier] = {"alias": name, "applies-to": applies or ["states"], "type": kind}
    return table


def _add_variables(mdp: MDP, files: dict[str, bytes | Numbers]) -> tuple[dict[str, Any] | None, dict[str, list[str]]]:
    """Add the state variables; return their description, and what the numbers of those that are text stand for."""
    if mdp.names.strings is not None or not mdp.names.variables:
        return None, {}
    described, records, texts = pack_columns(mdp.names.variables, mdp.states)
    files["valuations/states/valuations.bin"] = records.tobytes()
    return {"unique": False, "classes": [{"variables": described}]}, texts
