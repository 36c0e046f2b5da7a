"""The rows of some states of an archive enter; a Block leaves: their part of the graph and of the equations, and its rim.

A block *owns* the states ``first … last - 1``. It reads some more on either side, the *overlap*, and solves them, too: what it
assumes of its rim then hardly matters to the states that it owns, and few rounds suffice (restricted additive Schwarz; Cai and
Sarkis 1999). The *rim* are the states outside that branches lead to. Locally states are numbered from 0, those of the rim last.

References
----------
X.-C. Cai, M. Sarkis, A Restricted Additive Schwarz Preconditioner for General Sparse Linear Systems, SIAM J. Sci. Comput. 21(2), 1999.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ratherthan.cluster.archive import Described, described, read_parts
from ratherthan.errors import ModelError, PropertyError, SourceError
from ratherthan.io._umb_index import Annotation, Kind
from ratherthan.model.mdp import MDP, Floats, Reward
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.problem import Problem
from ratherthan.model.watch import room_for
from ratherthan.solve.goal import Goal, goal_of

__all__ = ["Block", "Extent", "read_block"]

States = npt.NDArray[np.int64]
PER_BRANCH, PER_CHOICE, PER_STATE = 60, 80, 120
"""Bytes that a block takes while it is worked on."""


@dataclass(frozen=True, kw_only=True)
class Extent:
    """Which rows a block is made of.

    Parameters
    ----------
    run : str
        Tells one solving from another.
    path : str
    number : int
    first, last : int
        The states that it owns.
    begin, end : int
        Those with the overlap.
    objective : ExpectedCost
    """

    run: str
    path: str
    number: int
    first: int
    last: int
    begin: int
    end: int
    objective: ExpectedCost


@dataclass(eq=False)
class Block:
    """The rows of an extent, resolved for its objective; m states inside, r in the rim."""

    extent: Extent
    goal: Goal
    rim: States  # [r], ascending
    action: npt.NDArray[np.int64]  # [C], numbers of the archive; -1 in the rim
    first_choice: int  # of the archive
    memory: dict[str, object] = field(default_factory=dict)  # what is worth keeping between two rounds

    @property
    def inside(self) -> int:
        """The number of states inside, m."""
        return self.extent.end - self.extent.begin

    @cached_property
    def owned(self) -> slice:
        """The local numbers of the states that it owns."""
        return slice(self.extent.first - self.extent.begin, self.extent.last - self.extent.begin)

    @cached_property
    def needs(self) -> States:
        """The states of others whose numbers it must know: the rim, and where branches of its own states lead."""
        index = self.goal.index
        own = slice(
            index.choice_to_branches[index.state_to_choices[self.owned.start]],
            index.choice_to_branches[index.state_to_choices[self.owned.stop]],
        )
        target = index.branch_to_target[own]
        outside = (target < self.owned.start) | (target >= self.owned.stop)
        overlap = np.unique(target[outside & (target < self.inside)]).astype(np.int64) + self.extent.begin
        return np.union1d(overlap, self.rim)

    @cached_property
    def needed(self) -> States:
        """The local numbers of `needs`."""
        return self.local(self.needs)

    @cached_property
    def from_rim(self) -> npt.NDArray[np.bool_]:
        """Which of `needs` are in the rim."""
        mask: npt.NDArray[np.bool_] = self.needed >= self.inside
        return mask

    def local(self, states: States) -> States:
        """Return the local numbers of states inside or in the rim."""
        inside = (states >= self.extent.begin) & (states < self.extent.end)
        return np.where(inside, states - self.extent.begin, self.inside + np.searchsorted(self.rim, states))

    def everywhere(self, local: States) -> States:
        """Return the numbers in the archive of local states."""
        outside = local >= self.inside
        numbers = local + self.extent.begin
        numbers[outside] = self.rim[local[outside] - self.inside]
        return numbers


def read_block(extent: Extent) -> Block:
    """Read a block.

    Raises
    ------
    SourceError, ModelError, PropertyError
        As for a whole model; places are counted from the block's first state.
    """
    about = described(extent.path)
    header, begin, end = about.header, extent.begin, extent.end
    offsets = _offsets(about, "state-to-choices.bin", slice(begin, end), (header.states, header.choices))
    choices = slice(int(offsets[0]), int(offsets[-1]))
    branch_offsets = _offsets(about, "choice-to-branches.bin", choices, (header.choices, header.branches))
    branches = slice(int(branch_offsets[0]), int(branch_offsets[-1]))
    count = branches.stop - branches.start
    room_for(
        PER_BRANCH * count + PER_CHOICE * (choices.stop - choices.start) + PER_STATE * (end - begin),
        f"A block of {end - begin} states",
    )
    where = {"states": slice(begin, end), "choices": choices, "branches": branches}
    try:
        return _made(about, extent, where, offsets - offsets[0], branch_offsets - branch_offsets[0])
    except (ModelError, PropertyError) as error:
        # What the model says of its states counts from the block's first one.
        message = f"{error.message} States are counted from {begin} there."
        raise type(error)(message, path=extent.path, begin=begin) from error


def _made(
    about: Described, extent: Extent, where: dict[str, slice], state_to_choices: States, choice_to_branches: States
) -> Block:
    header, path = about.header, about.path
    reward = None if extent.objective.reward is None else _reward(about, extent.objective.reward)
    parts = {
        "branch-to-target.bin": _bytes_of(where["branches"], 8),
        "branch-to-probability.bin": _bytes_of(where["branches"], 8),
        "actions/choices/values.bin": _bytes_of(where["choices"], 4),
    }
    for label in header.labels:
        parts[f"{label.folder}/states/values.bin"] = (where["states"].start // 8, -(-where["states"].stop // 8))
    for entity in reward.applies_to if reward is not None else ():
        parts[f"{reward.folder}/{entity}/values.bin"] = _bytes_of(where[entity], 8)  # type: ignore[union-attr]
    data = read_parts(path, parts)
    if "branch-to-target.bin" not in data:
        raise SourceError(
            f"'{path}' must have branch-to-target.bin, but it is missing. Write the archive anew.", path=path
        )
    target = data["branch-to-target.bin"].view("<u8")
    if len(target) and int(target.max()) >= header.states:
        raise ModelError(f"Targets of branches must lie below {header.states}, got {int(target.max())} in '{path}'.")
    if (np.diff(state_to_choices) == 0).any():
        raise SourceError(
            f"Every state must have a choice to be solved in blocks, but state "
            f"{where['states'].start + int(np.argmin(np.diff(state_to_choices)))} of '{path}' has none. "
            f"Write it anew: ratherthan convert '{path}' model.umb.",
            path=path,
        )
    target = target.astype(np.int64)
    outside = (target < extent.begin) | (target >= extent.end)
    rim = np.unique(target[outside])
    inside = extent.end - extent.begin
    local = np.where(outside, 0, target - extent.begin)
    local[outside] = inside + np.searchsorted(rim, target[outside])
    r, m, b = len(rim), len(choice_to_branches) - 1, len(local)
    ones = np.ones(r)
    probability = _doubles(data.get("branch-to-probability.bin"), header.probability, b, path)
    mdp = MDP(
        state_to_choices=np.concatenate([state_to_choices, state_to_choices[-1] + np.arange(1, r + 1)]),
        choice_to_branches=np.concatenate([choice_to_branches, b + np.arange(1, r + 1)]),
        branch_to_target=np.concatenate([local, inside + np.arange(r)]),
        branch_to_probability=np.concatenate([probability, ones]),
        labels={label.name: _bits(data.get(f"{label.folder}/states/values.bin"), extent, r) for label in header.labels},
        rewards={} if reward is None else {reward.name: _values(data, reward, (inside, m, b), r, path)},
        initial=np.array([0]),  # there must be one; nobody asks which
    )
    goal = goal_of(Problem(mdp=mdp, definitions=about.outline().definitions, source=path), extent.objective)
    action = data.get("actions/choices/values.bin")
    numbers = np.full(m, -1) if action is None else action.view("<u4").astype(np.int64)
    return Block(
        extent=extent,
        goal=goal,
        rim=rim,
        action=np.concatenate([numbers, np.full(r, -1)]),
        first_choice=where["choices"].start,
    )


def _bytes_of(rows: slice, size: int) -> tuple[int, int]:
    return size * rows.start, size * rows.stop


def _offsets(about: Described, name: str, wanted: slice, counts: tuple[int, int]) -> States:
    """Return the offsets of some rows and the next, as they stand in the archive."""
    begin, end, (rows, entries) = wanted.start, wanted.stop, counts
    if name not in about.sizes:
        if rows != entries:
            raise SourceError(
                f"'{about.path}' must have {name}, but it is missing. Write the archive anew.", path=about.path
            )
        return np.arange(begin, end + 1)
    offsets = read_parts(about.path, {name: (8 * begin, 8 * (end + 1))})[name].view("<u8").astype(np.int64)
    if offsets[0] < 0 or offsets[-1] > entries or (np.diff(offsets) < 0).any():
        raise ModelError(f"'{name}' of '{about.path}' must rise from 0 to {entries}. Write the archive anew.")
    return offsets


def _reward(about: Described, name: str) -> Annotation:
    found = next((reward for reward in about.header.rewards if reward.name == name), None)
    if found is None:
        there = ", ".join(f"'{reward.name}'" for reward in about.header.rewards) or "none"
        raise PropertyError(
            f"In blocks the objective must be about one reward of the model, got '{name}'; there are: {there}.",
            reward=name,
        )
    return found


def _doubles(data: npt.NDArray[np.uint8] | None, kind: Kind | None, count: int, path: str) -> Floats:
    if kind is None or data is None:
        return np.ones(count)
    if kind.name != "double":
        raise SourceError(
            f"In blocks numbers must be doubles, but '{path}' has the type {kind.name}. "
            f"Write it anew: ratherthan convert '{path}' model.umb.",
            path=path,
        )
    return data.view("<f8")


def _bits(data: npt.NDArray[np.uint8] | None, extent: Extent, rim: int) -> npt.NDArray[np.bool_]:
    """Return whether the states of an extent have a label; those of the rim are asked of their owners."""
    mask = np.zeros(extent.end - extent.begin + rim, dtype=np.bool_)
    if data is not None:
        bits = np.unpackbits(data, bitorder="little").view(np.bool_)
        skipped = extent.begin % 8
        mask[: extent.end - extent.begin] = bits[skipped : skipped + extent.end - extent.begin]
    return mask


def _values(
    data: dict[str, npt.NDArray[np.uint8]], reward: Annotation, counts: tuple[int, int, int], rim: int, path: str
) -> Reward:
    parts = {}
    for entity, part, count in zip(
        ("states", "choices", "branches"), ("state", "choice", "branch"), counts, strict=True
    ):
        found = data.get(f"{reward.folder}/{entity}/values.bin")
        if found is not None:
            parts[part] = np.concatenate([_doubles(found, reward.kind, count, path), np.zeros(rim)])
    return Reward(**parts)
