"""What options of a command line say of a table's columns enters, their meaning leaves."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from ratherthan.apps.study.analysis.words import listed
from ratherthan.errors import QuestionError

__all__ = ["ROLES", "Meaning", "contrasts_in", "meaning_of", "pairs_in"]

ROLES = ("participant", "kind", "map", "item", "value")


@dataclass(frozen=True, kw_only=True)
class Meaning:
    """What the columns of a table mean.

    Parameters
    ----------
    roles : mapping of str to str
        From `ROLES` to columns.
    ratings, times, choices : mapping of str to str
        From what they measure to columns; patterns with ``{kind}`` and ``{map}`` stand for several.
    labels : mapping of str to str
        What kinds are called.
    scales : mapping of str to str
        The least and the most that a rating can be, such as "1-5".
    """

    roles: Mapping[str, str] = field(default_factory=dict)
    ratings: Mapping[str, str] = field(default_factory=dict)
    times: Mapping[str, str] = field(default_factory=dict)
    choices: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, str] = field(default_factory=dict)

    def points(self, name: str) -> list[tuple[float | None, str]]:
        """Return the values of a rating's scale; nothing where none is given.

        Raises
        ------
        QuestionError
            If it is no scale.
        """
        if name not in self.scales:
            return []
        match = re.fullmatch(r"(-?\d{1,3})-(-?\d{1,3})", self.scales[name])
        least, most = (int(end) for end in match.groups()) if match else (0, 0)
        if not 1 <= most - least <= 100:
            raise QuestionError(f"--scales takes NAME=LEAST-MOST, such as trust=1-5, got '{name}={self.scales[name]}'.")
        return [(float(value), "") for value in range(least, most + 1)]

    def __bool__(self) -> bool:
        return bool(self.roles or self.ratings or self.times or self.choices)


def pairs_in(texts: Iterable[str], what: str) -> dict[str, str]:
    """Return ``name=value`` pairs, several in a text parted by commas.

    Raises
    ------
    QuestionError
        If a part is no such pair, or a name stands there twice.

    Examples
    --------
    >>> pairs_in(["participant=PID, kind=condition"], "--columns")
    {'participant': 'PID', 'kind': 'condition'}
    """
    found: dict[str, str] = {}
    for text in texts:
        for part in text.split(","):
            name, sign, value = (piece.strip() for piece in part.partition("="))
            if not (name and sign and value):
                raise QuestionError(f"{what} takes NAME=COLUMN, several parted by commas, got '{part.strip()}'.")
            if name in found:
                raise QuestionError(f"{what} names each thing once, and '{name}' stands there twice.")
            found[name] = value
    return found


def meaning_of(
    *,
    columns: Sequence[str] = (),
    ratings: Sequence[str] = (),
    times: Sequence[str] = (),
    choices: Sequence[str] = (),
    labels: Sequence[str] = (),
    scales: Sequence[str] = (),
) -> Meaning:
    """Return what the options of the command line say of a table.

    Raises
    ------
    QuestionError
        If they cannot be understood.
    """
    roles = pairs_in(columns, "--columns")
    strange = sorted(set(roles) - set(ROLES))
    if strange:
        raise QuestionError(
            f"--columns knows {listed(ROLES)}, got '{strange[0]}'. Answers are given with --ratings and --times."
        )
    if ("item" in roles) != ("value" in roles):
        raise QuestionError(
            "Where answers stand in one column and what they answer in another, --columns needs both item=… and value=…."
        )
    return Meaning(
        roles=roles,
        ratings=pairs_in(ratings, "--ratings"),
        times=pairs_in(times, "--times"),
        choices=pairs_in(choices, "--choices"),
        labels=pairs_in(labels, "--labels"),
        scales=pairs_in(scales, "--scales"),
    )


def contrasts_in(text: str) -> list[tuple[str, str]]:
    """Return comparisons ``A:B,C:D``.

    Raises
    ------
    QuestionError
        If a part is no pair.

    Examples
    --------
    >>> contrasts_in("olson:control")
    [('olson', 'control')]
    """
    pairs = []
    for part in text.split(","):
        first, sign, second = (piece.strip() for piece in part.partition(":"))
        if not (first and sign and second):
            raise QuestionError(f"--contrasts takes A:B, several parted by commas, got '{part.strip()}'.")
        pairs.append((first, second))
    return list(dict.fromkeys(pairs))
