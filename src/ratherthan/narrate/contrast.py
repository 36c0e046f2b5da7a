"""A step with a foil enters, the reason leaves: "because it leads to a shorter route (6.7 instead of 10.7)"."""

from __future__ import annotations

from collections.abc import Mapping

from ratherthan.explain.explanation import Claim, Measured, Step, Tally
from ratherthan.factors import Comparison, compare
from ratherthan.narrate.numbers import contrasted, plain
from ratherthan.narrate.words import Vocabulary

__all__ = ["contrast_reason"]

_FLEXIBILITY = {"more flexible": "more", "less flexible": "fewer", "as flexible": "same"}


def contrast_reason(words: Vocabulary, step: Step) -> str:
    """Return what is said after "We move east rather than south at grid 10"."""
    claims = {claim.claim: claim for claim in step.claims}
    flexibility = next((claims[name] for name in _FLEXIBILITY if name in claims), None)
    outcome = next((claims[name] for name in ("better", "worse", "equal") if name in claims), None)
    key = "open" if outcome is None else outcome.claim
    if outcome is not None and outcome.claim == "better" and _rows(outcome)[1].fate is not None:
        key = "avoids"
    filled = {"clause": "" if outcome is None else _clause(words, step, outcome)} | _counts(flexibility)
    template: str = words.table("contrasts")[key]["unsaid" if flexibility is None else _FLEXIBILITY[flexibility.claim]]
    return template.format(**filled)


def _counts(claim: Claim | None) -> dict[str, str]:
    if claim is None:
        return {}
    own, foil = claim.evidence.taken, claim.evidence.others[0]
    assert isinstance(own, Tally)
    assert isinstance(foil, Tally)
    return {"count": _tally(own), "foil_count": _tally(foil)}


def _tally(tally: Tally) -> str:
    return str(tally.lower) if tally.lower == tally.upper else f"{tally.lower} to {tally.upper}"


def _rows(claim: Claim) -> tuple[Measured, Measured]:
    own, foil = claim.evidence.taken, claim.evidence.others[0]
    assert isinstance(own, Measured)
    assert isinstance(foil, Measured)
    return own, foil


def _clause(words: Vocabulary, step: Step, claim: Claim) -> str:
    """Return the clause about the outcome."""
    own, foil = _rows(claim)
    clauses: Mapping[str, str] = words.table("clauses")
    chance = words.explanation.objective.kind != "cost"
    numbers: Mapping[str, str] = words.table("numbers")
    better, worse = (own, foil) if claim.claim == "better" else (foil, own)
    pair = contrasted(worse.number.value, [better.number.value], numbers, chance=chance)
    said = numbers["pair"].format(better=pair[1][0], own=pair[0]) if pair else numbers["close"]
    values = numbers["values"].format(better=plain(better.number.value, numbers, chance=chance))
    return clauses[_clause_key(words, claim, own, foil)].format(
        numbers=said, values=values, foil_doing=words.doing(step.foil or ""), **words.objective
    )


def _clause_key(words: Vocabulary, claim: Claim, own: Measured, foil: Measured) -> str:
    step = "_step" if words.explanation.question.policy_values else ""
    if claim.claim == "equal":
        if own.fate is not None:
            return "equal_infinite" + step
        nothing = own.number.lower == own.number.upper == 0.0
        lost = nothing and words.explanation.objective.kind in ("probability", "safety")
        return ("equal_lost" if lost else "equal") + step
    if claim.claim == "worse":
        return {None: "worse", "dead end": "worse_dead", "may fail": "worse_fail"}[own.fate] + step
    if foil.fate is not None:
        return {"dead end": "foil_dead", "may fail": "foil_fail" + step}[foil.fate]
    if step:
        return "better_step"
    kept = all(
        compare(optimum, followed, words.explanation.question.tolerance) is Comparison.EQUAL
        for _, optimum, followed in claim.evidence.follows
    )
    return "better" if kept else "better_begun"
