"""A problem as Storm built it enters; the same problem leaves under the names that its source has."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.io._constants import Constant
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem

__all__ = ["RANGE_BIT", "Symbolic", "finished"]

RANGE_BIT = "_OutOfBoundsBit"
"""The variable by which Storm tells that another one left its range."""
_LOCATION = "_loc_"
_UNNAMED_REWARD, _ITS_NAME = "default", "reward"


@dataclass(frozen=True, kw_only=True)
class Symbolic:
    """A model that Storm has read but not built.

    Parameters
    ----------
    program : stormpy program or model
    shown : str
        How the source is called in errors.
    constants : sequence of Constant
    locations : mapping of str to sequence of str
        The names of the locations of each automaton.
    unnamed_reward : bool
        Whether a reward structure has no name.
    order : sequence of str
        The state variables in the order of their declaration, where it is known; Storm lists truth values first.
    """

    program: Any
    shown: str
    constants: Sequence[Constant]
    locations: Mapping[str, Sequence[str]]
    unnamed_reward: bool = False
    order: Sequence[str] = ()


def finished(problem: Problem, symbolic: Symbolic, hidden: Collection[str]) -> Problem:
    """Name locations by their names and the nameless reward by ours, and note what Storm repaired."""
    mdp = problem.mdp
    columns = _Columns(mdp.names.variables, symbolic, {RANGE_BIT, *hidden})
    rewards = dict(mdp.rewards)
    if symbolic.unnamed_reward and _UNNAMED_REWARD in rewards and _ITS_NAME not in rewards:
        rewards = {_ITS_NAME if name == _UNNAMED_REWARD else name: reward for name, reward in rewards.items()}
    notes = problem.notes
    stuck = int(np.count_nonzero(mdp.labels["deadlock"])) if "deadlock" in mdp.labels else 0
    if stuck:
        states = "1 state had" if stuck == 1 else f"{stuck} states had"
        notes += (f'{states} no choice in the source and got a loop in place (label "deadlock").',)
    mdp = replace(mdp, names=StateNames(count=mdp.states, variables=columns), rewards=rewards)
    return replace(problem, mdp=mdp, source=symbolic.shown, notes=notes)


class _Columns(Mapping[str, npt.NDArray[np.generic]]):
    """State variables without those that tell nothing, decoded on demand; locations as their names.

    `in_declared_order` says whether they come in the order in which the source declares them.
    """

    def __init__(
        self, inner: Mapping[str, npt.NDArray[np.generic]], symbolic: Symbolic, hidden: Collection[str]
    ) -> None:
        self.inner = inner
        self.words = {_LOCATION + name: np.array(names, dtype=object) for name, names in symbolic.locations.items()}
        self.decoded: dict[str, npt.NDArray[np.generic]] = {}
        self.names = tuple(
            name for name in inner if name not in hidden and not (name in self.words and self._stays(name))
        )
        self.in_declared_order = sorted(symbolic.order) == sorted(self.names)
        if self.in_declared_order:
            self.names = tuple(symbolic.order)

    def _stays(self, name: str) -> bool:
        return bool((self.inner[name] == self.inner[name][0]).all())

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __getitem__(self, name: str) -> npt.NDArray[np.generic]:
        if name not in self.names:
            raise KeyError(name)
        if name not in self.words:
            return self.inner[name]
        if name not in self.decoded:
            self.decoded[name] = np.asarray(self.words[name][self.inner[name].astype(np.int64)])
        return self.decoded[name]
