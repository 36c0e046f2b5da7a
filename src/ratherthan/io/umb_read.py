"""An archive of the Unified Markov Binary format (``.umb``) enters, a Problem leaves.

The format is the one of pmc-tools/umb, version 1, in which Storm and PRISM exchange models: a tar archive, plain or
packed by gzip or xz, of an ``index.json`` with every count and type, and one binary file per array. A file that is
absent has a meaning: offsets are 0, 1, 2 …, labels are false everywhere, rewards are 0.

Read are MDPs, and DTMCs as MDPs with one choice per state. Fractions become the nearest doubles. States without choices
get a loop in place that earns nothing. Each of these is said in the notes of the Problem. Refused, with the reason:
continuous time, games, partial observation, intervals.

The archive is a stranger: the index is read and checked first, and with it the size of every other file is known, so
that none is read, nor memory taken for it, unless it has that size and all of them together keep to `Limits`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import ModelError, RatherthanError, SourceError
from ratherthan.io._extras import Extras, problem_of
from ratherthan.io._files import Limits, open_source
from ratherthan.io._numbers import doubles_of_rationals
from ratherthan.io._rows import Rows, checked_offsets, checked_targets, with_loops
from ratherthan.io._strings import PackedStrings
from ratherthan.io._tar import is_tar
from ratherthan.io._umb_archive import OWN, read_contents, read_header
from ratherthan.io._umb_index import Annotation, Header, Kind
from ratherthan.io._umb_valuations import Columns
from ratherthan.io._unpacking import packing_of
from ratherthan.model.mdp import MDP, Floats, Ints, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem

__all__ = ["read_umb"]

Array = npt.NDArray[Any]


def read_umb(path: str | os.PathLike[str], *, limits: Limits | None = None) -> Problem:
    """Read a model from an archive of the Unified Markov Binary format.

    Parameters
    ----------
    path : path
    limits : Limits, optional
        What the archive may unpack to.

    Returns
    -------
    Problem
        What was repaired or left out on the way is in its `notes`.

    Raises
    ------
    SourceError
        Where the file is missing, damaged, of another kind, too large, or breaks the format.
    ModelError
        Where the model in it breaks a law: offsets that fall, targets out of range, probabilities that do not sum to 1.
    """
    limits, shown = limits or Limits(), os.fspath(path)
    with open_source(path) as file:
        head = file.read(512)
        if not packing_of(head) and not is_tar(head):
            raise SourceError(
                f"A UMB file must be a tar archive, plain or packed by gzip or xz, but '{shown}' is neither. "
                "Check what it is, and name it with the right suffix.",
                path=shown,
            )
        header = read_header(file, limits, shown)
        data = read_contents(file, header, limits, shown)
    try:
        return _Model(header, data, shown).problem()
    except RatherthanError as error:
        error.place.setdefault("path", shown)
        raise


class _Model:
    """Puts the arrays of an archive together."""

    def __init__(self, header: Header, data: dict[str, Array], shown: str) -> None:
        self.header, self.data, self.shown = header, data, shown
        self.notes = list(header.notes)

    def problem(self) -> Problem:
        """Return the whole: the model, and what of ours lies beside it."""
        header = self.header
        actions, choice_to_action = self.actions()
        rows = Rows(
            state_to_choices=self.offsets("state-to-choices.bin", header.states, header.choices, "state", "choices"),
            choice_to_branches=self.offsets(
                "choice-to-branches.bin", header.choices, header.branches, "choice", "branches"
            ),
            branch_to_target=self.targets(),
            branch_to_probability=self.probabilities(),
            choice_to_action=choice_to_action,
            rewards={reward.name: self.reward(reward) for reward in header.rewards},
        )
        rows, repairs = with_loops(rows)
        if header.players == 0:
            if header.choices > header.states:
                raise ModelError(
                    f"A DTMC must have one choice per state, but '{self.shown}' has {header.states} states and "
                    f"{header.choices} choices. Give it one player to make it an MDP."
                )
            self.notes.append("The source is a DTMC: every state got one choice.")
        self.notes += repairs
        extras = Extras.unpacked(
            {name[len(OWN) :]: value for name, value in self.data.items() if name.startswith(OWN)}, self.shown
        )
        labels = {label.name: self.bits(f"{label.folder}/states/values.bin") for label in header.labels}
        mdp = MDP(
            state_to_choices=rows.state_to_choices,
            choice_to_branches=rows.choice_to_branches,
            branch_to_target=rows.branch_to_target,
            branch_to_probability=rows.branch_to_probability,
            choice_to_action=rows.choice_to_action,
            actions=actions,
            labels=extras.all_labels(labels, header.states),
            rewards=rows.rewards,
            initial=self.initial(),
            names=self.names(extras),
        )
        return problem_of(mdp, extras, source=self.shown, notes=tuple(self.notes))

    def offsets(self, name: str, rows: int, entries: int, row: str, entry: str) -> Ints:
        """Return a CSR file as offsets; absent, each row has one entry."""
        data = self.data.get(name)
        if data is not None:
            return checked_offsets(data, entries, name)
        if rows != entries:
            raise SourceError(
                f"'{self.shown}' must have {name}, as it has {rows} {row}s but {entries} {entry}. Write the archive anew.",
                path=self.shown,
            )
        return np.arange(rows + 1, dtype=np.int64)

    def targets(self) -> Ints:
        data = self.data.get("branch-to-target.bin")
        if data is None:
            raise SourceError(
                f"'{self.shown}' must have branch-to-target.bin, but it is missing. Write the archive anew.",
                path=self.shown,
            )
        return checked_targets(data, self.header.states, "Targets of branches")

    def probabilities(self) -> Floats:
        """Return the probability of every branch; absent, it is 1 and no choice may have two branches."""
        kind, data = self.header.probability, self.data.get("branch-to-probability.bin")
        if kind is not None and data is not None:
            return _numbers(data, kind)
        if self.header.branches != self.header.choices:
            raise ModelError(
                f"Without branch-to-probability.bin every choice must have one branch, but '{self.shown}' has "
                f"{self.header.choices} choices and {self.header.branches} branches. Give the branches probabilities."
            )
        return np.ones(self.header.branches)

    def actions(self) -> tuple[tuple[str, ...], Ints]:
        """Return the names of the actions, and the action of every choice, -1 where its name is empty."""
        count, choices = self.header.choice_actions, self.header.choices
        numbers, strings = self.data.get("actions/choices/values.bin"), self.strings("actions/choices")
        if count == 0 or (strings is None and count > choices):
            return (), np.full(choices, -1)
        action: Ints = np.zeros(choices, dtype=np.int32)
        if numbers is not None:
            action = checked_targets(numbers.view("<u4"), count, "Actions of choices")
        if strings is None:
            self.notes.append(f"The actions have no names in the source and are called a0 … a{count - 1}.")
            return tuple(f"a{number}" for number in range(count)), action
        if len(strings) != count:
            raise SourceError(
                f"There must be one name per action ({count}), got {len(strings)}. Write the archive anew."
            )
        named = np.array([bool(string) for string in strings])
        position = np.where(named, np.cumsum(named) - 1, -1).astype(np.int32)
        return tuple(string for string in strings if string), position[action]

    def strings(self, folder: str) -> PackedStrings | None:
        """Return the strings of a folder, None where it has none."""
        offsets, block = self.data.get(f"{folder}/string-mapping.bin"), self.data.get(f"{folder}/strings.bin")
        if offsets is None and (block is None or len(block) == 0):
            return None
        if offsets is None or len(offsets) % 8:
            raise SourceError(
                f"'{self.shown}' must have {folder}/string-mapping.bin with its strings, in words of 8 bytes. "
                "Write the archive anew.",
                path=self.shown,
            )
        return PackedStrings(
            offsets.view("<u8"), np.zeros(0, np.uint8) if block is None else block, f"{folder} in '{self.shown}'"
        )

    def bits(self, name: str) -> npt.NDArray[np.bool_]:
        """Return a set of states; absent, it is empty."""
        data = self.data.get(name)
        if data is None:
            return np.zeros(self.header.states, dtype=bool)
        return np.unpackbits(data, count=self.header.states, bitorder="little").view(np.bool_)

    def reward(self, reward: Annotation) -> Reward:
        parts: dict[str, Floats] = {}
        for entity in reward.applies_to:
            data = self.data.get(f"{reward.folder}/{entity}/values.bin")
            if data is not None:
                parts[{"states": "state", "choices": "choice", "branches": "branch"}[entity]] = _numbers(
                    data, reward.kind
                )
        return Reward(**parts)

    def initial(self) -> npt.NDArray[np.int64]:
        """Return the initial states; where the source names none, any state may be the start."""
        found = np.flatnonzero(self.bits("state-is-initial.bin"))
        if len(found) != self.header.initial_states:
            raise SourceError(
                f"'{self.shown}' must mark {self.header.initial_states} initial states as index.json says, got {len(found)}. "
                "Write the archive anew.",
                path=self.shown,
            )
        if len(found) == 0:
            self.notes.append("The source names no initial state: any state may be the start.")
            return np.arange(self.header.states)
        return found

    def names(self, extras: Extras) -> StateNames:
        """Return how states are called: by names of our own, or by their variables."""
        described, states = self.header.valuations, self.header.states
        records = self.data.get("valuations/states/valuations.bin")
        own = extras.names(states)
        if own is not None:
            return StateNames(count=states, strings=own)
        if described is None or records is None:
            return StateNames(count=states)
        class_data = self.data.get("valuations/states/valuation-to-class.bin")
        class_of_state = None
        sizes = np.asarray(described.record_bytes, dtype=np.int64)
        demanded = int(sizes[0]) * states
        if len(sizes) > 1:
            numbers = np.zeros(4 * states, dtype=np.uint8) if class_data is None else class_data
            class_of_state = checked_targets(numbers.view("<u4"), len(sizes), "Valuation classes")
            demanded = int(sizes @ np.bincount(class_of_state, minlength=len(sizes)))
        if len(records) != demanded:
            raise SourceError(
                f"'valuations/states/valuations.bin' of '{self.shown}' must have {demanded} bytes, got {len(records)}. "
                "Write the archive anew.",
                path=self.shown,
            )
        strings: Sequence[str] = self.strings("valuations/states") or ()
        columns = Columns(
            described, records, states=states, class_of_state=class_of_state, strings=strings, texts=extras.texts()
        )
        return StateNames(count=states, variables=columns)


def _numbers(data: Array, kind: Kind) -> Floats:
    """Return stored numbers as doubles, fractions as the nearest."""
    if kind.name == "double":
        return data.view("<f8")
    if kind.name == "rational":
        words = data.view("<u8").reshape(-1, kind.bits // 64)
        half = words.shape[1] // 2
        return doubles_of_rationals(words[:, :half], words[:, half:])
    return data.view("<i8" if kind.name == "int" else "<u8").astype(np.float64)
