"""An environment without a table enters, the table of all it can come to leaves: every action is tried in every state.

The environment is reset once and then copied: a state is the value of all attributes of the copy, save its spaces, its
generator of chance and what it draws with. From every state a copy takes every action, breadth first, until no new state
comes up. That is the whole model if nothing but the attributes and the action decides what happens; so a step that
draws on chance is refused, and so is one that, repeated on another copy, gives something else.

Attributes that only count steps would make a new state of every moment: those named in `ignore` are set back to what they
were at the start before every step. Whether a step says *truncated* plays no part: a time limit is no part of the model.
"""

from __future__ import annotations

import copy
import random
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np

from ratherthan.errors import SourceError
from ratherthan.io._gym_entries import Table
from ratherthan.io._gym_values import UnknowableError, chance_of, value_bytes
from ratherthan.model.mdp import Bools

__all__ = ["Explored", "explore"]

GENERATOR = "_np_random"
SKIPPED = (
    *(GENERATOR, "_np_random_seed", "spec", "action_space", "observation_space", "metadata", "reward_range"),
    *("render_mode", "window", "window_size", "window_surface", "screen", "clock", "viewer"),
)
LEGACY = np.random.mtrand._rand  # noqa: SLF001 - NumPy's global generator, to see whether the environment draws on it
TWICE = 64
"""So many first steps are taken twice, on two copies, to see whether they come to the same."""

