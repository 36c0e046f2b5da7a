"""Numbers and counts of choices enter, the nouns that claims rest on leave. There are no sentences here."""

from __future__ import annotations

from dataclasses import dataclass

from ratherthan.factors import Interval

__all__ = ["Claim", "Evidence", "Judged", "Measured", "Tally", "Trade"]


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A choice with its number: the action value q (or ω), with bounds.

    `fate` tells what it means that an expected total is infinitely bad (∞ where it is minimised, -∞ where it is maximised and
    arrival is demanded): ``"dead end"`` where nothing after the action can arrive any more, ``"may fail"`` where it may.
    """

    choice: int
    action: str
    number: Interval
    fate: str | None = None


@dataclass(frozen=True, kw_only=True)
class Tally:
    """A choice with its count of decisions left open, ε, between two bounds."""

    choice: int
    action: str
    lower: int
    upper: int


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a claim rests on: the number (or count) of the choice taken, and those of the choices it is compared with.

    `follows` lists, for claims about the rest of the way, each successor with ρ and ρ^π.
    """

    taken: Measured | Tally
    others: tuple[Measured | Tally, ...] = ()
    follows: tuple[tuple[int, Interval, Interval], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One thing that holds of the choice taken, against which actions, and why.

    Parameters
    ----------
    claim : str
        Outcome: "best", "among the best", "right start only", "not best", "hopeless"; judged by single steps: "better
        step", "equal step", "worse step"; flexibility: "most flexible", "equally flexible"; details: "avoids", "only way
        on"; against a foil: "better", "worse", "equal", "more flexible", "less flexible", "as flexible".
    against : tuple of str
        The actions it is claimed against.
    evidence : Evidence
    level : int
        Which level of the objective it speaks of; beyond the first (0) only of actions that are equal at all levels before.
    """

    claim: str
    against: tuple[str, ...]
    evidence: Evidence
    level: int = 0


@dataclass(frozen=True, kw_only=True)
class Judged:
    """What the choice taken, and another one, come to under one objective, if the plan is followed after either.

    Parameters
    ----------
    objective : int
        Which: the levels of the plan's own objective come first, those given beside it follow.
    taken, other : Measured
        Each with q^π: the choice once, then the plan.
    relation : str
        "better", "worse" or "equal": how the choice taken compares with the other; "open" where the bounds leave it open.
    """

    objective: int
    taken: Measured
    other: Measured
    relation: str


@dataclass(frozen=True, kw_only=True)
class Trade:
    """How the choice taken compares with one other under all objectives together.

    Parameters
    ----------
    claim : str
        "better on all" (better under one at least, worse under none, all decided), "trade" (better under one at least and
        worse under one at least), "dominated" (worse under one at least, better under none, all decided), "indifferent"
        (equal under all), "open" (the bounds leave it between these).
    against : tuple of str
        The one action.
    judged : tuple of Judged
        One for each objective, in order.
    """

    claim: str
    against: tuple[str, ...]
    judged: tuple[Judged, ...]
