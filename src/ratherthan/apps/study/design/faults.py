"""What is wrong with a design is gathered here, each fault with its place, and raised at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ratherthan.errors import InputError

__all__ = ["DesignError", "Fault", "Faults"]

LONGEST_KEY = 60
"""The most characters of a key that are shown."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One thing that is wrong, or (in a list of warnings) doubtful.

    Parameters
    ----------
    place : str
        The file, the line where it is known, and the key: "design.toml, line 12: items[2].id".
    sentence : str
        What must hold, what came, what to do.
    """

    place: str
    sentence: str

    def __str__(self) -> str:
        """Return place and sentence on one line."""
        return f"{self.place}: {self.sentence}"


def _plain(key: str) -> str:
    """Return a key that stays on one line: it may be a stranger's."""
    plain = "".join(c if c.isprintable() else "�" for c in key)
    return plain if len(plain) <= LONGEST_KEY else f"{plain[:LONGEST_KEY]}…"


class DesignError(InputError):
    """A design cannot be used; `faults` lists all that was found.

    Parameters
    ----------
    faults : sequence of Fault
        At least one.
    """

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        more = len(self.faults) - 1
        said = f" And {more} more fault{'s' if more > 1 else ''}: 'ratherthan study check' lists all." if more else ""
        super().__init__(f"{self.faults[0]}{said}")


class Faults:
    """Gathers faults.

    Parameters
    ----------
    source : str
        What the file is called in places.
    lines : dict, optional
        The line of each key, where it is known.
    """

    def __init__(self, source: str, lines: dict[tuple[str | int, ...], int] | None = None) -> None:
        self.source = source
        self.lines = lines or {}
        self.found: list[Fault] = []

    def add(self, keys: Sequence[str | int], sentence: str) -> None:
        """Note one fault at a key of the file; numbers among the keys count from 1."""
        self.found.append(Fault(place=self.place(keys), sentence=sentence))

    def place(self, keys: Sequence[str | int]) -> str:
        """Return how a key is pointed at."""
        line = next((line for n in range(len(keys), 0, -1) if (line := self._line(tuple(keys[:n])))), 0)
        where = f"{self.source}, line {line}" if line else self.source
        named = "".join(f"[{key}]" if isinstance(key, int) else f".{_plain(key)}" for key in keys).removeprefix(".")
        return f"{where}: {named}" if named else where

    def _line(self, keys: tuple[str | int, ...]) -> int:
        """Return the line of a key, of a list that of its first entry; 0 where it is not known."""
        return self.lines.get(keys) or self.lines.get((*keys, 1)) or 0

    def check(self) -> None:
        """Raise all faults, if there are any."""
        if self.found:
            raise DesignError(self.found)
