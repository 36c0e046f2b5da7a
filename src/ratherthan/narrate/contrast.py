"""A step with a foil enters, the reason leaves: "because it leads to a shorter route (6.7 instead of 10.7)"."""

from __future__ import annotations

from collections.abc import Mapping

from ratherthan.explain.explanation import Claim, Measured, Step
from ratherthan.factors import Comparison, compare
from ratherthan.narrate.evidence import claims_at, flexibility_of, measured, pair, values
from ratherthan.narrate.words import Vocabulary, Wanted

__all__ = ["contrast_reason"]


def contrast_reason(words: Vocabulary, step: Step) -> str:
    """Return what is said after "We move east rather than south at grid 10"."""
    flexibility, counted = flexibility_of(claims_at(step, 0))
    outcomes = [_outcome(claims_at(step, level)) for level in range(len(words.explanation.levels))]
    told = [claim for claim in outcomes if claim is not None]
    key = "open" if not told else told[-1].claim
    if told and key == "better" and _rows(told[-1])[1].fate is not None:
        key = "avoids"
    clause = _clauses(words, step, told) if told else ""
    filled = {"clause": clause, "doing": words.doing(step.action)} | counted
    template: str = words.table("contrasts")[key][flexibility]
    return template.format(**filled)


def _outcome(claims: Mapping[str, Claim]) -> Claim | None:
    return next((claims[name] for name in ("better", "worse", "equal") if name in claims), None)


def _rows(claim: Claim) -> tuple[Measured, Measured]:
    return measured(claim.evidence.taken), measured(claim.evidence.others[0])


def _clauses(words: Vocabulary, step: Step, told: list[Claim]) -> str:
    """Return the clause about the outcome: that of the level that decides, after what is equal before it."""
    if len(told) == 1:
        return _clause(words, step, told[0], words.table("clauses"))
    second, step_only = words.table("second_clauses"), words.explanation.question.policy_values
    equal = told if told[-1].claim == "equal" and _usual(words, told[-1]) else told[:-1]
    phrases = [words.objectives[claim.level].words["equal"] for claim in equal]
    before: str = second["equal"].format(equal_before=words.language.joined(phrases, "and"))
    if equal is told:
        return before + (words.table("trades")["on"] if step_only else "")
    return str(second["both"].format(before=before, clause=_clause(words, step, told[-1], second)))


def _usual(words: Vocabulary, claim: Claim) -> bool:
    """Return whether two choices that are equal lead anywhere at all."""
    return _clause_key(words, claim, *_rows(claim)) in ("equal", "equal_step")


def _clause(words: Vocabulary, step: Step, claim: Claim, preferred: Mapping[str, str]) -> str:
    """Return the clause about one level."""
    own, foil = _rows(claim)
    wanted = words.objectives[claim.level]
    better, worse = (own, foil) if claim.claim == "better" else (foil, own)
    key = _clause_key(words, claim, own, foil)
    clauses: Mapping[str, str] = {**words.table("clauses"), **preferred}
    return clauses[key].format(
        numbers=pair(words, wanted, worse.number.value, [better.number.value]),
        values=values(words, wanted, [better.number.value]),
        foil_doing=words.doing(step.foil or ""),
        **wanted.words,
    )


def _clause_key(words: Vocabulary, claim: Claim, own: Measured, foil: Measured) -> str:
    step = "_step" if words.explanation.question.policy_values else ""
    if claim.claim == "equal":
        if own.fate is not None:
            return "equal_infinite" + step
        return ("equal_lost" if _lost(words.objectives[claim.level], own) else "equal") + step
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


def _lost(wanted: Wanted, row: Measured) -> bool:
    """Return whether a choice has no chance at all to do what is wanted."""
    return wanted.record.chance and wanted.record.maximise and row.number.lower == row.number.upper == 0.0
