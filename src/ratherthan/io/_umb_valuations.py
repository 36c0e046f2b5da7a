"""Bit-packed records enter, columns of state variables leave, and back: one column at a time, on first use.

A record holds the variables of one state, the first in the least significant bits, written in little-endian order.
Reading a column cuts the bytes that its bits lie in out of all records at once and shifts them into place. An optional
variable has one bit before its value that tells whether there is one. A variable that some state does not have becomes
text: "none" where it is missing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._numbers import doubles_of_rationals
from ratherthan.io._umb_index import Valuations, Variable
from ratherthan.model.names import spell

__all__ = ["Columns", "pack_columns"]

Bytes = npt.NDArray[np.uint8]
Words = npt.NDArray[np.uint64]
MISSING = "none"


class Columns(Mapping[str, npt.NDArray[np.generic]]):
    """The state variables of a model by name; each column is decoded when it is first asked for.

    Parameters
    ----------
    described : Valuations
    records : array of uint8
        All records, one after the other.
    states : int
        How many records there are.
    class_of_state : array of int, ``[S]``, optional
        Which class each state's record is of; None where there is only one.
    strings : sequence of str
        What string variables point into.
    texts : mapping of str to sequence of str
        For variables that are stored as numbers but stand for text: what the numbers stand for.
    """

    def __init__(
        self,
        described: Valuations,
        records: Bytes,
        *,
        states: int,
        class_of_state: npt.NDArray[Any] | None,
        strings: Sequence[str],
        texts: Mapping[str, Sequence[str]],
    ) -> None:
        self.described, self.states, self.strings, self.texts = described, states, strings, texts
        self.class_of_state = class_of_state
        if class_of_state is None:
            self.parts = [records.reshape(states, described.record_bytes[0])]
        else:
            self.parts = _split(records, class_of_state, described.record_bytes)
        self.names = tuple(dict.fromkeys(variable.name for group in described.classes for variable in group))
        self.decoded: dict[str, npt.NDArray[np.generic]] = {}

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __getitem__(self, name: str) -> npt.NDArray[np.generic]:
        if name not in self.decoded:
            if name not in self.names:
                raise KeyError(name)
            column = self._decode(name)
            if name in self.texts:
                column = _pointed(column, self.texts[name], name)
            column.flags.writeable = False
            self.decoded[name] = column
        return self.decoded[name]

    def _decode(self, name: str) -> npt.NDArray[np.generic]:
        pieces: list[tuple[int, npt.NDArray[np.generic], npt.NDArray[np.bool_] | None]] = []
        for number, group in enumerate(self.described.classes):
            for variable in group:
                if variable.name == name:
                    records = self.parts[number]
                    there = None
                    if variable.optional:
                        there = _bits(records, variable.at - 1, 1) != 0
                    pieces.append((number, self._values(records, variable), there))
        if len(self.parts) == 1:
            _, values, there = pieces[0]
            return values if there is None or there.all() else _with_gaps(values, there)
        return self._merged(pieces)

    def _merged(
        self, pieces: list[tuple[int, npt.NDArray[np.generic], npt.NDArray[np.bool_] | None]]
    ) -> npt.NDArray[np.generic]:
        """Return one column out of the classes that have the variable."""
        assert self.class_of_state is not None
        rows = [np.flatnonzero(self.class_of_state == number) for number, _, _ in pieces]
        whole = sum(len(row) for row in rows) == self.states and all(
            there is None or there.all() for *_, there in pieces
        )
        kinds = {values.dtype.kind for _, values, _ in pieces}
        if whole and (len(kinds) == 1 or kinds <= set("iuf")):
            column = np.empty(self.states, dtype=np.result_type(*(values for _, values, _ in pieces)))
            for row, (_, values, _) in zip(rows, pieces, strict=True):
                column[row] = values
            return column
        text = np.full(self.states, MISSING, dtype=object)
        for row, (_, values, there) in zip(rows, pieces, strict=True):
            text[row] = _with_gaps(values, np.ones(len(values), dtype=bool) if there is None else there)
        return text

    def _values(self, records: Bytes, variable: Variable) -> npt.NDArray[np.generic]:
        """Return the values of a variable in the records of one class, whether they are there or not."""
        name, bits = variable.kind.name, variable.kind.bits
        if name == "bool":
            return _any_bit(records, variable.at, bits)
        if name == "rational":
            half = bits // 2
            return doubles_of_rationals(
                _limbs(records, variable.at, half, sign=True), _limbs(records, variable.at + half, half)
            )
        words = _bits(records, variable.at, bits)
        if name == "double":
            return words.view(np.float64)
        if name == "string":
            if variable.optional:
                words[_bits(records, variable.at - 1, 1) == 0] = 0
            return _pointed(words, self.strings, variable.name)
        return _with_offset(_signed(words, bits) if name == "int" else words, variable)


def _pointed(numbers: npt.NDArray[Any], strings: Sequence[str], name: str) -> npt.NDArray[np.generic]:
    """Return the strings that numbers point to; equal ones are shared."""
    if numbers.dtype.kind not in "iu" or int(numbers.min(initial=0)) < 0 or int(numbers.max(initial=0)) >= len(strings):
        raise SourceError(
            f"A string variable must point to one of {len(strings)} strings, but '{name}' points to {numbers.max()}. "
            "Write the archive anew."
        )
    shared = np.empty(len(strings), dtype=object)
    shared[:] = list(strings)
    return np.asarray(shared[numbers.astype(np.int64)])


def _split(records: Bytes, class_of_state: npt.NDArray[Any], sizes: Sequence[int]) -> list[Bytes]:
    """Return the records of each class as a table, from records of different sizes in a row."""
    ends = np.cumsum(np.asarray(sizes, dtype=np.int64)[class_of_state])
    parts = []
    for number, size in enumerate(sizes):
        starts = (ends - size)[class_of_state == number]
        parts.append(records[starts[:, np.newaxis] + np.arange(size)])
    return parts


def _bits(records: Bytes, at: int, bits: int) -> Words:
    """Return up to 64 bits of every record as unsigned words."""
    first, shift = at // 8, at % 8
    reach = -(-(shift + bits) // 8)
    low = np.zeros((len(records), 8), dtype=np.uint8)
    low[:, : min(reach, 8)] = records[:, first : first + min(reach, 8)]
    words = low.view("<u8")[:, 0].astype(np.uint64, copy=False) >> np.uint64(shift)
    if reach > 8:
        words |= records[:, first + 8].astype(np.uint64) << np.uint64(64 - shift)
    return words if bits == 64 else words & np.uint64((1 << bits) - 1)


def _limbs(records: Bytes, at: int, bits: int, *, sign: bool = False) -> Words:
    """Return `bits` bits of every record as words of 64, the least first; with `sign` the last is filled with it."""
    words = [_bits(records, at + start, min(64, bits - start)) for start in range(0, bits, 64)]
    last = bits - 64 * (len(words) - 1)
    if sign and last < 64:
        words[-1] = _signed(words[-1], last).view(np.uint64)
    return np.stack(words, axis=1)


def _any_bit(records: Bytes, at: int, bits: int) -> npt.NDArray[np.bool_]:
    found = np.zeros(len(records), dtype=bool)
    for start in range(0, bits, 64):
        found |= _bits(records, at + start, min(64, bits - start)) != 0
    return found


def _signed(words: Words, bits: int) -> npt.NDArray[np.int64]:
    """Return words of `bits` bits in two's complement as signed numbers."""
    shift = np.int64(64 - bits)
    return (words << np.uint64(64 - bits)).view(np.int64) >> shift


