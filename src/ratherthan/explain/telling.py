"""An Explanation enters, the steps that its sentences tell leave, a group for each sentence: sentences and pictures number them alike.

Without a number of sentences that there may be, every step that is told has a sentence of its own. With one, steps in a row become
one *run* where a sentence about all of them is true of each: they take the same action as often, all of them matter or none was
asked whether it does, and their claims are alike in all that is said of a run. On a map each of them must lead in the same
direction, as far as the one before: a turn is a turn.

What a run says of its claims are their names, and of those that name alternatives, also which; their numbers differ from step to step
and are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence

from ratherthan.explain.evidence import Claim, Measured, Trade
from ratherthan.explain.explanation import Explanation, Step
from ratherthan.explain.question import Question

__all__ = ["matters", "runs", "told_groups"]

Place = Callable[[int], tuple[int, int] | None]

NAMING = ("not best", "worse step")
"""Claims of which the alternatives are named."""
DETAILS = ("avoids", "only way on")
"""Claims that are said as details alone."""


def told_groups(explanation: Explanation) -> tuple[tuple[int, ...], ...]:
    """Return the indices of the steps that each sentence about steps tells, in the order of the sentences.

    Parameters
    ----------
    explanation : Explanation
    """
    asked, steps = explanation.question, explanation.steps
    told = [place for place, step in enumerate(steps) if step.told and matters(step, asked)]
    if asked.at_most is None:
        return tuple((place,) for place in told)
    states = explanation.states
    return runs(steps, told, explanation.route, asked, lambda state: states[state].place)


def matters(step: Step, asked: Question) -> bool:
    """Return whether a sentence may tell a step: it is critical, or it was not asked which are."""
    return asked.scope != "route" or "selectiveness" not in asked.factors or step.critical is not False


def runs(
    steps: Sequence[Step], told: Sequence[int], route: Sequence[int], asked: Question, place: Place
) -> tuple[tuple[int, ...], ...]:
    """Return steps in groups of those that one sentence can tell.

    Parameters
    ----------
    steps : sequence of Step
    told : sequence of int
        The indices of those that are to be told, in their order.
    route : sequence of int
        The states of the route, one more than steps.
    asked : Question
    place : callable
        Where a state lies on the map; None where it has no place.
    """
    groups: list[list[int]] = []
    looks = {at: _look(steps[at], asked) for at in told}
    for at in told:
        before = groups[-1][-1] if groups else None
        if before is not None and before + 1 == at and at + 1 < len(route):
            here, then = _move(route, before, place), _move(route, at, place)
            if looks[before] is not None and looks[before] == looks[at] and here == then != "stays":
                groups[-1].append(at)
                continue
        groups.append([at])
    return tuple(map(tuple, groups))


def _move(route: Sequence[int], at: int, place: Place) -> Hashable:
    """Return in which direction a step leads on the map, or that it stays in its cell; None where there is no map."""
    here, there = place(route[at]), place(route[at + 1])
    if here is None or there is None:
        return None
    return "stays" if here == there else (there[0] - here[0], there[1] - here[1])


def _look(step: Step, asked: Question) -> Hashable:
    """Return all of a step that a sentence about a run says; None where it cannot be said of a run."""
    if step.foil is not None or any(_aside(trade) for trade in step.trades):
        return None
    claims = tuple(_said(claim) for claim in step.claims if _heard(claim, asked))
    return step.action, step.share, step.critical is not False, claims


def _aside(trade: Trade) -> bool:
    """Return whether something is said of an alternative under further objectives, with its numbers."""
    return any(one.relation in ("worse", "open") or one.taken.fate is not None for one in trade.judged) or any(
        one.other.number.infinite or one.taken.number.infinite for one in trade.judged
    )


def _heard(claim: Claim, asked: Question) -> bool:
    """Return whether a claim may be said at all."""
    if claim.claim == "equally flexible":
        return asked.factors == {"constrictiveness"}
    return claim.claim not in DETAILS or asked.detail


def _said(claim: Claim) -> Hashable:
    """Return what is said of a claim in a sentence about a run."""
    taken, others = claim.evidence.taken, claim.evidence.others
    own = taken if isinstance(taken, Measured) else None
    fates = frozenset(row.fate for row in others if isinstance(row, Measured))
    return (
        claim.claim,
        claim.level,
        None if own is None else own.fate,
        own is not None and own.number.infinite,
        fates if claim.claim in ("better step", "avoids") else None,
        claim.against if claim.claim in (*NAMING, *DETAILS) else None,
    )
