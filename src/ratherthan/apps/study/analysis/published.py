"""The numbers that the paper printed leave, each as printed and never computed by us."""

from __future__ import annotations

import functools
import tomllib
from dataclasses import dataclass
from pathlib import Path

__all__ = ["PublishedF", "published_f", "published_share"]


@dataclass(frozen=True, kw_only=True)
class PublishedF:
    """A published test."""

    f: float
    between: int
    within: int
    shown: str  # F as printed
    printed: str  # p as printed

    @property
    def p(self) -> float:
        """What p follows from F and its degrees of freedom."""
        from scipy.stats import f as law

        return float(law.sf(self.f, self.between, self.within))


@functools.cache
def _numbers() -> tuple[dict[str, PublishedF], list[tuple[tuple[str, ...], tuple[float, ...]]]]:
    told = tomllib.loads((Path(__file__).parent / "words" / "published.toml").read_text(encoding="utf-8"))
    tests = {name: PublishedF(**numbers) for name, numbers in told["f"].items()}
    return tests, [(tuple(entry["kinds"]), tuple(entry["values"])) for entry in told["shares"]]


def published_f() -> dict[str, PublishedF]:
    """Return the published tests by what was measured."""
    return _numbers()[0]


def published_share(kinds: tuple[str, ...], kind: str) -> float | None:
    """Return the published share of a kind in the grouping of `kinds`, None where there is none.

    Examples
    --------
    >>> published_share(("naive-state", "responsibility"), "responsibility")
    0.46
    """
    for named, values in _numbers()[1]:
        if set(named) == set(kinds) and kind in named:
            return values[named.index(kind)]
    return None