Quiet = Callable[[str], AbstractContextManager[None]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Explored:
    """All that an environment can come to, from one start.

    Parameters
    ----------
    table : Table
        State 0 is the start.
    facts : list of mapping
        What is told of each state, ``[S]``.
    ended : array of bool, ``[S]``
        Whether the episode is over there.
    drawn : bool
        Whether chance had a part in the start.
    truncated : bool
        Whether some step said truncated.
    start : gymnasium.Env
        The environment as it stands at the start.
    """

    table: Table
    facts: Sequence[Mapping[str, Any]]
    ended: Bools  # [S]
    drawn: bool
    truncated: bool
    start: Any


@dataclass
class _Search:
    """What is found so far."""

    number: dict[tuple[bytes, bool], int] = field(default_factory=dict)
    facts: list[Mapping[str, Any]] = field(default_factory=list)
    ended: list[bool] = field(default_factory=list)
    entries: list[tuple[int, int, int, float, bool]] = field(default_factory=list)
    chances: tuple[str, ...] | None = None
    truncated: bool = False


@dataclass(frozen=True, kw_only=True)
class Explorer:
    """How one environment is explored.

    Parameters
    ----------
    shown : str
        How it is called in errors.
    ignore : tuple of str
        Attributes that are set back before every step.
    most_states : int
    facts : callable
        What to tell of the environment as it stands.
    constant : callable
        Objects in it that never change.
    prepare : callable
        What may copy parts of it faster than `copy.deepcopy` does, into the memo of that.
    quiet : callable
        A context in which its own code is run.
    """

    shown: str
    ignore: tuple[str, ...]
    most_states: int
    facts: Callable[[Any], Mapping[str, Any]]
    constant: Callable[[Any], Sequence[Any]]
    prepare: Callable[[Any, dict[int, Any]], None]
    quiet: Quiet


def explore(environment: Any, seed: int, how: Explorer) -> Explored:
    """Try every action in every state that can be reached.

    Parameters
    ----------
    environment : gymnasium.Env
        Without wrappers; it is copied and stays as it is.
    seed : int
        Which start is drawn, where the environment draws its start.
    how : Explorer

    Raises
    ------
    SourceError
        Where it cannot be copied or compared, draws on chance, or has more states than `how` allows.
    """
    walker = _Walker(environment, seed, how)
    search = _Search()
    first = walker.start
    waiting = deque([(walker.numbered(search, first, ended=False), first)])
    steps = 0
    while waiting:
        state, here = waiting.popleft()
        for action in range(walker.actions):
            there, reward, over, truncated = walker.step(here, action)
            if steps < TWICE:
                walker.compare(here, action, (there, reward, over))
            steps += 1
            known = len(search.facts)
            target = walker.numbered(search, there, ended=over)
            search.entries.append((state, action, target, reward, over))
            search.truncated |= truncated
            if target == known and not over:
                waiting.append((target, there))
    columns = list(zip(*search.entries, strict=True))
    table = Table(
        states=len(search.facts),
        actions=walker.actions,
        state=np.array(columns[0], dtype=np.int64),
        action=np.array(columns[1], dtype=np.int64),
        target=np.array(columns[2], dtype=np.int64),
        probability=np.ones(len(columns[0])),
        reward=np.array(columns[3], dtype=np.float64),
        terminated=np.array(columns[4], dtype=np.bool_),
    )
    return Explored(
        table=table,
        facts=search.facts,
        ended=np.array(search.ended, dtype=np.bool_),
        drawn=walker.drawn,
        truncated=search.truncated,
        start=first,
    )


class _Walker:
    """Copies of an environment, and the steps they take."""

    def __init__(self, environment: Any, seed: int, how: Explorer) -> None:
        self.how = how
        _check_spaces(environment, how.shown)
        self.actions = int(environment.action_space.n)
        self.offset = int(getattr(environment.action_space, "start", 0))
        self.start = self._reset(environment, seed)
        missing = [name for name in how.ignore if name not in vars(self.start)]
        if missing:
            raise SourceError(
                f"What is ignored must be attributes of '{how.shown}': {', '.join(sorted(vars(self.start)))}; got "
                f"{', '.join(missing)}.",
                environment=how.shown,
            )
        self.before = {name: copy.deepcopy(getattr(self.start, name)) for name in how.ignore}
        constants = [getattr(self.start, name) for name in SKIPPED if name in vars(self.start)]
        constants += how.constant(self.start)
        self.constants = {id(item): item for item in constants if item is not None}
        self.shared = {key: number for number, key in enumerate(self.constants)}
        self.skipped = (*SKIPPED, *how.ignore)
        self.drawn = self._is_drawn(environment, seed)

    def _reset(self, environment: Any, seed: int) -> Any:
        with self.how.quiet("be copied and reset"):
            start = copy.deepcopy(environment)
            start.reset(seed=seed)
        return start

    def _is_drawn(self, environment: Any, seed: int) -> bool:
        """Tell whether another seed gives another start; the same seed must not."""
        values = [self._plain_value(self._reset(environment, other)) for other in (seed, seed, seed + 1)]
        if values[0] != values[1]:
            raise SourceError(
                f"An environment must start the same from the same seed, but '{self.how.shown}' does not. Let its reset "
                "draw from self.np_random alone.",
                environment=self.how.shown,
            )
        return values[0] != values[2]

    def _plain_value(self, environment: Any) -> bytes:
        """Return the value of an environment that shares nothing with others."""
        constant = {id(item): number for number, item in enumerate(self.how.constant(environment))}
        return self._value(environment, dict.fromkeys(constant, 0))[0]

    def step(self, here: Any, action: int) -> tuple[Any, float, bool, bool]:
        """Return a copy after an action, its reward, and whether the episode is over or was cut short."""
        before = _chance_outside(here)
        with self.how.quiet("be copied and stepped"):
            memo = dict(self.constants)
            self.how.prepare(here, memo)
            there = copy.deepcopy(here, memo)
            for name, value in self.before.items():
                setattr(there, name, copy.deepcopy(value))
            _, reward, over, truncated, *_ = there.step(action + self.offset)
            reward = float(reward)
        if _chance_outside(there) != before:
            self._refuse_chance()
        if not np.isfinite(reward):
            raise SourceError(
                f"A reward must be a finite number, but a step of '{self.how.shown}' gives {reward}.",
                environment=self.how.shown,
            )
        return there, reward, bool(over), bool(truncated)

    def _refuse_chance(self) -> NoReturn:
        raise SourceError(
            f"An environment without a transition table must leave nothing to chance, but a step of '{self.how.shown}' "
            "draws on it, and how likely what is cannot be seen. Give its transitions as arrays, or as a table in JSON.",
            environment=self.how.shown,
        )

    def compare(self, here: Any, action: int, came: tuple[Any, float, bool]) -> None:
        """Take a step again, and refuse the environment where something else comes of it."""
        there, reward, over, _ = self.step(here, action)
        if (reward, over) != came[1:] or self.value(there) != self.value(came[0]):
            raise SourceError(
                f"What a step of '{self.how.shown}' does must depend on its attributes and the action alone, but the same "
                "step gave two outcomes. Give its transitions as arrays, or as a table in JSON.",
                environment=self.how.shown,
            )

    def value(self, environment: Any) -> tuple[bytes, tuple[str, ...]]:
        """Return the value of a state, and what its sources of chance will bring."""
        return self._value(environment, self.shared)

    def _value(self, environment: Any, shared: Mapping[int, int]) -> tuple[bytes, tuple[str, ...]]:
        try:
            return value_bytes(environment, self.skipped, shared)
        except UnknowableError as error:
            raise SourceError(
                f"The states of '{self.how.shown}' cannot be told apart: {error}. Name the attribute in ignore=… if it "
                "plays no part, or give the transitions as arrays.",
                environment=self.how.shown,
            ) from error

    def numbered(self, search: _Search, environment: Any, *, ended: bool) -> int:
        """Return the number of a state, a new one where it has not come up."""
        value, chances = self.value(environment)
        if search.chances not in (None, chances):
            self._refuse_chance()
        search.chances = chances
        key = (value, ended)
        number = search.number.setdefault(key, len(search.facts))
        if number == len(search.facts):
            if number >= self.how.most_states:
                raise SourceError(
                    f"At most {self.how.most_states} states are explored, but '{self.how.shown}' has more: it is large, or "
                    "an attribute counts steps. Name such a one in ignore=…, or allow more by max_states=….",
                    environment=self.how.shown,
                )
            search.facts.append(self.how.facts(environment))
            search.ended.append(ended)
        return number


def _chance_outside(environment: Any) -> tuple[str | None, ...]:
    """Return what the environment's generator and the global ones will bring."""
    legacy = LEGACY.get_state(legacy=False)
    _, words, gauss = random.getstate()
    numbers = (legacy["state"]["pos"], legacy["state"]["key"][0], legacy["has_gauss"], words[0], words[-1], gauss)
    return (chance_of(getattr(environment, GENERATOR, None)), repr(numbers))


def _check_spaces(environment: Any, shown: str) -> None:
    """Refuse an environment whose actions cannot be listed, or whose observations are not countable."""
    actions = type(environment.action_space).__name__
    if actions != "Discrete":
        raise SourceError(
            f"The actions of an environment must be a Discrete space, to be listed, but those of '{shown}' are a {actions}.",
            environment=shown,
        )
    if _is_continuous(environment.observation_space):
        raise SourceError(
            f"An environment without a transition table must have states that can be counted, but '{shown}' observes real "
            "numbers. Make a table of it first, for instance by discretising it.",
            environment=shown,
        )


def _is_continuous(space: Any) -> bool:
    parts = getattr(space, "spaces", None)
    if parts is not None:
        return any(_is_continuous(part) for part in (parts.values() if isinstance(parts, Mapping) else parts))
    dtype = getattr(space, "dtype", None)
    return isinstance(dtype, np.dtype) and dtype.kind in "fc"
