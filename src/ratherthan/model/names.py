"""Variables or strings enter, the name of one state leaves: names are made lazily, never a million at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, overload, runtime_checkable

import numpy as np
import numpy.typing as npt

from ratherthan.errors import ModelError, QuestionError

__all__ = ["Columns", "Pairs", "Placing", "StateNames", "spell"]


@dataclass(frozen=True, kw_only=True, eq=False)
class StateNames:
    """How the states of a model are called.

    Either `strings` (one per state), or `variables` (columns, one value per state), or neither: then a state has no
    name but its number.

    Parameters
    ----------
    count : int
        The number of states, S.
    strings : sequence of str, optional
        A name per state, ``[S]``.
    variables : mapping of str to array, optional
        State variables in the order of their declaration, each ``[S]`` (bool, integer, float or str). A mapping that
        decodes its columns on demand is welcome.
    """

    count: int
    strings: Sequence[str] | None = None
    variables: Mapping[str, npt.NDArray[np.generic]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.strings is not None and len(self.strings) != self.count:
            raise ModelError(f"There must be one name per state: {self.count} states, got {len(self.strings)} names.")

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, state: int) -> str:
        """Return the name of one state, its number where it has none."""
        if self.strings is not None:
            return str(self.strings[state])
        if self.variables:
            return ", ".join(f"{name}={spell(column[state])}" for name, column in self.variables.items())
        return str(state)

    @property
    def named(self) -> bool:
        """Whether states have names beside their numbers."""
        return self.strings is not None or bool(self.variables)

    def find(self, name: str) -> int:
        """Return the state that is called `name` exactly.

        Parameters
        ----------
        name : str
            A name as `self[state]` gives it; for variables ``x=1, y=2`` in any order, and as few as single one state out.

        Raises
        ------
        QuestionError
            If no state, or more than one, is called so.
        """
        found = self.called(name)
        if len(found) == 1:
            return int(found[0])
        if len(found) == 0:
            raise QuestionError(
                f"A state must be a number from 0 to {self.count - 1} or an exact name, got '{name}'. "
                f"Names look like {self._examples()}.",
                state=name,
            )
        some = ", ".join(str(int(i)) for i in found[:5])
        raise QuestionError(
            f"A state's name must single out one state, but '{name}' fits {len(found)} states ({some}"
            f"{', …' if len(found) > 5 else ''}). Give the state's number.",
            state=name,
        )

    def called(self, name: str) -> npt.NDArray[np.int64]:
        """Return the states that are called `name`, as `find` understands it."""
        if isinstance(self.strings, Finding):
            return self.strings.called(name)
        if self.strings is not None:
            return np.array([i for i, string in enumerate(self.strings) if string == name], dtype=np.int64)
        return np.flatnonzero(self._matching(name)) if self.variables else np.empty(0, dtype=np.int64)

    def _matching(self, name: str) -> npt.NDArray[np.bool_]:
        match = np.ones(self.count, dtype=bool)
        text = name.strip().removeprefix("(").removesuffix(")")
        for part in text.split(","):
            key, equals, value = part.partition("=")
            column = self.variables.get(key.strip())
            if not equals or column is None:
                return np.zeros(self.count, dtype=bool)
            match &= _equal(np.asarray(column), value.strip())
        return match

    def _examples(self) -> str:
        if not self.named:
            return f"0 … {self.count - 1} (this model has no state names)"
        return ", ".join(f"'{self[i]}'" for i in range(min(3, self.count)))


@runtime_checkable
class Finding(Protocol):
    """Names that find a state by themselves, without a look at each."""

    def called(self, name: str) -> npt.NDArray[np.int64]:
        """Return the states that are called `name`."""


@runtime_checkable
class Placing(Protocol):
    """Names that know how the cells of a map are called, those without a state too."""

    def of_cell(self, cell: int) -> str:
        """Return how a cell is called."""


class Pairs(Sequence[str]):
    """The names of a product's states, made as they are asked for: how a state is called, and what is remembered there.

    Parameters
    ----------
    phrase : callable
        How a state of the model is called, by its number.
    names : StateNames
        The names of the model, under which a state is found as well.
    state, memory : array of int, ``[S]``
        The state of the model and the memory of each pair; the first pairs are the states of the model in their order.
    endings : sequence of str
        What stands behind the state's name for each memory.
    """

    def __init__(
        self,
        phrase: Callable[[int], str],
        names: StateNames,
        state: npt.NDArray[np.integer],
        memory: npt.NDArray[np.integer],
        endings: Sequence[str],
    ) -> None:
        self.phrase, self.names, self.state, self.memory, self.endings = phrase, names, state, memory, endings

    def __len__(self) -> int:
        return len(self.state)

    @overload
    def __getitem__(self, pair: int) -> str: ...
    @overload
    def __getitem__(self, pair: slice) -> list[str]: ...
    def __getitem__(self, pair: int | slice) -> str | list[str]:
        """Return the name of one pair, or of several."""
        if isinstance(pair, slice):
            return [self[i] for i in range(*pair.indices(len(self)))]
        return f"{self.phrase(int(self.state[pair]))}{self.endings[self.memory[pair]]}"

    def called(self, name: str) -> npt.NDArray[np.int64]:
        """Return the pairs called `name`; where there are none, the state called so with nothing done yet."""
        found = np.zeros(len(self), dtype=bool)
        for memory, ending in enumerate(self.endings):
            if name.endswith(ending):
                here = self.memory == memory
                here[here] = np.isin(self.state[here], self._states(name.removesuffix(ending)))
                found |= here
        return np.flatnonzero(found) if found.any() else self._states(name)

    def _states(self, name: str) -> npt.NDArray[np.int64]:
        """Return the states of the model that are called `name`, there or in sentences."""
        found = self.names.called(name)
        if len(found):
            return found
        return np.array([s for s in range(self.names.count) if self.phrase(s) == name], dtype=np.int64)


class Columns(Mapping[str, npt.NDArray[np.generic]]):
    """State variables of a product: those of the model, taken when they are asked for."""

    def __init__(self, variables: Mapping[str, npt.NDArray[np.generic]], state: npt.NDArray[np.integer]) -> None:
        self._variables, self._state = variables, state

    def __getitem__(self, name: str) -> npt.NDArray[np.generic]:
        """Return one column, ``[S]``."""
        column: npt.NDArray[np.generic] = np.asarray(self._variables[name])[self._state]
        return column

    def __iter__(self) -> Iterator[str]:
        return iter(self._variables)

    def __len__(self) -> int:
        return len(self._variables)


def spell(value: object) -> str:
    """Return the value of a state variable as names show it: true, 0.5, 3."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float | np.floating):
        return f"{float(value):g}"
    return str(value)


def _equal(column: npt.NDArray[np.generic], value: str) -> npt.NDArray[np.bool_]:
    if column.dtype == np.bool_:
        wanted = {"true": True, "false": False}.get(value.lower())
        return np.zeros(len(column), dtype=bool) if wanted is None else column == np.bool_(wanted)
    if np.issubdtype(column.dtype, np.number):
        try:
            return np.asarray(column == float(value))
        except ValueError:
            return np.zeros(len(column), dtype=bool)
    return np.asarray(column == value)  # text, as fixed-width strings or as objects: one long string must not widen all
