"""Steps and claims enter, the parts that sentences speak of leave: claims by level, action values, numbers in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ratherthan.explain.explanation import Claim, Measured, Step, Tally
from ratherthan.narrate.numbers import contrasted, plain
from ratherthan.narrate.words import Vocabulary, Wanted

__all__ = ["alternatives", "claims_at", "counts", "flexibility_of", "measured", "pair", "values"]


def claims_at(step: Step, level: int) -> dict[str, Claim]:
    """Return the claims of one level by name."""
    return {claim.claim: claim for claim in step.claims if claim.level == level}


def measured(row: Measured | Tally) -> Measured:
    """Return a row of evidence as an action value."""
    if not isinstance(row, Measured):
        raise TypeError("A claim about outcomes must carry action values as evidence.")
    return row


def pair(words: Vocabulary, wanted: Wanted, own: float, others: Sequence[float]) -> str:
    """Return better numbers beside the own: all of them, the best where others look like the own, or that it is close."""
    numbers, chance, named = words.table("numbers"), wanted.record.chance, wanted.words["named"]
    found = contrasted(own, others, numbers, chance=chance)
    if found:
        listed = words.language.joined(list(dict.fromkeys(found[1])), "or")
        return str(numbers["pair"].format(better=listed, own=_with_unit(words, wanted, found[0]), named=named))
    found = contrasted(own, [max(others) if wanted.record.maximise else min(others)], numbers, chance=chance)
    if not found:
        return str(numbers["close"].format(named=named))
    return str(numbers["best"].format(better=found[1][0], own=_with_unit(words, wanted, found[0]), named=named))


def _with_unit(words: Vocabulary, wanted: Wanted, number: str) -> str:
    """Return a number with its unit, in the singular where it is 1."""
    return words.language.counted(number + wanted.words["unit"])


def values(words: Vocabulary, wanted: Wanted, numbers: Sequence[float]) -> str:
    """Return numbers alone: "(6.7 or 7)"."""
    spelled = [plain(number, words.table("numbers"), chance=wanted.record.chance) for number in numbers]
    return str(words.table("numbers")["values"].format(better=words.language.joined(spelled, "or")))


def alternatives(words: Vocabulary, wanted: Wanted, claim: Claim) -> dict[str, str]:
    """Return the better alternatives and their numbers in words."""
    own, better = (
        measured(claim.evidence.taken).number.value,
        [measured(o).number.value for o in claim.evidence.others],
    )
    return {
        "others": words.alternatives(claim.against),
        "numbers": pair(words, wanted, own, better),
        "values": values(words, wanted, better),
    }


_FLEXIBILITY = {"more flexible": "more", "less flexible": "fewer", "as flexible": "same"}


def flexibility_of(claims: Mapping[str, Claim]) -> tuple[str, dict[str, str]]:
    """Return "more", "fewer" or "same" decisions than a foil leaves open, or "unsaid", and the counts in words."""
    claim = next((claims[name] for name in _FLEXIBILITY if name in claims), None)
    return ("unsaid", {}) if claim is None else (_FLEXIBILITY[claim.claim], counts(claim))


def counts(claim: Claim) -> dict[str, str]:
    """Return the counts of a claim against a foil in words."""
    own, foil = claim.evidence.taken, claim.evidence.others[0]
    assert isinstance(own, Tally)
    assert isinstance(foil, Tally)
    return {"count": _tally(own), "foil_count": _tally(foil)}


def _tally(tally: Tally) -> str:
    return str(tally.lower) if tally.lower == tally.upper else f"{tally.lower} to {tally.upper}"