def _with_offset(values: npt.NDArray[Any], variable: Variable) -> npt.NDArray[np.generic]:
    """Return whole numbers with their offset added, as int64 where they fit, else as uint64."""
    if len(values) == 0:
        return values.astype(np.int64)
    least, most = int(values.min()) + variable.offset, int(values.max()) + variable.offset
    if least >= -(2**63) and most < 2**63:
        return np.asarray((values.view(np.uint64) + np.uint64(variable.offset % 2**64)).view(np.int64))
    if least >= 0 and most < 2**64:
        return np.asarray(values.view(np.uint64) + np.uint64(variable.offset % 2**64))
    raise SourceError(
        f"State variables must fit into 64 bits, but '{variable.name}' runs from {least} to {most}. Give it a smaller offset."
    )


def _with_gaps(values: npt.NDArray[np.generic], there: npt.NDArray[np.bool_]) -> npt.NDArray[np.generic]:
    """Return a column as text, "none" where there is no value."""
    kinds, inverse = np.unique(values, return_inverse=True) if values.dtype != object else _unique_objects(values)
    spelled = np.array([*(spell(value) for value in kinds), MISSING], dtype=object)
    return np.asarray(spelled[np.where(there, inverse, len(kinds))])


def _unique_objects(values: npt.NDArray[Any]) -> tuple[list[str], npt.NDArray[np.int64]]:
    number: dict[str, int] = {}
    inverse = np.fromiter(
        (number.setdefault(str(value), len(number)) for value in values), dtype=np.int64, count=len(values)
    )
    return list(number), inverse


def pack_columns(
    columns: Mapping[str, npt.NDArray[np.generic]], states: int
) -> tuple[list[dict[str, Any]], Bytes, dict[str, list[str]]]:
    """Return variables as ``index.json`` describes them, the records as bytes, and what numbers for text stand for."""
    described: list[dict[str, Any]] = []
    parts: list[tuple[Words, int]] = []
    texts: dict[str, list[str]] = {}
    for name, column in columns.items():
        column = np.asarray(column)
        if column.dtype.kind not in "biuf":
            texts[name], column = _unique_objects(column)
        words, bits, entry = _encoded(column)
        described.append({"name": name, "type": {"type": entry.pop("type"), "size": bits}} | entry)
        parts.append((words, bits))
    total = sum(bits for _, bits in parts)
    if total % 8:
        described.append({"padding": -total % 8})
    records = np.zeros((states, -(-total // 8)), dtype=np.uint8)
    at = 0
    for words, bits in parts:
        first, shift = at // 8, at % 8
        low = words << np.uint64(shift)
        for byte in range(min(8, records.shape[1] - first)):
            records[:, first + byte] |= (low >> np.uint64(8 * byte)).astype(np.uint8)
        if shift + bits > 64:
            records[:, first + 8] |= (words >> np.uint64(64 - shift)).astype(np.uint8)
        at += bits
    return described, records.reshape(-1), texts


def _encoded(column: npt.NDArray[Any]) -> tuple[Words, int, dict[str, Any]]:
    """Return a column as unsigned words, their size in bits, and its description."""
    if column.dtype == np.bool_:
        return column.astype(np.uint64), 1, {"type": "bool"}
    if column.dtype.kind == "f":
        return column.astype(np.float64).view(np.uint64), 64, {"type": "double"}
    least, most = int(column.min()), int(column.max())
    if least < 0:  # no offsets and no bounds: not every reader of the format knows them
        bits = max((-least - 1).bit_length(), most.bit_length() if most > 0 else 0) + 1
        return column.astype(np.int64).view(np.uint64) & np.uint64(2**bits - 1), bits, {"type": "int"}
    return column.astype(np.uint64), max(1, most.bit_length()), {"type": "uint"}
