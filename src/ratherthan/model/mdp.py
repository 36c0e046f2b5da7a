"""Arrays enter, a checked and locked Markov decision process leaves.

An MDP is (S, s0, A, δ, r). It is kept as compressed rows, states → choices → branches, in the words of the Unified
Markov Binary format: a *choice* is a state with one of its enabled actions, a *branch* is one successor of a choice
with its probability. Shapes use S, C, B, A as in docs/conventions.md: states, choices, branches, actions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from ratherthan.errors import ModelError
from ratherthan.model.names import StateNames

__all__ = ["MDP", "Bools", "Floats", "Ints", "Reward"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32] | npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

SUM_TOLERANCE = 1e-8
"""How far the probabilities of a choice may be from 1 in a file; what is nearer is rescaled to 1."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Reward:
    """One reward structure: what is earned (or paid) per step, in its own unit.

    Parameters
    ----------
    state, choice, branch : array of float, optional
        Earned in a state whatever is chosen ``[S]``, by a choice ``[C]``, on a branch ``[B]``; ``None`` is 0 everywhere.
    """

    state: Floats | None = None  # [S]
    choice: Floats | None = None  # [C]
    branch: Floats | None = None  # [B]

    def parts(self) -> Iterator[tuple[str, Floats]]:
        """Yield ``("state" | "choice" | "branch", array)`` for the parts that are given."""
        for part in ("state", "choice", "branch"):
            values = getattr(self, part)
            if values is not None:
                yield part, values


@dataclass(frozen=True, kw_only=True, eq=False)
class MDP:
    """A Markov decision process in compressed rows.

    Arrays that own their memory are taken over and locked; a view of memory that somebody can still write is copied.
    Branches of probability 0 are dropped. Probabilities that miss 1 by no more than 1e-8 are rescaled to sum to 1.

    Parameters
    ----------
    state_to_choices : array of int, ``[S+1]``
        The choices of state s are ``state_to_choices[s]`` up to, not including, ``state_to_choices[s+1]``; at least one.
    choice_to_branches : array of int, ``[C+1]``
        The branches of choice c, likewise; at least one.
    branch_to_target : array of int, ``[B]``
        The successor of each branch, 0 … S-1.
    branch_to_probability : array of float, ``[B]``
        Its probability, in (0, 1].
    choice_to_action : array of int, ``[C]``, optional
        The action of each choice as an index into `actions`; -1 where the choice has no name. All -1 by default.
    actions : sequence of str
        The names of the actions, ``[A]``.
    labels : mapping of str to array of bool, ``[S]``
        Named sets of states.
    rewards : mapping of str to Reward
        Several reward structures side by side.
    initial : array of int, ``[I]``
        The initial states.
    names : StateNames, optional
        How states are called.

    Raises
    ------
    ModelError
        With every fault found in ``faults``.

    Examples
    --------
    >>> import numpy as np
    >>> mdp = MDP(
    ...     state_to_choices=np.array([0, 2, 3]),
    ...     choice_to_branches=np.array([0, 1, 3, 4]),
    ...     branch_to_target=np.array([0, 0, 1, 1]),
    ...     branch_to_probability=np.array([1, 0.1, 0.9, 1]),
    ...     choice_to_action=np.array([0, 1, 0]),
    ...     actions=["wait", "go"],
    ...     initial=np.array([0]),
    ... )
    >>> mdp.states, mdp.choices, mdp.branches
    (2, 3, 4)
    """

    state_to_choices: Ints  # [S+1]
    choice_to_branches: Ints  # [C+1]
    branch_to_target: Ints  # [B]
    branch_to_probability: Floats  # [B]
    choice_to_action: Ints = None  # type: ignore[assignment]  # [C], filled below
    actions: tuple[str, ...] = ()  # [A]
    labels: Mapping[str, Bools] = field(default_factory=dict)  # each [S]
    rewards: Mapping[str, Reward] = field(default_factory=dict)
    initial: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int32))  # [I]
    names: StateNames = None  # type: ignore[assignment]  # filled below

    def __post_init__(self) -> None:
        from ratherthan.model.checks import faults_of, normalised, shape_faults

        faults = shape_faults(self)
        if not faults:
            for name, value in normalised(self).items():
                object.__setattr__(self, name, value)
            faults = faults_of(self)
        if faults:
            more = f" ({len(faults) - 1} more faults of this model follow it.)" if len(faults) > 1 else ""
            raise ModelError(faults[0].sentence + more, faults=tuple(f.sentence for f in faults), **faults[0].place)
        object.__setattr__(self, "labels", MappingProxyType(dict(self.labels)))
        object.__setattr__(self, "rewards", MappingProxyType(dict(self.rewards)))

    @property
    def states(self) -> int:
        """The number of states, S."""
        return len(self.state_to_choices) - 1

    @property
    def choices(self) -> int:
        """The number of choices, C."""
        return len(self.choice_to_branches) - 1

    @property
    def branches(self) -> int:
        """The number of branches, B."""
        return len(self.branch_to_target)

    def choices_of(self, state: int) -> range:
        """Return the choices of one state, in the model's order."""
        return range(int(self.state_to_choices[state]), int(self.state_to_choices[state + 1]))

    def branches_of(self, choice: int) -> slice:
        """Return the branches of one choice as a slice into the branch arrays."""
        return slice(int(self.choice_to_branches[choice]), int(self.choice_to_branches[choice + 1]))

    def state_of(self, choice: int) -> int:
        """Return the state that a choice belongs to."""
        offset = self.state_to_choices.dtype.type(choice)  # of another width, the whole array would be converted
        return int(self.state_to_choices.searchsorted(offset, side="right")) - 1

    def action_name(self, choice: int) -> str:
        """Return the shown name of a choice: its action's, else "choice k"; equal names in one state get " (2)", " (3)"."""
        own = self.choices_of(self.state_of(choice))
        name = self._plain_name(choice, own.start)
        earlier = sum(self._plain_name(other, own.start) == name for other in range(own.start, choice))
        return f"{name} ({earlier + 1})" if earlier else name

    def _plain_name(self, choice: int, first: int) -> str:
        action = int(self.choice_to_action[choice])
        return (self.actions[action] if action >= 0 else "") or f"choice {choice - first}"

    def __repr__(self) -> str:
        return (
            f"MDP({self.states} states, {self.choices} choices, {self.branches} branches; "
            f"labels: {', '.join(self.labels) or 'none'}; rewards: {', '.join(self.rewards) or 'none'})"
        )
