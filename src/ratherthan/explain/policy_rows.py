"""Columns of a policy enter: state, choice, share; its rows leave, one by one or as the text of a document, without a loop."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, overload

import numpy as np
import numpy.typing as npt

__all__ = ["PolicyRows"]

Row = tuple[int, int, float]
Numbers = npt.NDArray[np.int64]
Letters = npt.NDArray[np.uint8]

BLOCK = 1 << 14
"""So many rows are spelled at a time: what they take stays in the processor's cache."""


class PolicyRows(Sequence[Row]):
    """The rows (state, choice, probability) of a policy, which may be a million, kept as three columns.

    Parameters
    ----------
    state, choice : array of int, ``[N]``
    share : array of float, ``[N]``
    """

    __slots__ = ("choice", "share", "state")

    def __init__(self, *, state: Numbers, choice: Numbers, share: npt.NDArray[np.float64]) -> None:
        self.state = np.ascontiguousarray(state, dtype=np.int64)
        self.choice = np.ascontiguousarray(choice, dtype=np.int64)
        self.share = np.ascontiguousarray(share, dtype=np.float64)
        for column in (self.state, self.choice, self.share):
            column.flags.writeable = False

    @classmethod
    def of(cls, rows: Iterable[Sequence[Any]]) -> PolicyRows:
        """Return rows as columns.

        Raises
        ------
        TypeError
            Where a row is no (whole number, whole number, number).
        OverflowError
            Where a number is beyond 64 bits.
        """
        state, choice, share = ([], [], []) if not (listed := list(rows)) else map(list, zip(*listed, strict=True))
        for column, kinds in ((state, {int}), (choice, {int}), (share, {int, float})):
            if not set(map(type, column)) <= kinds:
                raise TypeError("rows of a policy must be [whole number, whole number, number]")
        return cls(
            state=np.array(state, dtype=np.int64),
            choice=np.array(choice, dtype=np.int64),
            share=np.array(share, dtype=np.float64),
        )

    def __len__(self) -> int:
        return len(self.state)

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: slice) -> PolicyRows: ...
    def __getitem__(self, index: int | slice) -> Row | PolicyRows:
        if isinstance(index, slice):
            return PolicyRows(state=self.state[index], choice=self.choice[index], share=self.share[index])
        return int(self.state[index]), int(self.choice[index]), float(self.share[index])

    def __iter__(self) -> Iterator[Row]:
        return iter(zip(self.state.tolist(), self.choice.tolist(), self.share.tolist(), strict=True))

    def __eq__(self, other: object) -> bool:
        if isinstance(other, PolicyRows):
            return (
                np.array_equal(self.state, other.state)
                and np.array_equal(self.choice, other.choice)
                and np.array_equal(self.share, other.share)
            )
        return tuple(self) == tuple(other) if isinstance(other, list | tuple) else NotImplemented

    def __hash__(self) -> int:
        return hash((len(self), self.state.tobytes(), self.choice.tobytes(), self.share.tobytes()))

    def __repr__(self) -> str:
        some = ", ".join(map(repr, self[:3]))
        return f"PolicyRows({len(self)} rows{': ' if some else ''}{some}{', …' if len(self) > 3 else ''})"

    def spelled(self) -> str:
        """Return the rows as JSON in its shortest form: ``[[0,1,1.0],[2,7,0.5]]``.

        Raises
        ------
        ValueError
            Where a share is no finite number.
        """
        if min(self.state.min(initial=0), self.choice.min(initial=0)) < 0 or not np.isfinite(self.share).all():
            return json.dumps(list(self), separators=(",", ":"), allow_nan=False)
        shares, which = np.unique(self.share, return_inverse=True)
        tails = [f",{share!r}],".encode() for share in shares.tolist()]
        blocks = (slice(i, i + BLOCK) for i in range(0, len(self), BLOCK))
        parts = [_spelled(self.state[block], self.choice[block], which[block], tails) for block in blocks]
        return "[" + b"".join(parts)[:-1].decode("ascii") + "]"


def _spelled(state: Numbers, choice: Numbers, which: npt.NDArray[np.intp], tails: Sequence[bytes]) -> bytes:
    """Return ``[state,choice`` and the tail of its share for each row of a block."""
    state_size, choice_size = _digits(state), _digits(choice)
    size = 2 + state_size + choice_size + np.array([len(tail) for tail in tails])[which]
    begin = np.zeros(len(size) + 1, dtype=np.int64)
    np.cumsum(size, out=begin[1:])
    letters = np.empty(int(begin[-1]), dtype=np.uint8)
    first = begin[:-1]
    comma = first + 1 + state_size
    after = comma + 1 + choice_size
    letters[first], letters[comma] = ord("["), ord(",")
    _write(letters, first + 1, state, state_size)
    _write(letters, comma + 1, choice, choice_size)
    for k in np.unique(which).tolist():
        own = after if len(tails) == 1 else after[which == k]
        for i, letter in enumerate(tails[k]):
            letters[own + i] = letter
    return letters.tobytes()


def _digits(numbers: Numbers) -> Numbers:
    """Return how many digits whole numbers from 0 on have."""
    size = np.ones(len(numbers), dtype=np.int64)
    power, most = 10, int(numbers.max(initial=0))
    while power <= most:
        size += numbers >= power
        power *= 10
    return size


def _write(letters: Letters, begin: Numbers, numbers: Numbers, size: Numbers) -> None:
    """Write the digits of whole numbers from 0 on, each from its place on, the last digit first."""
    left, at = numbers, begin + size - 1
    while True:
        rest = left // 10
        letters[at] = (left - 10 * rest + ord("0")).astype(np.uint8)
        going = rest > 0
        if not going.any():
            return
        if going.all():
            left, at = rest, at - 1
        else:
            left, at = rest[going], at[going] - 1
