"""The outcome of each check enters one noun, the Verdicts, and is passed on whole: holds, fails, or undecided, with a reason."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from enum import Enum

__all__ = ["Check", "Verdict", "Verdicts"]


class Verdict(Enum):
    """What the model says to one part of an explanation; each value is a sentence."""

    HOLDS = "The model confirms it."
    FAILS = "The model contradicts it."
    UNDECIDED = "The bounds that were computed leave it open."


@dataclass(frozen=True, kw_only=True)
class Check:
    """One part of an explanation, compared with the model.

    Parameters
    ----------
    what : str
        What was checked: a claim by its name ("best"), or a part of the document ("route", "spread").
    where : str
        The state it is about, by its name, and "" where it is about the whole.
    verdict : Verdict
    reason : str
        Why it does not hold, or why it is open; "" where it holds.
    state : int, optional
        The state it is about.
    """

    what: str
    where: str
    verdict: Verdict
    reason: str = ""
    state: int | None = None

    def __str__(self) -> str:
        place = f" at {self.where}" if self.where else ""
        return f"{self.what}{place}: {self.reason or self.verdict.value}"


@dataclass(frozen=True, kw_only=True)
class Verdicts:
    """All checks of one explanation, in the order of the document."""

    checks: tuple[Check, ...]

    def of(self, verdict: Verdict) -> tuple[Check, ...]:
        """Return the checks with this verdict."""
        return tuple(check for check in self.checks if check.verdict is verdict)

    @property
    def holds(self) -> bool:
        """Whether every part is confirmed."""
        return all(check.verdict is Verdict.HOLDS for check in self.checks)

    @property
    def fails(self) -> bool:
        """Whether some part is contradicted."""
        return any(check.verdict is Verdict.FAILS for check in self.checks)

    @property
    def undecided(self) -> bool:
        """Whether nothing is contradicted, but something is left open."""
        return not self.fails and not self.holds

    def summary(self) -> str:
        """Return how many checks came out how, in one line."""
        count = Counter(check.verdict for check in self.checks)
        return (
            f"checked: {len(self.checks)}, confirmed: {count[Verdict.HOLDS]}, "
            f"contradicted: {count[Verdict.FAILS]}, undecided: {count[Verdict.UNDECIDED]}"
        )
